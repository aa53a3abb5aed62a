"""`lab inspect` on the command line: what it refuses, and how it ends."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gui.view_state import ViewState

from ..unit.command_line import refused
from .browser import SCENE, Server, Tab, open_browser, play

REFUSALS = {
    "an unknown scene": (["missing.glb"], "missing.glb"),
    "no scene": ([], "no scene given"),
    "a scene that is none": (["notes.txt"], "notes.txt"),
    "port of words": (["SCENE", "--port", "http"], "--port http"),
    "port too large": (["SCENE", "--port", "65536"], "65535"),
    "port negative": (["SCENE", "--port", "-1"], "--port"),
    "an unknown host": (["SCENE", "--host", "no.such.host.invalid"], "--host no.such.host.invalid"),
    "a host that is another machine": (["SCENE", "--host", "192.0.2.1", "--port", "0"], "--host 192.0.2.1"),
    "window and pictures": (["SCENE", "--window", "--screenshot", "out"], "exclude each other"),
    "an unknown setting": (["SCENE", "--set", "alhpa=2"], "alpha"),
    "an unknown camera": (["SCENE", "--camera", "frnt"], "front"),
    "size": (["SCENE", "--size", "4"], "--size 4"),
    "no such state": (["SCENE", "--state", "gone.json"], "gone.json"),
    "a state that is none": (["SCENE", "--state", "notes.txt"], "notes.txt"),
}


@pytest.mark.usefixtures("empty_folder")
@pytest.mark.parametrize("name", REFUSALS)
def test_bad_input_is_refused_in_one_line(quads: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("notes.txt").write_text("nothing")
    arguments, word = REFUSALS[name]
    assert word in refused(["inspect", *(str(quads) if word == "SCENE" else word for word in arguments)], capsys)


@pytest.mark.usefixtures("empty_folder")
def test_a_taken_port_is_refused(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        said = refused(["inspect", str(quads), "--port", f"{port}"], capsys)
    assert f"--port {port}" in said and "choose another" in said


@pytest.mark.usefixtures("empty_folder")
def test_a_missing_extra_is_named(
    quads: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lab.commands.inspect.find_spec", lambda name: None if name.startswith("trame") else name)
    said = refused(["inspect", str(quads)], capsys)
    assert "trame, trame_pyvista" in said and "make setup EXTRA=gui" in said


@pytest.mark.usefixtures("empty_folder")
def test_damaged_states_are_refused(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = json.loads(ViewState(scene=str(quads)).to_json())
    for damage in ({"inspector": 2}, {"zoom": "much"}, {"params": {"alpha": 0}}, {"camera": "frnt"}, {"lair": 1}):
        Path("state.json").write_text(json.dumps({**good, **damage}))
        refused(["inspect", "--state", "state.json"], capsys)
    Path("state.json").write_text(json.dumps({**good, "scene": "gone.glb"}))
    assert "gone.glb" in refused(["inspect", "--state", "state.json"], capsys)


def ended_well(server: Server) -> None:
    code, seconds = server.interrupt()
    assert code == 0 and seconds < 3, (code, seconds)
    assert server.errors.read_text() == ""


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Server]]:
    """Starts servers of this test alone."""
    servers: list[Server] = []

    def started(*arguments: str) -> Server:
        servers.append(Server(tmp_path, [str(SCENE), *arguments]))
        return servers[-1]

    yield started
    for server in servers:
        server.end()


def test_other_hosts_are_warned_of_and_ctrl_c_ends_it(start: Callable[..., Server]) -> None:
    server = start("--size", "32x18", "--set", "vpls=200", "--host", "0.0.0.0")
    assert any("warning: whoever can reach 0.0.0.0" in line for line in server.said), server.said
    ended_well(server)


def test_ctrl_c_ends_it_with_a_browser_and_a_job_at_work(start: Callable[..., Server]) -> None:
    server = start("--size", "640x360", "--set", "vpls=20000")
    with play() as player:
        browser = open_browser(player)
        tab = Tab(browser.new_page(), server)
        tab.click("#tab-leaks")
        tab.click("#leaks-path_tracer")
        tab.until(lambda: tab.text("#busy"), lambda said: "path tracer" in said)
        ended_well(server)
        browser.close()
