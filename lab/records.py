"""THE data between the stages of a frame: plain records of numpy arrays.

Shapes: n input lights, m grid lights of all levels merged (level 0 included), L levels, k shadow samples,
H x W pixels. All arrays are C-contiguous; floats are float32; lengths are in the scene's own unit; colours are
linear RGB. A *merged index* names a grid light everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import LabError

Floats = NDArray[np.float32]

_LARGEST = 1e30
"""Beyond it sums and squares of float32 numbers overflow."""


def as_rows(name: str, values: ArrayLike, columns: int) -> Floats:
    """`values` as a finite, contiguous float32 (n, columns) array, or a :class:`LabError` naming `name`."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float32)
    except (TypeError, ValueError):
        raise LabError(f"{name}: expected numbers of shape (n, {columns}), got {values!r:.60}") from None
    if array.ndim != 2 or array.shape[1] != columns:
        raise LabError(f"{name}: expected shape (n, {columns}), got {array.shape}")
    if not np.isfinite(array).all():
        row = int(np.argmin(np.isfinite(array).all(axis=1)))
        raise LabError(f"{name}: row {row} is {array[row].tolist()}, every number must be finite (and fit float32)")
    return array


@dataclass(frozen=True)
class Lights:
    """The input lights S0: virtual point lights, or a user's own list.

    Attributes:
        position: (n, 3).
        flux: (n, 3) power Phi in RGB, >= 0. An isotropic light of intensity I has 4 pi I, a Lambertian one pi I.
        normal: (n, 3) unit normals of one-sided Lambertian emitters; a zero row, or None for all: isotropic.
        paths_launched: light paths that were launched to get these lights (0 for a user's list).
    """

    position: Floats
    flux: Floats
    normal: Floats | None = None
    paths_launched: int = 0

    def __post_init__(self) -> None:
        position = as_rows("Lights.position", self.position, 3)
        flux = as_rows("Lights.flux", self.flux, 3)
        normal = np.zeros_like(position) if self.normal is None else as_rows("Lights.normal", self.normal, 3)
        if not len(position) == len(flux) == len(normal):
            raise LabError(
                f"Lights: {len(position)} positions, {len(flux)} fluxes and {len(normal)} normals must agree"
            )
        if len(position) == 0:
            raise LabError("Lights: at least one light is needed, got none")
        if (flux < 0).any():
            raise LabError(f"Lights.flux: row {int(np.argmax((flux < 0).any(axis=1)))} is negative")
        length = np.linalg.norm(normal, axis=1)
        if ((length > 0) & (np.abs(length - 1) > 1e-3)).any():
            row = int(np.argmax((length > 0) & (np.abs(length - 1) > 1e-3)))
            raise LabError(
                f"Lights.normal: row {row} has length {length[row]:g}, expected 1 (or 0 for an isotropic light)"
            )
        if float(flux.sum(dtype=np.float64)) > _LARGEST or float(np.abs(position).max()) > _LARGEST:
            raise LabError(
                f"Lights: positions and the sum of all flux must stay under {_LARGEST:g}: choose other units"
            )
        for name, value in (("position", position), ("flux", flux), ("normal", normal)):
            object.__setattr__(self, name, value)

    @classmethod
    def of_paths(cls, position: Floats, flux: Floats, normal: Floats, paths_launched: int) -> Lights:
        """Lights that an engine traced, in arrays of its own: only their magnitudes are looked at."""
        bounds = ((position, _LARGEST), (flux, _LARGEST / max(flux.size, 1)), (normal, 1.001))
        if not all(-limit <= a.min(initial=0) and a.max(initial=0) <= limit for a, limit in bounds):
            return cls(position, flux, normal, paths_launched)  # says what is wrong with them
        lights = object.__new__(cls)
        for name, value in zip(("position", "flux", "normal"), (position, flux, normal), strict=True):
            object.__setattr__(lights, name, value)
        object.__setattr__(lights, "paths_launched", paths_launched)
        return lights

    def __len__(self) -> int:
        return len(self.position)


