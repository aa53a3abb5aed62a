"""The overdraw picture shows the counts it was given."""

from __future__ import annotations

import numpy as np
import pytest

from lab.colour import HEAT
from lab.heatmap import TALLEST, WIDTH, Panel, draw_heatmap, nice_ticks


def picture(width: int, height: int, levels: int) -> tuple[np.ndarray, list[np.ndarray]]:
    rng = np.random.default_rng(levels)
    counts = [rng.integers(0, 40, (height, width)).astype(np.uint32) for _ in range(levels)]
    seen = np.ones((height, width), bool)
    panels = [Panel(f"level {i}: 12,345 lights, mean 1.23, max 39", values) for i, values in enumerate(counts)]
    return draw_heatmap([Panel("total", sum(counts))], panels, seen), counts


@pytest.mark.parametrize("size", [(32, 18), (1, 1), (7, 300), (2000, 3), (1280, 720)])
@pytest.mark.parametrize("levels", [1, 3, 8, 13])
def test_any_shape_and_number_of_levels_makes_a_page(size: tuple[int, int], levels: int) -> None:
    pixels, _ = picture(*size, levels)
    assert pixels.dtype == np.uint8 and pixels.shape[1] == 2 * 24 + WIDTH + 14 + 18 + 64
    assert pixels.shape[0] < 4 * TALLEST


def test_the_total_is_drawn_at_its_place_in_its_colours() -> None:
    pixels, counts = picture(48, 27, 2)
    total = sum(counts)
    scale = total.max()
    corner, step = (24, 24 + 26), WIDTH // 48
    centres = pixels[corner[1] + step // 2 :: step, corner[0] + step // 2 :: step][:27, :48]
    expected = HEAT[np.rint(total / scale * 255).astype(int)]
    np.testing.assert_array_equal(centres, expected)


def test_totals_share_a_scale() -> None:
    few, many = np.full((9, 16), 5, np.uint32), np.full((9, 16), 10, np.uint32)
    pixels = draw_heatmap([Panel("", few), Panel("", many)], [Panel("", few)], np.ones((9, 16), bool))
    middle = 24 + 26 + 540 // 2
    np.testing.assert_array_equal(pixels[middle, 24 + WIDTH // 2], HEAT[128])
    np.testing.assert_array_equal(pixels[middle + 26 + 540 + 2 * 14, 24 + WIDTH // 2], HEAT[255])


def test_what_is_not_seen_is_grey() -> None:
    counts = np.full((9, 16), 5, np.uint32)
    seen = np.zeros((9, 16), bool)
    pixels = draw_heatmap([Panel("", counts)], [Panel("", counts)], seen)
    inside = pixels[24 + 26 : 24 + 26 + 540, 24 : 24 + WIDTH]
    assert (inside == inside[0, 0]).all() and np.ptp(inside[0, 0].astype(int)) < 8


@pytest.mark.parametrize("top", [1, 2, 3, 7, 45, 240, 999, 1e6, 12_345_678])
@pytest.mark.parametrize("most", [3, 6, 10])
def test_ticks_are_few_round_and_reach_the_top(top: float, most: int) -> None:
    ticks = nice_ticks(top, most)
    step = ticks[1] - ticks[0]
    assert ticks[0] == 0 and ticks[-1] <= top < ticks[-1] + step
    assert 2 <= len(ticks) <= most + 1
    assert f"{step:e}"[0] in "125" and step >= 1
    np.testing.assert_allclose(np.diff(ticks), step)
