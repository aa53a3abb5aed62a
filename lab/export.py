"""Lights and levels of a hierarchy in files of other programs: ParaView (.vtm), numpy (.npz), point clouds (.ply).

Mitsuba's .xml holds the scene itself: see ``lab/mitsuba_scene``; here it is only known as a format.

Level 0 is the input lights, in merged order; every level has the same fields, so all formats read alike:
position, flux, normal = E[n], normal_moment = E[n n^T] as xx yy zz xy xz yz, deviation, and the level's cell_size.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.colour import luminance, srgb_encode, tone_map
from lab.errors import LabError, nearest
from lab.outputs import write_all
from lab.records import GridLevel, Hierarchy

FIELDS = ("flux", "normal", "normal_moment", "deviation")
SCENE_FORMAT = ".xml"
FORMATS = (".vtm", ".npz", ".ply", SCENE_FORMAT)


def export_hierarchy(path: str | Path, hierarchy: Hierarchy, metadata: Mapping[str, str]) -> list[Path]:
    """Writes every level to `path` in the format of its ending, with `metadata`; returns the files written.

    Errors: :class:`LabError` for another ending, or where `.vtm` lacks pyvista. Nothing is half-written.
    """
    path = Path(path)
    if export_format(path) == SCENE_FORMAT:
        raise LabError(f"{path}: an .xml holds a scene, not a hierarchy; use lab.mitsuba_scene.export_mitsuba")
    writers: dict[str, Callable[[Path, Hierarchy, Mapping[str, str]], list[Path]]] = {
        ".vtm": _write_vtm,
        ".npz": _write_npz,
        ".ply": _write_ply,
    }
    return writers[export_format(path)](path, hierarchy, metadata)


def export_format(path: Path) -> str:
    """The ending of `path`, checked: a known format whose library is installed."""
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise LabError(f"-o {path}: the ending must be one of {', '.join(FORMATS)}{nearest(ending, FORMATS)}")
    if ending == ".vtm":
        from importlib.util import find_spec

        if find_spec("pyvista") is None:
            raise LabError(
                f"-o {path}: .vtm needs pyvista, which is not installed; "
                "install it with: make setup EXTRA=gui (or write .npz or .ply)"
            )
    return ending


def _write_npz(path: Path, hierarchy: Hierarchy, metadata: Mapping[str, str]) -> list[Path]:
    arrays: dict[str, NDArray[Any]] = {"input_index": hierarchy.input_index, "origin": hierarchy.origin}
    for level in hierarchy.levels:
        for name in ("position", *FIELDS):
            arrays[f"L{level.level}_{name}"] = getattr(level, name)
        arrays[f"L{level.level}_cell_size"] = np.array(level.cell_size)
    arrays["metadata"] = np.array(json.dumps(dict(metadata)))

    def write(target: Path) -> None:
        with target.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)

    write_all({path: write})
    return [path]


def display_colours(flux: NDArray[np.floating]) -> NDArray[np.uint8]:
    """(m, 3) flux to sRGB bytes to look at: the level's 90th percentile of luminance is exposed to white's knee."""
    bright = float(np.percentile(luminance(flux), 90)) if len(flux) else 0.0
    exposure = 0.5 / bright if bright > 0 else 1.0
    return np.rint(srgb_encode(tone_map(flux, exposure)) * 255).astype(np.uint8)


def _write_ply(path: Path, hierarchy: Hierarchy, metadata: Mapping[str, str]) -> list[Path]:
    """One cloud: position, display colours, unit normals, and level, cell_size, flux, normal_length, deviation.

    Full flux is in flux_r, flux_g, flux_b; nx ny nz times normal_length is E[n]. PLY readers differ in what custom
    fields they keep; .npz has everything. open3d writes no comments, so `metadata` stays with the other formats.
    """
    import open3d as o3d

    levels = hierarchy.levels
    position = np.concatenate([level.position for level in levels])
    flux = np.concatenate([level.flux for level in levels])
    normal = np.concatenate([level.normal for level in levels])
    deviation = np.concatenate([level.deviation for level in levels])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    columns: dict[str, NDArray[Any]] = {
        "normals": (normal / np.where(length > 0, length, 1)).astype(np.float32),
        "colors": np.concatenate([display_colours(level.flux) for level in levels]),
        "level": np.concatenate([np.full((len(level), 1), level.level, np.int32) for level in levels]),
        "cell_size": np.concatenate([np.full((len(level), 1), level.cell_size, np.float32) for level in levels]),
        "normal_length": length.astype(np.float32),
    }
    for i, channel in enumerate("rgb"):
        columns[f"flux_{channel}"] = flux[:, i : i + 1]
    for i, axis in enumerate("xyz"):
        columns[f"deviation_{axis}"] = deviation[:, i : i + 1]
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor.from_numpy(np.ascontiguousarray(position)))
    for name, values in columns.items():
        cloud.point[name] = o3d.core.Tensor.from_numpy(np.ascontiguousarray(values))

    def write(target: Path) -> None:
        # open3d picks the format by the ending, which the file beside does not have.
        named = target.with_name(f"{target.name}.ply")
        try:
            if not o3d.t.io.write_point_cloud(named, cloud):
                raise OSError(f"{path}: open3d could not write the point cloud")
            named.replace(target)
        finally:
            named.unlink(missing_ok=True)

    write_all({path: write})
    return [path]


def _write_vtm(path: Path, hierarchy: Hierarchy, metadata: Mapping[str, str]) -> list[Path]:
    """One block a level, ``L0`` the lights; point data as in :data:`FIELDS` and blend radius, metadata as field data.

    The blocks lie in a folder beside the file, named like it, as VTK has it.
    """
    import tempfile

    import pyvista

    blocks = pyvista.MultiBlock()
    for level in hierarchy.levels:
        blocks[f"L{level.level}"] = _vtk_points(pyvista, level, metadata)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f"{path.name}.", suffix=".tmp") as scratch:
        blocks.save(str(Path(scratch) / path.name))
        made = sorted(p for p in Path(scratch).rglob("*") if p.is_file() and p.suffix != ".vtm")
        parts = [path.parent / part.relative_to(scratch) for part in made]
        # The index comes last: it never names a block that is not there yet.
        files = [*made, Path(scratch) / path.name]
        write_all({target: _mover(source) for source, target in zip(files, [*parts, path], strict=True)})
    return [path, *parts]


def _mover(source: Path) -> Callable[[Path], None]:
    def move(target: Path) -> None:
        source.replace(target)

    return move


def _vtk_points(pyvista: Any, level: GridLevel, metadata: Mapping[str, str]) -> Any:
    cloud = pyvista.PolyData(np.array(level.position))
    for name in FIELDS:
        cloud.point_data[name] = np.array(getattr(level, name))
    cloud.point_data["luminance"] = np.array(luminance(level.flux), dtype=np.float32)
    cloud.field_data["level"] = [level.level]
    cloud.field_data["cell_size"] = [level.cell_size]
    for key, value in metadata.items():
        # VTK shows ASCII only.
        cloud.field_data[key] = [value.encode("ascii", "backslashreplace").decode()]
    return cloud
