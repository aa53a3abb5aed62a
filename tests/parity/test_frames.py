"""Whole frames with the default settings, each engine with its own lights: one picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.engine.vulkan.engine import VulkanEngine
from lab.frame import render_frame
from lab.metrics import flip
from lab.params import Params
from lab.scene.load import load_scene

SIZE = (160, 90)


@pytest.mark.parametrize(
    "settings", [{}, {"interleave": 4, "shadow_samples": 1}, {"picker": "race", "alpha": 2.0}], ids=str
)
def test_frames_are_the_cpus(gpu: Any, root: Any, settings: dict[str, Any]) -> None:
    scene = load_scene(root / "scenes/atrium/scene.toml")
    params, camera = Params(vpls=10_000, **settings), scene.cameras[0]
    want = render_frame(CpuEngine(scene), camera, SIZE, params)
    got = render_frame(VulkanEngine(scene, gpu), camera, SIZE, params)
    assert np.mean(got.lighting.light != want.lighting.light) < 2e-3
    assert flip(got.image.colour, want.image.colour)[0] < 5e-3
    # Other picks would be seen.
    noise = render_frame(CpuEngine(scene), camera, SIZE, params.replace(frame=1))
    assert flip(noise.image.colour, want.image.colour)[0] > 0.05
