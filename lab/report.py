"""The record of a run: what was rendered, with what, on what, how long it took and what came out, as strict JSON."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab import __version__
from lab.colour import auto_exposure
from lab.engine.engine import STAGES
from lab.errors import LabError
from lab.params import Params
from lab.records import Frame, Hierarchy, Lighting
from lab.scene.scene import Camera, Scene

Record = dict[str, Any]


@dataclass(frozen=True)
class RunInfo:
    """What a frame does not know about its run.

    Attributes:
        preset: the preset the parameters started from.    engine: name of the engine.
        load_ms: time to read the scene.    overrides: the camera, sun and exposure given by hand, as text.
        device: the graphics card of engine ``vulkan``.

    """

    preset: str = "ours"
    engine: str = "cpu"
    load_ms: float = 0.0
    overrides: dict[str, str] = field(default_factory=dict)
    device: Record | None = None


def run_record(frame: Frame, scene: Scene, run: RunInfo, base: Path) -> Record:
    """The JSON of a rendered frame whose files are written as `base` + ending."""
    return {
        "params": frame.params.to_dict(),
        "preset": run.preset,
        "engine": run.engine,
        "device": run.device,
        "scene": _scene_record(scene, frame, run.overrides, base),
        "machine": machine() | core(),
        "version": __version__,
        "stages_ms": {stage: round(frame.stages_ms[stage], 3) for stage in STAGES},
        "total_ms": round(frame.total_ms, 3),
        "load_ms": round(run.load_ms, 3),
        "counts": {
            "vpls": len(frame.lights),
            "paths_launched": frame.lights.paths_launched,
            "levels": level_records(frame.hierarchy, frame.lighting, frame.gbuffer.depth > 0),
        },
        "notes": list(scene.notes),
    }


def level_records(hierarchy: Hierarchy, lighting: Lighting, seen: NDArray[np.bool_]) -> list[Record]:
    """One row a level: its lights, their flux summed in float64, and means over the pixels `seen` (H, W)."""
    rows = []
    overdraw, lights_used = lighting.counts()
    for level in hierarchy.levels:
        counts = {"overdraw": overdraw[level.level], "lights_used": lights_used[level.level]}
        rows.append(
            {
                "level": level.level,
                "cell_size": level.cell_size,
                "grid_lights": len(level),
                "flux": level.flux.sum(axis=0, dtype=np.float64).tolist(),
            }
            | {f"{name}_mean": float(values[seen].mean()) if seen.any() else 0.0 for name, values in counts.items()}
        )
    return rows


def add_maxima(record: Record, channels: Mapping[str, NDArray[Any]], seen: NDArray[np.bool_]) -> None:
    """Adds each level's greatest counts, and mean and greatest of the totals, over the pixels `seen` (H, W)."""
    for layer in ("overdraw", "lights_used", "fragments"):
        if f"{layer}.Y" not in channels:
            continue
        total = channels[f"{layer}.Y"][seen]
        record["counts"][layer] = {
            "mean": float(total.mean()) if len(total) else 0.0,
            "max": int(total.max(initial=0)),
        }
        for row in record["counts"]["levels"] if layer != "fragments" else ():
            counts = channels.get(f"{layer}.L{row['level']}")
            row[f"{layer}_max"] = 0 if counts is None else int(counts[seen].max(initial=0))


def _scene_record(scene: Scene, frame: Frame, overrides: dict[str, str], base: Path) -> Record:
    path = Path(scene.path).resolve()
    return {
        "path": str(path),
        # So that a record moved together with its scene still finds it.
        "relative_path": os.path.relpath(path, base.resolve().parent),
        "name": scene.name,
        "triangles": scene.triangles,
        "lights": light_counts(scene),
        "camera": camera_record(frame.camera),
        "size": list(frame.gbuffer.size),
        "exposure": shown_exposure(scene, frame),
        "overrides": overrides,
    }


def shown_exposure(scene: Scene, frame: Frame) -> float:
    """The exposure that a picture of the frame has: the scene's, or the one that suits the frame."""
    if scene.exposure is not None:
        return scene.exposure
    return auto_exposure(frame.image.colour, frame.gbuffer.depth > 0)


def camera_record(camera: Camera) -> Record:
    """The camera's numbers."""
    vectors = {name: [float(v) for v in getattr(camera, name)] for name in ("eye", "target", "up")}
    return {"name": camera.name, **vectors, "fov_y_deg": float(camera.fov_y_deg)}


def light_counts(scene: Scene) -> dict[str, int]:
    """How many lights of each kind the scene has."""
    emitting = [any(value > 0 for value in material.emission) for material in scene.materials]
    return {
        "suns": len(scene.suns),
        "points": len(scene.points),
        "spots": len(scene.spots),
        "emissive_triangles": sum(len(mesh.index) for mesh in scene.meshes if emitting[mesh.material]),
        "light_list": 0 if scene.light_list is None else len(scene.light_list),
    }


def image_metadata(scene: Scene, params: Params, camera: Camera) -> dict[str, str]:
    """What every image carries inside: nothing that differs between two runs of the same settings."""
    return export_metadata(scene, params) | {"camera": json.dumps(camera_record(camera))}


def export_metadata(scene: Scene, params: Params) -> dict[str, str]:
    """What every exported hierarchy carries inside."""
    return {
        # Not "version": OpenEXR keeps that name to itself.
        "lab_version": __version__,
        "scene": scene.name,
        "params": json.dumps(params.to_dict()),
        "seed": str(params.seed),
        "machine": json.dumps(machine()),
    }


@cache
def machine() -> dict[str, str | int]:
    """Processor, cores, operating system and Python."""
    cpu = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text(errors="replace").splitlines()
        cpu = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), cpu)
    return {
        "cpu": cpu,
        "cores": os.cpu_count() or 1,
        "os": platform.platform(),
        "python": platform.python_version(),
    }


def core() -> Record:
    """What the core runs on: its threads, and the instruction set of its hot loops."""
    from lab import _core

    info = _core.info()
    return {"threads": int(info["threads"]), "simd": str(info["simd"])}


def to_json(record: Record) -> str:
    """Strict JSON (no NaN, no Infinity) for people to read."""
    return json.dumps(record, indent=2, allow_nan=False) + "\n"


def read_json(option: str, path: str | Path, wanted: str) -> Any:
    """What a JSON file holds, or a :class:`LabError` that says what is wrong with it and what is `wanted`."""
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise LabError(f"{option} {path}: can't be read ({reason}); {wanted}") from error
    except (json.JSONDecodeError, RecursionError) as error:
        raise LabError(f"{option} {path}: is not valid JSON ({error}); {wanted}") from error


def read_record(path: str | Path) -> Record:
    """The record of an earlier run, or a :class:`LabError` that says what is wrong with the file."""
    record = read_json("--from", path, "give the BASE.json of an earlier run")
    scene = record.get("scene") if isinstance(record, dict) else None
    if not isinstance(scene, dict) or not isinstance(record.get("params"), dict):
        raise LabError(f"--from {path}: holds no 'params' and 'scene'; give the BASE.json of an earlier run")
    return dict(record)
