"""An outside judge: our path tracer against Mitsuba 3 on the same scene data.

Run it: ``python -m lab.experiments.mitsuba_judge scenes/cornell/scene.toml scenes/atrium/scene.toml``.

Both average over whole pixels (box filter). For direct and for indirect light the table tells the ratio of energies
with its standard error, and how many blocks of pixels fail a z-test of equal means: more than none, after Sidak's
correction for their number, is a disagreement. Blocks, not pixels: paths are heavy-tailed, and only means of some
thousand of them are nearly Gaussian.

Each scene is judged with flat normals, where both programs mean the same: these rows must agree. And as modelled: with
interpolated normals the two differ at silhouettes on purpose. Where such a normal leans away from the eye, Mitsuba
lights the surface from behind, and ours, which goes by the geometry, from the front; on Sponza's curtains in the sun
that is 1 % of the direct light.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.colour import luminance
from lab.engine.cpu import CpuEngine
from lab.experiments.mitsuba_runner import SCALAR, Layer, Mitsuba
from lab.metrics import Sidak, sidak, z_test
from lab.mitsuba_scene import export_mitsuba
from lab.params import Params
from lab.reference import Budget, path_traced
from lab.scene.load import load_scene
from lab.scene.scene import Scene

Doubles = NDArray[np.float64]


ROUNDING = 1e-4
"""Relative difference that float32 sums explain."""


@dataclass(frozen=True)
class Verdict:
    """One layer of one scene.

    Attributes:
        energy: ours over Mitsuba's, luminance.    energy_error: its standard error, or a little less than shown.
        blocks: the z-test over blocks of pixels, each channel, with Sidak's correction.    lowest: the smallest p.
        spread: standard deviation of the z of all noisy blocks; 1 where noise is all there is.

    """

    layer: str
    energy: float
    energy_error: float
    blocks: Sidak
    lowest: float
    spread: float

    def agrees(self, tolerance: float = 0.01) -> bool:
        """Energies within `tolerance` of each other, and no block fails."""
        return abs(self.energy - 1) <= tolerance and self.blocks.accepted


def judge(layer: str, ours: Layer, theirs: Layer, block: int = 8) -> Verdict:
    """Compares (H, W, 3) means of known variance, in blocks of `block` x `block` pixels."""
    a, b = in_blocks(ours, block), in_blocks(theirs, block)
    variance = a.variance + b.variance
    p = z_test(a.mean, b.mean, variance, tolerance=ROUNDING * np.abs(b.mean))
    noisy = variance > 0
    z = (a.mean - b.mean)[noisy] / np.sqrt(variance[noisy])
    (sum_a, error_a), (sum_b, error_b) = _energy(ours), _energy(theirs)
    if sum_b == 0:
        ratio, error = (1.0 if sum_a == 0 else math.inf), 0.0
    else:
        ratio = sum_a / sum_b
        error = math.hypot(error_a, ratio * error_b) / sum_b
    return Verdict(layer, ratio, error, sidak(p), float(p.min()), float(z.std()) if z.size else 0.0)


def _energy(layer: Layer) -> tuple[float, float]:
    """Luminance of the whole picture and its standard error, as if all channels erred together: an upper bound."""
    total, error = layer.mean.sum(axis=(0, 1)), np.sqrt(layer.variance.sum(axis=(0, 1)))
    return float(luminance(total)), float(luminance(error))


def in_blocks(layer: Layer, block: int) -> Layer:
    """Means of blocks; pixels at the right and the bottom that fill none are left out."""
    high, wide = (min(block, side) for side in layer.mean.shape[:2])
    down, across = layer.mean.shape[0] // high, layer.mean.shape[1] // wide

    def folded(values: Doubles) -> Doubles:
        kept: Doubles = values[: down * high, : across * wide]
        return kept.reshape(down, high, across, wide, 3)

    return Layer(folded(layer.mean).mean(axis=(1, 3)), folded(layer.variance).sum(axis=(1, 3)) / (high * wide) ** 2)


def judge_path_tracer(
    scene: Scene, size: tuple[int, int], params: Params, *, spp: int, variant: str = SCALAR, camera: str = ""
) -> list[Verdict]:
    """Our path tracer and Mitsuba's, with `spp` paths a pixel each: a verdict on direct and one on indirect light."""
    scene = replace(scene, background=(0.0, 0.0, 0.0))  # which Mitsuba's picture has not
    view = scene.camera(camera)
    with tempfile.TemporaryDirectory() as folder:
        xml = export_mitsuba(Path(folder) / "scene.xml", scene, view, size, params).files[0]
        theirs = Mitsuba(xml, variant).layers(spp, seed=params.seed)
    ours = path_traced(CpuEngine(scene), view, size, params, budget=Budget(spp=spp), pixel="area")
    return [
        judge("direct", Layer(ours.direct, ours.direct_variance), theirs.direct),
        judge("indirect", Layer(ours.indirect, ours.indirect_variance), theirs.indirect),
    ]


def flat(scene: Scene) -> Scene:
    """`scene` without vertex normals."""
    return replace(scene, meshes=[replace(mesh, normal=None) for mesh in scene.meshes])


def rows(paths: list[str], size: tuple[int, int], spp: int, variant: str) -> Iterator[tuple[str, str, Verdict]]:
    """Scene by scene its name, what its normals are, and the verdict on a layer."""
    for path in paths:
        scene = load_scene(path)
        for normals, changed in (("flat", flat(scene)), ("modelled", scene)):
            for verdict in judge_path_tracer(changed, size, Params(), spp=spp, variant=variant):
                yield scene.name, normals, verdict


def main(argv: list[str] | None = None) -> int:
    """Prints the table; 1 where the two disagree with flat normals."""
    parser = argparse.ArgumentParser(description="Our path tracer against Mitsuba 3's")
    parser.add_argument("scene", nargs="+")
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--variant", default=SCALAR)
    args = parser.parse_args(argv)
    width, height = (int(side) for side in args.size.split("x"))
    heads = f"{'energy':>7} {'+-':>7} {'failing':>12} {'lowest p':>9} {'spread':>7}"
    sys.stdout.write(f"{'scene':<16} {'normals':<9} {'layer':<9} {heads}\n")
    agreed = True
    for name, normals, v in rows(args.scene, (width, height), args.spp, args.variant):
        failing = f"{v.blocks.failing} of {v.blocks.tests}"
        numbers = f"{v.energy:>7.4f} {v.energy_error:>7.4f} {failing:>12} {v.lowest:>9.1e} {v.spread:>7.3f}"
        sys.stdout.write(f"{name:<16} {normals:<9} {v.layer:<9} {numbers}\n")
        sys.stdout.flush()
        agreed = agreed and (normals != "flat" or v.agrees())
    return 0 if agreed else 1


if __name__ == "__main__":
    sys.exit(main())
