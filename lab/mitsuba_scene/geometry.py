"""The scene's triangles as Mitsuba meshes: one part for each material and set of vertex attributes, as binary PLY."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.records import Floats
from lab.scene.parts import unit_normals
from lab.scene.scene import Material, Mesh, Scene, Vec3


@dataclass(frozen=True)
class Part:
    """Triangles that Mitsuba draws as one shape.

    Attributes:
        material: what they are made of.
        tint: base colour, and the vertex colour where it is one for all; in [0, 1].
        position: (n, 3).    index: (t, 3).    normal: (n, 3), or None for flat shading.
        uv: (n, 2), or None without a texture.    colour: (n, 3) vertex colours times base colour, in place of `tint`.
    """

    material: Material
    tint: Vec3
    position: Floats
    index: NDArray[np.uint32]
    normal: Floats | None = None
    uv: Floats | None = None
    colour: Floats | None = None

    @property
    def emits(self) -> bool:
        """Whether it is an area light."""
        return max(self.material.emission) > 0


def parts(scene: Scene, notes: list[str]) -> list[Part]:
    """`scene` as parts, joined where they are alike; adds to `notes` what could not be kept."""
    alike: dict[Any, list[Part]] = defaultdict(list)
    for mesh in scene.meshes:
        if not len(mesh.index) or _is_one_hole(scene.materials[mesh.material]):
            continue
        part = _part(scene, mesh, notes)
        key = mesh.material, part.tint, part.normal is None, part.uv is None, part.colour is None
        alike[key].append(part)
    return [_joined(group) for group in alike.values()]


def _is_one_hole(material: Material) -> bool:
    return material.texture < 0 and material.alpha < material.alpha_cutoff


def _part(scene: Scene, mesh: Mesh, notes: list[str]) -> Part:
    material = scene.materials[mesh.material]
    used, index = np.unique(mesh.index, return_inverse=True)
    tint = np.asarray(material.base_colour, np.float64)
    colour = None if mesh.colour is None else mesh.colour[used] * tint
    if colour is not None and (material.texture >= 0 or (colour == colour[0]).all()):
        if (colour != colour[0]).any():
            notes.append(
                f"material {material.name}: has vertex colours and a texture, which Mitsuba can't multiply; "
                "the colours' mean is written"
            )
        tint, colour = colour.mean(axis=0), None
    brightest = tint if colour is None else colour
    if brightest.max() > 1:
        notes.append(f"material {material.name}: reflects more than all light; Mitsuba allows 1 at most")
    red, green, blue = np.minimum(tint, 1).tolist()
    part = Part(material, (red, green, blue), mesh.position[used], index.reshape(-1, 3).astype(np.uint32))
    if colour is not None:
        part = replace(part, tint=(1.0, 1.0, 1.0), colour=np.minimum(colour, 1).astype(np.float32))
    if material.texture >= 0:
        uv = np.zeros((len(used), 2), np.float32) if mesh.uv is None else np.nan_to_num(mesh.uv[used])
        part = replace(part, uv=uv)
    if mesh.normal is not None and not part.emits:
        part = replace(part, normal=unit_normals(part.position, part.index, mesh.normal[used]))
    return part


def _joined(group: list[Part]) -> Part:
    start = np.cumsum([0, *(len(part.position) for part in group[:-1])]).astype(np.uint32)

    def all_of(name: str) -> Any:
        rows = [getattr(part, name) for part in group]
        return None if rows[0] is None else np.concatenate(rows)

    return replace(
        group[0],
        position=all_of("position"),
        index=np.concatenate([part.index + first for part, first in zip(group, start, strict=True)]),
        normal=all_of("normal"),
        uv=all_of("uv"),
        colour=all_of("colour"),
    )


def reversed_behind(part: Part, distance: float) -> Part:
    """`part` seen from behind: its triangles turned over and moved `distance` along their backs."""
    corners = part.position[part.index].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    step = distance + 4e-7 * np.abs(corners).max(axis=(1, 2))[:, None]
    behind = corners - (step * normal / np.where(length > 0, length, 1))[:, None]
    order = part.index[:, ::-1].ravel()
    return replace(
        part,
        position=behind[:, ::-1].reshape(-1, 3).astype(np.float32),
        index=np.arange(len(order), dtype=np.uint32).reshape(-1, 3),
        uv=None if part.uv is None else part.uv[order],
        colour=None if part.colour is None else part.colour[order],
    )


def write_ply(path: Path, part: Part) -> None:
    """Writes `part` as binary PLY: x y z, nx ny nz, u v, r g b (linear) as far as it has them."""
    columns = {"x y z": part.position, "nx ny nz": part.normal, "u v": part.uv, "r g b": part.colour}
    present = {names: values for names, values in columns.items() if values is not None}
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(part.position)}",
        *(f"property float {name}" for names in present for name in names.split()),
        f"element face {len(part.index)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    faces = np.empty(len(part.index), [("count", "u1"), ("corner", "<i4", 3)])
    faces["count"], faces["corner"] = 3, part.index
    with path.open("wb") as file:
        file.write(("\n".join(header) + "\n").encode("ascii"))
        file.write(np.hstack(list(present.values())).astype("<f4").tobytes())
        file.write(faces.tobytes())
