"""The server and the browser that the browser tests share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext

from gui.scene_view import SceneView
from lab.records import Hierarchy

from . import scenes
from .browser import PARAMS, SCENE, SIZE, WINDOW, Server, Tab, chromium, open_browser, play, renderer
from .scene_views import emptied, room_view


@pytest.fixture(scope="module", autouse=True)
def library() -> Iterator[None]:
    """The renderer of these tests gives its memory back before others look at what is kept."""
    yield
    if renderer.cache_info().currsize:
        renderer().close()
        renderer.cache_clear()


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One inspector for all tests: each puts it into the state that it needs."""
    chromium()
    size = "x".join(map(str, SIZE))
    server = Server(tmp_path_factory.mktemp("inspector"), [str(SCENE), "--size", size, "--set", f"vpls={PARAMS.vpls}"])
    yield server
    server.end()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A browser. It ends with its module: while one is open, no other test could run an event loop of its own."""
    chromium()
    with play() as player:
        browser = open_browser(player)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def window(browser: Browser) -> Iterator[BrowserContext]:
    """Tabs of one window share what they have loaded."""
    context = browser.new_context(viewport=WINDOW, accept_downloads=True)
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    yield context
    context.close()


@pytest.fixture(scope="module")
def loaded(server: Server, window: BrowserContext) -> Iterator[Tab]:
    """The module's tab: to load the page for each test would take most of the time."""
    tab = Tab(window.new_page(), server)
    yield tab
    tab.page.close()


@pytest.fixture
def tab(server: Server, loaded: Tab) -> Iterator[Tab]:
    """A tab with the inspector in its first state. What browser or server complain of fails the test."""
    before = server.complaints()
    loaded.errors.clear()
    loaded.begin()
    yield loaded
    assert not loaded.errors, "\n".join([*loaded.errors, server.complaints()])
    assert server.complaints() == before


# --- the 3D view --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def room() -> Iterator[SceneView]:
    """A 3D view of the small room, for the tests of one module."""
    made = room_view()
    yield made
    made.close()


@pytest.fixture
def view(room: SceneView) -> SceneView:
    """The same with nothing shown in it."""
    return emptied(room)


@pytest.fixture(scope="module")
def hierarchy() -> Hierarchy:
    """Of the small room's frame."""
    return scenes.frame().hierarchy
