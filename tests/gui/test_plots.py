"""Plots: what they draw is what the records say, at any size, and nothing is left behind."""

from __future__ import annotations

import gc
import io
import weakref
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch
from PIL import Image

from gui.plots import (
    blend_plot,
    distribution_plot,
    growth_plot,
    level_shares_plot,
    levels_plot,
    overdraw_levels_plot,
    overdraw_plot,
    picks_plot,
    timings_plot,
    to_png,
    to_svg,
)
from gui.plots.shadows import MAPS, Distributions
from lab.blend_curves import blend_radii, blend_weights, drawn_levels
from lab.engine.engine import STAGES
from lab.errors import LabError
from lab.level_colours import LEVEL_COLOURS
from lab.params import Params
from lab.pixel import PickTrials, Probe, probe_pixel, sample_pixel
from lab.report import level_records
from lab.survey import OverdrawGrowth, OverdrawSurvey, compare_importance, overdraw_survey

from .scenes import SIZE, engine, frame

X, Y = 8, 18  # on the wall
SKY = next((int(x), int(y)) for y, x in np.argwhere(np.ones((SIZE[1], SIZE[0]))) if not frame().gbuffer.depth[y, x])


@cache
def probe(x: int = X, y: int = Y) -> Probe:
    return probe_pixel(engine(), frame(), x, y)


@cache
def trials(x: int = X, y: int = Y) -> PickTrials:
    return sample_pixel(engine(), frame(), x, y, 512)


@cache
def survey(counted: str = "overdraw") -> OverdrawSurvey:
    return overdraw_survey(frame(), counted)


@cache
def distributions() -> Distributions:
    both = compare_importance(engine(), frame())
    return {"by importance": both.on.distribution, "evenly": both.off.distribution}


GROWTH = OverdrawGrowth([1000, 10_000, 100_000], [900, 6000, 40_000], [80.0, 130.0, 175.0], 25.0, -90.0, 0.998)
STAGES_MS = {stage: 10.0 * (i + 1) for i, stage in enumerate(STAGES)}

PLOTS: dict[str, Callable[[], Figure]] = {
    "blend": lambda: blend_plot(frame().params, frame().hierarchy, probe()),
    "blend of the levels alone": lambda: blend_plot(frame().params, frame().hierarchy),
    "blend of the sky": lambda: blend_plot(frame().params, frame().hierarchy, probe(*SKY)),
    "picks": lambda: picks_plot(trials()),
    "picks of the sky": lambda: picks_plot(trials(*SKY)),
    "overdraw": lambda: overdraw_plot(survey()),
    "overdraw of a level": lambda: overdraw_plot(survey("lights_used"), 1),
    "overdraw of levels": lambda: overdraw_levels_plot(survey()),
    "growth": lambda: growth_plot(GROWTH),
    "level shares": lambda: level_shares_plot(distributions()),
    **{name: lambda name=name: distribution_plot(distributions(), name) for name in MAPS},  # type: ignore[misc]
    "timings": lambda: timings_plot(STAGES_MS),
    "levels": lambda: levels_plot(level_records(frame().hierarchy, frame().lighting, frame().gbuffer.depth > 0)),
}


def texts(figure: Figure) -> str:
    """Every text of a figure."""
    found = [text.get_text() for axes in figure.axes for text in axes.texts]
    for axes in figure.axes:
        found += [axes.get_title(loc="left"), axes.get_xlabel(), axes.get_ylabel()]
        found += [text.get_text() for text in (axes.get_legend().get_texts() if axes.get_legend() else [])]
        found += [label.get_text() for label in (*axes.get_xticklabels(), *axes.get_yticklabels())]
    return "\n".join(found)


def heights(axes: Axes) -> list[float]:
    (bars,) = [c for c in axes.containers if isinstance(c, BarContainer)]
    return [bar.get_height() for bar in bars]


