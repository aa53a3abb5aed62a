"""A 3D view of the room that the inspector's tests share, emptied for each test."""

from __future__ import annotations

from typing import Any

import numpy as np

from gui.scene_view import SceneView

from . import scenes

SIZE = (320, 240)


def room_view() -> SceneView:
    """A view of the room; to be closed."""
    return SceneView(scenes.engine().scene, window_size=SIZE)


def emptied(view: SceneView) -> SceneView:
    """`view` with nothing shown in it, still, from the room's camera."""
    view.show_mesh("none")
    for show in (view.show_vpls, view.show_levels, view.show_frustum, view.show_rays, view.show_pixel_lights):
        show(None)
    view.show_cells(None, None)
    view.select_light(None, None)
    view.set_moving(False)
    view.show_legend(False)
    view.look_from(scenes.CAMERA)
    return view


def actors(view: SceneView) -> set[Any]:
    """All that is drawn or hidden in it."""
    return set(view.plotter.renderer.GetViewProps())


def shown(view: SceneView, colour: tuple[int, int, int], within: int = 40) -> np.ndarray:
    """(H, W) pixels of about `colour`."""
    return (np.abs(view.screenshot().astype(int) - colour) <= within).all(axis=-1)
