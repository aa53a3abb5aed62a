"""Settings in a browser: what a change shows, what is refused, undo, and the same frame elsewhere."""

from __future__ import annotations

import re
from functools import cache

from gui.view_state import ViewState
from gui.workbench import Workbench, command_line, python_code
from lab.survey import overdraw_survey

from .browser import PARAMS, SCENE, SIZE, START, Tab, frame


@cache
def overdraw_rows(**settings: object) -> list[list[str]]:
    """The table of the overdraw panel, as the library has it."""
    made = frame(**settings)
    survey = overdraw_survey(made)
    found = [
        (f"{level.level}", len(made.hierarchy.levels[level.level or 0]), level)
        for level in survey.levels[made.params.first_level :]
    ]
    found.append(("all", sum(lights for _, lights, _ in found), survey.total))
    return [
        [name, f"{lights:,}", f"{s.mean:.4g}", f"{s.median:g}", f"{s.p95:.4g}", f"{s.max:,}"]
        for name, lights, s in found
    ]


def test_alpha_changes_the_overdraw(tab: Tab) -> None:
    tab.click("#tab-overdraw")
    tab.choose("#layer", "overdraw")
    tab.until(lambda: tab.text(".lab-title-a"), lambda title: title == "overdraw")
    before = tab.until(lambda: tab.table("#overdraw-table"), lambda rows: rows == overdraw_rows())
    picture, plot = tab.source(".lab-image-a"), tab.source("#overdraw-plot")
    tab.write("#param-alpha", 2)
    after = tab.until(lambda: tab.table("#overdraw-table"), lambda rows: rows == overdraw_rows(alpha=2.0))
    assert float(after[-1][2]) > 1.5 * float(before[-1][2])
    assert tab.source(".lab-image-a") != picture and tab.source("#overdraw-plot") != plot

    # A level's row shows that level.
    tab.find("#overdraw-table tbody tr").nth(1).click()
    tab.until(lambda: tab.text(".lab-title-a"), lambda title: "1" in title)
    tab.until(lambda: tab.text("#overdraw-table .lab-chosen td"), lambda level: level == "1")

    # Undo, redo, reset: the fields, the table and the picture go along.
    tab.find("#overdraw-table tbody tr").last.click()
    changed = tab.until(lambda: tab.source(".lab-image-a"), bool)
    tab.click("#undo")
    tab.until(lambda: tab.table("#overdraw-table"), lambda rows: rows == before)
    assert tab.value("#param-alpha") == "1"
    tab.until(lambda: tab.source(".lab-image-a"), lambda source: source == picture)
    tab.click("#redo")
    tab.until(lambda: tab.table("#overdraw-table"), lambda rows: rows == after)
    tab.until(lambda: tab.source(".lab-image-a"), lambda source: source != picture and source[:20] == changed[:20])
    assert tab.value("#param-alpha") == "2" and tab.find("#redo").is_disabled()
    tab.write("#param-shadow_samples", 8)
    tab.click("#reset")
    tab.until(lambda: (tab.value("#param-alpha"), tab.value("#param-shadow_samples")), lambda said: said == ("1", "4"))
    assert tab.find(".lab-changed").count() == 0


def test_every_kind_of_field_renders(tab: Tab) -> None:
    """A choice, a switch, a preset, a camera, a size."""
    tab.click("#tab-overdraw")
    picture = tab.source(".lab-image-a")
    tab.choose("#param-lobe", "mean")
    second = tab.until(lambda: tab.source(".lab-image-a"), lambda source: source != picture)
    tab.find("#param-importance").uncheck(force=True)
    tab.until(lambda: tab.source(".lab-image-a"), lambda source: source not in (picture, second))
    assert set(tab.find(".lab-changed").all_inner_texts()) >= {"lobe", "importance (f_i)"}
    tab.choose("#preset", "paper")
    tab.until(lambda: tab.table("#overdraw-table"), lambda rows: rows == overdraw_rows_of_preset("paper"))
    tab.write("#size", "64x36")
    tab.until(
        lambda: tab.find(".lab-image-a").evaluate("e => [e.naturalWidth, e.naturalHeight]"), lambda s: s == [64, 36]
    )
    tab.click("#undo")
    tab.click("#undo")
    tab.until(lambda: tab.value("#preset"), lambda name: name == "ours")


@cache
def overdraw_rows_of_preset(name: str) -> list[list[str]]:
    bench = Workbench(START)
    changed = bench.choose_preset(name).params.to_dict()
    bench.close()
    return overdraw_rows(**changed)


def test_a_refused_value_stays_red_with_its_reason(tab: Tab) -> None:
    picture = tab.source(".lab-image-a")
    tab.write("#param-alpha", "-3")
    said = tab.until(lambda: tab.text(".lab-field:has(#param-alpha) .lab-error"), bool)
    assert said.startswith("alpha=-3") and "> 0" in said
    assert tab.value("#param-alpha") == "-3"
    assert tab.find(".v-field--error:has(#param-alpha)").count() == 1
    tab.write("#param-alpha", "two")
    tab.until(lambda: tab.text(".lab-field:has(#param-alpha) .lab-error"), lambda said: said.startswith("alpha=two"))
    tab.write("#size", "9x9x9")
    tab.until(lambda: tab.text(".lab-frame-row .lab-error"), lambda said: "WIDTHxHEIGHT" in said)
    tab.page.wait_for_timeout(200)
    assert tab.source(".lab-image-a") == picture and tab.text("#busy") == "", "nothing was rendered"
    tab.write("#param-alpha", "1.5")
    tab.until(lambda: tab.source(".lab-image-a"), lambda source: source != picture)
    tab.until(lambda: tab.find(".lab-error").count(), lambda n: n == 0)
    assert tab.value("#size") == "x".join(map(str, SIZE)), "what was refused does not stay as if it were taken"
    tab.write("#exposure", "bright")
    assert "expected a number of stops" in tab.message()
    tab.write("#exposure", "nan")
    assert "exposure=nan" in tab.message()
    tab.write("#param-alpha", "1")
    tab.until(lambda: tab.value("#exposure"), lambda stops: stops == "0")


def test_the_frame_is_copied_as_a_command_and_as_python(tab: Tab) -> None:
    tab.write("#param-alpha", 1.75)
    tab.until(lambda: tab.value("#param-alpha"), lambda value: value == "1.75")
    tab.idle()
    tab.click("#code")
    bench = Workbench(ViewState(scene=str(SCENE), params={**PARAMS.to_dict(), "alpha": 1.75}, size=SIZE))
    changed = bench.changed_settings()
    expected = {
        "command": command_line(str(SCENE), bench.settings, changed),
        "python": python_code(str(SCENE), bench.settings, changed),
    }
    bench.close()
    assert re.search(r"--set .*alpha=1.75", expected["command"]) and "alpha=1.75" in expected["python"]
    for name, text in expected.items():
        tab.until(lambda name=name: tab.text(f"#code-{name}"), lambda said, text=text: said.strip() == text.strip())  # type: ignore[misc]
        tab.click(f"#copy-{name}")
        tab.until(tab.clipboard, lambda said, text=text: said == text)  # type: ignore[misc]
