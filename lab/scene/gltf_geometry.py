"""The geometry of a glTF: every number is checked here, then trimesh reads a plain copy of the document.

trimesh alone would take sparse accessors for zeros, normalised integers for raw ones, and leaves out fans, texture
coordinates without a material and nodes that hold a camera. The copy holds only checked accessors, one buffer view
each, under attribute names that trimesh hands through untouched, and one mesh for each primitive. (open3d merges
materials that are equal and drops their names, so that a light can no longer be found by its material's name.)
"""

from __future__ import annotations

import io
import itertools
import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.scene.gltf_container import GltfFile, whole
from lab.scene.gltf_nodes import Matrix, world_transforms
from lab.scene.quiet import quiet

_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_DTYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_FLOAT, _UINT = 5126, 5125
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True)
class Primitive:
    """Triangles of one material, in the space of their node; arrays as the file stores them, integers scaled.

    Attributes:
        name: what a message calls it.    material: row of the document's materials, -1 for none.
        position: (n, 3).    index: (t, 3).    normal: (n, 3) or None.    colour: (n, 3) linear or None.
        uv: (n, 2) or None for each set of texture coordinates the primitive has.
    """

    name: str
    material: int
    position: NDArray[Any]
    index: NDArray[np.int64]
    normal: NDArray[Any] | None
    colour: NDArray[Any] | None
    uv: dict[int, NDArray[Any]]


@dataclass
class Geometry:
    """What :func:`read_geometry` found: primitives, placed by nodes; `world` gives every node's transform."""

    placed: list[tuple[int, Primitive]]
    world: dict[int, Matrix]
    skipped: int = 0


@dataclass
class _Copy:
    """The plain document in the making."""

    file: GltfFile
    blobs: list[bytes] = field(default_factory=list)
    views: list[dict[str, int]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    known: dict[int, int] = field(default_factory=dict)
    size: int = 0

    def add(self, data: bytes, accessor: dict[str, Any], stride: int | None = None) -> int:
        view = {"buffer": 0, "byteOffset": self.size, "byteLength": len(data)}
        if stride:
            view["byteStride"] = stride
        self.views.append(view)
        self.accessors.append({**accessor, "bufferView": len(self.views) - 1})
        self.blobs.append(data)
        self.size += len(data)
        return len(self.accessors) - 1

    def accessor(self, number: object, user: str, types: tuple[str, ...], components: tuple[int, ...]) -> int:
        """The copy's number of the document's accessor `number`, after every check."""
        source = self.file.item("accessors", number, user)
        where = f"{self.file.path}: accessors[{number}]"
        kind, component = source.get("type"), source.get("componentType")
        if kind not in types or component not in components:
            raise LabError(f"{where} ({user}) has type {kind!r}, component type {component!r}, which it may not have")
        if "sparse" in source:
            raise LabError(f"{where} ({user}) is sparse, which is not supported: export the file without sparse data")
        if "bufferView" not in source:
            raise LabError(f"{where} ({user}) has no data; compressed geometry is not supported: export without it")
        assert isinstance(number, int)  # item() has checked it
        if number in self.known:
            return self.known[number]
        view = self.file.item("bufferViews", source["bufferView"], where)
        data = self.file.view(source["bufferView"], where)
        count, start = whole(where, source, "count"), whole(where, source, "byteOffset", 0)
        row = _SIZES[component] * _WIDTHS[kind]
        stride = whole(where, view, "byteStride", 0)
        if stride and stride < row:
            raise LabError(f"{where}: byteStride is {stride}, but an element has {row} bytes; the file is broken")
        span = (count - 1) * (stride or row) + row if count else 0
        if count == 0:
            raise LabError(f"{where} ({user}) is empty: its count is 0")
        if start + span > len(data):
            raise LabError(
                f"{where} ({user}) needs {start + span} bytes but its buffer view has {len(data)}: the file is broken"
            )
        plain = {"componentType": component, "count": count, "type": kind}
        self.known[number] = self.add(data[start : start + span], plain, stride if stride != row else None)
        return self.known[number]

    def count(self, number: int) -> int:
        return int(self.accessors[number]["count"])


def read_geometry(file: GltfFile) -> Geometry:
    """All triangles of the document's default scene, and the world transform of its nodes.

    Errors: :class:`LabError` for every broken reference, size or transform.
    """
    world = world_transforms(file)
    copy = _Copy(file)
    sources: list[dict[str, Any]] = []  # of each primitive: name, material, the copy's mesh
    by_mesh: dict[int, list[int]] = {}
    placed: list[tuple[int, int]] = []
    skipped = 0
    for number in world:
        row = file.items("nodes")[number].get("mesh")
        if row is None:
            continue
        mesh = file.item("meshes", row, f"nodes[{number}]")
        if row not in by_mesh:
            rows, missed = _primitives(copy, row, mesh)
            by_mesh[row] = list(range(len(sources), len(sources) + len(rows)))
            sources += rows
            skipped += missed
        placed += [(number, k) for k in by_mesh[row]]
    # The nodes are flat: trimesh takes minutes over a chain of some thousand.
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(sources)))}],
        "nodes": [{"name": f"p{k}", "mesh": k} for k in range(len(sources))],
        "meshes": [source["mesh"] for source in sources],
        "accessors": copy.accessors,
        "bufferViews": copy.views,
        "buffers": [{"byteLength": copy.size}],
    }
    primitives = _read_copy(file, _glb(document, copy.blobs), sources)
    return Geometry([(node, primitives[k]) for node, k in placed], world, skipped)


