"""LY19 Figure 5: mean overdraw against the logarithm of the number of grid lights, as the VPL count grows.

Run it: ``python -m lab.experiments.overdraw_growth scenes/atrium/scene.toml``.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass

import numpy as np

from lab.engine import create_engine
from lab.params import Params
from lab.scene.load import load_scene
from lab.scene.scene import Scene


@dataclass(frozen=True)
class Growth:
    """One row a VPL count: the grid lights of all drawn levels, mean overdraw, and the fit's quality."""

    vpls: list[int]
    grid_lights: list[int]
    overdraw: list[float]
    slope: float
    r_squared: float


def overdraw_growth(scene: Scene, size: tuple[int, int], counts: list[int]) -> Growth:
    """Measures and fits mean overdraw = a + slope * ln(grid lights); means are over pixels that see a surface."""
    engine = create_engine("cpu", scene)
    gbuffer = engine.render_gbuffer(scene.camera(), size)
    seen = gbuffer.depth > 0
    grid_lights, overdraw = [], []
    for vpls in counts:
        params = Params(vpls=vpls, first_level=1, shadow_samples=0)
        hierarchy = engine.build_hierarchy(engine.trace_vpls(params), params)
        lighting = engine.light(hierarchy, gbuffer, params)
        grid_lights.append(len(hierarchy.position) - len(hierarchy.input_index))
        overdraw.append(float(lighting.counts()[0].sum(axis=0)[seen].mean()))
    x, y = np.log(grid_lights), np.array(overdraw)
    slope, start = np.polyfit(x, y, 1)
    residual = float(np.sum((y - start - slope * x) ** 2) / np.sum((y - y.mean()) ** 2))
    return Growth(counts, grid_lights, overdraw, float(slope), 1 - residual)


def main(argv: list[str] | None = None) -> int:
    """Prints the table and R^2."""
    parser = argparse.ArgumentParser(description="Mean overdraw against log(grid lights), the paper's Figure 5")
    parser.add_argument("scene")
    parser.add_argument("--size", default="1280x720")
    args = parser.parse_args(argv)
    width, height = (int(side) for side in args.size.split("x"))
    growth = overdraw_growth(load_scene(args.scene), (width, height), [1_000, 10_000, 100_000, 1_000_000])
    out = sys.stdout
    out.write(f"{'VPLs':>9} {'grid lights':>12} {'mean overdraw':>14}\n")
    for vpls, lights, overdraw in zip(growth.vpls, growth.grid_lights, growth.overdraw, strict=True):
        out.write(f"{vpls:>9,} {lights:>12,} {overdraw:>14.1f}\n")
    out.write(f"overdraw = a + {growth.slope:.1f} ln(grid lights), R^2 = {growth.r_squared:.3f}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
