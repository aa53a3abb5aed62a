"""A grid light taken apart: where it is blended, how its members lie and face, where it shines, and who they are."""

from __future__ import annotations

import numpy as np
import pyvista
from numpy.typing import NDArray

from gui.scene_view.actors import Part, ball, circles, lines_actor, points_actor, surface_actor
from gui.scene_view.clouds import Cloud
from gui.scene_view.colours import DEVIATION, LOBE, MEMBER, NORMAL, SELECTED, SHELLS, Rgb
from gui.scene_view.legend import Block
from lab.grid_lights import blend_shells, emission, level_of
from lab.params import Params
from lab.records import Hierarchy

Members = tuple[NDArray[np.integer], NDArray[np.floating]]

_LINES = 24  # to the heaviest members
_REACH = 0.5  # cells that an emission of 1, or a mean normal of length 1, is drawn long


class SelectedPart(Part):
    """One light of the hierarchy."""

    def show(self, hierarchy: Hierarchy, index: int | None, params: Params, members: Members | None) -> None:
        """Shows light `index` (None: none).

        `members`: merged indices of the input lights that it is made of, and their shares.
        """
        self.clear()
        if index is None:
            return
        level = level_of(hierarchy, index)
        centre = hierarchy.position[index].astype(np.float64)
        reach = _REACH * float(hierarchy.cell_size[level])
        rows: list[tuple[Rgb | None, str]] = []
        self.add(points_actor(hierarchy.position[index : index + 1], SELECTED, 9, spheres=False, through=True))

        sphere, triangles = ball()
        for name, radius in blend_shells(hierarchy, params, level).items():
            rounds = circles(centre, radius)
            self.add(lines_actor(rounds, SHELLS[name], 1.5))
            self.add(lines_actor(rounds, SHELLS[name], 1.0, through=True))
            self.add(surface_actor(centre + radius * sphere, triangles, SHELLS[name], 0.03 if name == "2r" else 0.05))
            rows.append((SHELLS[name], f"blend radius {name} = {radius:.4g}"))
        deviation = hierarchy.deviation[index].astype(np.float64)
        if deviation.any():
            self.add(surface_actor(centre + deviation * sphere, triangles, DEVIATION, 0.3))
            rows.append((DEVIATION, "deviation " + " x ".join(f"{axis:.3g}" for axis in deviation)))
        rows.append((LOBE, self._add_lobe(hierarchy, index, params, reach)))
        normal = hierarchy.normal[index].astype(np.float64)
        if normal.any():
            self._add_arrow(centre, 1.3 * reach * normal)
            rows.append((NORMAL, "mean normal E[n]"))
        if members is not None and len(members[0]):
            self._add_members(hierarchy, centre, *members)
            rows.append((MEMBER, f"members: {len(members[0]):,}"))
        flux = " ".join(f"{channel:.3g}" for channel in hierarchy.flux[index])
        title = f"light {index:,} of level {level}" + (" (top)" if level == hierarchy.top else "")
        self.legend = Block(title, [(SELECTED, f"flux {flux} (RGB)"), *rows])

    def _add_lobe(self, hierarchy: Hierarchy, index: int, params: Params, reach: float) -> str:
        """The surface whose distance from the centre is the emission toward it; returns what it is called."""
        sphere, triangles = ball(48, 24)
        distance = emission(hierarchy, index, sphere, params).astype(np.float64)
        vertices = hierarchy.position[index] + reach * distance[:, None] * sphere
        self.add(surface_actor(vertices, triangles, LOBE, 0.45))
        return "emission" if hierarchy.oriented[index] else "emission, isotropic"

    def _add_arrow(self, start: NDArray[np.float64], along: NDArray[np.float64]) -> None:
        length = float(np.linalg.norm(along))
        arrow = pyvista.Arrow(start=start, direction=along / length, scale=length, shaft_radius=0.02, tip_radius=0.06)
        triangulated = arrow.triangulate()
        self.add(surface_actor(triangulated.points, triangulated.faces.reshape(-1, 4)[:, 1:], NORMAL, 1.0))

    def _add_members(
        self,
        hierarchy: Hierarchy,
        centre: NDArray[np.float64],
        indices: NDArray[np.integer],
        shares: NDArray[np.floating],
    ) -> None:
        position = hierarchy.position[indices]
        heaviest = float(shares.max())
        weight = np.sqrt(shares / heaviest) if heaviest > 0 else np.zeros(len(shares))
        colours = np.tile(np.asarray(MEMBER, np.uint8), (len(indices), 1))
        # Of thousands, each is drawn smaller, or they would hide each other.
        most = 0.75 * min(1.0, (1000 / len(indices)) ** 0.5)
        Cloud(self, position, colours, most * weight).show(moving=False)
        first = np.argsort(-shares, kind="stable")[:_LINES]
        first = first[shares[first] > 0]
        if first.size:
            ends = np.stack([np.broadcast_to(centre, (len(first), 3)), position[first]], axis=1)
            self.add(lines_actor(ends, (MEMBER[0] * 2 // 3, MEMBER[1] * 2 // 3, MEMBER[2] * 2 // 3)))
