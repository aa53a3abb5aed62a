"""The frames that are rendered under the validation layers: each way of lighting, sampling and filtering, and scenes
of each kind."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from lab.engine.vulkan.device import Gpu
from lab.engine.vulkan.engine import VulkanEngine
from lab.frame import render_frame
from lab.params import SETTINGS, Params
from lab.scene.load import load_scene
from lab.scene.scene import Scene

from ..unit.vulkan_scenes import ROOT, gallery

SIZE = 52, 31  # no multiple of any workgroup
BASE = {"vpls": 700, "picker": "race"}


@dataclass(frozen=True)
class Case:
    """A scene and what is set; rendered twice: what is read back once is known the second time."""

    scene: str
    settings: dict[str, Any] = field(default_factory=dict)
    size: tuple[int, int] = SIZE


def _shared(name: str) -> Path | None:
    folder = os.environ.get("LAB_SCENES", "")
    return Path(folder) / f"{name}.glb" if folder else None


def _scenes() -> dict[str, Callable[[], Scene]]:
    scenes: dict[str, Callable[[], Scene]] = {"gallery": gallery}  # area lights, textures, holes, lights of every kind
    for name in ("atrium", "lamps", "cornell"):
        scenes[name] = lambda name=name: load_scene(ROOT / "scenes" / name / "scene.toml")  # type: ignore[misc]
    hall = _shared("modern_hall")
    if hall:
        scenes["modern_hall"] = lambda: load_scene(hall)
    return scenes


SCENES = _scenes()


def _ways_to_light() -> list[dict[str, Any]]:
    """Every lighting mode with all that belongs to it alone."""
    tiled = [{"lighting": "tiled", "picker": picker} for picker in SETTINGS["picker"].choices]
    locks = SETTINGS["reservoir_locks"].choices
    return tiled + [{"lighting": "raster", "picker": "reservoir", "reservoir_locks": lock} for lock in locks]


def _cases() -> dict[str, Case]:
    cases = [Case(scene) for scene in SCENES]
    for way in _ways_to_light():
        cases += [Case("gallery", {**way, "interleave": n}) for n in (1, 4)]
    for name in ("construction", "shadow_estimator", "filter"):
        cases += [Case("gallery", {name: choice}) for choice in SETTINGS[name].choices]
    cases += [
        Case("gallery", {"shadow_points": "jitter"}),
        Case("gallery", {"compensation": "path"}),
        Case("gallery", {"shadow_samples": 0, "direct_samples": 0}),
        Case("gallery", {"shadow_samples": 64}),
        Case("lamps", {"shadow_points": "jitter", "interleave": 4}),
        Case("gallery", {"vpls": 1}),
        Case("gallery", {"levels": 10}),
        Case("gallery", {"interleave": 8}, (1, 1)),
        Case("gallery", {"lighting": "raster", "interleave": 8}, (1, 1)),
        Case("lamps", {"lighting": "raster", "first_shadow_level": 2, "shadow_samples": 9}),
        Case("gallery", {"lighting": "raster", "shadow_samples": 0}),
    ]
    return {_title(case): case for case in cases}


def _title(case: Case) -> str:
    size = "" if case.size == SIZE else " {}x{}".format(*case.size)
    return " ".join([case.scene, *(f"{name}={value}" for name, value in case.settings.items())]) + size


CASES = _cases()


@cache
def _engine(gpu: Gpu, scene: str) -> VulkanEngine:
    return VulkanEngine(SCENES[scene](), gpu)


def render(gpu: Gpu, case: Case) -> None:
    """The frame twice, its picture read back."""
    engine = _engine(gpu, case.scene)
    params = Params(**BASE | case.settings)
    for frame in range(2):
        made = render_frame(engine, engine.scene.cameras[0], case.size, params.replace(frame=frame))
        assert made.image.colour.shape == (case.size[1], case.size[0], 3)
