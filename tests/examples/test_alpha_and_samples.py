"""How does the error fall with alpha, and with k, the shadow rays a pixel, on my scene?

An experiment to copy: put this file anywhere, and run it on a scene of yours with

    pytest test_alpha_and_samples.py --lab-scene=model.glb --lab-size=160x90

It judges the unfiltered frame against every virtual light with every shadow ray, over the same lights: what is seen is
the error of the method, not that of its lights. The table is written to ``out/alpha_and_samples.csv`` and ``.md`` where
pytest is run. A check that fails says by how much, and leaves pictures in ``.lab-evidence``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from lab import Params
from lab.metrics import energy_ratio, rel_mse
from lab.testing import Referee, Renderer, assert_energy

ALPHAS = (0.5, 1.0, 2.0, 4.0)
SAMPLES = (1, 4, 16, 64)
FRAMES = 4  # the same lights, other shadow rays: what is averaged over
SETTINGS = Params(vpls=2000, filter="none")

# A small alpha cuts near lights short, which loses or gains energy; that must stay within these shares.
WITHIN = {0.5: 0.3, 1.0: 0.15, 2.0: 0.1, 4.0: 0.1}

# The scene is looked for beside this file, then where pytest's rootdir is; --lab-scene takes its place.
pytestmark = pytest.mark.lab_scene("scenes/cornell/scene.toml", size=(64, 36))


@dataclass(frozen=True)
class Measured:
    """One cell of the table: mean relMSE of a frame, energy of the mean frame, and that frame with its reference."""

    rel_mse: float
    energy: float
    indirect: np.ndarray
    reference: np.ndarray


Measure = Callable[[float, int], Measured]
Cells = dict[tuple[float, int], Measured]


@pytest.fixture(scope="module")
def cells(request: pytest.FixtureRequest) -> Iterator[Cells]:
    """What was measured; at the end it becomes the table."""
    measured: Cells = {}
    yield measured
    if measured:
        write_table(measured, request.config.invocation_params.dir / "out")


@pytest.fixture
def measure(cells: Cells, lab_render: Renderer, lab_reference: Referee) -> Measure:
    """Measures a cell, once."""

    def measured(alpha: float, samples: int) -> Measured:
        if (alpha, samples) not in cells:
            # As many draws as there are lights: every light is summed.
            truth = lab_reference("brute_force", SETTINGS, spp=SETTINGS.vpls).indirect
            frames = [lab_render(SETTINGS, alpha=alpha, shadow_samples=samples, frame=i) for i in range(FRAMES)]
            images = [frame.image.indirect for frame in frames]
            mean = np.mean(images, axis=0)
            error = float(np.mean([rel_mse(image, truth) for image in images]))
            cells[alpha, samples] = Measured(error, energy_ratio(mean, truth), mean, truth)
        return cells[alpha, samples]

    return measured


@pytest.mark.parametrize("samples", SAMPLES)
@pytest.mark.parametrize("alpha", ALPHAS)
def test_energy_is_kept(measure: Measure, alpha: float, samples: int) -> None:
    """Neither alpha nor k loses or invents light beyond a bound."""
    cell = measure(alpha, samples)
    assert_energy(cell.indirect, cell.reference, within=WITHIN[alpha])


@pytest.mark.parametrize("alpha", ALPHAS)
def test_error_falls_with_samples(measure: Measure, alpha: float) -> None:
    """More shadow rays, less noise, at every alpha."""
    errors = [measure(alpha, samples).rel_mse for samples in SAMPLES]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.5 * errors[0]


def test_error_falls_with_alpha(measure: Measure) -> None:
    """A larger alpha, less bias: seen where shadow rays leave little noise."""
    errors = [measure(alpha, max(SAMPLES)).rel_mse for alpha in ALPHAS]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.5 * errors[0]


def write_table(cells: Cells, folder: Path) -> None:
    """One row a cell as CSV; relMSE with the energy in brackets, alpha by k, as Markdown."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = [f"{alpha:g},{k},{cell.rel_mse:.6g},{cell.energy:.6g}" for (alpha, k), cell in sorted(cells.items())]
    (folder / "alpha_and_samples.csv").write_text("\n".join(["alpha,samples,rel_mse,energy", *rows]) + "\n")
    lines = ["| alpha | " + " | ".join(f"k = {k}" for k in SAMPLES) + " |", "|---" * (len(SAMPLES) + 1) + "|"]
    for alpha in ALPHAS:
        found = [cells.get((alpha, k)) for k in SAMPLES]
        texts = [f"{cell.rel_mse:.3g} ({cell.energy:.2f})" if cell else "" for cell in found]
        lines.append(f"| {alpha:g} | " + " | ".join(texts) + " |")
    (folder / "alpha_and_samples.md").write_text("\n".join(lines) + "\n")
