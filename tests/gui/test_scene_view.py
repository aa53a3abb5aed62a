"""The 3D view shows what it is told, where lab's cameras see it, and frees what it drew with."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from vtkmodules.vtkCommonCore import vtkObjectBase

import lab
from gui.scene_view import SceneView, cells, clouds
from gui.scene_view.actors import ball
from gui.scene_view.colours import BACKGROUND, BLOCKED, FREE, LEVELS, LOBE, SHELLS
from gui.scene_view.mesh import STYLES
from gui.scene_view.window import SceneWindow
from lab.grid_lights import blend_shells, emission, occupied_cells
from lab.pixel.members import member_shares
from lab.pixel.probing import probe_pixel
from lab.records import Hierarchy
from lab.scene.scene import Camera, Material, Mesh, Scene

from . import scenes

SIZE = (320, 240)


@pytest.fixture(scope="module")
def shared() -> Iterator[SceneView]:
    view = SceneView(scenes.engine().scene, window_size=SIZE)
    yield view
    view.close()


@pytest.fixture
def view(shared: SceneView) -> SceneView:
    """The room, seen by its camera, with nothing shown."""
    shared.show_mesh("none")
    for show in (shared.show_vpls, shared.show_levels, shared.show_frustum, shared.show_rays, shared.show_pixel_lights):
        show(None)
    shared.show_cells(None, None)
    shared.select_light(None, None)
    shared.set_moving(False)
    shared.show_legend(False)
    shared.look_from(scenes.CAMERA)
    return shared


@pytest.fixture(scope="module")
def hierarchy() -> Hierarchy:
    return scenes.frame().hierarchy


def actors(view: SceneView) -> set[Any]:
    return set(view.plotter.renderer.GetViewProps())


def shown(view: SceneView, colour: tuple[int, int, int], within: int = 40) -> np.ndarray:
    """(H, W) pixels of about `colour`."""
    return (np.abs(view.screenshot().astype(int) - colour) <= within).all(axis=-1)


# --- where things are -----------------------------------------------------------------------------


def test_the_view_looks_as_a_camera_of_the_lab_does(view: SceneView) -> None:
    height = SIZE[1]
    gbuffer = scenes.engine().render_gbuffer(scenes.CAMERA, SIZE)
    y, x = np.nonzero(gbuffer.depth > 0)
    pixels, depth = view._viewpoint.project(gbuffer.position[y, x])
    np.testing.assert_allclose(pixels, np.stack([x, y], axis=1) + 0.5, atol=5e-3)
    np.testing.assert_allclose(depth, gbuffer.depth[y, x], rtol=1e-5)
    renderer = view.plotter.renderer
    for row, column in ((3, 7), (120, 160), (200, 300)):
        renderer.SetWorldPoint(*map(float, gbuffer.position[row, column]), 1.0)
        renderer.WorldToDisplay()
        at = renderer.GetDisplayPoint()
        np.testing.assert_allclose((at[0], height - at[1]), (column + 0.5, row + 0.5), atol=0.02)
    eye, ways = view._viewpoint.rays(np.stack([x, y], axis=1) + 0.5)
    toward = gbuffer.position[y, x] - eye
    np.testing.assert_allclose(ways, toward / np.linalg.norm(toward, axis=1, keepdims=True), atol=1e-4)


def test_what_is_drawn_lies_where_it_projects_to(view: SceneView) -> None:
    point = np.array([0.4, 0.9, -0.5])
    view.show_rays(point)
    y, x = np.nonzero(shown(view, (255, 255, 255)))
    assert len(x) > 20
    np.testing.assert_allclose((x.mean() + 0.5, y.mean() + 0.5), view._viewpoint.project([point])[0][0], atol=0.6)


def test_the_camera_stays_as_things_are_shown(view: SceneView, hierarchy: Hierarchy) -> None:
    before = view.camera
    np.testing.assert_allclose(before.eye, scenes.CAMERA.eye)
    assert before.fov_y_deg == scenes.CAMERA.fov_y_deg
    view.show_mesh("grey")
    view.show_levels(hierarchy, {0, 1, hierarchy.top})
    view.show_cells(hierarchy, hierarchy.top)
    view.select_light(hierarchy, 0)
    view.screenshot()
    assert view.camera == before


def test_it_turns_about_what_it_looks_at(view: SceneView) -> None:
    eye, target = np.array(scenes.CAMERA.eye), np.array(view.camera.target)
    middle = scenes.engine().render_gbuffer(scenes.CAMERA, (1, 1))
    np.testing.assert_allclose(np.linalg.norm(target - eye), middle.depth[0, 0], rtol=1e-4)


# --- the mesh -------------------------------------------------------------------------------------


def test_the_mesh_is_shown_in_each_style(view: SceneView) -> None:
    pictures = {}
    for style in STYLES:
        view.show_mesh(style)
        pictures[style] = view.screenshot().astype(int)
    assert (pictures["none"] == BACKGROUND).all()
    grey = pictures["grey"]
    mesh = (grey != BACKGROUND).any(axis=-1)
    assert mesh.mean() > 0.5 and (np.ptp(grey[mesh], axis=-1) <= 5).all()
    assert len(np.unique(grey[mesh][:, 0])) >= 3, "walls, floor and ceiling differ"
    assert (pictures["albedo"].sum(axis=-1) >= pictures["textured"].sum(axis=-1) - 3).mean() > 0.99
    view.show_mesh("grey", 0.4)
    faint = view.screenshot().astype(int)
    assert (faint != grey).any(axis=-1).mean() > 0.5
    view.show_mesh("grey", 0)
    assert (view.screenshot() == BACKGROUND).all()


@pytest.mark.parametrize(
    ("style", "opacity", "message"),
    [("gray", 1, "mesh style 'gray': .*did you mean 'grey'"), ("grey", 1.5, "mesh opacity 1.5: allowed is 0 to 1")],
)
def test_a_wrong_style_is_named(view: SceneView, style: str, opacity: float, message: str) -> None:
    with pytest.raises(lab.LabError, match=message):
        view.show_mesh(style, opacity)


def test_alpha_masks_are_holes(view: SceneView) -> None:
    texels = np.full((64, 64, 4), 255, np.uint8)
    texels[:, 32:, 3] = 0
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    quad = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), uv=uv)
    material = Material(base_colour=(1, 0, 0), texture=0, alpha_cutoff=0.5)
    scene = Scene("leaf", [quad], [material], [texels], cameras=[Camera("c", (0, 0, 3), (0, 0, 0), fov_y_deg=30)])
    leaf = SceneView(scene, window_size=(120, 120))
    try:
        for style, moving in (("textured", False), ("textured", True), ("albedo", False), ("grey", False)):
            leaf.show_mesh(style)
            leaf.set_moving(moving)
            picture = leaf.screenshot()
            assert (picture[40:80, 66:] == BACKGROUND).all()
            assert (picture[40:80, 10:54] != BACKGROUND).any(axis=-1).all()
        leaf.show_mesh("textured", 0.3)
        assert (leaf.screenshot()[40:80, 66:] == BACKGROUND).all()
        assert (leaf.screenshot()[40:80, 10:54] != BACKGROUND).any(axis=-1).all()
    finally:
        leaf.close()


# --- lights ---------------------------------------------------------------------------------------


def test_levels_are_shown_in_their_colours(view: SceneView, hierarchy: Hierarchy) -> None:
    top = hierarchy.top
    view.show_levels(hierarchy, {1, top}, "level", size=2.0)
    lit = [shown(view, LEVELS[level], 60).sum() for level in range(top + 1)]
    assert lit[1] > 50 and lit[top] > 50
    view.show_levels(hierarchy, {top}, "level")
    assert shown(view, LEVELS[1], 20).sum() < 5
    view.show_levels(hierarchy, set())
    assert (view.screenshot() == BACKGROUND).all()


def test_a_level_is_made_once(view: SceneView, hierarchy: Hierarchy) -> None:
    view.show_levels(hierarchy, {1, 2}, "level")
    made = actors(view)
    for levels in ({1}, {2}, {1, 2}, set()):
        view.show_levels(hierarchy, levels, "level")
        assert actors(view) == made
    view.show_levels(hierarchy, {2}, "deviation")
    assert not actors(view) & made - {view.plotter.renderer}


@pytest.mark.parametrize("colour_by", ["flux", "level", "deviation"])
def test_the_legend_counts_the_lights(view: SceneView, hierarchy: Hierarchy, colour_by: str) -> None:
    view.show_levels(hierarchy, {0, 2}, colour_by)
    block = view._levels.legend
    assert block is not None
    assert [text for _, text in block.rows] == [
        f"level 0 (input): {len(hierarchy.levels[0]):,}",
        f"level 2: {len(hierarchy.levels[2]):,}",
    ]
    assert (block.bar is None) == (colour_by == "level")
    if block.bar:
        assert all(0 <= place <= 1 for place, _ in block.bar.ticks)


def test_brighter_lights_are_larger(hierarchy: Hierarchy) -> None:
    sizes = clouds.sizes_px(np.linspace(-0.5, 1.2, 50))
    assert (np.diff(sizes) >= 0).all() and sizes[0] == clouds.SMALLEST_PX and sizes[-1] == clouds.LARGEST_PX
    assert len(np.unique(sizes)) == 6


def test_clouds_are_thinned_out_while_the_view_moves(view: SceneView, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clouds, "WHILE_MOVING", 100)
    view.show_vpls(scenes.frame().lights)

    def drawn() -> int:
        visible = [a for a in actors(view) if a.IsA("vtkActor") and a.GetVisibility()]
        return sum(actor.GetMapper().GetInput().GetNumberOfPoints() for actor in visible)

    assert drawn() == 600
    view.set_moving(True)
    assert drawn() == 100
    view.show_vpls(scenes.frame().lights)
    assert drawn() == 100, "what is shown while moving is thinned out, too"
    view.set_moving(False)
    assert drawn() == 600


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (({99}, "flux"), r"levels \[99\]: this hierarchy has levels 0 to \d+"),
        (({1}, "fluks"), "colour_by='fluks': .*did you mean 'flux'"),
        (({1}, "flux", 0.0), "size=0.0: allowed is > 0"),
    ],
)
def test_wrong_levels_are_named(view: SceneView, hierarchy: Hierarchy, arguments: Any, message: str) -> None:
    with pytest.raises(lab.LabError, match=message):
        view.show_levels(hierarchy, *arguments)


def test_cells_are_drawn_edge_by_edge_and_never_dropped_in_silence(
    view: SceneView, hierarchy: Hierarchy, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = actors(view)
    assert view.show_cells(hierarchy, hierarchy.top) == ""
    (box,) = actors(view) - before
    assert box.GetMapper().GetInput().GetNumberOfLines() == 12
    side = float(hierarchy.cell_size[hierarchy.top])
    low, high = hierarchy.origin, hierarchy.origin + side
    np.testing.assert_allclose(np.reshape(box.GetBounds(), (3, 2)).T, [low, high], rtol=1e-5)
    found, lights = occupied_cells(hierarchy, 2)
    monkeypatch.setattr(cells, "MOST", 3)
    note = view.show_cells(hierarchy, 2)
    assert note == f"3 of {len(found)} cells of level 2 are shown: those with most lights"
    (box,) = actors(view) - before
    fullest = found[np.argsort(-lights, kind="stable")[:3]]
    corners = hierarchy.origin + np.concatenate([fullest, fullest + 1]) * float(hierarchy.cell_size[2])
    np.testing.assert_allclose(
        np.reshape(box.GetBounds(), (3, 2)).T, [corners.min(axis=0), corners.max(axis=0)], rtol=1e-4, atol=1e-5
    )
    view.show_cells(hierarchy, None)
    assert actors(view) == before


def test_a_selected_light_is_taken_apart(view: SceneView, hierarchy: Hierarchy) -> None:
    index = int(hierarchy.offset[2]) + 1
    params = lab.Params(alpha=0.7, lobe="mean_energy")
    members = member_shares(hierarchy, index)
    before = actors(view)
    view.select_light(hierarchy, index, params, members)
    parts = {
        tuple(round(255 * c) for c in actor.GetProperty().GetColor()): actor
        for actor in actors(view) - before
        if actor.GetMapper().GetInput().GetNumberOfPolys()
    }
    centre = hierarchy.position[index]
    for name, radius in blend_shells(hierarchy, params, 2).items():
        points = np.array(parts[SHELLS[name]].GetMapper().GetInput().points)
        np.testing.assert_allclose(np.linalg.norm(points - centre, axis=1), radius, rtol=1e-4)
    lobe = np.array(parts[LOBE].GetMapper().GetInput().points).astype(np.float64) - centre
    sphere, _ = ball(48, 24)
    reach = 0.5 * float(hierarchy.cell_size[2])
    expected = reach * emission(hierarchy, index, sphere, params)[:, None] * sphere
    np.testing.assert_allclose(lobe, expected, atol=1e-5)
    block = view._selected.legend
    assert block is not None and block.title == f"light {index:,} of level 2"
    assert f"members: {len(members[0]):,}" in [text for _, text in block.rows]
    view.select_light(hierarchy, None)
    assert actors(view) == before
    with pytest.raises(lab.LabError, match="merged indices"):
        view.select_light(hierarchy, 10**8)


def test_input_lights_can_be_selected_too(view: SceneView, hierarchy: Hierarchy) -> None:
    view.select_light(hierarchy, 0, lab.Params(first_level=1), member_shares(hierarchy, 0))
    block = view._selected.legend
    assert block is not None and "members: 1" in [text for _, text in block.rows]
    assert not any("blend radius" in text for _, text in block.rows), "level 0 is not drawn: no shells"


# --- a pixel --------------------------------------------------------------------------------------


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


# --- picking and flying ---------------------------------------------------------------------------


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


# --- memory ---------------------------------------------------------------------------------------


def vtk_objects() -> int:
    gc.collect()
    return sum(issubclass(type(thing), vtkObjectBase) for thing in gc.get_objects())


def test_nothing_of_vtk_is_left_behind(hierarchy: Hierarchy) -> None:
    frame = scenes.frame()
    before = vtk_objects()
    for with_window in (False, True, False, True):
        view = SceneView(scenes.engine().scene, window_size=(160, 120))
        view.show_mesh("textured")
        view.show_vpls(frame.lights)
        view.show_levels(hierarchy, {1, 2})
        view.show_cells(hierarchy, 2)
        view.select_light(hierarchy, int(hierarchy.offset[2]), frame.params)
        view.show_rays((0, 1, 0), [[1, 1, 1]], [True])
        view.show_frustum(scenes.CAMERA)
        view.screenshot()
        assert vtk_objects() > before + 10
        if with_window:
            window = SceneWindow(view, frame)
            window.press("v")
            window.close()
            del window
        view.close()
        view.close()
        del view
        assert vtk_objects() == before
