"""Writers of small scene files, made by hand so that they owe nothing to the libraries that read them."""

from __future__ import annotations

import copy
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

QUAD = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float32)
QUAD_UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], dtype=np.float32)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint16)

_COMPONENT = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}


class Gltf:
    """A glTF document in the making: `json` is the document, `binary` its one buffer."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
            "accessors": [], "bufferViews": [], "materials": [], "images": [], "textures": [],
        }  # fmt: skip
        self.binary = b""

    def view(self, data: bytes, **more: Any) -> int:
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **more}
        )  # fmt: skip
        self.binary += data
        return len(self.json["bufferViews"]) - 1

    def array(self, values: np.ndarray, **more: Any) -> int:
        values = np.asarray(values)
        width = 1 if values.ndim == 1 else values.shape[1]
        self.json["accessors"].append(
            {
                "bufferView": self.view(values.tobytes()),
                "componentType": _COMPONENT[values.dtype.str[1:]],
                "count": len(values),
                "type": {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[width],
                **more,
            }
        )
        return len(self.json["accessors"]) - 1

    def mesh(self, indices: np.ndarray | None = TRIANGLES, material: int | None = None, mode: int | None = None,
             normalized: tuple[str, ...] = (), **attributes: np.ndarray) -> int:  # fmt: skip
        """A mesh of one primitive; attributes by their glTF name."""
        attributes.setdefault("POSITION", QUAD)
        primitive: dict[str, Any] = {
            "attributes": {
                name: self.array(values, **({"normalized": True} if name in normalized else {}))
                for name, values in attributes.items()
            }
        }
        if indices is not None:
            primitive["indices"] = self.array(np.ravel(indices))
        if material is not None:
            primitive["material"] = material
        if mode is not None:
            primitive["mode"] = mode
        self.json["meshes"].append({"primitives": [primitive]})
        return len(self.json["meshes"]) - 1

    def node(self, parent: int | None = None, **node: Any) -> int:
        self.json["nodes"].append(node)
        number = len(self.json["nodes"]) - 1
        if parent is None:
            self.json["scenes"][0]["nodes"].append(number)
        else:
            self.json["nodes"][parent].setdefault("children", []).append(number)
        return number

    def material(self, **material: Any) -> int:
        self.json["materials"].append(material)
        return len(self.json["materials"]) - 1

    def texture(self, image: np.ndarray | bytes) -> int:
        data = image if isinstance(image, bytes) else png(image)
        self.json["images"].append({"bufferView": self.view(data), "mimeType": "image/png"})
        self.json["textures"].append({"source": len(self.json["images"]) - 1})
        return len(self.json["textures"]) - 1

    def document(self) -> dict[str, Any]:
        document = {key: value for key, value in copy.deepcopy(self.json).items() if value != []}
        document["buffers"] = [{"byteLength": len(self.binary)}]
        return document

    def bytes(self) -> bytes:
        return pack_glb(self.document(), self.binary)

    def save(self, path: Path) -> Path:
        path.write_bytes(self.bytes())
        return path


def pack_glb(document: object, binary: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary))
    return head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary


def quad_glb() -> Gltf:
    """One lit-up quad: the smallest scene that holds a material."""
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(material=gltf.material(name="plain")))
    return gltf


def png(image: np.ndarray) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(image).save(out, "PNG")
    return out.getvalue()


def ply(
    vertices: np.ndarray, faces: list[list[int]] | None, form: str = "ascii", extra: str = "", names: str = "x y z"
) -> bytes:
    """A PLY; `extra` columns ("uchar red") stand behind x y z, all values are rows of `vertices`."""
    types = [("float", name) for name in names.split()]
    types += [(words.split()[0], words.split()[1]) for words in extra.split(",") if words]
    lines = ["ply", f"format {form} 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property {kind} {name}" for kind, name in types]
    if faces is not None:
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    head = "\n".join([*lines, "end_header\n"]).encode()
    if form == "ascii":
        rows = [" ".join(repr(float(v)) if t == "float" else str(int(v)) for v, (t, _) in zip(row, types, strict=True))
                for row in vertices]  # fmt: skip
        rows += [" ".join(map(str, [len(face), *face])) for face in faces or []]
        return head + "\n".join(rows).encode() + b"\n"
    order = ">" if "big" in form else "<"
    code = {"float": "f", "uchar": "B", "ushort": "H"}
    body = b"".join(
        struct.pack(order + code[t], float(v) if t == "float" else int(v))
        for row in vertices
        for v, (t, _) in zip(row, types, strict=True)
    )
    body += b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in faces or [])
    return head + body
