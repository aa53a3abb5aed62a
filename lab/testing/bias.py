"""The assertion over many seeds: a method's mean is its reference, but for what noise explains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from lab.errors import LabError
from lab.metrics import Moments, moments, sidak, welch_test
from lab.testing.blocks import Blocks
from lab.testing.evidence import leave_evidence
from lab.testing.pictures import Array, Pair, Region, as_picture, check_finite, check_same_shape, cut, versus

Render = Callable[[int], ArrayLike]

_KNOWN = 1e12
"""The number of seeds that stands for a variance that is known: Student's distribution becomes the Gaussian."""

_ROUNDING = 2.0**-20
"""Share of a mean that is the rounding of float32 sums, however well the seeds agree."""

_MOST_SHOWN = 5


@dataclass(frozen=True)
class Unbiased:
    """What :func:`assert_unbiased` returns: how sharp the test was that found nothing.

    Attributes:
        tests: blocks times channels, and the whole picture.
        smallest_p, threshold: the least likely of them, and what it was not below.
        standard_error: of the whole picture's mean, as a share of it. A bias of several of these would have been seen.

    """

    tests: int
    smallest_p: float
    threshold: float
    standard_error: float


def assert_unbiased(
    render_of_seed: Render,
    reference: ArrayLike | Render,
    *,
    seeds: int = 16,
    significance: float = 0.01,
    block: int = 8,
    reference_variance: ArrayLike = 0.0,
    region: Region | None = None,
    evidence: str | Path | None = None,
) -> Unbiased:
    """Fails if a method's mean over many seeds differs from the reference by more than noise explains.

    The picture is dealt to blocks of `block` x `block` pixels. The mean of each block and of the whole picture, in each
    channel, is put to Welch's t-test; Sidak's correction makes one verdict of all. A correct method fails with the
    chance `significance`; as the seeds are fixed, it does so always or never.

    The means of blocks are taken for Gaussian over the seeds. A few bright pixels in a few seeds make them skewed:
    larger blocks help, and more seeds. Noise hides bias: look at the ``standard_error`` of what is returned.

    Args:
        render_of_seed: gives a picture, (H, W, 3) or (H, W); called with 0, 1, ... `seeds` - 1.
        reference: the expected picture; or a second method, called with as many other seeds.
        seeds: at least 3.
        significance: chance that a correct method fails.
        block: side of a block in pixels; the last ones of rows and columns may be smaller.
        reference_variance: of the pixels of a reference that is noisy itself: ``Reference.indirect_variance``.
        region: (x, y, width, height) in pixels: only this part counts.
        evidence: folder for the pictures of a failure; default: the running test's, none outside pytest.

    Raises:
        AssertionError: which blocks differ, by how much, how unlikely that is, and where the pictures are.
        LabError: for shapes that differ, and for arguments out of range.

    """
    __tracebackhide__ = True
    for name, value, least in (("seeds", seeds, 3), ("block", block, 1)):
        if type(value) is not int or value < least:
            raise LabError(f"{name}={value!r}: expected a whole number of {least} or more")
    image, found = _over_seeds("image", render_of_seed, range(seeds), block, region)
    if callable(reference):
        target, expected = _over_seeds("reference", reference, range(2**31, 2**31 + seeds), block, region)
    else:
        target, expected = _known(reference, reference_variance, block, region)
    check_same_shape("image", image, target)
    image, target = cut(image, region), cut(target, region)
    p = welch_test(found.moments(), expected.moments(rounding=_ROUNDING))
    verdict = sidak(p, significance)
    blocks = Blocks(image.shape, block)
    error = np.sqrt(found.error2 + expected.error2)
    sharpness = blocks.whole_share(error, expected.mean)
    if verdict.accepted:
        return Unbiased(verdict.tests, float(p.min()), verdict.threshold, sharpness)

    corner = (0, 0) if region is None else region[:2]
    what = f"image is biased: {verdict.failing} of {verdict.tests} means differ from the reference"
    rows = [
        f"  {'test':<9} {seeds} seeds, p below {verdict.threshold:.2g} each ({significance:g} over all); "
        f"the whole picture has a standard error of {100 * sharpness:.2g} %"
    ]
    if not found.error2.any():
        rows.append(f"  {'note':<9} all seeds gave the same picture: is the seed used?")
    worst = np.argsort(p, kind="stable")[: min(verdict.failing, _MOST_SHOWN)]  # the least likely
    for i in worst:
        gap = abs(found.mean[i] - expected.mean[i])
        deviation = f", {gap / error[i]:.1f} standard errors" if error[i] > 0 else ""
        found_so = versus(found.mean[i], expected.mean[i])
        rows.append(f"  {'differs':<9} {blocks.name(i, corner)}: {found_so}{deviation}, p = {p[i]:.2g}")
    if verdict.failing > len(worst):
        rows.append(f"  {'':<9} and {verdict.failing - len(worst)} more")
    numbers = {"failure": what, "seeds": seeds, "significance": significance, "smallest_p": float(p.min())}
    failing = np.where(p < verdict.threshold, found.mean, expected.mean)
    said = leave_evidence(
        Pair(image, target, corner),
        {**numbers, "threshold": verdict.threshold, "tests": verdict.tests, "failing": verdict.failing},
        evidence,
        blocks=Pair(blocks.spread(failing), blocks.spread(expected.mean), corner),
        layers={"p_value": blocks.spread(p)},
    )
    raise AssertionError("\n".join([what, *rows, f"  {'evidence':<9} {said}"]))


@dataclass(frozen=True)
class _Means:
    """A vector of block means, the variance of these means, and how many seeds that was estimated from."""

    mean: Array
    error2: Array
    seeds: float

    def moments(self, rounding: float = 0.0) -> Moments:
        """As the tests take them, with `rounding` times the mean as one more standard error."""
        return Moments(self.seeds, self.mean, self.seeds * (self.error2 + (rounding * self.mean) ** 2))


def _over_seeds(name: str, render: Render, seeds: range, block: int, region: Region | None) -> tuple[Array, _Means]:
    """The mean picture over the seeds, whole, and the means of the blocks of its region."""
    __tracebackhide__ = True
    total: Array | None = None
    means = []
    for seed in seeds:
        picture = as_picture(f"{name} of seed {seed}", render(seed))
        total = np.zeros_like(picture) if total is None else total
        check_same_shape(f"{name} of seed {seed}", picture, total)
        part = cut(picture, region)
        check_finite(f"{name} of seed {seed}", part, region)
        total += picture
        means.append(Blocks(part.shape, block).means(part))
    seen = moments(means)
    return np.asarray(total) / len(seeds), _Means(seen.mean, seen.variance / len(seeds), len(seeds))


def _known(reference: ArrayLike, variance: ArrayLike, block: int, region: Region | None) -> tuple[Array, _Means]:
    """A picture, whole, and the means of the blocks of its region; the noise of its pixels is independent."""
    __tracebackhide__ = True
    picture = as_picture("reference", reference)
    part = cut(picture, region)
    check_finite("reference", part, region)
    try:
        noise = cut(np.broadcast_to(np.asarray(variance, np.float64), picture.shape), region)
    except (TypeError, ValueError):
        raise LabError("reference_variance: expected a number, or a picture of the reference's shape") from None
    if not (np.isfinite(noise) & (noise >= 0)).all():
        raise LabError("reference_variance: every value must be finite and 0 or more")
    blocks = Blocks(part.shape, block)
    return picture, _Means(blocks.means(part), blocks.means(noise) / blocks.pixels, _KNOWN)
