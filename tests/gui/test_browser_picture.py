"""The picture in a browser: layers, wipe, difference, zoom, and the keys."""

from __future__ import annotations

import pytest

from .browser import SIZE, Tab, frame


def divider(tab: Tab) -> float:
    """Where the divider is, as a share of the picture."""
    line, picture = tab.box(".lab-divider"), tab.box(".lab-image-a")
    return (line["x"] + line["width"] / 2 - picture["x"]) / picture["width"]


def drag(tab: Tab, start: tuple[float, float], end: tuple[float, float]) -> None:
    mouse = tab.page.mouse
    mouse.move(*start)
    mouse.down()
    mouse.move((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    mouse.move(*end)
    mouse.up()


def test_the_wipe_follows_the_mouse_and_both_pictures_stay_together(tab: Tab) -> None:
    tab.click("#compare-wipe")
    tab.until(lambda: tab.source(".lab-image-b"), bool, "picture B")
    assert tab.text(".lab-title-b").startswith("this frame: ") and abs(divider(tab) - 0.5) < 0.01
    line = tab.box(".lab-divider")
    y = line["y"] + line["height"] / 2
    drag(tab, (line["x"] + line["width"] / 2, y), (tab.place(39.5, 0)[0], y))
    assert abs(divider(tab) - 0.25) < 0.01, "answered at once"
    tab.until(lambda: tab.saved()["wipe"], lambda at: abs(at - 0.25) < 0.01)
    assert tab.find(".lab-image-a").evaluate("e => e.style.clipPath").startswith("inset(0px calc(75")
    assert tab.find(".lab-image-b").evaluate("e => e.style.clipPath").endswith("%)")

    # The wheel zooms on the point under the pointer; a drag moves; B does as A does.
    before = tab.box(".lab-image-a")
    at = round(tab.place(120, 20)[0]), round(tab.place(120, 20)[1])  # wheels turn at whole pixels
    tab.page.mouse.move(*at)
    tab.page.mouse.wheel(0, -400)
    tab.until(lambda: tab.box(".lab-image-a")["width"], lambda width: abs(width / before["width"] - 2.718) < 0.02)
    held = tab.place(120, 20)
    assert held == pytest.approx(at, abs=2.5)
    assert tab.box(".lab-image-a") == tab.box(".lab-image-b")
    drag(tab, at, (at[0] - 60, at[1] + 25))
    assert tab.place(120, 20) == pytest.approx((held[0] - 60, held[1] + 25), abs=0.5)
    assert tab.box(".lab-image-a") == tab.box(".lab-image-b")
    tab.until(lambda: tab.saved()["zoom"], lambda zoom: abs(zoom - 2.718) < 0.02)
    tab.press("f")
    tab.until(lambda: tab.box(".lab-image-a"), lambda box: box == before, "fitted again")
    tab.until(lambda: tab.saved()["zoom"], lambda zoom: zoom == 1)
    assert tab.saved()["pixel"] is None, "a drag is no click"


def test_the_keys_do_what_the_help_says(tab: Tab) -> None:
    def title(name: str) -> str:
        return tab.until(lambda: tab.text(name), bool, name)

    first = title(".lab-title-a")
    tab.press("2")
    second = tab.until(lambda: tab.text(".lab-title-a"), lambda said: said != first)
    tab.press("ArrowRight")
    tab.until(lambda: tab.text(".lab-title-a"), lambda said: said not in (first, second))
    tab.press("ArrowLeft")
    tab.until(lambda: tab.text(".lab-title-a"), lambda said: said == second)
    tab.press("1")
    tab.until(lambda: tab.text(".lab-title-a"), lambda said: said == first)

    plain = tab.source(".lab-image-a")
    tab.press("e")
    tab.until(lambda: tab.value("#exposure"), lambda stops: stops == "0.5")
    brighter = tab.until(lambda: tab.source(".lab-image-a"), lambda source: source != plain)
    tab.press("Shift+E")
    tab.press("Shift+E")
    tab.until(lambda: tab.value("#exposure"), lambda stops: stops == "-0.5")
    assert tab.until(lambda: tab.source(".lab-image-a"), lambda source: source not in (plain, brighter))
    tab.press("r")
    tab.until(lambda: tab.source(".lab-image-a"), lambda source: source == plain, "as before")

    tab.press("w")
    tab.until(lambda: tab.source(".lab-image-b"), bool)
    tab.press("Shift+Digit3")
    tab.until(lambda: tab.text(".lab-title-b"), lambda said: said.startswith("this frame: "))
    tab.press("d")
    tab.until(lambda: tab.text(".lab-title-a"), lambda said: said == "A - B")
    assert not tab.find(".lab-image-b").count() and "relative to B" in tab.text("#legend")
    tab.press("d")
    tab.until(lambda: tab.text(".lab-title-a"), lambda said: said == first)
    tab.press("?")
    tab.until(lambda: tab.text(".lab-keys"), lambda said: "fit the picture" in said)
    tab.press("?")
    tab.until(lambda: tab.find(".lab-keys").is_visible(), lambda shown: not shown)

    # In a field, and on a slider, keys are the field's.
    tab.find("#exposure").press("w")
    tab.slide("#level-slider", "ArrowRight")
    tab.until(lambda: tab.saved()["levels"], lambda levels: levels == [2])
    assert tab.saved()["compare"] == "off" and tab.saved()["layer"] == "colour"


def test_the_number_under_the_pointer_is_the_frame_s(tab: Tab) -> None:
    tab.begin(layer="overdraw")
    counts = frame().lighting.counts()[0].sum(axis=0)
    assert counts.shape == SIZE[::-1]
    for x, y in ((70, 50), (101, 61)):
        tab.page.mouse.move(*tab.place(x, y))
        tab.until(lambda: tab.text("#hovered"), lambda said, x=x, y=y: said.startswith(f"({x}, {y})"))  # type: ignore[misc]
        assert f"{int(counts[y, x]):,} lights" in tab.text("#hovered")
        tab.page.wait_for_timeout(100)  # the pointer is asked about ten times a second


def test_another_preset_is_rendered_to_compare_with(tab: Tab) -> None:
    tab.begin(compare="wipe", other_source="preset:paper", other_layer="colour")
    tab.until(lambda: tab.text(".lab-title-b"), lambda said: said.startswith("preset paper"))
    assert tab.source(".lab-image-b") not in ("", tab.source(".lab-image-a"))
    tab.click("#keep")
    tab.until(lambda: tab.text(".lab-title-b"), lambda said: said.startswith("the kept frame"))
    assert tab.source(".lab-image-b") == tab.source(".lab-image-a")
