"""The inspector as its users have it: `lab inspect` in a process of its own, and a browser that looks at it."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Locator, Page, sync_playwright

import lab
from gui.view_state import ViewState
from lab.pixel import Probe, probe_pixel
from lab.records import Frame

T = TypeVar("T")

ROOT = Path(__file__).resolve().parent.parent.parent
SCENE = ROOT / "scenes" / "cornell" / "scene.toml"
SIZE = (160, 90)
PARAMS = lab.Params(vpls=2000)
START = ViewState(scene=str(SCENE), params=PARAMS.to_dict(), size=SIZE)
"""What every test begins with."""

CHROMIUM_FLAGS = ["--headless", "--no-sandbox", "--disable-gpu"]
WINDOW = {"width": 1280, "height": 800}
PATIENCE_S = 15.0


def chromium() -> str:
    """The browser's program; without it the test skips, but never where CI is set."""
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        said = "there is no chromium: .house/setup.sh test installs it, or apt-get install chromium"
        if os.environ.get("CI") == "true":
            pytest.fail(said)
        pytest.skip(said)
    return found


def open_browser(player: Any) -> Browser:
    """A browser without a window; `player` is playwright."""
    browser: Browser = player.chromium.launch(executable_path=chromium(), args=CHROMIUM_FLAGS)
    return browser


def until(
    read: Callable[[], T],
    wanted: Callable[[T], bool],
    page: Page | None = None,
    said: str = "",
    patience_s: float = PATIENCE_S,
) -> T:
    """Reads until it is as wanted; the last reading is the message of what never came."""
    ends = time.monotonic() + patience_s
    while True:
        seen = read()
        if wanted(seen):
            return seen
        assert time.monotonic() < ends, f"{said or 'what was waited for never came'}; last seen: {str(seen)[:2000]}"
        if page is None:
            time.sleep(0.03)
        else:
            page.wait_for_timeout(30)


class Server:
    """`lab inspect` with `arguments`, as a process of its own; `address` as it was printed."""

    def __init__(self, folder: Path, arguments: Sequence[str], patience_s: float = PATIENCE_S) -> None:
        self.errors = folder / f"stderr-{time.monotonic_ns()}"
        with self.errors.open("wb") as errors:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "lab", "inspect", *arguments, "--port", "0"],
                stdout=subprocess.PIPE, stderr=errors, text=True, cwd=folder,
                env={**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONFAULTHANDLER": "1"},
            )  # fmt: skip
        self.said: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        try:
            until(lambda: self.said, self._told_or_ended, said="the server's address", patience_s=patience_s)
        except AssertionError:
            self.end()
            raise
        assert self.process.poll() is None, self.complaints()
        self.address = next(line for line in self.said if "http" in line).split()[1]

    def _read(self) -> None:
        for line in self.process.stdout or ():
            self.said.append(line)

    def _told_or_ended(self, said: list[str]) -> bool:
        return any("http" in line for line in said) or self.process.poll() is not None

    def complaints(self) -> str:
        """All it wrote on standard error, and how it ended if it did."""
        code = self.process.poll()
        return self.errors.read_text() + ("" if code is None else f"ended with code {code}\n")

    def interrupt(self) -> tuple[int, float]:
        """Ctrl-C. Exit code, and how many seconds it took."""
        begun = time.monotonic()
        self.process.send_signal(signal.SIGINT)
        code = self.process.wait(PATIENCE_S)
        return code, time.monotonic() - begun

    def end(self) -> None:
        """Ends it, whatever it is doing."""
        self.process.kill()
        self.process.wait()
        self._reader.join()
        if self.process.stdout:
            self.process.stdout.close()


