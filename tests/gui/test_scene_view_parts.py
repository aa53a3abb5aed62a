"""Parts of the 3D view without a window: the legend's picture, the sphere, colours."""

from __future__ import annotations

import numpy as np
import pytest

from gui.scene_view.actors import ball, circles
from gui.scene_view.colours import LEVELS, RAMP, hues, ramp_colours
from gui.scene_view.legend import Bar, Block, draw_legend
from gui.scene_view.picking import nearest_light

BLOCKS = [
    Block("camera", [((1, 200, 30), "main, 640 x 360")]),
    Block(
        "grid lights", [(LEVELS[i], f"level {i}: {10**i:,}") for i in range(8)], Bar("flux", RAMP, [(0, "a"), (1, "b")])
    ),
    Block("keys", [(None, "0 ... 9\tlevel on or off")]),
]


@pytest.mark.parametrize("tallest", [60, 200, 300, 600])
def test_the_legend_fits_and_its_blocks_stand_apart(tallest: int) -> None:
    page = draw_legend(BLOCKS, tallest)
    assert page.shape[2] == 4 and page.dtype == np.uint8
    highest = max(block.height for block in BLOCKS)
    assert page.shape[0] <= max(tallest, highest + 16)
    for colour, _ in [*BLOCKS[0].rows, *BLOCKS[1].rows]:
        assert (page[..., :3] == colour).all(axis=-1).sum() >= 60, "each swatch is seen whole"


def test_the_legend_of_one_block_is_small() -> None:
    page = draw_legend(BLOCKS[:1], 400)
    assert page.shape[0] < 60 and page.shape[1] < 160


@pytest.mark.parametrize(("columns", "rows"), [(8, 3), (32, 16), (48, 24)])
def test_the_ball_is_closed_and_faces_outward(columns: int, rows: int) -> None:
    vertices, triangles = ball(columns, rows)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", normal, a + b + c) > 0).all()
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    assert len({tuple(edge) for edge in edges}) == len(edges)
    assert {tuple(edge) for edge in edges} == {tuple(edge[::-1]) for edge in edges}
    assert len(vertices) - len(edges) // 2 + len(triangles) == 2
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    assert volume == pytest.approx(4 * np.pi / 3, rel=0.4 if rows == 3 else 0.02)


def test_circles_lie_on_their_sphere() -> None:
    ends = circles((1, 2, 3), 0.5)
    np.testing.assert_allclose(np.linalg.norm(ends - [1, 2, 3], axis=-1), 0.5)


def test_colours_stand_out_from_the_background() -> None:
    assert RAMP.astype(int).sum(axis=1).min() > 150
    np.testing.assert_array_equal(ramp_colours(np.array([-1.0, 0, 1, 2])), RAMP[[0, 0, -1, -1]])
    assert len(set(LEVELS)) == 13
    dim, bright = hues(np.array([[1.0, 0.5, 0], [0, 0, 0]]), np.array([0.0, 1.0]))
    assert dim[0] > 80 and dim[0] > dim[1] > dim[2] == 0
    assert bright.tolist() == [255, 255, 255], "a light without flux has no hue"


def test_of_lights_under_a_place_the_nearest_comes_first() -> None:
    pixels = np.array([[10.0, 10], [11, 10], [10, 10.2], [30, 10], [10, 10]])
    depth = np.array([5.0, 1, 3, 1, -1])
    radius = np.array([2.0, 2, 2, 25, 2])
    assert nearest_light((10, 10), pixels, depth, radius, 6.0).tolist() == [2, 0, 1, 3]
    assert nearest_light((100, 100), pixels, depth, radius, 6.0).size == 0
