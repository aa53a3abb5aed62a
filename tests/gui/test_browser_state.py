"""The whole state: saved, restored, reloaded, shared by two tabs, and what is damaged."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, BrowserContext

from .browser import CHROMIUM_FLAGS, START, Server, Tab, chromium, until
from .test_browser_settings import overdraw_rows

CHANGED: dict[str, Any] = {
    "layer": "overdraw", "compare": "wipe", "wipe": 0.3, "colour_map": "magma", "log_scale": True, "zoom": 2.0,
    "centre": (0.4, 0.6), "levels": (1, 3), "colour_by": "deviation", "cells": 2, "mesh": "none", "vpls": True,
    "pixel": (70, 60), "light": 5, "panel": "overdraw", "split": "both", "other_layer": "lights_used",
}  # fmt: skip


def give(tab: Tab, text: str, name: str = "state.json") -> None:
    """Chooses a file as the button 'restore' does."""
    tab.find("#restore-file").set_input_files({"name": name, "mimeType": "application/json", "buffer": text.encode()})


def test_save_change_reload_restore(tab: Tab) -> None:
    tab.begin(params={"alpha": 1.5}, **CHANGED)
    before = tab.until(tab.saved, lambda state: state["params"]["alpha"] == 1.5)
    assert {name: before[name] for name in CHANGED} == json.loads(json.dumps(CHANGED))
    name, content = tab.download("#save")
    assert name == "cornell-inspector.json" and json.loads(content) == before
    table = tab.until(lambda: tab.table("#overdraw-table"), lambda rows: rows == overdraw_rows(alpha=1.5))
    picture = tab.source(".lab-image-a"), tab.source(".lab-image-b")

    tab.write("#param-alpha", 1)
    tab.click("#tab-timings")
    tab.press("d")
    tab.until(lambda: tab.text(".lab-title-a"), lambda title: title == "A - B")
    tab.until(lambda: tab.saved()["params"]["alpha"], lambda alpha: alpha == 1)
    tab.idle()
    changed, shown = tab.saved(), tab.source(".lab-image-a")

    tab.load()  # nothing is lost: the state lives with the server
    assert tab.saved() == changed and changed != before
    tab.until(lambda: tab.source(".lab-image-a"), lambda source: source == shown)
    assert tab.value("#param-alpha") == "1" and tab.find("#timings").is_visible()

    give(tab, content.decode())
    tab.until(tab.saved, lambda state: state == before, "the state as it was saved")
    tab.until(lambda: tab.table("#overdraw-table"), lambda rows: rows == table)
    tab.until(lambda: (tab.source(".lab-image-a"), tab.source(".lab-image-b")), lambda now: now == picture)
    assert tab.value("#param-alpha") == "1.5" and tab.find("#overdraw-table").is_visible()


def damaged() -> dict[str, tuple[str, str]]:
    """Damaged states by what is wrong with them: the text, and a word of the message."""
    good = json.loads(START.to_json())

    def text(**changes: Any) -> str:
        return json.dumps({**good, **changes})

    return {
        "not JSON": ('{"inspector": 1, "scene"', "no JSON"),
        "empty": ("", "no JSON"),
        "binary": ("\x00\x89PNG\x00", "no JSON"),
        "another file": ('{"version": "0.1"}', "no saved state"),
        "a list": ("[1, 2, 3]", "no saved state"),
        "deep": ("[" * 100_000, "no JSON"),
        "a later version": (text(inspector=99), "format 99"),
        "no scene": (json.dumps({"inspector": 1}), "names no scene"),
        "another scene": (text(scene="scenes/atrium/scene.toml"), "lab inspect scenes/atrium/scene.toml"),
        "a misspelt field": (text(lair="colour"), "lair"),
        "a setting out of range": (text(params={"alpha": -1}), "alpha=-1"),
        "an unknown setting": (text(params={"alhpa": 1}), "alpha"),
        "settings of words": (text(params="all"), "params"),
        "size of words": (text(size=["a", "b"]), "size"),
        "a number not finite": (text(zoom=float("nan")), "zoom"),
        "a huge number": (text(exposure=1e300), "exposure"),
        "an unknown camera": (text(camera="frnt"), "frnt"),
        "an unknown panel": (text(panel=[]), "panel"),
        "pixel of one number": (text(pixel=[3]), "pixel"),
        "an unknown engine": (text(engine="gpu"), "engine"),
    }


def test_a_damaged_state_ends_in_a_message_and_changes_nothing(tab: Tab) -> None:
    before, picture = tab.saved(), tab.source(".lab-image-a")
    for wrong, (text, word) in damaged().items():
        give(tab, text, "mine.json")
        said = tab.message()
        assert said.startswith("mine.json: ") or "camera" in wrong, (wrong, said)
        assert word in said, (wrong, said)
    assert tab.saved() == before and tab.source(".lab-image-a") == picture


def test_two_tabs_show_the_same_and_do_not_harm_each_other(tab: Tab, server: Server, window: BrowserContext) -> None:
    other = Tab(window.new_page(), server)
    tab.click("#tab-overdraw")
    tab.write("#param-alpha", 2)
    for each in (tab, other):
        each.until(lambda each=each: each.table("#overdraw-table"), lambda rows: rows == overdraw_rows(alpha=2.0))  # type: ignore[misc]
        assert each.value("#param-alpha") == "2"
    other.press("w")
    tab.until(lambda: tab.source(".lab-image-b"), bool, "the other tab's wipe")

    # Both at once: settings, pixels, layers, levels, keys.
    for step in range(4):
        tab.write("#param-alpha", 1 + step / 10)
        other.page.mouse.click(*other.place(60 + 2 * step, 50))
        other.press(str(1 + step % 3))
        tab.slide("#level-slider", "ArrowRight" if step % 2 else "ArrowLeft")
        other.click("#undo" if step % 2 else "#tab-pixel")
        tab.press("d")
    for each in (tab, other):
        each.idle()
    tab.write("#param-alpha", 1.25)
    tab.press("1")
    for each in (tab, other):
        each.until(lambda each=each: each.value("#param-alpha"), lambda alpha: alpha == "1.25")  # type: ignore[misc]
        each.idle()
    tab.click("#tab-overdraw")
    for each in (tab, other):
        each.until(lambda each=each: each.table("#overdraw-table"), lambda rows: rows == overdraw_rows(alpha=1.25))  # type: ignore[misc]

    def seen(each: Tab) -> list[object]:
        names = (".lab-image-a", ".lab-image-b", "#overdraw-plot")
        return [each.source(name) for name in names] + [each.table("#pixel-lights"), each.text("#legend")]

    tab.until(lambda: seen(tab) == seen(other), bool, "two tabs that show the same")
    other.close()
    tab.write("#param-alpha", 1)
    tab.until(lambda: tab.table("#overdraw-table"), lambda rows: rows == overdraw_rows())


def test_a_killed_browser_leaves_the_inspector_serving(
    tab: Tab, server: Server, browser: Browser, tmp_path: Path
) -> None:
    stderr = tmp_path / "chromium"
    flags = [*CHROMIUM_FLAGS, "--remote-debugging-port=0", f"--user-data-dir={tmp_path / 'profile'}"]
    with stderr.open("wb") as heard:
        victim = subprocess.Popen(
            [chromium(), *flags, server.address], stdout=heard, stderr=heard, start_new_session=True
        )
    try:
        until(stderr.read_text, lambda said: "DevTools listening on" in said, tab.page)
        devtools = stderr.read_text().partition("DevTools listening on ")[2].split()[0]
        there = browser.browser_type.connect_over_cdp(devtools)
        page = there.contexts[0].pages[0]
        page.wait_for_selector(".lab-image-a")
        page.locator("#param-alpha").fill("2")
        page.locator("#param-alpha").press("Enter")
        page.wait_for_function("trame.state.get('param_changed').includes('alpha')")
    finally:
        os.killpg(victim.pid, signal.SIGKILL)
        victim.wait()
    tab.until(lambda: tab.value("#param-alpha"), lambda alpha: alpha == "2")
    tab.click("#tab-overdraw")
    tab.until(lambda: tab.table("#overdraw-table"), lambda rows: rows == overdraw_rows(alpha=2.0))
    tab.load()
    tab.click("#tab-pixel")
    tab.click_pixel(70, 60)


def test_what_is_open_is_remembered(tab: Tab) -> None:
    tab.click("#split-image")
    tab.click("#tab-levels")
    opened = {"split": "image", "panel": "levels"}
    tab.until(tab.saved, lambda state: {name: state[name] for name in opened} == opened)
    tab.load()
    assert tab.saved() == json.loads(replace(START, **opened).to_json())
    tab.until(lambda: len(tab.table("#levels-table")), lambda rows: rows > 2)
    assert tab.find("#levels-table").is_visible() and not tab.find("#view-scene").is_visible()
