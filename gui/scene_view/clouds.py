"""Many points, few actors: VTK draws all points of an actor at one size, so that a cloud is dealt to sizes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkRenderingCore import vtkActor

from gui.scene_view.actors import Part, points_actor
from gui.scene_view.colours import Bytes

WHILE_MOVING = 30_000
"""Points of a cloud that are drawn while the view moves; of spheres, which cost twice as much, half as many."""

_BUCKETS = 6
SMALLEST_PX, LARGEST_PX = 3.0, 20.0
"""Diameters of points."""


def sizes_px(weight: NDArray[np.floating]) -> NDArray[np.floating]:
    """(n,) diameters in pixels of points of (n,) weights from 0 to 1: one of a few."""
    bucket = np.clip(np.floor(np.asarray(weight) * _BUCKETS), 0, _BUCKETS - 1)
    return np.asarray(SMALLEST_PX + (LARGEST_PX - SMALLEST_PX) * bucket / (_BUCKETS - 1))


class Cloud:
    """Points with a colour and a weight each; heavier ones are drawn larger. Hidden until shown."""

    def __init__(
        self,
        part: Part,
        position: NDArray[np.float32],
        colours: Bytes,
        weight: NDArray[np.floating] | None = None,
        *,
        spheres: bool = True,
    ) -> None:
        """`weight`: (n,) from 0 to 1, None for all alike."""
        self._still: list[tuple[vtkActor, float]] = []
        self._moving: list[tuple[vtkActor, float]] = []
        sizes = sizes_px(np.zeros(len(position)) if weight is None else weight)
        kept = _thinned(len(position), WHILE_MOVING // 2 if spheres else WHILE_MOVING)
        for size in np.unique(sizes).tolist():
            inside = sizes == size
            actor = part.add(points_actor(position[inside], colours[inside], size, spheres=spheres))
            self._still.append((actor, size))
            if kept is None:
                self._moving.append((actor, size))
                continue
            inside &= kept
            if inside.any():
                fewer = part.add(points_actor(position[inside], colours[inside], size, spheres=spheres))
                self._moving.append((fewer, size))
        self.hide()

    def show(self, moving: bool, size: float = 1.0) -> None:
        """Shows the cloud, thinned out if `moving`, its points `size` times as large as usual."""
        self.hide()
        for actor, size_px in self._moving if moving else self._still:
            actor.GetProperty().SetPointSize(size * size_px)
            actor.VisibilityOn()

    def hide(self) -> None:
        """Draws none of it."""
        for actor, _ in [*self._still, *self._moving]:
            actor.VisibilityOff()


def _thinned(count: int, most: int) -> NDArray[np.bool_] | None:
    """Which of `count` points are kept while moving, `most` of them and the same each time; None for all."""
    if count <= most:
        return None
    kept = np.zeros(count, bool)
    kept[np.random.default_rng(1).choice(count, most, replace=False)] = True
    return kept


class CloudPart(Part):
    """One cloud: the input lights, or the lights of a pixel."""

    def __init__(self, renderer: Any) -> None:
        super().__init__(renderer)
        self._cloud: Cloud | None = None
        self._size, self._is_moving = 1.0, False

    def show(
        self,
        position: NDArray[np.float32],
        colours: Bytes,
        weight: NDArray[np.floating] | None = None,
        *,
        spheres: bool = True,
        size: float = 1.0,
    ) -> None:
        """As of :class:`Cloud`, in place of the cloud before."""
        self.clear()
        self._cloud, self._size = Cloud(self, position, colours, weight, spheres=spheres), size
        self.set_moving(self._is_moving)

    def clear(self) -> None:
        """Removes the cloud."""
        super().clear()
        self._cloud = None

    def set_moving(self, moving: bool) -> None:
        """Thinned out while the view moves."""
        self._is_moving = moving
        if self._cloud is not None:
            self._cloud.show(moving, self._size)
