"""``lab.survey``: statistics of the lights that pixels look at, and how these grow with the VPLs."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.records import Frame
from lab.survey import overdraw_growth, overdraw_survey

from ..oracle_geometry.scenes import occluded_room, wall_lights
from .test_frame import CAMERA, engine, frame


def counted(overdraw: Any, seen: Any) -> Frame:
    """A frame with these (L, H, W) counts, which sees a surface where `seen`."""
    f = frame((overdraw.shape[2], overdraw.shape[1]))
    counts = np.asarray(overdraw, np.uint32)
    lighting = dataclasses.replace(f.lighting, overdraw=counts, lights_used=counts // 2)
    gbuffer = dataclasses.replace(f.gbuffer, depth=np.asarray(seen, np.float32))
    return dataclasses.replace(f, lighting=lighting, gbuffer=gbuffer)


def by_hand(counts: Any, seen: Any) -> tuple[float, float, float, int]:
    """Mean, median, 95 % and greatest of the pixels that see a surface, one by one."""
    values = sorted(int(counts[y, x]) for y in range(seen.shape[0]) for x in range(seen.shape[1]) if seen[y, x])

    def quantile(share: float) -> float:
        place = share * (len(values) - 1)
        low = int(place)
        return values[low] + (values[min(low + 1, len(values) - 1)] - values[low]) * (place - low)

    return sum(values) / len(values), quantile(0.5), quantile(0.95), values[-1]


@pytest.mark.parametrize("most", [1, 5, 39, 40, 79, 80, 3000, 123_456])
def test_statistics_and_histograms(most: int) -> None:
    random = np.random.default_rng(most)
    counts, seen = random.integers(0, most + 1, (3, 9, 14)), random.random((9, 14)) < 0.8
    survey = overdraw_survey(counted(counts, seen))
    assert [s.level for s in survey.levels] == [0, 1, 2] and survey.total.level is None
    np.testing.assert_array_equal(survey.total.map, counts.sum(axis=0))
    for found, values in zip([*survey.levels, survey.total], [*counts, counts.sum(axis=0)], strict=True):
        np.testing.assert_allclose((found.mean, found.median, found.p95, found.max), by_hand(values, seen), rtol=1e-12)
        assert found.pixels == seen.sum() == found.histogram.sum()
        assert found.edges[0] == 0 and found.edges[-2] <= found.max < found.edges[-1]
        assert 1 <= len(found.histogram) <= 40 and len(set(np.diff(found.edges))) == 1
        width = str(found.edges[1])
        assert width[0] in "125" and set(width[1:]) <= {"0"}, "round numbers"
        for i, number in enumerate(found.histogram):
            inside = (values >= found.edges[i]) & (values < found.edges[i + 1]) & seen
            assert inside.sum() == number


def test_it_measures_the_frame() -> None:
    f = frame()
    overdraw, lights_used = f.lighting.counts()
    survey, used = overdraw_survey(f), overdraw_survey(f, "lights_used")
    seen = f.gbuffer.depth > 0
    assert 0 < seen.sum() < seen.size, "a window of background"
    assert survey.total.mean == pytest.approx(overdraw.sum(axis=0)[seen].mean())
    assert used.total.max == lights_used.sum(axis=0)[seen].max()
    assert sum(level.mean for level in survey.levels) == pytest.approx(survey.total.mean)
    assert (used.total.map <= survey.total.map).all()


def test_a_view_of_nothing() -> None:
    survey = overdraw_survey(counted(np.full((2, 3, 4), 7), np.zeros((3, 4))))
    assert survey.total.pixels == 0 and survey.total.mean == 0 and survey.total.histogram.sum() == 0


def test_what_can_not_be_surveyed() -> None:
    f = frame()
    with pytest.raises(LabError, match="lights_used"):
        overdraw_survey(f, "lights_usde")
    with pytest.raises(LabError, match="counts"):
        overdraw_survey(dataclasses.replace(f, lighting=dataclasses.replace(f.lighting, overdraw=None)))


def test_growth_where_every_light_reaches_everything() -> None:
    """With blending this wide, overdraw is the number of lights drawn; the line is the least squares one."""
    g = engine().render_gbuffer(CAMERA, (12, 8))
    said: list[tuple[float, str]] = []
    for first_level in (0, 1):
        params = Params(alpha=1e6, first_level=first_level)
        growth = overdraw_growth(engine(), g, (100, 400, 1600), params, lambda share, line: said.append((share, line)))
        assert growth.vpls == [100, 400, 1600]
        for vpls, lights, mean in zip(growth.vpls, growth.grid_lights, growth.overdraw, strict=True):
            hierarchy = engine().build_hierarchy(engine().trace_vpls(params.replace(vpls=vpls)), params)
            drawn = len(hierarchy.position) - (vpls if first_level else 0)
            assert lights == drawn and mean == drawn
        x, y = np.log(np.array(growth.grid_lights, np.float64)), np.array(growth.overdraw)
        slope = ((x - x.mean()) * (y - y.mean())).sum() / ((x - x.mean()) ** 2).sum()
        assert growth.slope == pytest.approx(slope) and growth.intercept == pytest.approx(y.mean() - slope * x.mean())
        assert growth.r_squared == pytest.approx(np.corrcoef(x, y)[0, 1] ** 2) and growth.r_squared < 0.99
        np.testing.assert_allclose(growth.fitted(growth.grid_lights), y.mean() + slope * (x - x.mean()))
    shares = [share for share, _ in said]
    assert shares == sorted(shares[:4]) * 2 and shares[-1] == 1 and "400 VPLs" in said[1][1]


def test_growth_on_a_real_view_is_the_frames_own_overdraw() -> None:
    g = engine().render_gbuffer(CAMERA, (12, 8))
    growth = overdraw_growth(engine(), g, (200, 800), Params(alpha=0.7))
    for vpls, mean in zip(growth.vpls, growth.overdraw, strict=True):
        assert mean == overdraw_survey(frame((12, 8), vpls=vpls, alpha=0.7)).total.mean
    assert growth.r_squared == pytest.approx(1.0), "two points lie on a line"


def test_growth_that_can_not_be_measured() -> None:
    g = engine().render_gbuffer(CAMERA, (4, 4))
    with pytest.raises(LabError, match="two or more"):
        overdraw_growth(engine(), g, (100, 100))
    with pytest.raises(LabError, match="no surface"):
        overdraw_growth(engine(), dataclasses.replace(g, depth=np.zeros_like(g.depth)), (100, 200))
    with pytest.raises(LabError, match="list"):
        overdraw_growth(CpuEngine(occluded_room(wall_lights(1, 9))), g, (100, 200))
