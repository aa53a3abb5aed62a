"""The 3D view in a browser: what is shown of the hierarchy, and what a click in it selects."""

from __future__ import annotations

import math

import numpy as np

from lab.pixel import pixel_of_point

from .browser import SIZE, Tab, frame, renderer
from .test_browser_picture import drag

VIEW = "#scene img"


def shown(tab: Tab) -> bytes:
    """The view, once it no longer changes."""
    seen = [b"", tab.look(VIEW)]

    def again() -> bool:
        seen.append(tab.look(VIEW))
        return seen[-1] == seen[-2] == seen[-3]

    tab.until(again, bool, "a view that stands still")
    return seen[-1]


def test_the_level_slider_changes_the_view(tab: Tab) -> None:
    first = shown(tab)
    tab.slide("#level-slider", "ArrowRight")
    second = tab.until(lambda: tab.look(VIEW), lambda now: now != first, "another level")
    tab.until(lambda: tab.saved()["levels"], lambda levels: levels == [2])
    tab.slide("#level-slider", "End")
    top = frame().hierarchy.top
    tab.until(lambda: tab.saved()["levels"], lambda levels: levels == [top])
    tab.until(lambda: tab.look(VIEW), lambda now: now not in (first, second), "the coarsest level")
    tab.page.locator("#levels button").nth(1).click()  # both
    tab.until(lambda: tab.saved()["levels"], lambda levels: levels == [1, top])
    tab.page.locator("#levels button").nth(top).click()
    tab.until(lambda: tab.saved()["levels"], lambda levels: levels == [1])
    tab.until(lambda: tab.look(VIEW), lambda now: now == first, "the view as it was")


def test_everything_else_of_the_view(tab: Tab) -> None:
    """Colours, cells, mesh, VPLs, opacity: each shows, and all of them are saved."""
    before = shown(tab)
    tab.click("#scene-options")
    tab.find("#colour-by").wait_for()
    tab.choose("#colour-by", "level")
    tab.until(lambda: tab.look(VIEW), lambda now: now != before, "other colours")
    before = shown(tab)
    tab.choose("#cells", "cells of level 2")
    tab.until(lambda: tab.look(VIEW), lambda now: now != before, "cells")
    before = shown(tab)
    tab.choose("#mesh", "none")
    tab.until(lambda: tab.look(VIEW), lambda now: now != before, "no mesh")
    before = shown(tab)
    tab.find("#vpls-shown").check(force=True)
    tab.until(lambda: tab.look(VIEW), lambda now: now != before, "VPLs")
    state = tab.saved()
    assert [state[name] for name in ("colour_by", "cells", "mesh", "vpls")] == ["level", 2, "none", True]


def test_a_click_on_a_surface_probes_its_pixel(tab: Tab) -> None:
    tab.begin(levels=())
    box = tab.box(VIEW)
    tab.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    x, y = tab.until(lambda: tab.saved()["pixel"], bool, "a pixel")
    assert abs(x - SIZE[0] / 2) <= 1.5 and abs(y - SIZE[1] / 2) <= 1.5, "the view looks as the picture does"
    tab.until(lambda: tab.pairs("#pixel-summary").get("pixel"), lambda said: said == f"{x}, {y}")
    assert len(tab.table("#pixel-lights")) > 20


def test_a_click_on_a_light_selects_it(tab: Tab) -> None:
    made, level = frame(), 2
    camera, hierarchy = renderer().scene.camera(), made.hierarchy
    first, last = hierarchy.offset[level : level + 2]
    position = np.asarray(hierarchy.position[first:last], np.float64)
    eye, target, up = (np.asarray(vector, np.float64) for vector in (camera.eye, camera.target, camera.up))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    away = position - eye
    depth = away @ forward
    reach = math.tan(math.radians(camera.fov_y_deg) / 2)
    on_screen = np.stack([away @ right, away @ np.cross(forward, right)], axis=1) / (depth[:, None] * reach)
    apart = np.linalg.norm(on_screen[:, None] - on_screen[None], axis=-1) + 9 * np.eye(len(position))
    seen = np.array([pixel_of_point(made.gbuffer, point) is not None for point in position])
    inside = (np.abs(on_screen) < 0.9).all(axis=1) & (depth > 0) & seen
    best = int(np.where(inside, apart.min(axis=1), 0).argmax())

    tab.begin(levels=(level,))
    box = tab.box(VIEW)
    half = box["height"] / 2
    x, y = box["x"] + box["width"] / 2 + half * on_screen[best, 0], box["y"] + half * (1 + on_screen[best, 1])
    before = shown(tab)
    tab.page.mouse.click(x, y)
    tab.until(lambda: tab.saved()["light"], lambda light: light == first + best, f"light {first + best} selected")
    tab.until(lambda: tab.look(VIEW), lambda now: now != before, "the selected light taken apart")


def test_a_turned_view_stays_and_the_camera_button_turns_it_back(tab: Tab) -> None:
    before = shown(tab)
    box = tab.box(VIEW)
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    drag(tab, middle, (middle[0] + 80, middle[1] + 20))
    tab.until(lambda: tab.saved()["scene_camera"], bool, "the turned view, kept")
    assert shown(tab) != before and tab.saved()["pixel"] is None, "a turn is no click"
    tab.click("#fly-camera")
    tab.until(lambda: tab.saved()["scene_camera"], lambda camera: camera is None)
    tab.until(lambda: tab.look(VIEW), lambda now: now == before, "the view as it was")
    tab.page.mouse.move(*middle)
    tab.page.mouse.wheel(0, -200)
    near = tab.until(lambda: tab.saved()["scene_camera"], bool, "nearer")
    eye = renderer().scene.camera().eye
    assert math.dist(near[:3], near[3:6]) < 0.95 * math.dist(eye, near[3:6])
    drag(tab, middle, (middle[0] + 60, middle[1]))
    tab.until(lambda: tab.saved()["scene_camera"], lambda camera: camera != near)
    picture = tab.source(".lab-image-a")
    tab.click("#render-here")
    tab.until(lambda: tab.source(".lab-image-a"), lambda source: source != picture, "the picture from there")
    assert ":" in tab.saved()["camera"]