@dataclass(frozen=True)
class GridLevel:
    """One level of the hierarchy: views into :class:`Hierarchy`'s merged arrays.

    Attributes:
        level: 0 = the input lights, 1 = finest grid, up to the top.
        cell_size: h_l (level 0: h_1 / 2, so that r_0 = r_1 / 2).
        position: (m, 3) illumination centres.    flux: (m, 3).    normal: (m, 3) = E[n], not renormalised.
        normal_moment: (m, 6) = E[n n^T] as xx yy zz xy xz yz.    deviation: (m, 3) standard deviation of position.
        vertex: (m, 3) uint16 grid vertex (level 0: the level-1 cell that holds the light).
    """

    level: int
    cell_size: float
    position: Floats
    flux: Floats
    normal: Floats
    normal_moment: Floats
    deviation: Floats
    vertex: NDArray[np.uint16]

    def __len__(self) -> int:
        return len(self.position)


@dataclass(frozen=True)
class Members:
    """What each grid light of level >= 1 is made of: weighted lists, drawn from for shadow points.

    Row i (= merged index - number of input lights) is the alias table ``slot[offset[i]:offset[i + 1]]``: one of its
    slots is taken evenly, and gives its own light in ``keep`` of 2^32 cases, else its other one. These are merged
    indices of lights of a finer level, whose own row is then drawn from, down to an input light. Level 1 is made of
    input lights, in proportion to trilinear weight times luminance; so is level 2 of S1's lights (gather; with a
    half-open range every coarser level is). The others are made of the vertices of level 2 (or of level 1, where they
    are level 2 themselves): the finer tents add up to the coarser one's, which makes it the same draw. A row's first
    columns name all its members, once each; some may have no weight.

    Attributes:
        offset: (m - n + 1,) int64.    slot: (e, 3) uint32, own light, other light, keep.
    """

    offset: NDArray[np.int64]
    slot: NDArray[np.uint32]


@dataclass(frozen=True)
class Hierarchy:
    """The lighting grid hierarchy: all levels merged, finest first, grid order (x fastest) inside a level.

    Attributes:
        origin: (3,) corner shared by all grids.    cell_size: (L,) h_l of levels 0..top.
        offset: (L + 1,) int64; level l is rows ``offset[l]:offset[l + 1]``.
        position, flux, normal, normal_moment, deviation, vertex: see :class:`GridLevel`, (m, ...).
        oriented: (m,) uint8; 0 = made only of lights without a normal: isotropic in every lobe.
        input_index: (n,) uint32; row of the input list that merged index i < n came from.
        members: lists for drawing shadow points, or None when nothing asked for them.
    """

    origin: Floats
    cell_size: Floats
    offset: NDArray[np.int64]
    position: Floats
    flux: Floats
    normal: Floats
    normal_moment: Floats
    deviation: Floats
    vertex: NDArray[np.uint16]
    oriented: NDArray[np.uint8]
    input_index: NDArray[np.uint32]
    members: Members | None = None

    @property
    def top(self) -> int:
        """The coarsest level, l_max."""
        return len(self.cell_size) - 1

    @property
    def levels(self) -> list[GridLevel]:
        """Levels 0..top as views; ``levels[l].level == l``."""
        return [self._level(level) for level in range(self.top + 1)]

    def _level(self, level: int) -> GridLevel:
        rows = slice(int(self.offset[level]), int(self.offset[level + 1]))
        names = ("position", "flux", "normal", "normal_moment", "deviation", "vertex")
        return GridLevel(level, float(self.cell_size[level]), *(getattr(self, name)[rows] for name in names))


@dataclass(frozen=True)
class GBuffer:
    """What the camera sees, one sample at each pixel's centre.

    Attributes:
        position: (H, W, 3).    normal: (H, W, 3) interpolated, turned to the geometric one's side.
        geometric_normal: (H, W, 3) turned toward the viewer.    albedo: (H, W, 3).
        emission: (H, W, 3) radiance toward the viewer.
        depth: (H, W) distance along the camera's axis; 0 where nothing is hit (and all else is 0 there).
        pixel_angle: tangent of the angle between neighbouring pixels: depth * pixel_angle is a pixel's footprint.
    """

    position: Floats
    normal: Floats
    geometric_normal: Floats
    albedo: Floats
    emission: Floats
    depth: Floats
    pixel_angle: float

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.depth.shape[1], self.depth.shape[0]


