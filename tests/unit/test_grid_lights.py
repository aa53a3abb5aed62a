"""One grid light as a shape: its level, shells, emission; and the cells that hold lights."""

from __future__ import annotations

import numpy as np
import pytest

import lab
from lab.grid_lights import blend_shells, emission, level_of, occupied_cells, relative_deviation

from ..oracle import cases, pure


@pytest.fixture(scope="module")
def hierarchy() -> lab.Hierarchy:
    return lab.build_hierarchy(cases.mixed_cloud(), lab.Params(levels=4, shadow_samples=0))


def test_each_light_knows_its_level(hierarchy: lab.Hierarchy) -> None:
    levels = [level_of(hierarchy, i) for i in range(len(hierarchy.position))]
    assert levels == np.repeat(np.arange(hierarchy.top + 1), np.diff(hierarchy.offset)).tolist()


@pytest.mark.parametrize("index", [-1, 10**9])
def test_a_light_that_does_not_exist_is_named(hierarchy: lab.Hierarchy, index: int) -> None:
    with pytest.raises(lab.LabError, match=rf"light {index}: merged indices .* from 0 to \d+"):
        level_of(hierarchy, index)


@pytest.mark.parametrize("first_level", [0, 1])
def test_the_weight_bends_at_the_shells_and_nowhere_else(hierarchy: lab.Hierarchy, first_level: int) -> None:
    params = lab.Params(alpha=1.5, first_level=first_level)
    for level in range(hierarchy.top + 1):
        shells = blend_shells(hierarchy, params, level)
        if level < first_level:
            assert shells == {}
            continue
        radius = params.alpha * float(hierarchy.cell_size[level])
        distance = np.linspace(0, 3 * radius, 3001)
        weight = pure.blend_weight(distance, radius, level == first_level, level == hierarchy.top)
        bends = distance[1:-1][np.abs(np.diff(weight, 2)) > 1e-6]
        for shell in shells.values():
            assert np.abs(bends - shell).min() < 2e-3 * radius
        for place in bends:
            assert min(abs(place - r) for r in shells.values()) < 2e-3 * radius
    with pytest.raises(lab.LabError, match="level 5: this hierarchy has levels 0 to 4"):
        blend_shells(hierarchy, params, 5)


@pytest.mark.parametrize("lobe", ["moments", "mean_energy", "mean"])
def test_emission_is_the_lobe_of_its_definition(hierarchy: lab.Hierarchy, lobe: str) -> None:
    directions = cases.unit_vectors(np.random.default_rng(1), 64)
    for index in (0, 3, int(hierarchy.offset[1]), int(hierarchy.offset[3]), len(hierarchy.position) - 1):
        expected = pure.emission(
            directions, lobe, hierarchy.normal[index], hierarchy.normal_moment[index], bool(hierarchy.oriented[index])
        )
        found = emission(hierarchy, index, directions, lab.Params(lobe=lobe))
        np.testing.assert_allclose(found, expected, rtol=2e-5, atol=2e-6)


def test_directions_must_be_unit_vectors(hierarchy: lab.Hierarchy) -> None:
    with pytest.raises(lab.LabError, match="directions: every row must have length 1"):
        emission(hierarchy, 0, [[1, 1, 0]])


def test_deviation_is_relative_to_the_cell(hierarchy: lab.Hierarchy) -> None:
    found = relative_deviation(hierarchy)
    for level in hierarchy.levels:
        rows = slice(*hierarchy.offset[level.level : level.level + 2])
        expected = np.linalg.norm(level.deviation.astype(np.float64), axis=1) / level.cell_size
        np.testing.assert_allclose(found[rows], expected, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("lights", [cases.cloud(seed=2), cases.on_faces(), cases.with_black()])
def test_cells_hold_the_lights_that_lie_in_them(lights: lab.Lights) -> None:
    hierarchy = lab.build_hierarchy(lights, lab.Params(levels=4, shadow_samples=0))
    position = hierarchy.position[: hierarchy.offset[1]].astype(np.float64)
    for level in range(1, hierarchy.top + 1):
        size = float(hierarchy.cell_size[level])
        cells, counts = occupied_cells(hierarchy, level)
        assert counts.sum() == len(position) and (counts > 0).all() and cells.min() >= 0
        assert cells.max() < 2 ** (hierarchy.top - level)
        assert len(np.unique(cells, axis=0)) == len(cells)
        assert cells.tolist() == sorted(cells.tolist(), key=lambda cell: cell[::-1])
        # Of a light on a face either cell may hold it: counted with and without a small margin.
        for cell, count in zip(cells, counts, strict=True):
            low = hierarchy.origin + cell * size
            away = np.maximum(low - position, position - (low + size)).max(axis=1)
            assert (away < -1e-5).sum() <= count <= (away < 1e-5).sum()


@pytest.mark.parametrize("level", [0, 5])
def test_only_grids_have_cells(hierarchy: lab.Hierarchy, level: int) -> None:
    with pytest.raises(lab.LabError, match=f"cells of level {level}: the grids of this hierarchy are levels 1 to 4"):
        occupied_cells(hierarchy, level)
