"""Our path tracer and Mitsuba's see the same scenes alike, layer by layer; and would be told apart if they did not.

z-tests are of blocks of pixels: the mean of tens of thousands of paths is nearly Gaussian, that of one pixel's few
hundred is not.
"""

from __future__ import annotations

import numpy as np
import pytest

from lab.experiments.mitsuba_judge import Layer, Verdict, judge

from .views import BLOCKS, ours, params_of, pictures, theirs

CASES = [
    ("cornell", "direct"),
    ("cornell", "indirect"),
    ("cornell_lamp", "indirect"),
    ("atrium", "direct"),
    ("atrium", "indirect"),
    ("lamps", "direct"),
]


def verdict(name: str, layer: str, scale: float = 1.0) -> Verdict:
    found = pictures(name)
    mean = getattr(found, f"our_{layer}")
    return judge(layer, Layer(scale * mean.mean, scale**2 * mean.variance), getattr(found.theirs, layer), BLOCKS[name])


@pytest.mark.parametrize(("name", "layer"), CASES)
def test_energy_is_the_same(name: str, layer: str) -> None:
    found = verdict(name, layer)
    assert found.energy_error < 0.007, "noise must leave a difference of 3 % nowhere to hide"
    assert abs(found.energy - 1) < 0.01 + 2 * found.energy_error, found


@pytest.mark.parametrize(("name", "layer"), [*CASES, ("cornell_lamp", "direct")])
def test_no_block_differs_by_more_than_noise(name: str, layer: str) -> None:
    found = verdict(name, layer)
    assert found.blocks.accepted, found
    # Were the noise told too great, nothing could ever fail.
    assert 0.6 < found.spread < 1.4, found


@pytest.mark.parametrize(("name", "layer"), CASES)
def test_three_percent_more_light_is_refused(name: str, layer: str) -> None:
    found = verdict(name, layer, 1.03)
    assert not found.agrees(), found
    assert abs(found.energy - 1) > 0.01 + 2 * found.energy_error, found


@pytest.mark.parametrize("name", ["cornell", "atrium"])
def test_one_bounce_less_is_refused(name: str) -> None:
    _, indirect = ours(name, params_of(name).replace(max_bounces=2))
    found = judge("indirect", indirect, theirs(name).indirect)
    assert not found.blocks.accepted, found
    assert found.energy < 0.97, found


@pytest.mark.parametrize("name", ["cornell", "atrium"])
def test_a_picture_turned_left_to_right_is_refused(name: str) -> None:
    indirect = pictures(name).our_indirect
    mirrored = Layer(np.flip(indirect.mean, 1), np.flip(indirect.variance, 1))
    assert not judge("indirect", mirrored, theirs(name).indirect).blocks.accepted
