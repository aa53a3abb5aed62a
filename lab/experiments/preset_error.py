"""What the presets ours, paper and demo get wrong, against every VPL summed one by one.

Run it: ``python -m lab.experiments.preset_error scenes/atrium/scene.toml``.

The unshadowed part compares irradiance without shadows, the shadowed part irradiance with every shadow ray (64 picks a
pixel, no filter, so that what remains is the method's own error and not noise).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from lab.engine.cpu import CpuEngine, build_hierarchy
from lab.library import irradiance
from lab.metrics import energy_ratio, rel_mse
from lab.params import PRESETS, Params, preset
from lab.scene.load import load_scene
from lab.scene.scene import Scene


@dataclass(frozen=True)
class PresetError:
    """One row of the table."""

    part: str
    preset: str
    alpha: float
    rel_mse: float
    energy: float


def preset_errors(scene: Scene, size: tuple[int, int], vpls: int, alphas: tuple[float, ...]) -> Iterator[PresetError]:
    """Yields unshadowed rows, then shadowed ones; all presets see the same VPLs."""
    engine = CpuEngine(scene)
    plain = Params(vpls=vpls)
    lights, gbuffer = engine.trace_vpls(plain), engine.render_gbuffer(scene.camera(), size)
    seen = gbuffer.depth > 0
    # Level 0 reaches everywhere at a huge alpha: every VPL is summed, exactly.
    everything = Params(alpha=1e6, shadow_samples=0)
    exact = irradiance(
        build_hierarchy(lights, everything),
        gbuffer.position[seen],
        gbuffer.normal[seen],
        everything,
        scene_radius=engine.scene_radius,
    )
    for name in PRESETS:
        for alpha in alphas:
            params = preset(name, alpha=alpha, vpls=vpls, shadow_samples=0)
            lit = engine.light(engine.build_hierarchy(lights, params), gbuffer, params, counts=False).irradiance[seen]
            yield PresetError("unshadowed", name, alpha, rel_mse(lit, exact), energy_ratio(lit, exact))
    # 0 draws: a ray to every light.
    everything_shadowed = engine.brute_force(lights, gbuffer, (0, size[1]), plain, draws=0, pass_number=0)
    truth = everything_shadowed["irradiance"][seen]
    for name in PRESETS:
        for alpha in alphas:
            params = preset(name, alpha=alpha, vpls=vpls, shadow_samples=64, filter="none")
            hierarchy = engine.build_hierarchy(lights, params)
            lighting = engine.light(hierarchy, gbuffer, params, counts=False)
            shadows = engine.trace_shadow_rays(hierarchy, gbuffer, lighting, params)
            filtered = engine.filter_shadows(gbuffer, shadows, params)
            image = engine.composite(gbuffer, lighting, shadows, filtered, params)
            shown = (image.unshadowed * image.shadow_ratio)[seen]
            yield PresetError("shadowed", name, alpha, rel_mse(shown, truth), energy_ratio(shown, truth))


def main(argv: list[str] | None = None) -> int:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="Error of the presets against brute force over the same VPLs")
    parser.add_argument("scene")
    parser.add_argument("--size", default="160x90")
    parser.add_argument("--vpls", type=int, default=20_000)
    args = parser.parse_args(argv)
    width, height = (int(side) for side in args.size.split("x"))
    sys.stdout.write(f"{'part':<12} {'preset':<7} {'alpha':>5} {'relMSE':>8} {'energy':>7}\n")
    for row in preset_errors(load_scene(args.scene), (width, height), args.vpls, (1.0, 2.0)):
        sys.stdout.write(f"{row.part:<12} {row.preset:<7} {row.alpha:>5g} {row.rel_mse:>8.4f} {row.energy:>7.3f}\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