@pytest.mark.parametrize("name", PLOTS)
def test_every_plot_is_drawn_at_its_size(name: str) -> None:
    figure = PLOTS[name]()
    image = Image.open(io.BytesIO(to_png(figure)))
    assert image.size == (500, 300)
    pixels = np.asarray(image.convert("RGB"))
    assert np.ptp(pixels) > 120, "nothing is drawn"
    corners = pixels[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert (corners == (250, 249, 246)).all()


def test_sizes_and_letters() -> None:
    figure = timings_plot(STAGES_MS)
    for width, height, dpi in ((333, 211, 100), (960, 540, 150), (1001, 401, 72)):
        image = Image.open(io.BytesIO(to_png(figure, width, height, dpi)))
        assert image.size == (width, height)
    svg = to_svg(figure, 600, 300)
    assert svg.startswith("<?xml") and 'width="432pt" height="216pt"' in svg
    assert to_svg(timings_plot(STAGES_MS), 600, 300) == svg


def test_figures_leave_nothing_behind() -> None:
    import sys

    figure = timings_plot(STAGES_MS)
    to_png(figure)
    gone = weakref.ref(figure)
    del figure
    gc.collect()
    assert gone() is None
    pyplot = sys.modules.get("matplotlib.pyplot")
    assert pyplot is None or not pyplot.get_fignums()


@pytest.mark.parametrize("settings", [{}, {"first_level": 1, "alpha": 0.7}, {"levels": 1}])
def test_blend_curves(settings: dict[str, object]) -> None:
    made = frame(**settings)
    hierarchy, params = made.hierarchy, made.params
    levels, radii = drawn_levels(hierarchy, params), blend_radii(hierarchy, params)
    np.testing.assert_allclose(radii, params.alpha * hierarchy.cell_size, rtol=1e-6)
    distance = np.random.default_rng(1).uniform(0, 3 * float(radii[-1]), 200)
    weights = blend_weights(hierarchy, params, distance)
    for level in range(hierarchy.top + 1):
        r = float(radii[level])
        up = np.ones_like(distance) if level == levels[0] else (distance - r / 2) / (r / 2)
        down = np.ones_like(distance) if level == levels[-1] else (2 * r - distance) / r
        expected = np.clip(np.minimum(up, down), 0, 1) if level in levels else np.zeros_like(distance)
        np.testing.assert_allclose(weights[level], expected, atol=2e-5)
    np.testing.assert_allclose(weights.sum(axis=0), 1, atol=1e-4)


def test_lights_stand_on_their_curves() -> None:
    found = probe()
    (axes,) = PLOTS["blend"]().axes
    (marks,) = [c for c in axes.collections if isinstance(c, PathCollection)]
    points = np.asarray(marks.get_offsets())
    assert np.array_equal(points[:, 0], found.lights.distance) and np.array_equal(
        points[:, 1], found.lights.blend_weight
    )
    curves = {line.get_color(): line for line in axes.lines}
    for (x, y), level in zip(points, found.lights.level, strict=True):
        line = curves[LEVEL_COLOURS[int(level)]]
        assert y == pytest.approx(np.interp(x, line.get_xdata(), line.get_ydata()), abs=0.02)
    low, high = axes.get_xlim()
    assert low <= points[:, 0].min() and points[:, 0].max() <= high
    said = texts(PLOTS["blend"]())
    assert (
        f"pixel ({X}, {Y}): {len(found.lights)} lights" in said
        and "distance (scene units); area of marks: share of light" in said
    )
    assert "no light" in texts(PLOTS["blend of the sky"]())


def test_picks_are_those_of_the_trials() -> None:
    found = trials()
    figure = picks_plot(found)
    drawn = heights(figure.axes[0])
    assert sum(drawn) == found.draws == 512
    order = np.argsort(-found.probability, kind="stable")
    assert np.array_equal(drawn[:36], found.count[order][:36])
    said = texts(figure)
    assert f"chi-square {found.statistic:.1f}, {found.freedom} dof, p = {found.p_value:.2g}" in said
    assert (f"{len(order) - 36} more" in said) == (len(order) > 36)
    assert "nothing to pick" in texts(PLOTS["picks of the sky"]())


def test_overdraw_is_that_of_the_survey() -> None:
    found = survey()
    for level in (None, 1):
        one = found.total if level is None else found.levels[level]
        figure = overdraw_plot(found, level)
        steps = next(patch for patch in figure.axes[0].patches if isinstance(patch, StepPatch))
        np.testing.assert_allclose(steps.get_data().values, 100 * one.histogram / one.pixels)
        np.testing.assert_allclose(steps.get_data().edges, one.edges - 0.5)
        said = texts(figure)
        assert f"mean {one.mean:.4g}" in said and f"max {one.max:,}" in said and f"95 % {one.p95:.4g}" in said
    said = texts(overdraw_levels_plot(found)).split("\n")
    for one in found.levels:
        assert f"{one.mean:.3g}" in said
    figure = growth_plot(GROWTH)
    assert "-90.0 + 25.00 ln(lights), R² = 0.998" in texts(figure) and "10K VPLs" in texts(figure)


def test_shadow_distributions() -> None:
    sides = distributions()
    figure = level_shares_plot(sides)
    groups = [c for c in figure.axes[0].containers if isinstance(c, BarContainer)]
    for (whole, dark), found in zip((groups[:2], groups[2:]), sides.values(), strict=True):
        shares = [bar.get_height() for bar in whole]
        np.testing.assert_allclose(shares, 100 * found.level_shares)
        assert sum(shares) == pytest.approx(100)
        blocked = sum(bar.get_height() for bar in dark) / 100
        rays = found.level_blocked.sum() / found.level_picks.sum()
        assert rays - 1e-9 <= blocked <= 1
    for name in MAPS:
        figure = distribution_plot(sides, name)
        steps = [patch for patch in figure.axes[0].patches if isinstance(patch, StepPatch)][::2]
        for step, (side, found) in zip(steps, sides.items(), strict=True):
            values = np.asarray(getattr(found, name))
            assert step.get_data().values.sum() == pytest.approx(100, abs=1e-6), name
            assert f"{side}: mean {np.nanmean(values):.3g}" in texts(figure)
    with pytest.raises(LabError, match="did you mean 'entropy'"):
        distribution_plot(sides, "entropie")


def test_timings() -> None:
    figure = timings_plot({**STAGES_MS, "trace_vpls": 0.0}, STAGES_MS)
    said = texts(figure)
    assert "taken again" in said and "70.0" in said and "270 ms in all (before, pale: 280 ms)" in said
    assert all(stage in said for stage in STAGES)
    assert "0 ms in all" in texts(timings_plot({}))


def test_levels() -> None:
    rows = level_records(frame().hierarchy, frame().lighting, frame().gbuffer.depth > 0)
    said = texts(levels_plot(rows)).split("\n")
    for row in rows:
        assert f" {row['grid_lights']:,}" in said
    assert frame().params == Params(vpls=600)


@pytest.mark.parametrize("name", PLOTS)
def test_every_plot_fits_a_small_place(name: str) -> None:
    """Without a warning that its parts have no room."""
    image = Image.open(io.BytesIO(to_png(PLOTS[name](), 300, 170)))
    assert image.size == (300, 170)
