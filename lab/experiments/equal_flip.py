"""How long Mitsuba 3 takes to look as near to the truth as one of our frames does: the time to equal FLIP.

Run it: ``python -m lab.experiments.equal_flip sponza.glb``.

FLIP is HDR-FLIP (:func:`lab.metrics.flip`): the largest LDR-FLIP over exposures that it derives from the reference,
averaged over pixels. The reference is our path tracer's, which agrees with Mitsuba's (``mitsuba_judge``), run until its
noise is far below. Each program is held to the truth about what it draws: ours shades pixels' centres with filtered
textures, Mitsuba averages over whole pixels; neither is blamed for the other's way. How our frame stands against whole
pixels is printed too.

Our time is a whole frame: VPLs, hierarchy, G-buffer, lighting, shadow rays, filter, composite; the median of several.
Mitsuba's is its rendering alone, after a first one that compiles its kernels. Neither counts reading the scene or
building the trees that rays go through. Both use all cores; nothing else should run.

Where surfaces have holes, Mitsuba must use ``volpath`` to be right, which is slower than ``path``. ``--solid`` fills
all holes, for both programs, and gives Mitsuba its faster integrator.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import lab.frame
from lab.engine.cpu import CpuEngine
from lab.experiments.mitsuba_runner import LLVM, SCALAR, Mitsuba, llvm_library
from lab.metrics import flip, rel_mse
from lab.mitsuba_scene import export_mitsuba
from lab.params import Params
from lab.reference import Budget, render_reference
from lab.scene.load import load_scene
from lab.scene.scene import Scene

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class Point:
    """One picture: how long it took, and how far it is from the truth."""

    spp: int
    seconds: float
    flip: float
    rel_mse: float


@dataclass(frozen=True)
class Ours:
    """Our frame. `flip` and `rel_mse` against pixels' centres, `flip_area` against whole pixels."""

    seconds: float
    flip: float
    rel_mse: float
    flip_area: float


@dataclass(frozen=True)
class References:
    """(H, W, 3) radiance at pixels' centres and over whole pixels.

    `noise`: FLIP between two halves of the latter's paths, which is more than its own distance from the truth.
    """

    centre: Doubles
    area: Doubles
    noise: float


def references(scene: Scene, size: tuple[int, int], params: Params, spp: int) -> References:
    """Path-traced with `spp` paths a pixel; kept on disk."""

    def traced(pixel: str, seed: int, paths: int) -> Doubles:
        budget = Budget(spp=paths)
        settings = params.replace(seed=seed)
        return render_reference(scene, "path_tracer", settings, size=size, budget=budget, pixel=pixel).colour

    halves = [traced("area", seed, spp // 2) for seed in (1, 2)]
    return References(traced("centre", 1, spp), (halves[0] + halves[1]) / 2, flip(halves[0], halves[1])[0])


def our_frame(scene: Scene, size: tuple[int, int], params: Params, truth: References, repeats: int) -> Ours:
    """The median over `repeats` frames of different seeds, after one that is not counted."""
    engine = CpuEngine(scene)
    found = []
    for seed in range(repeats + 1):
        start = time.perf_counter()
        frame = lab.frame.render_frame(engine, scene.camera(), size, params.replace(seed=seed))
        seconds = time.perf_counter() - start
        colour = frame.image.colour.astype(np.float64)
        errors = flip(colour, truth.centre)[0], rel_mse(colour, truth.centre), flip(colour, truth.area)[0]
        found.append((seconds, *errors))
    seconds, error, relative, area = np.median(found[1:], axis=0).tolist()
    return Ours(seconds, error, relative, area)


def mitsuba_points(mitsuba: Mitsuba, truth: References, most: int, repeats: int = 3) -> Iterator[Point]:
    """Mitsuba at 1, 2, 4 ... `most` samples a pixel; few samples are tried `repeats` times, and the median taken."""
    mitsuba.render(1, 0)
    spp = 1
    while spp <= most:
        found = []
        for seed in range(repeats if spp <= 32 else 1):
            mitsuba.render(spp, 1) if seed == 0 and spp <= 16 else None  # compiles what depends on the size
            start = time.perf_counter()
            image = mitsuba.render(spp, seed + 1)
            found.append((time.perf_counter() - start, flip(image, truth.area)[0], rel_mse(image, truth.area)))
        seconds, error, relative = np.median(found, axis=0).tolist()
        yield Point(spp, seconds, error, relative)
        spp *= 2


def time_to(error: float, points: list[Point]) -> float:
    """Seconds to a FLIP of `error`: interpolated between points, both as logarithms; infinite beyond the last one.

    A picture that is better at once than asked for gives its own time.
    """
    if points[0].flip <= error:
        return points[0].seconds
    for before, after in pairwise(points):
        if after.flip <= error:
            share = math.log(before.flip / error) / math.log(before.flip / after.flip)
            return float(before.seconds * (after.seconds / before.seconds) ** share)
    return math.inf


def solid(scene: Scene) -> Scene:
    """`scene` with all holes filled."""
    return replace(scene, materials=[replace(material, alpha_cutoff=0.0) for material in scene.materials])


def main(argv: list[str] | None = None) -> int:
    """Prints both curves and the ratio of times."""
    parser = argparse.ArgumentParser(description="Time to equal FLIP: Mitsuba 3 against one of our frames")
    parser.add_argument("scene")
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--reference", type=int, default=4096, metavar="SPP", help="paths a pixel of the truth")
    parser.add_argument("--most", type=int, default=1024, metavar="SPP", help="most of Mitsuba's samples a pixel")
    parser.add_argument("--repeats", type=int, default=7, help="frames of ours")
    parser.add_argument("--variant", default=LLVM if llvm_library() else SCALAR)
    parser.add_argument("--solid", action="store_true", help="fill all holes: Mitsuba's fastest integrator")
    args = parser.parse_args(argv)
    width, height = (int(side) for side in args.size.split("x"))
    scene = replace(load_scene(args.scene), background=(0.0, 0.0, 0.0))
    scene = solid(scene) if args.solid else scene
    params, size = Params(), (width, height)
    say = sys.stdout.write
    truth = references(scene, size, params, args.reference)
    say(f"{scene.name} {width}x{height}; FLIP between halves of the reference {truth.noise:.4f}\n")
    ours = our_frame(scene, size, params, truth, args.repeats)
    say(f"ours: {ours.seconds * 1e3:.0f} ms, FLIP {ours.flip:.4f}, relMSE {ours.rel_mse:.4f}")
    say(f" (against whole pixels: FLIP {ours.flip_area:.4f})\n")
    with tempfile.TemporaryDirectory() as folder:
        xml = export_mitsuba(Path(folder) / "scene.xml", scene, scene.camera(), size, params).files[0]
        points = []
        for point in mitsuba_points(Mitsuba(xml, args.variant), truth, args.most):
            points.append(point)
            say(f"{args.variant} {point.spp:>5} spp: {point.seconds:>8.3f} s, FLIP {point.flip:.4f}, ")
            say(f"relMSE {point.rel_mse:.4f}\n")
            sys.stdout.flush()
    for against, error in (("its own kind of pixel", ours.flip), ("whole pixels", ours.flip_area)):
        seconds = time_to(error, points)
        if math.isinf(seconds):
            say(f"against {against}: Mitsuba needs over {points[-1].seconds / ours.seconds:.0f} times as long\n")
        else:
            say(f"against {against}: Mitsuba needs {seconds:.2f} s, {seconds / ours.seconds:.1f} times as long\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
