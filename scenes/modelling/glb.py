"""Writes a model as one small, strict GLB: the same bytes for the same model on any machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygltflib as gltf
from numpy.typing import NDArray

from modelling.images import Texture
from modelling.mesh import Floats, Part, merge


@dataclass(frozen=True)
class Finish:
    """A diffuse material: linear base colour, texture, alpha mask, emission (radiance = emissive * strength)."""

    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    texture: Texture | None = None
    masked: bool = False
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    strength: float = 1.0


def _welded(part: Part) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Vertices (n, 8) = position, normal, uv with each one kept once, and the triangles that still have an area.

    Rounding (0.1 mm) comes first: it hides the last bits in which machines' sines differ.
    """
    uv = part.uv - np.floor(part.uv.min(axis=0))
    rows = np.concatenate([np.round(part.position, 4), np.round(part.normal, 3), np.round(uv, 4)], axis=1) + 0.0
    vertices, index = np.unique(rows, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[part.index]
    a, b, c = (vertices[triangles[:, k], :3] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    triangles = triangles[area > 1e-9]
    used, compact = np.unique(triangles, return_inverse=True)
    vertices = vertices[used]
    vertices[:, 3:6] /= np.linalg.norm(vertices[:, 3:6], axis=1, keepdims=True)
    return vertices.astype(np.float32), compact.reshape(-1, 3)


class _Buffer:
    """The binary chunk, and the views and accessors into it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[gltf.BufferView] = []
        self.accessors: list[gltf.Accessor] = []

    def add(self, data: bytes, target: int | None = None) -> int:
        """The index of a new view that holds `data`."""
        self.data += bytes(-len(self.data) % 4)
        self.views.append(gltf.BufferView(buffer=0, byteOffset=len(self.data), byteLength=len(data), target=target))
        self.data += data
        return len(self.views) - 1

    def attribute(self, values: NDArray[np.float32], kind: str, *, bounds: bool = False) -> int:
        """The index of a new float accessor."""
        low, high = (values.min(axis=0).tolist(), values.max(axis=0).tolist()) if bounds else (None, None)
        view = self.add(np.ascontiguousarray(values).tobytes(), gltf.ARRAY_BUFFER)
        self.accessors.append(
            gltf.Accessor(bufferView=view, componentType=gltf.FLOAT, count=len(values), type=kind, min=low, max=high)
        )
        return len(self.accessors) - 1

    def indices(self, triangles: NDArray[np.int64], vertices: int) -> int:
        """The index of a new scalar accessor, 16 bits wide where that is enough."""
        small = vertices < 65535
        data = triangles.astype(np.uint16 if small else np.uint32).tobytes()
        view = self.add(data, gltf.ELEMENT_ARRAY_BUFFER)
        kind = gltf.UNSIGNED_SHORT if small else gltf.UNSIGNED_INT
        self.accessors.append(gltf.Accessor(bufferView=view, componentType=kind, count=triangles.size, type="SCALAR"))
        return len(self.accessors) - 1


def _material(name: str, finish: Finish, texture: int | None) -> gltf.Material:
    extensions = {}
    if finish.strength != 1.0:
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": finish.strength}
    return gltf.Material(
        name=name,
        pbrMetallicRoughness=gltf.PbrMetallicRoughness(
            baseColorFactor=[*finish.colour, 1.0],
            baseColorTexture=None if texture is None else gltf.TextureInfo(index=texture),
            metallicFactor=0.0,
            roughnessFactor=1.0,
        ),
        alphaMode="MASK" if finish.masked else "OPAQUE",
        alphaCutoff=0.5 if finish.masked else None,
        doubleSided=finish.emissive == (0.0, 0.0, 0.0),
        emissiveFactor=list(finish.emissive),
        extensions=extensions,
    )


FEW, SMALL = 2, 40
"""Fewer copies than this, or copies of fewer triangles, are written out in full: nodes have their price too."""


def _meshes(parts: Sequence[Part]) -> list[tuple[Part, list[Floats]]]:
    """`parts` of one finish as meshes and the poses (4, 4) they stand in."""
    copies: dict[int, list[Part]] = {}
    for part in parts:
        copies.setdefault(id(part.prototype) if part.prototype else 0, []).append(part)
    single = copies.pop(0, [])
    meshes = []
    for same in copies.values():
        prototype = same[0].prototype
        assert prototype is not None
        if len(same) < FEW or len(prototype.index) < SMALL:
            single += same
        else:
            meshes.append((prototype, [part.pose for part in same]))
    return [(merge(single), [np.eye(4)]), *meshes] if single else meshes


def _node(name: str, mesh: int, pose: Floats) -> gltf.Node:
    column_major = (np.round(pose, 6) + 0.0).T.reshape(-1).tolist()
    return gltf.Node(mesh=mesh, name=name, matrix=None if np.array_equal(pose, np.eye(4)) else column_major)


def write_glb(path: Path, model: Sequence[tuple[str, Part]], finishes: Mapping[str, Finish]) -> int:
    """Writes `model`, pairs of a finish's name and a part, to `path`; returns the number of triangles, copies counted.

    One mesh a finish, and one for each prototype with its copies as nodes; textures inside.
    """
    buffer, textures = _Buffer(), list({id(f.texture): f.texture for f in finishes.values() if f.texture}.values())
    meshes: list[gltf.Mesh] = []
    nodes: list[gltf.Node] = []
    materials, triangles = [], 0
    for number, (name, finish) in enumerate(finishes.items()):
        for part, poses in _meshes([part for key, part in model if key == name]):
            vertices, index = _welded(part)
            triangles += len(index) * len(poses)
            attributes = gltf.Attributes(
                POSITION=buffer.attribute(vertices[:, 0:3], "VEC3", bounds=True),
                NORMAL=buffer.attribute(vertices[:, 3:6], "VEC3"),
            )
            if finish.texture:
                attributes.TEXCOORD_0 = buffer.attribute(vertices[:, 6:8], "VEC2")
            indices = buffer.indices(index, len(vertices))
            nodes += [_node(name, len(meshes), pose) for pose in poses]
            meshes.append(
                gltf.Mesh(
                    name=name, primitives=[gltf.Primitive(attributes=attributes, indices=indices, material=number)]
                )
            )
        materials.append(_material(name, finish, textures.index(finish.texture) if finish.texture else None))
    images = [gltf.Image(bufferView=buffer.add(t.data), mimeType=t.mime, name=t.name) for t in textures]
    document = gltf.GLTF2(
        asset=gltf.Asset(version="2.0", generator="many-lights-lab scenes"),
        scene=0,
        scenes=[gltf.Scene(nodes=list(range(len(nodes))))],
        nodes=nodes,
        meshes=meshes,
        materials=materials,
        accessors=buffer.accessors,
        bufferViews=buffer.views,
        buffers=[gltf.Buffer(byteLength=len(buffer.data) + -len(buffer.data) % 4)],
        images=images,
        textures=[gltf.Texture(source=k, sampler=0) for k in range(len(images))],
        samplers=[gltf.Sampler(wrapS=gltf.REPEAT, wrapT=gltf.REPEAT)] if images else [],
        extensionsUsed=["KHR_materials_emissive_strength"] if any(f.strength != 1 for f in finishes.values()) else [],
    )
    document.set_binary_blob(bytes(buffer.data) + bytes(-len(buffer.data) % 4))
    path.write_bytes(b"".join(document.save_to_bytes()))
    return triangles


def light_rows(values: Floats) -> NDArray[np.float32]:
    """`values` rounded to a ten-thousandth, as float32: a light list's column."""
    return (np.round(values, 4) + 0.0).astype(np.float32)
