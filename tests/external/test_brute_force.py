"""The sum over virtual lights, and over a user's lights, against Mitsuba."""

from __future__ import annotations

import numpy as np
import pytest

from lab.colour import luminance
from lab.engine.cpu import CpuEngine
from lab.experiments.mitsuba_judge import Layer, judge
from lab.params import Params
from lab.reference import Budget, brute_force

from .views import SIZE, scene_of, theirs


def finer(name: str, params: Params, draws: int, times: int) -> Layer:
    """The `indirect` layer of brute force, and its variance.

    It looks through pixels' centres: `times` x `times` of them, in finer pixels, stand for each of Mitsuba's pixels.
    """
    scene = scene_of(name)
    size = (times * SIZE[0], times * SIZE[1])
    found = brute_force(CpuEngine(scene), scene.camera(), size, params, budget=Budget(spp=draws)).indirect
    cells = found.reshape(SIZE[1], times, SIZE[0], times, 3)
    # As if the centres had been thrown at random; set out evenly they do better.
    return Layer(cells.mean(axis=(1, 3)), cells.var(axis=(1, 3), ddof=1) / times**2)


def test_two_hundred_lamps() -> None:
    """All shadow rays to all lights, no clamp: nothing random but where in the pixel one looks."""
    lamps = finer("lamps", Params(clamp_distance=0), 200, 4)
    direct = theirs("lamps").direct
    found = judge("lamps", lamps, direct)
    assert found.blocks.accepted, found
    assert abs(found.energy - 1) < 0.01 + 2 * found.energy_error, found
    brighter = judge("lamps", Layer(1.05 * lamps.mean, 1.05**2 * lamps.variance), direct)
    assert abs(brighter.energy - 1) > 0.01 + 2 * brighter.energy_error, brighter


@pytest.mark.parametrize("name", ["cornell", "atrium"])
def test_virtual_lights_carry_the_indirect_light(name: str) -> None:
    """VPLs are shared by all pixels: their noise shows over seeds only, and only energies can be compared."""
    energies = []
    for seed in range(8):
        params = Params(vpls=10_000, compensation="path", seed=100 + seed)
        found = finer(name, params, 32, 2)
        energies.append(float(luminance(found.mean.mean(axis=(0, 1)))))
    mean, error = np.mean(energies), np.std(energies, ddof=1) / np.sqrt(8)
    expected = float(luminance(theirs(name).indirect.mean.mean(axis=(0, 1))))
    assert error < 0.015 * expected, energies
    assert abs(mean - expected) < 0.02 * expected + 3 * error, (mean / expected, error / expected)
    assert abs(1.1 * mean - expected) > 0.02 * expected + 3 * error, "a tenth too much must show"
