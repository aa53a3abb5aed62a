"""glTF and GLB files: geometry by trimesh, materials, cameras and punctual lights by pygltflib."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.scene.gltf_container import GltfFile, read_gltf_file
from lab.scene.gltf_geometry import Primitive, read_geometry
from lab.scene.gltf_lights import read_lights_and_cameras
from lab.scene.gltf_materials import UvMap, read_materials
from lab.scene.parts import Parts, add_mesh
from lab.scene.quiet import quiet
from lab.scene.scene import Material

_UNDERSTOOD = {
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_texture_webp",
}


def read_gltf(path: Path) -> Parts:
    """The default scene of the glTF or GLB file at `path`.

    Errors: :class:`LabError` for a file that is cut off, broken, or needs an extension that is not understood.
    """
    file = read_gltf_file(path)
    _check_extensions(file)
    geometry = read_geometry(file)
    carriers = [n for n in geometry.world if {"camera", "extensions"} & file.items("nodes")[n].keys()]
    model = _model(file, carriers)
    parts = Parts()
    maps = read_materials(file, model, parts)
    plain = len(parts.materials)
    if any(primitive.material < 0 for _, primitive in geometry.placed):  # glTF 2.0, 3.9: the default is white
        parts.materials.append(Material("default", (1.0, 1.0, 1.0)))
        maps.append(UvMap())
    for node, primitive in geometry.placed:
        row = primitive.material if primitive.material >= 0 else plain
        _add(parts, file, primitive, geometry.world[node], row=row, uv_map=maps[row])
    places = [geometry.world[number] for number in carriers]
    read_lights_and_cameras(file, model, places, parts)
    if geometry.skipped:
        parts.note(f"{path.name}: {geometry.skipped} primitives of points or lines were left out")
    if file.document.get("skins"):
        parts.note(f"{path.name}: skinned meshes are shown as modelled, without their skeleton")
    return parts


def _check_extensions(file: GltfFile) -> None:
    required = file.document.get("extensionsRequired", [])
    if not isinstance(required, list):
        raise LabError(f"{file.path}: extensionsRequired must be a list; the file is broken")
    for name in required:
        if name not in _UNDERSTOOD and not str(name).startswith("KHR_materials_"):
            raise LabError(f"{file.path} needs the extension {name}, which is not supported: export it without")


def _model(file: GltfFile, carriers: list[int]) -> Any:
    """What pygltflib makes of the materials, lights and cameras; its nodes are the `carriers` alone, in their order.

    It takes some milliseconds for each object, so it is not given the geometry.
    """
    import pygltflib

    document: dict[str, Any] = {
        key: file.document[key] for key in ("materials", "cameras", "extensions") if key in file.document
    }
    kept = ("name", "camera", "extensions")
    nodes = [file.items("nodes")[number] for number in carriers]
    document["nodes"] = [{key: node[key] for key in kept if key in node} for node in nodes]
    with quiet():
        try:
            return pygltflib.GLTF2.gltf_from_json(json.dumps(document))
        except Exception as problem:  # a value of the wrong type ends in whatever error the library meets
            raise LabError(f"{file.path}: its glTF document is broken ({problem}); export it again") from problem


def _add(
    parts: Parts, file: GltfFile, primitive: Primitive, world: NDArray[np.float64], *, row: int, uv_map: UvMap
) -> None:
    position, normal, index = primitive.position, primitive.normal, primitive.index
    if not np.array_equal(world, np.eye(4)):
        with np.errstate(all="ignore"):
            position = np.asarray(position, dtype=np.float64) @ world[:3, :3].T + world[:3, 3]
            cofactors = _cofactors(world[:3, :3])  # carry normals through any linear map, singular ones included
            mirrored = bool(world[0, :3] @ cofactors[0] < 0)
            if normal is not None:
                normal = np.asarray(normal, dtype=np.float64) @ (-cofactors if mirrored else cofactors).T
        if mirrored:
            index = index[:, ::-1]
    uv = primitive.uv.get(uv_map.unit)
    if uv is not None:
        uv = uv_map.apply(uv)
    elif parts.materials[row].texture >= 0:
        parts.note(f"{file.path.name}: {primitive.name} has a texture but no coordinates for it")
    add_mesh(
        parts,
        f"{file.path}: {primitive.name}",
        position,
        index,
        material=row,
        normal=normal,
        uv=uv,
        colour=primitive.colour,
    )


def _cofactors(m: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([np.cross(m[1], m[2]), np.cross(m[2], m[0]), np.cross(m[0], m[1])])
