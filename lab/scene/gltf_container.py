"""The outer shell of a glTF: from a .glb or .gltf file to its JSON document and the bytes of its buffers.

glTF 2.0, sections 3.6.1 (buffers) and 4.4 (GLB). Nothing here trusts a number of the file.
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
import urllib.parse
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeGuard

from lab.errors import LabError

_JSON_CHUNK, _BINARY_CHUNK = b"JSON", b"BIN\0"


@dataclass(frozen=True)
class GltfFile:
    """A glTF as it lies on disk: the `document` and the bytes of each of its `buffers`."""

    path: Path
    document: dict[str, Any]
    buffers: list[bytes]
    _checked: dict[str, list[dict[str, Any]]] = field(default_factory=dict)

    def items(self, name: str) -> list[dict[str, Any]]:
        """The document's list `name` (empty when absent), every item an object."""
        if name in self._checked:
            return self._checked[name]
        listed = self.document.get(name, [])
        if not isinstance(listed, list) or not all(isinstance(item, dict) for item in listed):
            raise LabError(f"{self.path}: {name!r} must be a list of objects; the file is broken: export it again")
        self._checked[name] = listed
        return listed

    def view(self, number: object, user: str) -> bytes:
        """The bytes of buffer view `number`; `user` names what refers to it."""
        view = self.item("bufferViews", number, user)
        where = f"{self.path}: bufferViews[{number}]"
        buffer = view.get("buffer")
        start, length = whole(where, view, "byteOffset", 0), whole(where, view, "byteLength")
        if not is_whole(buffer) or buffer >= len(self.buffers):
            raise LabError(f"{where} refers to buffer {buffer!r}, but there are {len(self.buffers)}")
        data = self.buffers[buffer]
        if start + length > len(data):
            raise LabError(
                f"{where} needs bytes {start} to {start + length}, but the buffer has {len(data)}: the file is broken"
            )
        return data[start : start + length]

    def item(self, name: str, number: object, user: str) -> dict[str, Any]:
        """Item `number` of the document's list `name`; `user` names what refers to it."""
        listed = self.items(name)
        if not is_whole(number) or number >= len(listed):
            raise LabError(f"{self.path}: {user} refers to {name}[{number!r}], but there are {len(listed)}")
        return listed[number]


def is_whole(value: object) -> TypeGuard[int]:
    """True for an int of 0 or more."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def whole(where: str, table: dict[str, Any], key: str, default: int | None = None) -> int:
    """The whole number `table[key]`, 0 or more, or :class:`LabError` naming `where`."""
    value = table.get(key, default)
    if not is_whole(value):
        raise LabError(f"{where}: {key} is {value!r}, it must be a whole number of 0 or more; the file is broken")
    return int(value)


def read_gltf_file(path: Path) -> GltfFile:
    """Reads and checks the shell of `path`; buffers in files beside it are read too."""
    data = path.read_bytes()
    if not data:
        raise LabError(f"{path} is empty: a glTF scene was expected")
    if path.suffix.lower() == ".glb":
        text, binary = _split_glb(path, data)
    else:
        if data[:4] == b"glTF":
            raise LabError(f"{path} is a binary glTF: rename it to {path.stem}.glb")
        text, binary = data, None
    document = _parse(path, text)
    file = GltfFile(path, document, [])
    for number, buffer in enumerate(file.items("buffers")):
        file.buffers.append(_buffer(file, number, buffer, binary))
    return file


def _split_glb(path: Path, data: bytes) -> tuple[bytes, bytes | None]:
    if data[:4] != b"glTF":
        kind = "text" if data[:1024].isascii() else "something else"
        raise LabError(f"{path} is not a GLB file: it begins with {data[:4]!r} ({kind}), not with b'glTF'")
    if len(data) < 20:
        raise LabError(f"{path} is cut off: {len(data)} bytes are left of it; copy or export it again")
    version, total = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise LabError(f"{path} is glTF version {version}: version 2 is needed; export it again")
    if total > len(data):
        raise LabError(f"{path} is cut off: {len(data)} of {total} bytes are there; copy or export it again")
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= total:
        length, kind_of_chunk = struct.unpack_from("<I4s", data, at)
        if at + 8 + length > total:
            raise LabError(f"{path} is broken: a chunk of {length} bytes at byte {at} reaches past the end ({total})")
        chunks.setdefault(kind_of_chunk, data[at + 8 : at + 8 + length])
        at += 8 + length
    if _JSON_CHUNK not in chunks:
        raise LabError(f"{path} is broken: it holds no JSON chunk; export it again")
    return chunks[_JSON_CHUNK], chunks.get(_BINARY_CHUNK)


def _parse(path: Path, text: bytes) -> dict[str, Any]:
    try:
        document = json.loads(text.decode("utf-8-sig").rstrip("\0 "))
    except UnicodeDecodeError as problem:
        raise LabError(f"{path}: its JSON is not UTF-8 text (byte {problem.start}); the file is broken") from problem
    except RecursionError as problem:
        raise LabError(f"{path}: its JSON is nested too deeply; the file is broken") from problem
    except ValueError as problem:
        raise LabError(f"{path}: its JSON cannot be read: {problem}") from problem
    if not isinstance(document, dict):
        raise LabError(f"{path}: its JSON is a {type(document).__name__}, a glTF document was expected")
    asset = document.get("asset")
    version = asset.get("version") if isinstance(asset, dict) else None
    if not isinstance(version, str) or not version.startswith("2"):
        raise LabError(f"{path}: asset.version is {version!r}: a glTF 2 document was expected")
    return document


def _buffer(file: GltfFile, number: int, buffer: dict[str, Any], binary: bytes | None) -> bytes:
    where = f"{file.path}: buffers[{number}]"
    uri = buffer.get("uri")
    if uri is None:
        if number != 0 or binary is None:
            raise LabError(f"{where} holds no data: it has no uri, and the file no binary chunk for it")
        data = binary
    else:
        found = resolve_uri(file.path, uri, where)
        if found is None:
            raise LabError(
                f"{where}: there is no file {uri!r} beside {file.path.name}: put it there, or export as .glb"
            )
        data = found
    length = whole(where, buffer, "byteLength")
    if len(data) < length:
        raise LabError(f"{where} should have {length} bytes but has {len(data)}: the file is cut off")
    return data


def resolve_uri(path: Path, uri: object, where: str) -> bytes | None:
    """The bytes behind a data URI or a file beside `path`; None where there is no such file."""
    if not isinstance(uri, str):
        raise LabError(f"{where}: uri is {uri!r}, it must be a text")
    if uri.startswith("data:"):
        head, comma, body = uri.partition(",")
        if not comma:
            raise LabError(f"{where}: its data URI holds no data")
        try:
            return base64.b64decode(body) if head.endswith(";base64") else urllib.parse.unquote_to_bytes(body)
        except (binascii.Error, ValueError) as problem:
            raise LabError(f"{where}: its data URI is not valid base64: {problem}") from problem
    if "://" in uri:
        raise LabError(f"{where}: {uri[:80]!r} is on the net: only files beside the scene are read")
    try:
        target = path.parent / urllib.parse.unquote(uri)
        return target.read_bytes() if target.is_file() else None
    except (OSError, ValueError):
        return None
