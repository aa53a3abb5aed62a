"""Assertions on one picture and its reference: how close it is, and whether light is lost or invented."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from lab.errors import LabError
from lab.testing.evidence import leave_evidence
from lab.testing.pictures import Array, Pair, Region, as_pair, worst_block


def assert_images_close(
    image: ArrayLike,
    reference: ArrayLike,
    *,
    rel_mse: float | None = None,
    flip: float | None = None,
    region: Region | None = None,
    evidence: str | Path | None = None,
) -> None:
    """Fails if a picture is further from its reference than allowed.

    Args:
        image: (H, W, 3) or (H, W) linear radiance.
        reference: of the same shape.
        rel_mse: greatest :func:`lab.metrics.rel_mse`.
        flip: greatest mean :func:`lab.metrics.flip`, RGB only.
        region: (x, y, width, height) in pixels: only this part counts.
        evidence: folder for the pictures of a failure; default: the running test's, none outside pytest.

    Raises:
        AssertionError: what was measured, what is allowed, where it differs most, and where the pictures are.
        LabError: for shapes that differ, a region outside, and where no threshold is given.

    """
    __tracebackhide__ = True
    from lab import metrics

    if rel_mse is None and flip is None:
        raise LabError("assert_images_close: give a threshold, rel_mse= or flip=")
    pair = as_pair(image, reference, region)
    measured = {}
    if rel_mse is not None:
        measured["relMSE"] = (metrics.rel_mse(pair.image, pair.reference), _threshold("rel_mse", rel_mse))
    if flip is not None:
        measured["FLIP"] = (metrics.flip(pair.image, pair.reference)[0], _threshold("flip", flip))
    # Not ">": a measure that is no number is no pass.
    failing = [name for name, (value, most) in measured.items() if not value <= most]
    if failing:
        rows = {
            name: f"{value:.4g}, at most {most:g} allowed" + (" <- too much" if name in failing else "")
            for name, (value, most) in measured.items()
        }
        # Against a black reference errors are beyond all measure; their sums must still be numbers.
        error = np.clip(metrics.relative_error(pair.image, pair.reference), -1e100, 1e100)
        where, there = worst_block(pair, error**2)
        _fail(
            f"image and reference are not close: {' and '.join(failing)}",
            rows | {"energy": _energies(pair), "worst at": f"{where}, relMSE {there:.4g}"},
            pair,
            {name: value for name, (value, _) in measured.items()},
            evidence,
        )


def assert_energy(
    image: ArrayLike,
    reference: ArrayLike,
    *,
    within: float = 0.02,
    region: Region | None = None,
    evidence: str | Path | None = None,
) -> None:
    """Fails unless a picture holds as much light as its reference, within a share of it.

    Args:
        image: (H, W, 3) or (H, W) linear radiance.
        reference: of the same shape.
        within: greatest distance of :func:`lab.metrics.energy_ratio` from 1.
        region: (x, y, width, height) in pixels: only this part counts.
        evidence: folder for the pictures of a failure; default: the running test's, none outside pytest.

    Raises:
        AssertionError: the ratio, that of each channel, where it differs most, and where the pictures are.
        LabError: for shapes that differ and for a region outside.

    """
    __tracebackhide__ = True
    pair = as_pair(image, reference, region)
    ratio = _energy(pair.image, pair.reference)
    if not abs(ratio - 1) <= _threshold("within", within):
        lost = "loses" if ratio < 1 else "gains"
        _fail(
            f"image {lost} light: {ratio:.4g} of the reference's energy, 1 +- {within:g} allowed",
            {"energy": _energies(pair), "worst at": worst_block(pair, pair.image - pair.reference)[0]},
            pair,
            {"energy_ratio": ratio},
            evidence,
        )


def _threshold(name: str, value: float) -> float:
    if not (isinstance(value, (int, float)) and np.isfinite(value) and value >= 0):
        raise LabError(f"{name}={value!r}: a threshold is a number of 0 or more")
    return value


def _energy(image: Array, reference: Array) -> float:
    """The ratio of energies, infinite where only the reference is black."""
    from lab.metrics import energy_ratio

    with np.errstate(over="ignore"):
        return energy_ratio(image, reference)


def _energies(pair: Pair) -> str:
    ratios = [f"{_energy(pair.image, pair.reference):.4g} of the reference's"]
    if pair.image.ndim == 3:
        ratios += [f"{name} {_energy(pair.image[..., i], pair.reference[..., i]):.4g}" for i, name in enumerate("RGB")]
    return ", ".join(ratios)


def _fail(what: str, rows: dict[str, str], pair: Pair, numbers: dict[str, float], evidence: str | Path | None) -> None:
    __tracebackhide__ = True
    rows |= {"evidence": leave_evidence(pair, {"failure": what, **numbers}, evidence)}
    raise AssertionError("\n".join([what, *(f"  {name:<9} {text}" for name, text in rows.items())]))