@dataclass(frozen=True)
class Lighting:
    """Unshadowed light and the shadow samples picked on the way.

    Attributes:
        irradiance: (H, W, 3) of each pixel's own lights (its interleaving tile's, counted n^2 times).
        overdraw: (L, H, W) uint32, lights whose cube of half-edge 2 r_l contains the pixel's point. None where not
            counted.
        lights_used: (L, H, W) uint32, lights with a non-zero contribution. None where not counted.
        light: (H, W, k) int32 merged index of each pick, -1 for none.
        target_weight: (H, W, k) f of each pick.    weight_sum: (H, W) F, the sum picked from.
        visited: pairs of pixel and light that were evaluated, those of idle lanes included; 0 where not counted.
        fragments: (H, W) uint32, what the rasteriser made of the lights' cubes. None where nothing was rasterised, or
            not counted.
    """

    irradiance: Floats
    overdraw: NDArray[np.uint32] | None
    lights_used: NDArray[np.uint32] | None
    light: NDArray[np.int32]
    target_weight: Floats
    weight_sum: Floats
    visited: int = 0
    fragments: NDArray[np.uint32] | None = None

    def counts(self) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
        """`overdraw` and `lights_used`, which must have been counted."""
        if self.overdraw is None or self.lights_used is None:
            raise LabError("this lighting was made without its counts: engine.light(..., counts=True) makes them")
        return self.overdraw, self.lights_used


@dataclass(frozen=True)
class ShadowSamples:
    """The traced shadow samples and direct light.

    Attributes:
        point: (H, W, k, 3) where each shadow ray ends.    member: (H, W, k) int32 merged index of the drawn input
            light (-1: jittered, or none).
        omega: (H, W, k) weight of each sample.    visible: (H, W, k) uint8.
        shadowed: (H, W, c) S, mean of V omega (c = 3 for ``ratio_rgb``, else 1).
        weight: (H, W, c) what S is relative to: U = mean of omega for the ratios, 1 for ``average`` and ``corrected``;
            0 where nothing was picked.
        direct: (H, W, 3) irradiance from sun, point and spot lights.    area: (H, W, 3) from emissive triangles, noisy.
        left_out: (H, W, 3) irradiance that the clamped falloff leaves out, noisy; None without ``compensation``.
    """

    point: Floats
    member: NDArray[np.int32]
    omega: Floats
    visible: NDArray[np.uint8]
    shadowed: Floats
    weight: Floats
    direct: Floats
    area: Floats
    left_out: Floats | None = None


@dataclass(frozen=True)
class FilteredShadows:
    """Filtered S, its weight and the noisy irradiances (shapes as in :class:`ShadowSamples`)."""

    shadowed: Floats
    weight: Floats
    area: Floats
    left_out: Floats | None = None


@dataclass(frozen=True)
class Image:
    """The composited frame. All (H, W, 3) linear RGB but `shadow_ratio`.

    Attributes:
        colour: direct + indirect. direct: radiance of emission and direct light. unshadowed: irradiance E.
        indirect: radiance, (unshadowed * shadow ratio + what compensation brings back) * albedo / pi.
        shadow_ratio: (H, W, c), c = 3 for ``ratio_rgb``, else 1.
    """

    colour: Floats
    direct: Floats
    unshadowed: Floats
    indirect: Floats
    shadow_ratio: Floats


@dataclass(frozen=True)
class Frame:
    """One rendered frame: the image, every intermediate record, and the time each stage took.

    Attributes:
        stages_ms: milliseconds by the engine's own clock: the processor's, or the graphics card's.

    """

    image: Image
    lights: Lights
    hierarchy: Hierarchy
    gbuffer: GBuffer
    lighting: Lighting
    shadows: ShadowSamples
    filtered: FilteredShadows
    params: Any
    camera: Any
    stages_ms: Mapping[str, float] = field(default_factory=dict)

    @property
    def total_ms(self) -> float:
        """Sum of the seven stages, without loading."""
        return sum(self.stages_ms.values())