def _primitives(copy: _Copy, number: int, mesh: dict[str, Any]) -> tuple[list[dict[str, Any]], int]:
    """The primitives of one mesh that are triangles, and how many are not."""
    listed = mesh.get("primitives")
    if not isinstance(listed, list) or not all(isinstance(p, dict) for p in listed):
        raise LabError(f"{copy.file.path}: meshes[{number}].primitives must be a list; the file is broken")
    rows, skipped = [], 0
    for k, primitive in enumerate(listed):
        user = f"meshes[{number}].primitives[{k}]"
        mode = primitive.get("mode", _TRIANGLES)
        attributes = primitive.get("attributes")
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            if mode not in (0, 1, 2, 3):
                raise LabError(f"{copy.file.path}: {user}.mode is {mode!r}, it must be 0 to 6; the file is broken")
            skipped += 1
            continue
        if not isinstance(attributes, dict) or "POSITION" not in attributes:
            raise LabError(f"{copy.file.path}: {user} has no POSITION: there is nothing to draw; the file is broken")
        rows.append(_primitive(copy, user, primitive, mode, attributes))
        rows[-1]["mesh"]["name"] = f"p{number}.{k}"
    return rows, skipped


def _primitive(copy: _Copy, user: str, primitive: dict[str, Any], mode: int, found: dict[str, Any]) -> dict[str, Any]:
    integers = (5120, 5121, 5122, 5123)
    position = copy.accessor(found["POSITION"], f"{user}.POSITION", ("VEC3",), (_FLOAT, *integers))
    attributes = {"POSITION": position, "_POSITION": position}
    for name, plain, types in (("NORMAL", "_NORMAL", ("VEC3",)), ("COLOR_0", "_COLOUR", ("VEC3", "VEC4"))):
        if name in found:
            attributes[plain] = copy.accessor(found[name], f"{user}.{name}", types, (_FLOAT, *integers))
    for unit in range(2):
        if (name := f"TEXCOORD_{unit}") in found:
            attributes[f"_UV{unit}"] = copy.accessor(found[name], f"{user}.{name}", ("VEC2",), (_FLOAT, *integers))
    count = copy.count(position)
    for name, accessor in attributes.items():
        if (there := copy.count(accessor)) != count:
            raise LabError(
                f"{copy.file.path}: {user} has {count} positions but {there} in {name.strip('_')}: it is broken"
            )
    mesh: dict[str, Any] = {"attributes": attributes, "mode": mode}
    if primitive.get("indices") is not None:
        mesh["indices"] = copy.accessor(primitive["indices"], f"{user}.indices", ("SCALAR",), (5121, 5123, _UINT))
    corners = copy.count(mesh["indices"]) if "indices" in mesh else count
    if (mode == _TRIANGLES and corners % 3) or corners < 3:
        raise LabError(f"{copy.file.path}: {user} has {corners} corners, which makes no whole number of triangles")
    if mode == _FAN:
        mesh["mode"], mesh["indices"] = _TRIANGLES, _fan(copy, mesh.get("indices"), count)
    material = primitive.get("material")
    if material is not None:
        copy.file.item("materials", material, user)
    accessors = copy.file.items("accessors")
    stored = {"_POSITION": "POSITION", "_UV0": "TEXCOORD_0", "_UV1": "TEXCOORD_1"}
    normalised = {
        plain: accessors[found[name]].get("normalized") is True for plain, name in stored.items() if name in found
    }
    return {
        "name": user,
        "material": -1 if material is None else material,
        "normalised": normalised,
        "mesh": {"primitives": [mesh]},
    }


