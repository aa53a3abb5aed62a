"""What the 3D view shows of a pixel, and what lies under a place in the view."""

from __future__ import annotations

import numpy as np
import pytest

import lab
from gui.scene_view import SceneView
from gui.scene_view.colours import BLOCKED, FREE
from lab.pixel.probing import probe_pixel
from lab.records import Hierarchy
from lab.scene.scene import Camera

from . import scenes
from .scene_views import SIZE, actors, shown


def test_rays_are_green_where_free_and_red_where_blocked(view: SceneView) -> None:
    middle, ends = (0.0, 0.9, 0.0), [(1.0, 0.9, 0.0), (-1.0, 0.9, 0.0), (0.0, 1.9, 0.0)]
    view.show_rays(middle, ends, [True, False, True], picks=[4, 9, -1], normal=(0, 0, 1))
    assert shown(view, FREE).sum() > 50 and shown(view, BLOCKED).sum() > 50
    block = view._rays.legend
    assert block is not None and [text for _, text in block.rows][-2:] == ["free: 1", "blocked: 1"]
    view.show_rays(middle, ends[:1], [True])
    assert shown(view, BLOCKED).sum() == 0
    with pytest.raises(lab.LabError, match="rays: 3 targets and 2 visibilities must agree"):
        view.show_rays(middle, ends, [True, False])


def test_the_lights_of_a_pixel_are_those_of_its_probe(view: SceneView) -> None:
    engine, frame = scenes.engine(), scenes.frame()
    probe = probe_pixel(engine, frame, 20, 12)
    before = actors(view)
    view.show_pixel_lights(probe)
    points = np.concatenate(
        [actor.GetMapper().GetInput().points for actor in actors(view) - before if actor.GetVisibility()]
    )
    expected = probe.lights.position
    assert len(points) == len(expected) > 0
    order, other = np.lexsort(points.T), np.lexsort(expected.T)
    np.testing.assert_array_equal(points[order], expected[other])


def test_the_frustum_is_the_cone_of_the_camera(view: SceneView) -> None:
    before = actors(view)
    view.show_frustum(Camera("c", (0, 1, 0.5), (0, 1, -1), fov_y_deg=60), (200, 100))
    lines = next(a for a in actors(view) - before if a.GetMapper().GetInput().GetNumberOfLines())
    ends = np.array(lines.GetMapper().GetInput().points).reshape(-1, 2, 3)[:4]
    np.testing.assert_allclose(ends[:, 0], [[0, 1, 0.5]] * 4, atol=1e-6)
    ways = ends[:, 1] - ends[:, 0]
    half = np.tan(np.radians(30))
    np.testing.assert_allclose(np.abs(ways[:, 0] / ways[:, 2]), 2 * half, rtol=1e-5)
    np.testing.assert_allclose(np.abs(ways[:, 1] / ways[:, 2]), half, rtol=1e-5)
    view.show_frustum(None)
    assert actors(view) == before


def test_a_light_is_picked_where_it_is_drawn(view: SceneView, hierarchy: Hierarchy) -> None:
    view.show_levels(hierarchy, {2})
    first, end = map(int, hierarchy.offset[2:4])
    pixels, depth = view._viewpoint.project(hierarchy.position[first:end])
    inside = (depth > 0) & (pixels > 8).all(axis=1) & (pixels < np.array(SIZE) - 8).all(axis=1)
    alone = [i for i in np.flatnonzero(inside) if np.sort(np.linalg.norm(pixels - pixels[i], axis=1))[1] > 4]
    assert len(alone) > 5
    for i in alone:
        assert view.pick(*pixels[i]) == ("light", first + i)
        assert view.pick(*(pixels[i] + [1.4, -1.4])) == ("light", first + i)


def test_what_the_mesh_hides_is_not_picked(view: SceneView, hierarchy: Hierarchy) -> None:
    view.look_from(Camera("out", (9, 6, 11), (0, 1, 0), fov_y_deg=30))
    view.show_levels(hierarchy, {2})
    pixels, _ = view._viewpoint.project(hierarchy.position[slice(*hierarchy.offset[2:4])])
    through = {view.pick(*pixel)[0] for pixel in pixels}  # type: ignore[index]
    assert through == {"light"}
    view.show_mesh("grey")
    seen = [view.pick(*pixel)[0] for pixel in pixels]  # type: ignore[index]
    assert seen.count("surface") > len(seen) / 3
    view.show_mesh("grey", 0.5)
    assert {view.pick(*pixel)[0] for pixel in pixels} == {"light"}  # type: ignore[index]


def test_the_point_of_a_surface_is_picked(view: SceneView) -> None:
    view.show_mesh("grey")
    gbuffer = scenes.engine().render_gbuffer(scenes.CAMERA, SIZE)
    for x, y in ((20, 30), (160, 120), (300, 200)):
        kind, point = view.pick(x + 0.5, y + 0.5)  # type: ignore[misc]
        assert kind == "surface"
        np.testing.assert_allclose(point, gbuffer.position[y, x], atol=1e-4)
    view.look_from(Camera("away", (0, 1, 20), (0, 1, 40)))
    assert view.pick(160, 120) is None


def test_it_flies_to_where_the_target_is_seen(view: SceneView, hierarchy: Hierarchy) -> None:
    view.show_levels(hierarchy, {1, 2})
    point = scenes.frame().gbuffer.position[12, 20]
    for target, place in ((point, point), (int(hierarchy.offset[2]), hierarchy.position[hierarchy.offset[2]])):
        view.look_from(scenes.CAMERA)
        view.fly_to(target)
        pixels, depth = view._viewpoint.project([place])
        np.testing.assert_allclose(pixels[0], np.array(SIZE) / 2, atol=1e-3)
        assert depth[0] > 0 and view.camera.fov_y_deg == scenes.CAMERA.fov_y_deg
    view.fly_to(point)
    eye, ways = view._viewpoint.rays([np.array(SIZE) / 2])
    distance = np.linalg.norm(point - eye)
    assert view._mesh_rays.distances(eye[None], ways)[0] > 0.98 * distance, "nothing stands before it"
    view.fly_to(scenes.CAMERA)
    np.testing.assert_allclose(view.camera.eye, scenes.CAMERA.eye)
    with pytest.raises(lab.LabError, match="light 99999999: merged indices"):
        view.fly_to(99999999)
