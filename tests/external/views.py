"""What both programs render here, small enough for two cores and long enough that noise leaves little to hide in."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from lab.engine.cpu import CpuEngine
from lab.experiments.mitsuba_judge import Layer
from lab.experiments.mitsuba_runner import Layers, Mitsuba
from lab.mitsuba_scene import export_mitsuba
from lab.params import Params
from lab.records import Lights
from lab.reference import Budget, path_traced
from lab.scene.load import load_scene
from lab.scene.scene import Camera, Scene

ROOT = Path(__file__).resolve().parents[2]
SIZE = (64, 36)
SAMPLES = {"cornell": 1024, "cornell_lamp": 256, "atrium": 512, "lamps": 768}
"""Mitsuba's paths a pixel of each view. Ours are half as many: they choose lights by effect, and are less noisy."""

BLOCKS = {"cornell": 8, "cornell_lamp": 8, "atrium": 8, "lamps": 16}
"""Pixels a side of a block, for the z-test. One of 200 lamps picked evenly makes a rough picture: it needs more."""


def params_of(name: str) -> Params:
    """Among 200 lamps Mitsuba's bounced light is too noisy to be judged; it is left short."""
    return Params(max_bounces=1 if name == "lamps" else 3, seed=5)


def scene_of(name: str) -> Scene:
    """The scene of a view; its first camera is the view."""
    if name == "lamps":
        return _free_lamps(_loaded("lamps"))
    scene = _loaded("atrium" if name == "atrium" else "cornell")
    if name == "cornell":  # the lamp out of sight: its bright rim would rule the noise of everything else
        scene = replace(scene, cameras=[Camera("low", (0.0, 2.0, 8.5), (0.0, 1.7, 0.0), fov_y_deg=30.0)])
    return scene


def _loaded(name: str) -> Scene:
    return replace(load_scene(ROOT / "scenes" / name / "scene.toml"), background=(0.0, 0.0, 0.0))


def _free_lamps(scene: Scene) -> Scene:
    """200 of the lamps, of those that hang at least a metre from everything that is seen.

    Mitsuba gives each light as many rays: a lamp right beside a wall makes a spot whose variance no sample shows.
    """
    assert scene.light_list is not None
    gbuffer = CpuEngine(scene).render_gbuffer(scene.camera(), (4 * SIZE[0], 4 * SIZE[1]))
    distance, _ = cKDTree(gbuffer.position[gbuffer.depth > 0]).query(scene.light_list.position)
    free = np.flatnonzero(distance > 1)
    chosen = free[np.linspace(0, len(free) - 1, 200).astype(int)]
    return replace(scene, light_list=Lights(scene.light_list.position[chosen], scene.light_list.flux[chosen]))


@dataclass(frozen=True)
class Pictures:
    """Both layers of a view, by both programs."""

    our_direct: Layer
    our_indirect: Layer
    theirs: Layers


def ours(name: str, params: Params) -> tuple[Layer, Layer]:
    """Direct and indirect light of a view, by our path tracer."""
    scene = scene_of(name)
    found = path_traced(
        CpuEngine(scene), scene.camera(), SIZE, params, budget=Budget(spp=SAMPLES[name] // 2), pixel="area"
    )
    return Layer(found.direct, found.direct_variance), Layer(found.indirect, found.indirect_variance)


@cache
def theirs(name: str) -> Layers:
    """The same by Mitsuba; rendered once for all tests."""
    scene = scene_of(name)
    with tempfile.TemporaryDirectory() as folder:
        xml = export_mitsuba(Path(folder) / "scene.xml", scene, scene.camera(), SIZE, params_of(name)).files[0]
        return Mitsuba(xml).layers(SAMPLES[name])


@cache
def pictures(name: str) -> Pictures:
    """Both."""
    return Pictures(*ours(name, params_of(name)), theirs(name))