class Tab:
    """One tab of a browser with the inspector in it. What the browser complains of is kept in `errors`."""

    def __init__(self, page: Page, server: Server) -> None:
        self.page, self.server = page, server
        self.errors: list[str] = []
        self._leaving = False
        page.on("console", self._heard)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("crash", lambda _: self.errors.append("the page crashed"))
        page.set_default_timeout(1000 * PATIENCE_S)
        self.load()

    def load(self) -> None:
        """Opens the inspector; again: reloads it. Returns with the first picture."""
        self._leaving = True
        self.page.goto(self.server.address)
        self.page.wait_for_selector(".lab-image-a")
        self._leaving = False

    def _heard(self, message: ConsoleMessage) -> None:
        # trame's page asks by POST for a launcher first, which only its own cloud has.
        harmless = "405" in message.text and "/paraview" in str(message.location.get("url"))
        # A page that is left tells, as an object, that what it had just asked for was not answered.
        unanswered = self._leaving and message.text == "Object"
        if message.type == "error" and not harmless and not unanswered:
            self.errors.append(message.text)

    # --- reading ------------------------------------------------------------------------------------

    def find(self, selector: str) -> Locator:
        """What `selector` finds."""
        return self.page.locator(selector)

    def text(self, selector: str) -> str:
        """The text of what it finds first, "" of nothing."""
        found = self.find(selector).first
        return found.inner_text() if found.count() else ""

    def value(self, selector: str) -> str:
        """What a field holds."""
        return self.find(selector).input_value()

    def table(self, selector: str) -> list[list[str]]:
        """The cells of a table's body, row by row."""
        rows: list[list[str]] = self.page.eval_on_selector_all(
            f"{selector} tr:has(td)", "rows => rows.map(row => [...row.cells].map(cell => cell.innerText.trim()))"
        )
        return rows

    def pairs(self, selector: str) -> dict[str, str]:
        """A table of names and values."""
        return {row[0]: row[1] for row in self.table(selector)}

    def source(self, selector: str) -> str:
        """The address of an image, "" where there is none."""
        found = self.find(selector).first
        return (found.get_attribute("src") or "") if found.count() else ""

    def box(self, selector: str) -> dict[str, float]:
        """Where something is on the page."""
        found = self.find(selector).first.bounding_box()
        assert found is not None, f"{selector} is not on the page"
        return dict(found)

    def look(self, selector: str) -> bytes:
        """What the eye sees of it, as PNG."""
        return self.find(selector).first.screenshot()

    def until(self, read: Callable[[], T], wanted: Callable[[T], bool], said: str = "") -> T:
        """:func:`until`, while the page lives on."""
        return until(read, wanted, self.page, said)

    def idle(self) -> None:
        """Waits for the end of all work."""
        self.ask("saved")  # what the server has told before its answer has come by then
        self.page.wait_for_function("trame.state.get('busy') === ''")

    def ask(self, trigger: str, *arguments: str) -> Any:
        """What the server answers to one of the page's questions; JavaScript's promises would wait for ever."""
        asked = (
            "([name, rest, ms]) => Promise.race([trame.trigger(name, rest), new Promise((_, fail) => setTimeout("
            "() => fail(new Error(`no answer to ${name}`)), ms))])"
        )
        return self.page.evaluate(asked, [trigger, list(arguments), 1000 * PATIENCE_S])

    def saved(self) -> dict[str, Any]:
        """The state that the inspector would save."""
        state: dict[str, Any] = json.loads(self.ask("saved"))
        return state

    # --- doing --------------------------------------------------------------------------------------

    def restore(self, text: str) -> None:
        """Has the inspector restore a state, and waits for its frame."""
        self.ask("restore", text, "state.json")
        self.idle()

    def begin(self, **changes: Any) -> None:
        """The state that tests start from, with some of its fields changed; `params` are added to those."""
        params = PARAMS.replace(**changes.pop("params", {})).to_dict()
        self.page.evaluate("trame.state.set('message_open', false)")
        if self.find(".v-overlay--active").count():
            self.load()  # a menu that a test has left open
        self.restore(replace(START, params=params, **changes).to_json())
        self.until(lambda: self.value("#size"), lambda size: size == "x".join(map(str, changes.get("size", SIZE))))

    def click(self, selector: str) -> None:
        """Clicks it."""
        self.find(selector).first.click()

    def press(self, key: str) -> None:
        """Presses a key while nothing is written into."""
        self.page.evaluate("document.activeElement.blur()")
        self.page.keyboard.press(key)

    def write(self, selector: str, value: object) -> None:
        """Writes into a field and presses Enter."""
        self.find(selector).fill(str(value))
        self.find(selector).press("Enter")

    def choose(self, selector: str, title: str) -> None:
        """Chooses from a menu by its text."""
        self.page.locator(f".v-select:has({selector})").click()
        self.page.locator(".v-overlay--active .v-list-item").get_by_text(title, exact=True).click()

    def place(self, x: float, y: float, size: tuple[int, int] = SIZE) -> tuple[float, float]:
        """Where the middle of pixel (x, y) of the picture is on the page."""
        box = self.box(".lab-image-a")
        return box["x"] + (x + 0.5) * box["width"] / size[0], box["y"] + (y + 0.5) * box["height"] / size[1]

    def click_pixel(self, x: int, y: int) -> None:
        """Clicks a pixel of the picture and waits for its probe."""
        self.page.mouse.click(*self.place(x, y))
        self.until(lambda: self.pairs("#pixel-summary").get("pixel"), lambda said: said == f"{x}, {y}")

    def slide(self, selector: str, key: str) -> None:
        """Presses a key on a slider's thumb."""
        self.page.locator(f".v-slider:has({selector}) [role=slider]").press(key)

    def download(self, selector: str) -> tuple[str, bytes]:
        """Clicks something that hands over a file: its name and content."""
        with self.page.expect_download() as waiting:
            self.click(selector)
        return waiting.value.suggested_filename, Path(waiting.value.path()).read_bytes()

    def clipboard(self) -> str:
        """What was copied last."""
        text: str = self.page.evaluate("navigator.clipboard.readText()")
        return text

    def message(self) -> str:
        """Waits for the message at the foot of the page, and takes it away."""
        said = self.until(lambda: self.text(".v-snackbar__content"), bool, "a message at the foot of the page")
        self.page.evaluate("trame.state.set('message_open', false)")
        self.until(lambda: self.find(".v-snackbar__content").count(), lambda n: n == 0)
        return said

    def close(self) -> None:
        """Closes the tab; whatever the browser or the server complained of fails the test."""
        self.page.close()
        assert not self.errors, "\n".join([*self.errors, self.server.complaints()])


# --- the same, of the library -----------------------------------------------------------------------


@cache
def renderer() -> lab.Renderer:
    """The scene of the tests, in this process."""
    return lab.Renderer(lab.load_scene(SCENE))


def frame(**settings: object) -> Frame:
    """What the library renders of it; `settings` of Params."""
    return renderer().render(size=SIZE, params=PARAMS.replace(**settings), counts=True)


def probed(x: int, y: int, **settings: object) -> Probe:
    """What the library says of a pixel of it."""
    engine = renderer().engine
    assert isinstance(engine, lab.engine.cpu.CpuEngine)
    return probe_pixel(engine, frame(**settings), x, y)


def play() -> Any:
    """Playwright, for a `with`."""
    return sync_playwright()
