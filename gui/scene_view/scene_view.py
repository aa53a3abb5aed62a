"""The 3D view: the scene, its lights, and what the hierarchy makes of them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pyvista
from numpy.typing import ArrayLike, NDArray

from gui.display import use_software_display
from gui.scene_view.actors import Part
from gui.scene_view.cells import CellsPart
from gui.scene_view.clouds import WHILE_MOVING, CloudPart
from gui.scene_view.colours import BACKGROUND, hues
from gui.scene_view.legend import Block, Legend
from gui.scene_view.levels import LevelsPart
from gui.scene_view.mesh import MeshPart
from gui.scene_view.picking import MeshRays, nearest_light
from gui.scene_view.pixel import FrustumPart, PixelLightsPart, RaysPart, camera_axes
from gui.scene_view.selected import Members, SelectedPart
from gui.scene_view.viewpoint import Viewpoint
from lab import LabError
from lab.colour import luminance
from lab.grid_lights import level_of
from lab.params import Params
from lab.records import Hierarchy, Lights
from lab.scene.scene import Camera, Scene

Picked = tuple[Literal["light"], int] | tuple[Literal["surface"], NDArray[np.float64]]

_WITHIN_PX = 6.0


class SceneView:
    """What is shown is told by ``show_*``, each of which replaces what it showed before and keeps the camera.

        view = SceneView(scene)
        view.show_mesh("textured")
        view.show_levels(frame.hierarchy, {3, 4})
        view.look_from(scene.camera())
        pixels = view.screenshot()

    Attributes:
        scene: what is looked at.
        plotter: the pyvista plotter that it is drawn in.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        off_screen: bool = True,
        window_size: tuple[int, int] = (960, 640),
        plotter: pyvista.Plotter | None = None,
    ) -> None:
        """`plotter`: one to draw in, in place of a new one; its lights and background are set.

        Errors: :class:`lab.LabError` where nothing can be drawn off-screen.
        """
        self.scene = scene
        if plotter is None:
            if off_screen:
                use_software_display()
            plotter = pyvista.Plotter(off_screen=off_screen, window_size=list(window_size), lighting=None)
        self.plotter = plotter
        plotter.remove_all_lights()
        plotter.add_light(pyvista.Light(light_type="headlight"))
        renderer = plotter.renderer
        renderer.SetBackground(*(value / 255 for value in BACKGROUND))
        renderer.GradientBackgroundOff()
        self._window = renderer.GetRenderWindow()
        # Edges are smoothed in the picture: several samples a pixel would cost three times the rest in software.
        self._window.SetMultiSamples(0)
        renderer.SetUseFXAA(True)
        low, high = scene.bounds
        self._radius = float(np.linalg.norm(high - low)) / 2
        self._mesh = MeshPart(renderer, scene)
        self._levels, self._vpls = LevelsPart(renderer), CloudPart(renderer)
        self._cells, self._selected = CellsPart(renderer), SelectedPart(renderer)
        self._rays, self._pixel_lights = RaysPart(renderer), PixelLightsPart(renderer)
        self._frustum = FrustumPart(renderer)
        self._legend, self._viewpoint = Legend(renderer), Viewpoint(renderer)
        self._mesh_rays = MeshRays(scene)
        self._hierarchy: Hierarchy | None = None
        self._closed = False
        self._with_legend = True
        # Otherwise the first picture would be taken from where pyvista thinks best.
        plotter.renderer.camera_set = True
        self.look_from(scene.camera())

    @property
    def _parts(self) -> list[Part]:
        """In the order of their legends, from the top."""
        return [
            self._frustum, self._vpls, self._levels, self._cells, self._selected, self._pixel_lights, self._rays,
            self._mesh,
        ]  # fmt: skip

    def show_mesh(self, style: str = "textured", opacity: float = 1.0) -> None:
        """The triangles: ``textured`` and shaded, ``grey``, ``albedo`` unshaded, or ``none``."""
        self._mesh.show(style, opacity)
        self._changed()

    def show_vpls(self, lights: Lights | None) -> None:
        """The input lights as points, in the hue of their flux, brighter where it is greater."""
        self._vpls.clear()
        if lights is not None:
            flux = luminance(lights.flux)
            rank = np.empty(len(flux))
            rank[np.argsort(flux, kind="stable")] = np.linspace(0, 1, len(flux))
            self._vpls.show(lights.position, hues(lights.flux, rank), spheres=False)
            fewer = f" ({WHILE_MOVING:,} while moving)" if len(flux) > WHILE_MOVING else ""
            self._vpls.legend = Block("input lights, brighter = more flux", [(None, f"{len(flux):,}{fewer}")])
        self._changed()

    def show_levels(
        self,
        hierarchy: Hierarchy | None,
        levels: Collection[int] = (),
        colour_by: str = "flux",
        size: float = 1.0,
    ) -> None:
        """The grid lights of `levels`, coloured by ``flux``, ``level`` or ``deviation``; None: none.

        The larger the flux, the larger the sphere, `size` times as large as usual.
        """
        if hierarchy is None:
            self._levels.clear()
        else:
            self._levels.show(hierarchy, levels, colour_by, size)
            self._hierarchy = hierarchy
        self._changed()

    def show_cells(self, hierarchy: Hierarchy | None, level: int | None) -> str:
        """The cells of grid `level` that hold lights; returns a note where some are left out, else ""."""
        note = ""
        if hierarchy is None:
            self._cells.clear()
        else:
            note = self._cells.show(hierarchy, level)
        self._changed()
        return note

    def select_light(
        self,
        hierarchy: Hierarchy | None,
        index: int | None,
        params: Params | None = None,
        members: Members | None = None,
    ) -> None:
        """One light taken apart: blend radii, deviation, mean normal, emission and `members`.

        `members`: merged indices of input lights and their shares.
        """
        if hierarchy is None:
            self._selected.clear()
        else:
            self._selected.show(hierarchy, index, params or Params(), members)
            self._hierarchy = hierarchy
        self._changed()

    def show_rays(
        self,
        point: ArrayLike | None,
        targets: ArrayLike = (),
        visible: ArrayLike = (),
        picks: ArrayLike | None = None,
        normal: ArrayLike | None = None,
    ) -> None:
        """The shadow rays of a pixel: from its `point` to (n, 3) `targets`, green where `visible`, else red.

        `picks`: (n,) merged indices; a negative one has no ray. `normal`: the point's, drawn too. `point` None: none.
        """
        if point is None:
            self._rays.clear()
        else:
            self._rays.show(point, targets, visible, picks=picks, normal=normal, normal_length=0.06 * self._radius)
        self._changed()

    def show_pixel_lights(self, probe: Any | None) -> None:
        """The grid lights that light a pixel (``probe.lights``), sized by their contribution."""
        self._pixel_lights.show_probe(probe)
        self._changed()

    def show_probe(self, probe: Any | None) -> None:
        """A probed pixel: its shadow rays, and the lights that light it. None, or a pixel of nothing: none."""
        if probe is None or probe.depth == 0:
            self.show_rays(None)
            self.show_pixel_lights(None)
            return
        picks, traced = probe.picks, probe.picks.traced
        self.show_rays(probe.point, picks.point[traced], picks.visible[traced], normal=probe.normal)
        self.show_pixel_lights(probe)

    def show_frustum(self, camera: Camera | None, size: tuple[int, int] = (16, 9)) -> None:
        """The cone of sight of `camera` for a picture of `size` = (width, height)."""
        self._frustum.show(camera, size, 0.12 * self._radius)
        self._changed()

    def show_legend(self, shown: bool) -> None:
        """Whether what is shown is explained in a corner."""
        self._with_legend = shown
        self._changed()

    def look_from(self, camera: Camera) -> None:
        """Sees what `camera` sees: same eye, same vertical angle of view.

        The view then turns about the surface in its middle, as that is where one looks at.
        """
        eye, ahead = np.asarray(camera.eye, np.float64), camera_axes(camera)[2:]
        distance = float(self._mesh_rays.distances(eye[None], ahead)[0])
        if np.isfinite(distance) and distance > 1e-3 * self._radius:
            camera = replace(camera, target=tuple((eye + distance * ahead[0]).tolist()))
        self._viewpoint.camera = camera

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self._viewpoint.size

    @property
    def camera(self) -> Camera:
        """Where the view is seen from."""
        return self._viewpoint.camera

    def fly_to(self, target: ArrayLike | Camera | int, radius: float | None = None) -> None:
        """Brings a point (3,), a light of the hierarchy shown (its merged index) or a camera's view before the eye.

        `radius`: of what shall be seen around the point. The way of looking is kept where the mesh leaves it free.
        """
        if isinstance(target, Camera):
            return self.look_from(target)
        if isinstance(target, int | np.integer):
            if self._hierarchy is None:
                raise LabError(f"fly_to({target}): no hierarchy has been shown; show_levels first, or give a point")
            level = level_of(self._hierarchy, int(target))
            radius = radius or 1.2 * float(self._hierarchy.cell_size[level])
            target = self._hierarchy.position[target]
        point = np.asarray(target, np.float64)
        reach = radius or 0.1 * self._radius
        before = self._viewpoint.camera
        distance = reach / np.sin(np.radians(min(before.fov_y_deg, 60.0) / 2))
        eye = self._free_place(point, distance, reach)
        self._viewpoint.camera = Camera("view", tuple(eye), tuple(point), before.up, before.fov_y_deg)
        return None

    def _free_place(self, point: NDArray[np.float64], distance: float, reach: float) -> NDArray[np.float64]:
        """Where to look at `point` from: the first place that sees it, or at least what is a little before it."""
        for before, share in ((0.1, 1.0), (0.1, 0.6), (0.1, 0.35), (0.6, 1.0), (0.6, 0.6)):
            eyes = self._viewpoint.places_around(point, share * distance)
            ways = (point - eyes) / (share * distance)
            seen = self._mesh_rays.distances(eyes, ways) > share * distance - before * reach
            if seen.any():
                return np.asarray(eyes[int(np.argmax(seen))])
        return np.asarray(self._viewpoint.places_around(point, distance)[0])

    def pick(self, x: float, y: float) -> Picked | None:
        """What lies under place (x, y) of the view, in pixels from its upper left corner.

        ``("light", merged index)`` of a grid light shown, which the opaque mesh does not hide; else ``("surface",
        point)`` of the mesh (holes of alpha masks count as solid); else None.
        """
        eye, ways = self._viewpoint.rays([(x, y)])
        hit = float(self._mesh_rays.distances(eye[None], ways)[0])
        light = self._light_under(x, y, eye, ways[0])
        if light is not None:
            return "light", light
        return ("surface", eye + hit * ways[0]) if np.isfinite(hit) else None

    def _light_under(self, x: float, y: float, eye: NDArray[np.float64], way: NDArray[np.float64]) -> int | None:
        hierarchy = self._levels.hierarchy
        if hierarchy is None or not self._levels.shown:
            return None
        rows = np.concatenate([self._near_ray(hierarchy, level, eye, way) for level in self._levels.shown])
        pixels, depth = self._viewpoint.project(hierarchy.position[rows])
        under = nearest_light((x, y), pixels, depth, self._levels.radii_px(rows), _WITHIN_PX)[:64]
        if self._mesh.opaque and under.size:
            toward = hierarchy.position[rows[under]] - eye
            away = np.linalg.norm(toward, axis=1)
            # A light in a surface, as most are, is seen.
            seen = self._mesh_rays.distances(eye[None], toward / away[:, None]) > away - 5e-3 * self._radius
            under = under[seen]
        return int(rows[under[0]]) if under.size else None

    def _near_ray(
        self, hierarchy: Hierarchy, level: int, eye: NDArray[np.float64], way: NDArray[np.float64]
    ) -> NDArray[np.intp]:
        """Merged indices of the lights of `level` in a cone around a ray that holds all that may be under its pixel."""
        first, end = hierarchy.offset[level : level + 2]
        from_eye = hierarchy.position[first:end] - eye.astype(np.float32)
        along = from_eye @ way.astype(np.float32)
        aside = np.einsum("ij,ij->i", from_eye, from_eye) - along**2
        widest = 2 * self._viewpoint.pixel_angle * max(_WITHIN_PX, self._levels.largest_px / 2)
        return np.asarray(first + np.flatnonzero((along > 0) & (aside < (widest * along) ** 2)))

    def set_moving(self, moving: bool) -> None:
        """While the view moves, clouds are thinned out, the mesh is plainer and edges are not smoothed."""
        self.plotter.renderer.SetUseFXAA(not moving)
        for part in self._parts:
            part.set_moving(moving)

    def render(self) -> None:
        """Draws what has changed."""
        self._viewpoint.fit_planes()
        self._window.Render()

    def screenshot(self) -> NDArray[np.uint8]:
        """The view as (h, w, 3) sRGB bytes."""
        self._changed()
        self.render()
        return np.array(self.plotter.screenshot(None, return_img=True), np.uint8)[..., :3]

    def close(self) -> None:
        """Frees the window and everything in it; the view cannot be used any more."""
        if self._closed:
            return
        self._closed = True
        for part in self._parts:
            part.clear()
        self._legend.clear()
        self.plotter.close()
        self.plotter.deep_clean()
        self.__dict__.clear()
        self._closed = True

    def _changed(self) -> None:
        blocks = [part.legend for part in self._parts if part.legend] if self._with_legend else []
        self._legend.show(blocks, self._viewpoint.size[1])
        self._viewpoint.fit_planes()
