"""The scene: meshes, materials, lights and cameras as plain data.

+Y is up, colours are linear RGB, lengths are in the scene's own unit, surfaces are diffuse and two-sided.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError, nearest
from lab.records import Floats, Lights

Vec3 = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """A diffuse surface.

    Attributes:
        base_colour: linear RGB, multiplied with texture and vertex colour.
        texture: row of :attr:`Scene.textures`, -1 for none.
        alpha: opacity factor, multiplied with the texture's.
        alpha_cutoff: alpha below it is a hole for every ray (glTF MASK; BLEND uses 0.5); 0: never a hole.
        emission: radiance emitted (strength included), two-sided only if `two_sided`.
    """

    name: str = "default"
    base_colour: Vec3 = (0.8, 0.8, 0.8)
    texture: int = -1
    alpha: float = 1.0
    alpha_cutoff: float = 0.0
    emission: Vec3 = (0.0, 0.0, 0.0)
    two_sided: bool = False


@dataclass(frozen=True)
class Mesh:
    """Triangles of one material, in world space.

    Attributes:
        position: (n, 3).    index: (t, 3) uint32, counter-clockwise seen from the front.    material: row of materials.
        normal: (n, 3) unit vertex normals, or None for flat shading.    uv: (n, 2), v down as in glTF, or None.
        colour: (n, 3) linear RGB, or None.
    """

    position: Floats
    index: NDArray[np.uint32]
    material: int = 0
    normal: Floats | None = None
    uv: Floats | None = None
    colour: Floats | None = None


@dataclass(frozen=True)
class SunLight:
    """A directional light. `irradiance`: linear RGB on a plane that faces it; `to_sun`: unit vector."""

    to_sun: Vec3
    irradiance: Vec3


@dataclass(frozen=True)
class PointLight:
    """An isotropic point light of radiant `intensity` (linear RGB)."""

    position: Vec3
    intensity: Vec3


@dataclass(frozen=True)
class SpotLight:
    """A spot light: full `intensity` inside `inner_angle`, smooth to zero at `outer_angle` (half angles, radians)."""

    position: Vec3
    direction: Vec3
    intensity: Vec3
    inner_angle: float = 0.0
    outer_angle: float = math.pi / 4


@dataclass(frozen=True)
class Camera:
    """A pinhole camera; `fov_y_deg` is the full vertical angle of view in degrees."""

    name: str
    eye: Vec3
    target: Vec3
    up: Vec3 = (0.0, 1.0, 0.0)
    fov_y_deg: float = 45.0

    def __post_init__(self) -> None:
        values = [*self.eye, *self.target, *self.up, self.fov_y_deg]
        if not all(math.isfinite(v) for v in values):
            raise LabError(f"camera {self.name!r}: every number must be finite, got {values}")
        if not 0 < self.fov_y_deg < 180:
            raise LabError(
                f"camera {self.name!r}: the angle of view must be over 0 and under 180 degrees, got {self.fov_y_deg:g}"
            )
        if np.linalg.norm(np.cross(np.subtract(self.target, self.eye), self.up)) == 0:
            raise LabError(f"camera {self.name!r}: eye and target must differ, and up must not point along the view")


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a render needs.

    Attributes:
        textures: (h, w, 4) uint8 RGBA each, RGB in sRGB encoding, top row first.
        light_list: the user's own point lights; the hierarchy is built from them and no VPLs are traced.
        cameras: at least one; the first is the default.
        exposure: factor on colour before it is made a PNG; None: chosen from the picture
            (:func:`lab.colour.auto_exposure`).
        background: radiance seen where nothing is hit; it lights nothing.
        notes: what was decided for the user while loading (an automatic camera, an invented sun ...).
        files: the files it was read from, which nothing may overwrite.
    """

    name: str
    meshes: list[Mesh]
    materials: list[Material]
    textures: list[NDArray[np.uint8]] = field(default_factory=list)
    suns: list[SunLight] = field(default_factory=list)
    points: list[PointLight] = field(default_factory=list)
    spots: list[SpotLight] = field(default_factory=list)
    light_list: Lights | None = None
    cameras: list[Camera] = field(default_factory=list)
    exposure: float | None = None
    background: Vec3 = (0.0, 0.0, 0.0)
    path: str = ""
    notes: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return sum(len(mesh.index) for mesh in self.meshes)

    @property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest corner of the vertices that triangles use."""
        used = [mesh.position[np.unique(mesh.index)] for mesh in self.meshes if len(mesh.index)]
        points = np.concatenate(used).astype(np.float64)
        return points.min(axis=0), points.max(axis=0)

    def camera(self, name: str = "") -> Camera:
        """The camera called `name`, or the first one."""
        if not name:
            return self.cameras[0]
        for camera in self.cameras:
            if camera.name == name:
                return camera
        names = [camera.name for camera in self.cameras]
        raise LabError(f"no camera {name!r} in {self.name}: there are {', '.join(names)}{nearest(name, names)}")
