"""What it costs to leave reservoirs unguarded, which LY19 4.1 calls negligible but for very small viewports.

Run it on a graphics card: ``python -m lab.experiments.race_laboratory scenes/atrium/scene.toml -o race.json``.

Raster lighting lets all fragments of a pixel update its reservoirs: without locks (the paper), under a lock, and by the
race that needs none. For some pixels, picked at random, the exact probabilities p = f / F of all lights are found one
by one; many frames of the same light, with other random numbers, then say how often each light is picked. Told are

- chi2/dof, Pearson's statistic over its degrees of freedom, of all pixels together: 1 for an exact sampler, and the
  chance of so great a one;
- excess, (chi2 - dof) / picks: how far the distribution is off, sum (q - p)^2 / p for picks that follow q, whatever the
  number of picks; and what excess these picks would have shown (at a chance of 1e-3);
- the error of the shadow ratio: with V the visibility of each light's centre from the pixel, the exact ratio is
  sum p V, and the picks' is the share of them that see their light. Its mean absolute error contains the noise of the
  draws; what that noise alone comes to is printed beside it. The bias is the mean error with its sign.
- unlike, the share of picks that are not those under the lock, whose random numbers are the same: they come from
  fragments in another order, or at once;
- light ms, the median time of stage light by the device's clock.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab import __version__, _core
from lab.engine.cpu import CpuEngine
from lab.engine.vulkan.device import open_gpu
from lab.engine.vulkan.engine import VulkanEngine
from lab.errors import LabError
from lab.metrics import ChiSquare, chi_square, pooled
from lab.outputs import check_writable, write_all
from lab.params import PRESETS, Params, parse_assignments, preset
from lab.records import GBuffer, Hierarchy
from lab.report import machine
from lab.scene.load import load_scene

SIGNIFICANCE = 1e-3
_NORMAL_QUANTILE = 3.09  # of 1 - SIGNIFICANCE
WAYS = ("locked", "none", "atomic_race")
INTERLEAVES = (1, 4)


@dataclass(frozen=True)
class Exact:
    """A pixel that must be judged: (n,) merged indices of its lights, their p, and whether their centres are seen."""

    y: int
    x: int
    light: NDArray[np.int64]
    probability: NDArray[np.float64]
    visible: NDArray[np.bool_]


@dataclass(frozen=True)
class Verdict:
    """What picks have shown, over all pixels: see the head of this file. `strangers`: picks of lights with p = 0."""

    picks: int
    strangers: int
    chi2_per_dof: float
    p_value: float
    excess: float
    least_excess: float
    ratio_error: float
    ratio_noise: float
    ratio_bias: float


@dataclass(frozen=True)
class Row:
    """One line of the table. `unlike_locked`: share of picks that are not those under the lock.

    The random numbers are the same ones: such picks come from fragments in another order, or at once.
    """

    size: tuple[int, int]
    interleave: int
    locks: str
    unlike_locked: float
    light_ms: float
    verdict: Verdict


def exact_pixel(
    engine: CpuEngine, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, at: tuple[int, int]
) -> Exact:
    """The distribution that the pixel `at` (y, x) should pick from."""
    (y, x), n = at, params.interleave
    found = _core.probe_pixel(
        hierarchy,
        gbuffer.position[y, x],
        gbuffer.normal[y, x],
        (y % n) * n + x % n,
        params.to_core(),
        engine.scene_radius,
    )
    lit = found["bright"] > 0
    light = found["index"][lit].astype(np.int64)
    f = found["bright"][lit].astype(np.float64) if params.importance else np.ones(len(light))
    wanted = light >= int(found["first_pick"])
    f = np.where(wanted, f, 0.0) if wanted.any() else f
    light, f = light[f > 0], f[f > 0]
    return Exact(y, x, light, f / f.sum(), engine.visible(gbuffer, y, x, hierarchy.position[light]))


def judge(pixels: Iterable[Exact], picks: NDArray[np.int32]) -> Verdict:
    """The verdict on (frames, pixels, samples) `picks` of `pixels`; each pixel must have been picked for."""
    tests: list[ChiSquare] = []
    drawn, strangers = 0, 0
    errors, noises = [], []
    for pixel, its in zip(pixels, np.moveaxis(picks, 1, 0), strict=True):
        row = np.minimum(np.searchsorted(pixel.light, its.ravel()), len(pixel.light) - 1)
        known = pixel.light[row] == its.ravel()
        counts = np.bincount(row[known], minlength=len(pixel.light))
        tests.append(chi_square(counts, pixel.probability))
        drawn, strangers = drawn + its.size, strangers + int((~known).sum())
        ratio = float(pixel.probability[pixel.visible].sum())
        errors.append(float(counts[pixel.visible].sum()) / its.size - ratio)
        noises.append(math.sqrt(2 / math.pi * max(0.0, ratio * (1 - ratio)) / its.size))
    test = pooled(tests)
    if test.freedom == 0:
        raise LabError("no pixel chooses among lights often enough to be judged: take more frames or samples")
    return Verdict(
        picks=drawn,
        strangers=strangers,
        chi2_per_dof=test.statistic / test.freedom,
        # A light that all but sends nothing may round to either side; more than that is no rounding.
        p_value=test.p_value if strangers <= 1e-4 * drawn else 0.0,
        excess=(test.statistic - test.freedom) / drawn,
        # As so many degrees of freedom are all but normal: variance 2 each.
        least_excess=_NORMAL_QUANTILE * math.sqrt(2 * test.freedom) / drawn,
        ratio_error=float(np.abs(errors).mean()),
        ratio_noise=float(np.mean(noises)),
        ratio_bias=float(np.mean(errors)),
    )


def race_laboratory(
    engine: VulkanEngine, params: Params, sizes: Iterable[tuple[int, int]], frames: int, pixels: int
) -> Iterator[Row]:
    """Yields a row for each size, interleaving and way; `params` are of lighting=raster with reservoirs.

    All see the same lights, and all ways the same pixels.
    """
    cpu = CpuEngine(engine.scene)
    lights = engine.trace_vpls(params)
    hierarchy = cpu.build_hierarchy(lights, params.replace(shadow_samples=0))
    for size in sizes:
        gbuffer = engine.render_gbuffer(engine.scene.camera(), size)
        for interleave in INTERLEAVES:
            settings = params.replace(interleave=interleave)
            judged = _choose(cpu, hierarchy, gbuffer, settings, pixels)
            at = [pixel.y for pixel in judged], [pixel.x for pixel in judged]
            locked: NDArray[np.int32] | None = None
            for locks in WAYS:
                found, took = [], []
                for frame in range(frames):
                    now = settings.replace(reservoir_locks=locks, frame=frame)
                    found.append(engine.light(hierarchy, gbuffer, now, counts=False).light[at])
                    took.append(engine.stages_ms()["light"])
                picks = np.stack(found)
                locked = picks if locked is None else locked
                unlike = float((picks != locked).mean())
                yield Row(size, interleave, locks, unlike, statistics.median(took), judge(judged, picks))


def _choose(engine: CpuEngine, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, pixels: int) -> list[Exact]:
    """`pixels` of those that two lights or more light; fewer where there are not so many."""
    candidates = np.argwhere(gbuffer.depth > 0)
    chosen: list[Exact] = []
    for y, x in np.random.default_rng(0).permutation(candidates):
        if len(chosen) == pixels:
            break
        exact = exact_pixel(engine, hierarchy, gbuffer, params, (int(y), int(x)))
        if len(exact.light) > 1:
            chosen.append(exact)
    if not chosen:
        raise LabError(f"{engine.scene.name}: no pixel of this view chooses among lights; choose another scene")
    return chosen


def conclusion(rows: list[Row]) -> str:
    """What the rows say about unguarded reservoirs; that the other two ways are exact is part of it."""
    # Sidak (1967): so that all rows of an exact sampler together err as seldom as one.
    threshold = -math.expm1(math.log1p(-SIGNIFICANCE) / len(rows))
    wrong = [row for row in rows if row.locks != "none" and row.verdict.p_value < threshold]
    if wrong:
        named = ", ".join(_name(row) for row in wrong)
        return f"ways that should be exact are not ({named}): nothing can be said about races before that is mended."
    raced = [row for row in rows if row.locks == "none" and row.verdict.p_value < threshold]
    if not raced:
        unguarded = [row for row in rows if row.locks == "none"]
        least = max(row.verdict.least_excess for row in unguarded)
        said = (
            "no race shows: without locks, picks follow the exact distribution as well as with them (an excess of "
            f"{least:.1e} would have shown)"
        )
        if any(row.unlike_locked > 0 for row in unguarded):
            return f"{said}."
        return (
            f"{said}. They are the very picks that the lock gives: this driver runs the fragments of a pixel one after "
            "the other, and can't show a race. That takes a graphics card."
        )
    worst = max(raced, key=lambda row: row.verdict.excess)
    return (
        f"races show in {', '.join(map(_name, raced))}: at worst an excess of {worst.verdict.excess:.2e}, and a "
        f"shadow ratio off by {worst.verdict.ratio_error:.4f} on average, where noise alone makes "
        f"{worst.verdict.ratio_noise:.4f}."
    )


def _name(row: Row) -> str:
    n = row.interleave
    return f"{row.size[0]}x{row.size[1]} {n}x{n} {row.locks}"


def table(rows: Iterable[Row]) -> Iterator[str]:
    """Lines for people, each as soon as its row is there."""
    yield (
        f"{'size':>10} {'tiles':>5} {'locks':<11} {'light ms':>9} {'chi2/dof':>9} {'chance':>8} {'excess':>9} "
        f"{'would show':>10} {'unlike':>7} {'ratio err.':>10} {'noise':>7} {'bias':>8}"
    )
    for row in rows:
        v, n = row.verdict, row.interleave
        yield (
            f"{row.size[0]:>5}x{row.size[1]:<4} {n:>3}x{n} {row.locks:<11} {row.light_ms:>9.3f} {v.chi2_per_dof:>9.4f} "
            f"{v.p_value:>8.2g} {v.excess:>9.1e} {v.least_excess:>10.1e} {row.unlike_locked:>7.4f} "
            f"{v.ratio_error:>10.4f} {v.ratio_noise:>7.4f} {v.ratio_bias:>8.4f}"
        )


def record(engine: VulkanEngine, params: Params, args: argparse.Namespace, rows: list[Row]) -> dict[str, Any]:
    """What is kept of a run."""
    return {
        "experiment": "race_laboratory",
        "scene": engine.scene.name,
        "device": engine.gpu.describe(),
        "machine": machine(),
        "version": __version__,
        "date": datetime.now(UTC).date().isoformat(),
        "frames": args.frames,
        "pixels": args.pixels,
        "preset": args.preset,
        "params": params.to_dict(),
        "rows": [asdict(row) | {"verdict": asdict(row.verdict)} for row in rows],
        "conclusion": conclusion(rows),
    }


def main(argv: list[str] | None = None) -> int:
    """Prints the table and what follows from it, and writes both as JSON."""
    parser = argparse.ArgumentParser(description="Unguarded reservoirs against locked ones and the atomic race")
    parser.add_argument("scene")
    parser.add_argument("--sizes", default="320x180,1280x720", help="of the frame, with commas between them")
    parser.add_argument("--preset", default="paper", choices=list(PRESETS))
    parser.add_argument("--set", dest="assignments", nargs="+", default=[], metavar="NAME=VALUE")
    parser.add_argument("--frames", type=int, default=256)
    parser.add_argument("--pixels", type=int, default=256, help="that are judged")
    parser.add_argument("--device", default="", help="which Vulkan device, by name or number")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.json")
    args = parser.parse_args(argv)
    sizes = [(int(width), int(height)) for width, height in (size.split("x") for size in args.sizes.split(","))]
    params = preset(args.preset, **parse_assignments(args.assignments))
    params = params.replace(lighting="raster", picker="reservoir")
    if params.shadow_samples == 0:
        raise LabError("shadow_samples=0: there are no picks to judge")
    if args.output:
        check_writable(args.output)
    engine = VulkanEngine(load_scene(args.scene), open_gpu(args.device))
    sys.stdout.write(f"{engine.gpu.adapter.name}, {engine.scene.name}\n")
    rows: list[Row] = []

    def collected() -> Iterator[Row]:
        for row in race_laboratory(engine, params, sizes, args.frames, args.pixels):
            rows.append(row)
            yield row

    for line in table(collected()):
        sys.stdout.write(line + "\n")
        sys.stdout.flush()
    sys.stdout.write(conclusion(rows) + "\n")
    if args.output:
        text = json.dumps(record(engine, params, args, rows), indent=1, allow_nan=False) + "\n"

        def write(path: Path) -> None:
            path.write_text(text, encoding="utf-8")

        write_all({args.output: write})
    return 0


if __name__ == "__main__":
    sys.exit(main())
