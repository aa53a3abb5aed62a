"""The race laboratory: exact picks pass, those of lost updates do not, and what it concludes follows from its rows."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lab.errors import LabError
from lab.experiments.race_laboratory import INTERLEAVES, Exact, Row, Verdict, conclusion, exact_pixel, judge, main
from lab.params import Params

from ..oracle_geometry.grids import contributions, pick_weights
from .vulkan_scenes import cpu_engine

FRAMES, SAMPLES = 400, 8


def pixels(count: int = 20, lights: int = 30) -> list[Exact]:
    rng = np.random.default_rng(1)
    p = rng.gamma(1.0, size=(count, lights))
    index = np.sort(rng.permutation(500)[:lights])
    return [Exact(0, i, index, row / row.sum(), rng.random(lights) < 0.6) for i, row in enumerate(p)]


def reservoir_picks(chosen: list[Exact], lost: float, seed: int = 2) -> NDArray[np.int32]:
    """The paper's reservoirs, one light after the other; a share `lost` of lights add to a sum that is then lost."""
    rng = np.random.default_rng(seed)
    picks = np.empty((FRAMES, len(chosen), SAMPLES), np.int32)
    for i, pixel in enumerate(chosen):
        total = np.zeros(FRAMES)
        for light, f in zip(pixel.light, pixel.probability, strict=True):
            takes = rng.random((FRAMES, SAMPLES)) * (total + f)[:, None] < f
            picks[:, i][takes] = light
            total = np.where((rng.random(FRAMES) < lost) & (total > 0), total, total + f)
    return picks


def test_exact_picks_pass_and_lost_updates_do_not() -> None:
    chosen = pixels()
    exact = judge(chosen, reservoir_picks(chosen, 0.0))
    assert exact.picks == FRAMES * SAMPLES * 20 and exact.strangers == 0
    assert exact.p_value > 1e-3 and abs(exact.excess) < exact.least_excess
    assert exact.chi2_per_dof == pytest.approx(1, abs=0.2)
    assert exact.ratio_error == pytest.approx(exact.ratio_noise, rel=0.4)
    assert abs(exact.ratio_bias) < exact.ratio_noise
    raced = judge(chosen, reservoir_picks(chosen, 0.1))
    assert raced.p_value < 1e-6 and raced.excess > 2 * raced.least_excess > 0
    # Half as many picks show the same excess, only less clearly.
    half = judge(chosen, reservoir_picks(chosen, 0.1)[::2])
    assert half.excess == pytest.approx(raced.excess, rel=0.5) and half.least_excess > 1.3 * raced.least_excess


def test_the_shadow_ratio_is_told_by_which_lights_are_seen() -> None:
    light = np.array([3, 7])
    pixel = Exact(0, 0, light, np.array([0.25, 0.75]), np.array([True, False]))
    picks = np.full((100, 1, 1), 7, np.int32)
    picks[:40] = 3
    found = judge([pixel], picks)
    assert found.ratio_error == found.ratio_bias == pytest.approx(0.15)
    assert found.ratio_noise == pytest.approx(np.sqrt(2 / np.pi * 0.25 * 0.75 / 100))
    picks[:2] = 5
    assert judge([pixel], picks).strangers == 2 and judge([pixel], picks).p_value == 0
    with pytest.raises(LabError, match="more frames or samples"):
        judge([pixel], picks[:2])


def test_the_exact_distribution_is_that_of_the_paper() -> None:
    engine = cpu_engine("atrium")
    params = Params(vpls=300, first_shadow_level=1, interleave=2, deal_all=True)
    hierarchy = engine.build_hierarchy(engine.trace_vpls(params), params)
    gbuffer = engine.render_gbuffer(engine.scene.cameras[0], (32, 18))
    y, x = 12, 17
    found = exact_pixel(engine, hierarchy, gbuffer, params, (y, x))
    plain = params.replace(interleave=1)
    at, normal = gbuffer.position[y, x][None].astype(float), gbuffer.normal[y, x][None].astype(float)
    f = pick_weights(hierarchy, contributions(hierarchy, at, normal, plain, engine.scene_radius), plain)[0]
    assert 0.1 < len(found.light) / (f > 0).sum() < 0.5, "those of its tile"
    np.testing.assert_allclose(found.probability, f[found.light] / f[found.light].sum(), rtol=1e-3, atol=1e-6)
    seen = engine.visible(gbuffer, y, x, hierarchy.position[found.light])
    np.testing.assert_array_equal(found.visible, seen)


def row(locks: str, unlike: float, p_value: float) -> Row:
    verdict = Verdict(1000, 0, 1.5, p_value, 0.02, 0.003, 0.05, 0.01, 0.0)
    return Row((64, 36), 4, locks, unlike, 1.0, verdict)


def test_the_conclusion_follows_from_the_rows() -> None:
    good = [row("locked", 0, 0.5), row("none", 0, 0.5), row("atomic_race", 0.9, 0.5)]
    assert "no race shows" in conclusion(good) and "one after the other" in conclusion(good)
    assert "3.0e-03 would have shown" in conclusion(good)
    disordered = [good[0], row("none", 0.1, 0.5), good[2]]
    assert "no race shows" in conclusion(disordered) and "one after the other" not in conclusion(disordered)
    raced = conclusion([good[0], row("none", 0.1, 1e-9), good[2]])
    assert raced.startswith("races show in 64x36 4x4 none: at worst an excess of 2.00e-02") and "0.0500" in raced
    broken = conclusion([replace(good[0], verdict=row("", 0, 1e-9).verdict), *good[1:]])
    assert "64x36 4x4 locked" in broken and "mended" in broken


def test_a_run_is_kept(gpu: Any, root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "race.json"
    command = [str(root / "scenes/atrium/scene.toml"), "--sizes", "24x14", "--frames", "8", "--pixels", "40"]
    assert main([*command, "--set", "vpls=300", "shadow_samples=16", "-o", str(out)]) == 0
    kept, said = json.loads(out.read_text()), capsys.readouterr().out
    assert [(r["interleave"], r["locks"]) for r in kept["rows"]] == [
        (n, way) for n in INTERLEAVES for way in ("locked", "none", "atomic_race")
    ]
    assert kept["device"]["name"] in said and kept["conclusion"] in said
    assert all(0 < r["verdict"]["picks"] <= 8 * 16 * 40 and r["light_ms"] > 0 for r in kept["rows"])
    for r in kept["rows"]:
        assert r["locks"] == "none" or r["verdict"]["p_value"] > 1e-4
    if kept["device"]["kind"] == "software":
        assert "one after the other" in kept["conclusion"]
    with pytest.raises(LabError, match="no picks to judge"):
        main([*command, "--set", "shadow_samples=0"])
