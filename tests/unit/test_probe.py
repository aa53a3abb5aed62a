"""The probe of a pixel against float64, against the frame it was taken from, and as files."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lab
from lab import _core
from lab.errors import LabError
from lab.pixel import Probe, probe_pixel

from ..oracle.pixel import Table, scales, table
from ..oracle_geometry.probed import HIDDEN, INSIDE, LIGHTS, SIZE, engine, room_frame, some_pixels
from ..oracle_geometry.scenes import occluded_room

CASES: dict[str, dict[str, Any]] = {
    "ours": {},
    "mean_energy": {"lobe": "mean_energy"},
    "mean": {"lobe": "mean"},
    "soft": {"receiver": "soft"},
    "softened": {"falloff": "softened", "clamp_distance": 0.1},
    "from level 1": {"first_level": 1},
    "picks from level 2": {"first_shadow_level": 2},
    "picks from the top": {"first_shadow_level": 12, "alpha": 1.5},
    "even picks": {"importance": False},
    "race": {"picker": "race"},
    "interleaved": {"interleave": 2},
    "interleaved, all dealt": {"interleave": 4, "deal_all": True, "first_shadow_level": 2},
    "interleaved by 4": {"interleave": 4, "receiver": "soft"},
    "wide, jittered": {"alpha": 4.0, "shadow_points": "jitter", "shadow_estimator": "average"},
    "no shadows": {"shadow_samples": 0},
}


def oracle(probe: Probe, frame: Any) -> Table:
    n = probe.params.interleave
    tile = (probe.y % n) * n + probe.x % n
    scale = scales(frame.hierarchy, probe.params, tile, _core.dealt_tile)
    return table(frame.hierarchy, probe.point, probe.normal, probe.params, engine().scene_radius, scale)


@pytest.mark.parametrize("case", CASES)
def test_each_light_against_float64(case: str) -> None:
    frame = room_frame(**CASES[case])
    lights = 0
    for x, y in some_pixels(frame, 17):
        probe = probe_pixel(engine(), frame, x, y)
        wanted, found = oracle(probe, frame), probe.lights
        total = wanted.contribution.sum(axis=0)
        rows = found.index
        assert (np.diff(rows) > 0).all()
        missing = np.setdiff1d(np.flatnonzero(wanted.bright > 0), rows)
        assert wanted.bright[missing].sum() <= 1e-5 * wanted.bright.sum()
        pairs = [
            (found.distance, wanted.distance), (found.blend_weight, wanted.blend),
            (found.receiver_cosine, wanted.cosine), (found.emission, wanted.emission),
            (found.falloff, wanted.falloff), (found.scale, wanted.scale),
        ]  # fmt: skip
        for mine, theirs in pairs:
            np.testing.assert_allclose(mine, theirs[rows], rtol=1e-4, atol=3e-5)
        np.testing.assert_allclose(found.contribution, wanted.contribution[rows], rtol=1e-3, atol=1e-5 * total.max())
        np.testing.assert_allclose(probe.irradiance, total, rtol=1e-4)
        np.testing.assert_array_equal(found.position, frame.hierarchy.position[rows])
        np.testing.assert_array_equal(found.flux, frame.hierarchy.flux[rows])
        np.testing.assert_array_equal(found.level, np.searchsorted(frame.hierarchy.offset, rows, side="right") - 1)
        if case != "even picks":  # where a light at the edge of contributing counts as much as any
            np.testing.assert_allclose(found.target_weight, wanted.target[rows], rtol=1e-3, atol=1e-5 * total.max())
            np.testing.assert_allclose(found.probability, wanted.probability[rows], rtol=1e-3, atol=1e-5)
        assert found.probability.sum() == pytest.approx(1 if len(rows) else 0)
        lights += len(rows)
    assert lights > (400 if frame.params.interleave == 1 else 20)


@pytest.mark.parametrize("case", CASES)
def test_sums_and_counts_are_the_frames(case: str) -> None:
    frame = room_frame(**CASES[case])
    overdraw, used = frame.lighting.counts()
    off = 0
    pixels = some_pixels(frame)
    for x, y in pixels:
        probe = probe_pixel(engine(), frame, x, y)
        np.testing.assert_allclose(probe.irradiance, frame.lighting.irradiance[y, x], rtol=1e-4, atol=1e-7)
        np.testing.assert_array_equal(probe.overdraw, overdraw[:, y, x])
        off += int(np.abs(probe.lights_used - used[:, y, x].astype(int)).sum())
        assert probe.lights_used.sum() == len(probe.lights)
        if frame.params.shadow_samples:
            assert probe.weight_sum == pytest.approx(float(frame.lighting.weight_sum[y, x]), rel=1e-4)
        np.testing.assert_array_equal(probe.image.colour, frame.image.colour[y, x])
    assert off <= 1, "rounding may tip a light on the edge of contributing, not more"


@pytest.mark.parametrize("case", CASES)
def test_picks_are_among_the_lights(case: str) -> None:
    frame = room_frame(**CASES[case])
    for x, y in some_pixels(frame):
        probe = probe_pixel(engine(), frame, x, y)
        picks = probe.picks
        assert len(picks) == frame.params.shadow_samples
        if len(probe.lights) == 0:  # a tile may see none where all levels are dealt
            assert frame.params.deal_all and (picks.light == -1).all()
            continue
        assert (picks.probability > 0).all() and (picks.light >= 0).all()
        rows = np.searchsorted(probe.lights.index, picks.light)
        np.testing.assert_array_equal(probe.lights.index[rows], picks.light)
        np.testing.assert_allclose(probe.lights.target_weight[rows], picks.target_weight, rtol=1e-4, atol=1e-7)
        np.testing.assert_array_equal(probe.lights.level[rows], picks.level)
        assert not picks.visible[~picks.traced].any()
        np.testing.assert_array_equal(picks.point, frame.shadows.point[y, x])


def test_shares_levels_and_order() -> None:
    probe = probe_pixel(engine(), room_frame(), 5, 6)
    ranked = probe.lights.sorted()
    assert (np.diff(ranked.share) <= 0).all() and ranked.share.sum() == pytest.approx(1)
    assert ranked.cumulative_share[-1] == pytest.approx(1) and ranked.cumulative_share[0] == ranked.share[0]
    by_level = probe.lights.by_level()
    assert sum(map(len, by_level.values())) == len(probe.lights)
    for level, lights in by_level.items():
        assert (lights.level == level).all() and len(lights) == probe.lights_used[level]


def test_a_pixel_that_sees_nothing_has_no_lights() -> None:
    frame = room_frame(interleave=2)
    probe = probe_pixel(engine(), frame, *HIDDEN)
    assert probe.depth == 0 and len(probe.lights) == 0 and probe.weight_sum == 0 and probe.tile == (1, 1)
    assert not probe.irradiance.any() and not probe.overdraw.any() and not probe.lights_used.any()
    assert (probe.picks.light == -1).all() and not probe.picks.probability.any()
    assert np.isnan(probe.shadow.noisy_ratio).all()
    assert json.loads(probe.to_json())["shadow"]["noisy_ratio"] == [None]
    assert len(probe.to_csv().splitlines()) == 1


@pytest.mark.parametrize("pixel", [(-1, 0), (0, -1), (SIZE[0], 0), (0, SIZE[1]), (0.5, 0), (0, float("nan"))])
def test_pixels_outside_are_refused(pixel: tuple[int, int]) -> None:
    with pytest.raises(LabError, match=r"outside of the image of 24x16; x goes from 0 to 23"):
        probe_pixel(engine(), room_frame(), *pixel)
    with pytest.raises(LabError, match="outside"):
        lab.probe(occluded_room(LIGHTS), None, *pixel, size=SIZE)


def test_lab_probe_renders_the_frame_itself() -> None:
    frame = room_frame(seed=3)
    mine = probe_pixel(engine(), frame, 5, 6)
    for where in ("cpu", engine()):
        probe = lab.probe(engine().scene, frame.params, 5, 6, camera=INSIDE, size=SIZE, engine=where)
        assert isinstance(probe, lab.Probe)
        assert probe.to_json() == mine.to_json()


def test_files(tmp_path: Path) -> None:
    probe = probe_pixel(engine(), room_frame(), 5, 6)
    ranked = probe.lights.sorted()
    probe.write(tmp_path / "new" / "a.json")
    record = json.loads((tmp_path / "new" / "a.json").read_text())
    assert record["x"] == 5 and record["params"]["alpha"] == 0.7 and len(record["picks"]) == 4
    assert [row["index"] for row in record["lights"]] == ranked.index.tolist()
    assert np.float32(record["lights"][0]["distance"]) == ranked.distance[0]
    np.testing.assert_array_equal(np.float32(record["image"]["colour"]), probe.image.colour)
    assert record["lights"][-1]["cumulative_share"] == pytest.approx(1)

    probe.write(str(tmp_path / "a.CSV"))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "a.CSV").read_text())))
    assert len(rows) == len(ranked)
    for name, values in (("probability", ranked.probability), ("flux_g", ranked.flux[:, 1]), ("index", ranked.index)):
        np.testing.assert_array_equal(np.array([row[name] for row in rows], values.dtype), values)

    with pytest.raises(LabError, match=r"\.json"):
        probe.write(tmp_path / "a.txt")
    with pytest.raises(LabError, match="can't be written"):
        probe.write(tmp_path / "a.CSV" / "b.csv")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.CSV", "new"]
