"""What VTK draws, made from arrays: points, lines and surfaces; and the parts of the view that own them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from gui.scene_view.colours import Bytes, Rgb
from gui.scene_view.legend import Block

# Flat points come 0.6 % nearer to the eye, so that those on a surface are seen whole. (VTK's own means for this,
# polygon offset, hides points drawn as spheres.)
_FIRST = "//VTK::PositionVC::Impl\n  gl_Position.z = -0.999 * gl_Position.w;\n"
_NEARER = "//VTK::PositionVC::Impl\n  gl_Position.z -= 0.006 * (gl_Position.w - gl_Position.z);\n"


class Part:
    """Things in the view that are shown, replaced and removed together, with their block of the legend."""

    def __init__(self, renderer: Any) -> None:
        self._renderer = renderer
        self._actors: list[Any] = []
        self.legend: Block | None = None

    def add(self, actor: Any) -> Any:
        """Draws `actor` from now on."""
        self._actors.append(actor)
        self._renderer.AddActor(actor)
        return actor

    def clear(self) -> None:
        """Removes all of this part, and nothing else."""
        for actor in self._actors:
            self._renderer.RemoveActor(actor)
            actor.ReleaseGraphicsResources(self._renderer.GetRenderWindow())
        self._actors.clear()
        self.legend = None

    def set_moving(self, moving: bool) -> None:
        """What is costly to draw is drawn in fewer points or plainer while the view moves."""


def points_actor(
    position: NDArray[np.float32],
    colours: Bytes | Rgb,
    size_px: float,
    *,
    spheres: bool = True,
    through: bool = False,
) -> vtkActor:
    """(n, 3) points of one size, each of its own (n, 3) colour or all of one.

    With `through`, flat ones are seen through whatever is before them.
    """
    actor = _actor(pyvista.PolyData(np.asarray(position, np.float32)), colours)
    look = actor.GetProperty()
    look.SetRepresentationToPoints()
    look.SetPointSize(size_px)
    look.SetRenderPointsAsSpheres(spheres)
    look.SetLighting(spheres)
    look.SetAmbient(0.45)
    look.SetDiffuse(0.65)
    if through:
        _put_first(actor)
    elif not spheres:
        actor.GetShaderProperty().AddVertexShaderReplacement("//VTK::PositionVC::Impl", True, _NEARER, False)
    return actor


def lines_actor(
    ends: NDArray[np.floating], colours: Bytes | Rgb, width_px: float = 1.0, *, through: bool = False
) -> vtkActor:
    """(n, 2, 3) line segments, each of its own (n, 3) colour or all of one.

    With `through` they are seen, faintly, through whatever is before them.
    """
    points = np.ascontiguousarray(ends, np.float32).reshape(-1, 3)
    pairs = np.arange(len(points)).reshape(-1, 2)
    lines = np.column_stack([np.full(len(pairs), 2), pairs])
    if not isinstance(colours, tuple):
        colours = np.repeat(colours, 2, axis=0)
    actor = _actor(pyvista.PolyData(points, lines=lines.ravel()), colours)
    actor.GetProperty().SetLineWidth(width_px)
    actor.GetProperty().SetLighting(False)
    if through:
        actor.GetProperty().SetOpacity(0.3)
        _put_first(actor)
    return actor


def surface_actor(
    vertices: NDArray[np.floating], triangles: NDArray[np.integer], colour: Rgb, opacity: float
) -> vtkActor:
    """(n, 3) `vertices` and (t, 3) `triangles` as a smooth surface, lit from the eye."""
    surface = pyvista.PolyData(np.ascontiguousarray(vertices, np.float32), faces=faces_of(triangles))
    surface.compute_normals(cell_normals=False, split_vertices=False, inplace=True)
    actor = _actor(surface, colour)
    look = actor.GetProperty()
    look.SetOpacity(opacity)
    look.SetAmbient(0.4)
    look.SetDiffuse(0.6)
    return actor


def faces_of(triangles: NDArray[np.integer]) -> NDArray[np.int64]:
    """(t, 3) vertex numbers as the flat list, counts included, that pyvista takes."""
    return np.column_stack([np.full(len(triangles), 3), triangles]).astype(np.int64).ravel()


def ball(columns: int = 32, rows: int = 16) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The unit sphere as (n, 3) vertices, which are also its directions, and (t, 3) triangles."""
    turn = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    height = np.linspace(0, np.pi, rows + 1)[1:-1, None]
    ring = np.stack(np.broadcast_arrays(np.sin(height) * np.cos(turn), np.cos(height), np.sin(height) * np.sin(turn)))
    vertices = np.concatenate([[[0, 1, 0]], ring.reshape(3, -1).T, [[0, -1, 0]]])
    last, here = len(vertices) - 1, np.arange(columns)
    right = (here + 1) % columns
    start = 1 + columns * np.arange(rows - 2)[:, None]
    a, b, c, d = start + here, start + right, start + columns + here, start + columns + right
    around = [np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (b, d, c))]
    end = last - columns
    caps = [np.column_stack([np.zeros_like(here), 1 + right, 1 + here])]
    caps += [np.column_stack([np.full_like(here, last), end + here, end + right])]
    return vertices, np.concatenate([*caps, *around]).astype(np.int64)


def circles(centre: ArrayLike, radius: float, steps: int = 72) -> NDArray[np.float64]:
    """Three great circles of a sphere as (3 * steps, 2, 3) segments."""
    turn = np.linspace(0, 2 * np.pi, steps + 1)
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    rounds = [np.stack([r[:-1], r[1:]], axis=1) for r in (ring, ring[:, [0, 2, 1]], ring[:, [2, 0, 1]])]
    return np.asarray(np.concatenate(rounds) * radius + np.asarray(centre, np.float64))


def _put_first(actor: vtkActor) -> None:
    actor.GetShaderProperty().AddVertexShaderReplacement("//VTK::PositionVC::Impl", True, _FIRST, False)


def _actor(data: pyvista.PolyData, colours: Bytes | Rgb) -> vtkActor:
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(data)
    actor.SetMapper(mapper)
    if isinstance(colours, tuple):
        mapper.ScalarVisibilityOff()
        actor.GetProperty().SetColor(*(value / 255 for value in colours))
    else:
        data.point_data["colour"] = np.ascontiguousarray(colours)
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray("colour")
        mapper.SetColorModeToDirectScalars()
    return actor
