"""The 3D view looks as lab's cameras do, shows the mesh, and frees what it drew with."""

from __future__ import annotations

import gc

import numpy as np
import pytest
from vtkmodules.vtkCommonCore import vtkObjectBase

import lab
from gui.scene_view import SceneView
from gui.scene_view.colours import BACKGROUND
from gui.scene_view.mesh import STYLES
from gui.scene_view.window import SceneWindow
from lab.records import Hierarchy
from lab.scene.scene import Camera, Material, Mesh, Scene

from . import scenes
from .scene_views import SIZE, shown


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
