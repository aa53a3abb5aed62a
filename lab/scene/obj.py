"""OBJ files with their MTL materials, read by trimesh.

trimesh takes a relative (negative) index from the end of the file, lets index 0 through, misreads numbers as 1e-5 and
drops all texture coordinates of a group where one face has none. So the text is checked first and put in a plain form.
"""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.scene.parts import Parts, add_mesh
from lab.scene.quiet import quiet
from lab.scene.scene import Material, Vec3
from lab.scene.textures import decode_image, is_image, srgb_to_linear
from lab.scene.values import shown, vector

GREY_LIMIT = 0.41
"""Some exporters write a grey Kd of 0.4 beside map_Kd and mean nothing by it; under this the texture stands alone."""


def read_obj(path: Path) -> Parts:
    """The triangles of the OBJ file at `path`; polygons become fans. Kd, Ke, d, map_Kd and map_d are read.

    Errors: :class:`LabError` with the line for a broken vertex or face.
    """
    text = path.read_bytes().decode("utf-8", errors="replace")
    if "\0" in text:
        raise LabError(f"{path} is not an OBJ file: it holds binary data")
    text = _plain(path, text)
    files = _Files(path)
    from trimesh.exchange.obj import load_obj

    with quiet():
        try:
            loaded = load_obj(io.BytesIO(text.encode()), resolver=cast(Any, files))
        except Exception as problem:  # whatever the library stumbles on, the file is at fault
            raise LabError(f"{path} cannot be read as OBJ: {problem}") from problem
    parts = Parts()
    rows: dict[str, int] = {}
    for mesh in loaded["geometry"].values():
        _add(parts, path, files, mesh, rows)
    for name in files.broken:
        parts.note(f"{path.name}: the picture {name!r} is broken and was left out")
    for name in files.missing:
        parts.note(f"{path.name}: there is no file {name!r} beside it; what it says is left out")
    return parts


