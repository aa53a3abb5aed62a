"""The pictures of a comparison show what was compared."""

from __future__ import annotations

import numpy as np
import pytest

from lab.colour import heat
from lab.error_picture import MAGMA, SIGNED, draw_error, draw_flip, draw_side_by_side, round_up
from lab.figure import INK, PAPER
from lab.metrics import flip


def count(page: np.ndarray, colour: np.ndarray | tuple[int, ...]) -> int:
    """How many pixels of a page have exactly this colour."""
    return int((page == np.asarray(colour, np.uint8)).all(axis=-1).sum())


def test_magma_is_the_one_flip_maps_are_known_by() -> None:
    from flip_evaluator import evaluate

    rng = np.random.default_rng(1)
    reference = rng.random((64, 64, 3)).astype(np.float32)
    image = (reference * np.linspace(0, 1, 64)[:, None, None] ** 2).astype(np.float32)
    known = evaluate(reference, image, "HDR")[0]
    error_map = evaluate(reference, image, "HDR", applyMagma=False)[0][..., 0]
    assert error_map.max() - error_map.min() > 0.8, "most of the colours are seen"
    assert np.abs(heat(error_map, 1, MAGMA) / 255 - known).max() < 6 / 255  # One step of 256 is up to 3.


def test_signed_colours_are_white_at_zero_and_darken_evenly_to_blue_and_red() -> None:
    table = SIGNED.astype(int)
    assert table[127:129].min() > 240
    below, above = table[:128][::-1], table[128:]
    for half in (below, above):
        assert (np.diff(half.sum(axis=1)) <= 0).all()
    assert (below[20:, 2] > below[20:, 0] + 20).all() and (above[20:, 0] > above[20:, 2] + 20).all()
    assert np.abs(below.sum(axis=1) - above.sum(axis=1)).max() < 60, "equal errors look equally great"


def test_error_picture_tells_too_bright_from_too_dark() -> None:
    reference = np.full((8, 8, 3), 2.0)
    image = reference.copy()
    image[:, :4] *= 1.1
    image[:, 6:] *= 0.9
    page = draw_error(image, reference, "title")
    scale, error = 0.1, 0.2 / np.sqrt(4 + 0.02**2)
    red, blue, white = (heat(np.array(e + scale), 2 * scale, SIGNED) for e in (error, -error, 0))
    square = (720 // 8) ** 2
    # The bar adds some pixels of each colour.
    assert count(page, red) == pytest.approx(32 * square, rel=0.02)
    assert count(page, blue) == pytest.approx(16 * square, rel=0.02)
    assert count(page, white) == pytest.approx(16 * square, rel=0.02)
    assert red[0] > blue[0] and blue[2] > red[2]


def test_a_black_reference_makes_an_error_picture() -> None:
    page = draw_error(np.ones((4, 4, 3)), np.zeros((4, 4, 3)), "title")
    assert count(page, SIGNED[-1]) > 4 * 4 * 100
    assert (
        count(draw_error(np.zeros((4, 4)), np.zeros((4, 4)), "title"), heat(np.array(1.0), 2.0, SIGNED)) > 4 * 4 * 100
    )


@pytest.mark.parametrize(
    ("value", "top"), [(0, 0.01), (0.01, 0.01), (0.011, 0.02), (0.3, 0.5), (1, 1), (1.01, 2), (9, 2)]
)
def test_scales_are_round_and_have_an_end(value: float, top: float) -> None:
    assert round_up(value) == top


def test_flip_picture_has_the_colours_of_the_map() -> None:
    rng = np.random.default_rng(2)
    reference = rng.random((9, 16, 3))
    error_map = flip(reference * 0.5, reference)[1]
    page = draw_flip(error_map, "title", "subtitle")
    shown = heat(error_map, 1, MAGMA)
    side = 960 // 16
    corner = np.argwhere((page == shown[0, 0]).all(axis=-1)).min(axis=0)
    middles = page[corner[0] + side // 2 :: side, corner[1] + side // 2 :: side][:9, :16]
    np.testing.assert_array_equal(middles, shown)


def test_both_images_are_shown_alike() -> None:
    reference = np.random.default_rng(3).random((6, 10, 3))
    page = draw_side_by_side(reference, reference, ("A", "B"))
    half = (page.shape[1] + 14) // 2 - 24
    left, right = page[80:, 24 : 24 + 960], page[80:, 24 + 960 + 14 : 24 + 960 + 14 + 960]
    assert half > 900
    np.testing.assert_array_equal(left, right)
    darker = draw_side_by_side(reference / 4, reference, ("A", "B"))
    assert darker[80:, 24 : 24 + 960].mean() < 0.7 * left.mean()
    np.testing.assert_array_equal(darker[80:, -24 - 960 : -24], right)


@pytest.mark.parametrize("size", [(1, 1), (1, 900), (900, 1), (3, 2500), (2500, 3), (40, 64)])
@pytest.mark.parametrize("kind", ["light", "signed", "grey", "constant"])
def test_any_shape_and_kind_makes_a_page_of_sane_size(size: tuple[int, int], kind: str) -> None:
    rng = np.random.default_rng(4)
    shape = size if kind == "grey" else (*size, 3)
    reference = np.full(shape, 3.0) if kind == "constant" else rng.random(shape) - (kind == "signed")
    image = reference.copy() if kind == "constant" else reference * rng.uniform(0.5, 2, shape)
    pages = [
        draw_side_by_side(image, reference, ("A: " + "x" * 4000, "B")),
        draw_error(image, reference, "t" * 4000),
        draw_flip(rng.random(size).astype(np.float32), "title", ""),
    ]
    for page in pages:
        assert page.dtype == np.uint8 and page.shape[2] == 3
        assert 100 <= page.shape[0] <= 1600 and 600 <= page.shape[1] <= 4200
        assert count(page, PAPER) > 1000 and count(page[:80], INK) > 0
        assert count(page[:, -4:], PAPER) == 4 * page.shape[0], "nothing reaches the edge"