def _fan(copy: _Copy, indices: int | None, count: int) -> int:
    """A triangle list, as a new accessor, for the fan over `indices` (or all `count` vertices)."""
    if indices is None:
        corners = np.arange(count, dtype=np.int64)
    else:
        accessor = copy.accessors[indices]
        dtype = np.dtype(_DTYPES[accessor["componentType"]])
        stride = copy.views[accessor["bufferView"]].get("byteStride", dtype.itemsize)
        blob = np.frombuffer(copy.blobs[accessor["bufferView"]], dtype=np.uint8)
        rows = np.lib.stride_tricks.as_strided(blob, (accessor["count"], dtype.itemsize), (stride, 1))
        corners = np.ascontiguousarray(rows).view(dtype)[:, 0].astype(np.int64)
    hub = np.full(len(corners) - 2, corners[0])
    faces = np.stack([hub, corners[1:-1], corners[2:]], axis=1).astype("<u4")
    return copy.add(faces.tobytes(), {"componentType": _UINT, "count": faces.size, "type": "SCALAR"})


def _read_copy(file: GltfFile, plain: bytes, sources: list[dict[str, Any]]) -> list[Primitive]:
    if not sources:
        return []
    from trimesh.exchange.gltf import load_glb

    with quiet():
        try:
            read = load_glb(io.BytesIO(plain), skip_materials=True)["geometry"]
            return [_as_primitive(source, read[source["mesh"]["name"]]) for source in sources]
        except Exception as problem:  # whatever the library stumbles on, the file is at fault
            raise LabError(f"{file.path} cannot be read: {problem}; export it again") from problem


def _as_primitive(source: dict[str, Any], mesh: dict[str, Any]) -> Primitive:
    arrays = mesh["vertex_attributes"]
    normalised = source["normalised"]
    position = _scaled(arrays["_POSITION"], normalised["_POSITION"])
    normal = _scaled(arrays["_NORMAL"], True) if "_NORMAL" in arrays else None
    colour = _scaled(arrays["_COLOUR"], True)[:, :3] if "_COLOUR" in arrays else None
    uv = {k: _scaled(arrays[f"_UV{k}"], normalised[f"_UV{k}"]) for k in (0, 1) if f"_UV{k}" in arrays}
    index = np.asarray(mesh["faces"], dtype=np.int64)
    return Primitive(source["name"], source["material"], position, index, normal, colour, uv)


def _scaled(values: NDArray[Any], normalised: bool) -> NDArray[Any]:
    """Integers to numbers: 0..1 or -1..1 where `normalised` (glTF 2.0, 3.6.2.2), else their own value."""
    if values.dtype.kind == "f":
        return values
    wide = values.astype(np.float64)
    return np.maximum(wide / np.iinfo(values.dtype).max, -1.0) if normalised else wide


def _glb(document: dict[str, Any], blobs: list[bytes]) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(itertools.chain(blobs, [b"\0" * (-sum(map(len, blobs)) % 4)]))
    total = 12 + 8 + len(text) + 8 + len(binary)
    head = struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON")
    return b"".join([head, text, struct.pack("<I4s", len(binary), b"BIN\0"), binary])
