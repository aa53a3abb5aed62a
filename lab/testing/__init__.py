"""Scripted experiments as tests: a pytest plugin with fixtures for scenes of your own, and assertions that explain.

    import pytest
    from lab.testing import assert_energy

    @pytest.mark.lab_scene("model.glb", size=(160, 90))
    @pytest.mark.parametrize("alpha", [1, 2])
    def test_no_light_is_lost(lab_render, lab_reference, alpha):
        frame = lab_render(alpha=alpha, vpls=2000, shadow_samples=64, filter="none")
        truth = lab_reference("brute_force", frame.params, spp=2000)  # every light, every shadow ray
        assert_energy(frame.image.indirect, truth.indirect, within=0.15)

Where the package is installed, pytest finds the plugin by itself (:mod:`lab.testing.plugin` lists the fixtures and
options). The assertions work without pytest, too. Nothing of weight is loaded before it is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lab.testing.bias import assert_unbiased as assert_unbiased
    from lab.testing.comparisons import assert_energy as assert_energy
    from lab.testing.comparisons import assert_images_close as assert_images_close
    from lab.testing.workbench import Referee as Referee
    from lab.testing.workbench import Renderer as Renderer

_HOME = {
    "Referee": "lab.testing.workbench",
    "Renderer": "lab.testing.workbench",
    "assert_energy": "lab.testing.comparisons",
    "assert_images_close": "lab.testing.comparisons",
    "assert_unbiased": "lab.testing.bias",
}

__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'lab.testing' has no attribute {name!r}")