class _Files:
    """The files beside an OBJ, as trimesh asks for them; remembers what was missing or no picture."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.file_name = path.name
        self.missing: list[str] = []
        self.broken: list[str] = []

    def get(self, name: str) -> bytes:
        clean = name.strip().strip('"').replace("\\", "/")
        try:
            target = self.path.parent / clean
            if target.is_file():
                data = target.read_bytes()
                if target.suffix.lower() != ".mtl" and not is_image(data) and name not in self.broken:
                    self.broken.append(name)
                return data
        except (OSError, ValueError):
            pass
        if name not in self.missing:
            self.missing.append(name)
        raise FileNotFoundError(name)

    __getitem__ = get


def _plain(path: Path, text: str) -> str:
    """`text` checked and in the plainest form: all v, vt, vn, then triangles of absolute indices, all of one form."""
    rows: dict[str, list[list[float]]] = {"v": [], "vt": [], "vn": []}
    corners: list[tuple[int, int, int]] = []  # vertex, texture coordinate, normal; 0: none
    order: list[str | range] = []  # usemtl and mtllib lines, and the corners of each polygon
    lines: list[int] = []  # where each polygon stands
    for number, raw in enumerate(text.replace("\\\r\n", " ").replace("\\\n", " ").splitlines(), start=1):
        words = raw.split("#", 1)[0].split()
        if not words:
            continue
        if words[0] == "f":
            if len(words) < 4:
                raise LabError(f"{path}, line {number}: a face needs 3 corners or more, got {raw.strip()[:60]!r}")
            first = len(corners)
            corners += [_corner(path, number, word, rows) for word in words[1:]]
            order.append(range(first, len(corners)))
            lines.append(number)
        elif words[0] in rows:
            rows[words[0]].append(_numbers(path, number, words))
        elif words[0] in ("usemtl", "mtllib"):
            order.append(" ".join(words))
    if not rows["v"]:
        raise LabError(f"{path} holds no vertices (lines as 'v 1 2 3'): it is empty or not an OBJ file")
    if not corners:
        raise LabError(
            f"{path} holds no faces (lines as 'f 1 2 3'): there is nothing to light; points and lines are not drawn"
        )
    _check_corners(path, corners, [entry for entry in order if isinstance(entry, range)], lines, rows)
    has_uv, has_normal = any(c[1] for c in corners), any(c[2] for c in corners)
    rows["vt"].append([0.0, 0.0])  # for corners that have none where others have
    rows["vn"].append([0.0, 0.0, 0.0])  # likewise; add_mesh puts the geometric normal in its place
    width = 6 if all(len(row) >= 6 for row in rows["v"]) else 3
    out = [" ".join(["v", *map(repr, row[:width])]) for row in rows["v"]]
    out += [" ".join(["vt", *map(repr, [*row, 0.0][:2])]) for row in rows["vt"] if has_uv]
    out += [" ".join(["vn", *map(repr, row[:3])]) for row in rows["vn"] if has_normal]
    spare_uv, spare_normal = len(rows["vt"]), len(rows["vn"])
    shown = [
        f"{v}"
        + (f"/{t or spare_uv}" if has_uv else "/" if has_normal else "")
        + (f"/{n or spare_normal}" if has_normal else "")
        for v, t, n in corners
    ]
    for entry in order:
        if isinstance(entry, str):
            out.append(entry)
        else:
            out += [f"f {shown[entry[0]]} {shown[k]} {shown[k + 1]}" for k in entry[1:-1]]
    return "\n".join(out)


def _numbers(path: Path, line: int, words: list[str]) -> list[float]:
    try:
        values = [float(word) for word in words[1:]]
    except ValueError:
        values = []
    if len(values) < {"v": 3, "vt": 1, "vn": 3}[words[0]]:
        raise LabError(f"{path}, line {line}: {words[0]!r} needs numbers, got {' '.join(words)[:60]!r}")
    if words[0] == "v" and not np.isfinite(values[:3]).all():
        raise LabError(f"{path}, line {line}: vertex at {values[:3]}: every coordinate must be a finite number")
    return values


def _corner(path: Path, line: int, word: str, rows: dict[str, list[list[float]]]) -> tuple[int, int, int]:
    found = [0, 0, 0]
    for k, (kind, index) in enumerate(zip(rows, word.split("/"), strict=False)):
        if not index and k > 0:
            continue
        try:
            found[k] = int(index)
        except ValueError:
            message = f"{path}, line {line}: {word[:40]!r} is no corner of a face: it must be as 1, 1/2 or 1/2/3"
            raise LabError(message) from None
        if found[k] < 0:  # relative to what has been read so far
            found[k] += len(rows[kind]) + 1
        if found[k] < 1:
            raise LabError(
                f"{path}, line {line}: the face refers to {kind} {index}, which does not exist (they count from 1)"
            )
    return found[0], found[1], found[2]


def _check_corners(
    path: Path,
    corners: list[tuple[int, int, int]],
    polygons: list[range],
    lines: list[int],
    rows: dict[str, list[list[float]]],
) -> None:
    most = [max(corner[k] for corner in corners) for k in range(3)]
    for k, (kind, found) in enumerate(rows.items()):
        if most[k] > len(found):
            at = next(n for n, polygon in enumerate(polygons) if any(corners[c][k] == most[k] for c in polygon))
            raise LabError(f"{path}, line {lines[at]}: the face refers to {kind} {most[k]}, but there are {len(found)}")


def _add(parts: Parts, path: Path, files: _Files, mesh: dict[str, Any], rows: dict[str, int]) -> None:
    """Adds one of trimesh's meshes (one material) to `parts`; `rows` are the materials added so far."""
    visual = mesh.get("visual")
    source: Any = getattr(visual, "material", None)
    given = getattr(source, "kwargs", {}) if getattr(source, "name", None) else {}
    name = str(source.name) if given else "default"
    if name not in rows:
        rows[name] = len(parts.materials)
        where = f"{path}: material {name!r}"
        parts.materials.append(_material(parts, where, files, source, given) if given else Material())
    uv = None if visual is None else visual.uv
    if uv is not None:
        uv = np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1)  # OBJ counts v upward
    colour = mesh.get("vertex_colors")
    if colour is not None:
        colour = srgb_to_linear(colour)
    normal = mesh.get("vertex_normals")
    add_mesh(
        parts, str(path), mesh["vertices"], mesh["faces"], material=rows[name], normal=normal, uv=uv, colour=colour
    )


