"""LY19 Figure 5: mean overdraw against the logarithm of the number of grid lights, as the VPL count grows.

Run it: ``python -m lab.experiments.overdraw_growth scenes/atrium/scene.toml``. :mod:`lab.survey.overdraw_growth`
measures it.
"""

from __future__ import annotations

import argparse
import sys

from lab.engine import create_engine
from lab.scene.load import load_scene
from lab.survey.overdraw_growth import overdraw_growth


def main(argv: list[str] | None = None) -> int:
    """Prints the table and R^2."""
    parser = argparse.ArgumentParser(description="Mean overdraw against log(grid lights), the paper's Figure 5")
    parser.add_argument("scene")
    parser.add_argument("--size", default="1280x720")
    args = parser.parse_args(argv)
    width, height = (int(side) for side in args.size.split("x"))
    scene = load_scene(args.scene)
    engine = create_engine("cpu", scene)
    growth = overdraw_growth(engine, engine.render_gbuffer(scene.camera(), (width, height)))
    out = sys.stdout
    out.write(f"{'VPLs':>9} {'grid lights':>12} {'mean overdraw':>14}\n")
    for vpls, lights, overdraw in zip(growth.vpls, growth.grid_lights, growth.overdraw, strict=True):
        out.write(f"{vpls:>9,} {lights:>12,} {overdraw:>14.1f}\n")
    out.write(f"overdraw = a + {growth.slope:.1f} ln(grid lights), R^2 = {growth.r_squared:.3f}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
