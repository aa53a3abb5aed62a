"""What one file brings to a scene, while the scene is being put together; and meshes made safe for the core."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.records import Floats, Lights
from lab.scene.scene import Camera, Material, Mesh, PointLight, SpotLight, SunLight, Vec3


@dataclass
class Parts:
    """Fields as in :class:`lab.scene.scene.Scene`; `name`, `exposure`, `background` are None where nothing was said."""

    meshes: list[Mesh] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    textures: list[NDArray[np.uint8]] = field(default_factory=list)
    suns: list[SunLight] = field(default_factory=list)
    points: list[PointLight] = field(default_factory=list)
    spots: list[SpotLight] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    light_list: Lights | None = None
    name: str | None = None
    exposure: float | None = None
    background: Vec3 | None = None
    notes: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)

    def append(self, other: Parts) -> None:
        """Adds the lists of `other` to those here, its material and texture rows moved behind the rows here."""
        material, texture = len(self.materials), len(self.textures)
        self.meshes += [replace(mesh, material=mesh.material + material) for mesh in other.meshes]
        self.materials += [replace(m, texture=m.texture + texture) if m.texture >= 0 else m for m in other.materials]
        self.textures += other.textures
        self.suns += other.suns
        self.points += other.points
        self.spots += other.spots
        self.cameras += other.cameras
        self.notes += other.notes
        self.files += other.files

    def note(self, text: str) -> None:
        """Remembers `text` for the user, once."""
        if text not in self.notes:
            self.notes.append(text)

    def has_light(self) -> bool:
        """True where a sun, point or spot light, a light list or the material of some triangle gives any light."""
        if self.light_list is not None and self.light_list.flux.any():
            return True
        colours = [sun.irradiance for sun in self.suns]
        colours += [point.intensity for point in self.points]
        colours += [spot.intensity for spot in self.spots]
        colours += [self.materials[mesh.material].emission for mesh in self.meshes if len(mesh.index)]
        return any(max(colour) > 0 for colour in colours)


def add_mesh(
    parts: Parts,
    where: str,
    position: NDArray[np.floating],
    index: NDArray[np.integer],
    *,
    material: int,
    normal: NDArray[np.floating] | None = None,
    uv: NDArray[np.floating] | None = None,
    colour: NDArray[np.floating] | None = None,
) -> None:
    """Checks one mesh and adds it to `parts` in the form the core needs; a mesh without triangles adds nothing.

    Of any dtype: `position` (n, 3), `index` (t, 3), and, or None, `normal` (n, 3), `uv` (n, 2), `colour` (n, 3) linear.
    Normals become unit vectors; where the file has none worth the name, the geometric one is used.

    Errors: :class:`LabError` naming `where` for a vertex that is not finite and an index out of range.
    """
    if len(index) == 0:
        return
    with np.errstate(over="ignore"):
        points = np.ascontiguousarray(position, dtype=np.float32)
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise LabError(f"{where}: vertex {row} is at {points[row].tolist()}: every coordinate must be a finite number")
    low, high = int(index.min()), int(index.max())
    if low < 0 or high >= len(points):
        wrong = low if low < 0 else high
        raise LabError(
            f"{where}: a triangle refers to vertex {wrong}, but there are {len(points)}, 0 to {len(points) - 1}"
        )
    triangles = np.ascontiguousarray(index, dtype=np.uint32)
    if uv is not None and not np.isfinite(uv := np.ascontiguousarray(uv, dtype=np.float32)).all():
        uv = np.nan_to_num(uv, nan=0.0, posinf=0.0, neginf=0.0)
        parts.note(f"{where}: texture coordinates that are no finite numbers were set to 0")
    if colour is not None:
        colour = np.ascontiguousarray(colour, dtype=np.float32)
        if not ((colour >= 0) & (colour <= 1)).all():
            colour = np.clip(np.nan_to_num(colour, nan=1.0), 0, 1).astype(np.float32)
            parts.note(f"{where}: vertex colours outside 0..1 were brought into that range")
    unit = None if normal is None else unit_normals(points, triangles, normal)
    parts.meshes.append(Mesh(points, triangles, material, unit, uv, colour))


def unit_normals(position: Floats, index: NDArray[np.uint32], normal: NDArray[np.floating]) -> Floats:
    """`normal` (n, 3) as unit vectors; zero and non-finite rows become the area-weighted normal of their triangles."""
    wide = np.asarray(normal, dtype=np.float64)
    with np.errstate(all="ignore"):
        length = np.linalg.norm(wide, axis=1)
        unit = wide / length[:, None]
    bad = ~np.isfinite(unit).all(axis=1) | (length < 1e-12)
    if bad.any():
        unit[bad] = _geometric_normals(position, index)[bad]
    return np.ascontiguousarray(unit, dtype=np.float32)


def _geometric_normals(position: Floats, index: NDArray[np.uint32]) -> NDArray[np.float64]:
    corner = position.astype(np.float64)[index]
    edges = corner[:, 1:] - corner[:, :1]
    edges /= np.abs(edges).max() or 1.0  # so that no product vanishes or overflows
    area = np.cross(edges[:, 0], edges[:, 1])
    total = np.zeros((len(position), 3))
    for k in range(3):
        np.add.at(total, index[:, k], area)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    # A vertex of degenerate triangles only has no normal at all: up is as good as any, nothing is seen of it.
    return np.where(length > 0, total / np.where(length > 0, length, 1), (0.0, 1.0, 0.0))