def _material(parts: Parts, where: str, files: _Files, source: Any, given: dict[str, Any]) -> Material:
    """The MTL material `source` as trimesh has it; `given`: its lines by lower-case key, as numbers (kd) or words."""
    name = str(source.name)
    kd = _colour(where, given, "kd", 1.0)
    emission = _colour(where, given, "ke", math.inf) or (0.0, 0.0, 0.0)
    alpha = 1.0
    for key in ("d", "tr"):
        if given.get(key):
            value = _floats(given[key])
            if len(value) != 1 or not 0 <= value[0] <= 1:
                raise LabError(f"{where}: {key} is {shown(given[key])}: it must be a number from 0 to 1")
            alpha = value[0] if key == "d" else 1.0 - value[0]
    picture = _picture(parts, where, source.image)
    if given.get("map_d"):
        picture = _with_mask(files, picture, " ".join(given["map_d"]))
    if picture is None:
        return Material(name, kd or Material().base_colour, -1, alpha, 0.5 if alpha < 1 else 0.0, emission)
    colour = kd or (1.0, 1.0, 1.0)
    if max(colour) - min(colour) < 1e-3 and max(colour) < GREY_LIMIT:
        colour = (1.0, 1.0, 1.0)
        parts.note(f"{where}: its grey Kd {kd} is left out beside its texture, which it would only darken")
    parts.textures.append(picture)
    holes = alpha < 1 or int(picture[..., 3].min()) < 255
    return Material(name, colour, len(parts.textures) - 1, alpha, 0.5 if holes else 0.0, emission)


def _floats(value: Any) -> list[float]:
    try:
        return [float(v) for v in (value if isinstance(value, list) else [value])]
    except ValueError:
        return []


def _colour(where: str, given: dict[str, Any], key: str, high: float) -> Vec3 | None:
    if given.get(key) is None:
        return None
    value = _floats(given[key])
    return vector(f"{where}: {key.capitalize()}", value * 3 if len(value) == 1 else value, 0, high)


def _picture(parts: Parts, where: str, image: Any) -> NDArray[np.uint8] | None:
    if image is None:
        return None
    with quiet():
        try:
            return np.ascontiguousarray(np.asarray(image.convert("RGBA"), dtype=np.uint8))
        except Exception:  # Pillow's decoders raise whatever they meet
            parts.note(f"{where}: its texture is broken; the plain colour is used")
            return None


def _with_mask(files: _Files, picture: NDArray[np.uint8] | None, name: str) -> NDArray[np.uint8] | None:
    """`picture` with the grey of the mask in file `name` as its alpha."""
    try:
        mask = decode_image(files.get(name))
    except FileNotFoundError:
        return picture
    if mask is None:
        return picture
    from PIL import Image

    grey = mask[..., 3] if int(mask[..., 3].min()) < 255 else mask[..., :3].max(axis=2)
    if picture is None:
        picture = np.full((*grey.shape, 4), 255, dtype=np.uint8)
    height, width = picture.shape[:2]
    alpha = np.asarray(Image.fromarray(grey).resize((width, height), Image.Resampling.BILINEAR))
    return np.ascontiguousarray(np.concatenate([picture[..., :3], alpha[..., None]], axis=2))
