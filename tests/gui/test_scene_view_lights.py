"""Lights, levels, cells and a selected light in the 3D view are those of the hierarchy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import lab
from gui.scene_view import SceneView, cells, clouds
from gui.scene_view.actors import ball
from gui.scene_view.colours import BACKGROUND, LEVELS, LOBE, SHELLS
from lab.grid_lights import blend_shells, emission, occupied_cells
from lab.pixel.members import member_shares
from lab.records import Hierarchy

from . import scenes
from .scene_views import actors, shown


def test_levels_are_shown_in_their_colours(view: SceneView, hierarchy: Hierarchy) -> None:
    top = hierarchy.top
    view.show_levels(hierarchy, {1, top}, "level", size=2.0)
    lit = [shown(view, LEVELS[level], 60).sum() for level in range(top + 1)]
    assert lit[1] > 50 and lit[top] > 50
    view.show_levels(hierarchy, {top}, "level")
    assert shown(view, LEVELS[1], 20).sum() < 5
    view.show_levels(hierarchy, set())
    assert (view.screenshot() == BACKGROUND).all()


def test_a_level_is_made_once(view: SceneView, hierarchy: Hierarchy) -> None:
    view.show_levels(hierarchy, {1, 2}, "level")
    made = actors(view)
    for levels in ({1}, {2}, {1, 2}, set()):
        view.show_levels(hierarchy, levels, "level")
        assert actors(view) == made
    view.show_levels(hierarchy, {2}, "deviation")
    assert not actors(view) & made - {view.plotter.renderer}


@pytest.mark.parametrize("colour_by", ["flux", "level", "deviation"])
def test_the_legend_counts_the_lights(view: SceneView, hierarchy: Hierarchy, colour_by: str) -> None:
    view.show_levels(hierarchy, {0, 2}, colour_by)
    block = view._levels.legend
    assert block is not None
    assert [text for _, text in block.rows] == [
        f"level 0 (input): {len(hierarchy.levels[0]):,}",
        f"level 2: {len(hierarchy.levels[2]):,}",
    ]
    assert (block.bar is None) == (colour_by == "level")
    if block.bar:
        assert all(0 <= place <= 1 for place, _ in block.bar.ticks)


def test_brighter_lights_are_larger(hierarchy: Hierarchy) -> None:
    sizes = clouds.sizes_px(np.linspace(-0.5, 1.2, 50))
    assert (np.diff(sizes) >= 0).all() and sizes[0] == clouds.SMALLEST_PX and sizes[-1] == clouds.LARGEST_PX
    assert len(np.unique(sizes)) == 6


def test_clouds_are_thinned_out_while_the_view_moves(view: SceneView, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clouds, "WHILE_MOVING", 100)
    view.show_vpls(scenes.frame().lights)

    def drawn() -> int:
        visible = [a for a in actors(view) if a.IsA("vtkActor") and a.GetVisibility()]
        return sum(actor.GetMapper().GetInput().GetNumberOfPoints() for actor in visible)

    assert drawn() == 600
    view.set_moving(True)
    assert drawn() == 100
    view.show_vpls(scenes.frame().lights)
    assert drawn() == 100, "what is shown while moving is thinned out, too"
    view.set_moving(False)
    assert drawn() == 600


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (({99}, "flux"), r"levels \[99\]: this hierarchy has levels 0 to \d+"),
        (({1}, "fluks"), "colour_by='fluks': .*did you mean 'flux'"),
        (({1}, "flux", 0.0), "size=0.0: allowed is > 0"),
    ],
)
def test_wrong_levels_are_named(view: SceneView, hierarchy: Hierarchy, arguments: Any, message: str) -> None:
    with pytest.raises(lab.LabError, match=message):
        view.show_levels(hierarchy, *arguments)


def test_cells_are_drawn_edge_by_edge_and_never_dropped_in_silence(
    view: SceneView, hierarchy: Hierarchy, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = actors(view)
    assert view.show_cells(hierarchy, hierarchy.top) == ""
    (box,) = actors(view) - before
    assert box.GetMapper().GetInput().GetNumberOfLines() == 12
    side = float(hierarchy.cell_size[hierarchy.top])
    low, high = hierarchy.origin, hierarchy.origin + side
    np.testing.assert_allclose(np.reshape(box.GetBounds(), (3, 2)).T, [low, high], rtol=1e-5)
    found, lights = occupied_cells(hierarchy, 2)
    monkeypatch.setattr(cells, "MOST", 3)
    note = view.show_cells(hierarchy, 2)
    assert note == f"3 of {len(found)} cells of level 2 are shown: those with most lights"
    (box,) = actors(view) - before
    fullest = found[np.argsort(-lights, kind="stable")[:3]]
    corners = hierarchy.origin + np.concatenate([fullest, fullest + 1]) * float(hierarchy.cell_size[2])
    np.testing.assert_allclose(
        np.reshape(box.GetBounds(), (3, 2)).T, [corners.min(axis=0), corners.max(axis=0)], rtol=1e-4, atol=1e-5
    )
    view.show_cells(hierarchy, None)
    assert actors(view) == before


def test_a_selected_light_is_taken_apart(view: SceneView, hierarchy: Hierarchy) -> None:
    index = int(hierarchy.offset[2]) + 1
    params = lab.Params(alpha=0.7, lobe="mean_energy")
    members = member_shares(hierarchy, index)
    before = actors(view)
    view.select_light(hierarchy, index, params, members)
    parts = {
        tuple(round(255 * c) for c in actor.GetProperty().GetColor()): actor
        for actor in actors(view) - before
        if actor.GetMapper().GetInput().GetNumberOfPolys()
    }
    centre = hierarchy.position[index]
    for name, radius in blend_shells(hierarchy, params, 2).items():
        points = np.array(parts[SHELLS[name]].GetMapper().GetInput().points)
        np.testing.assert_allclose(np.linalg.norm(points - centre, axis=1), radius, rtol=1e-4)
    lobe = np.array(parts[LOBE].GetMapper().GetInput().points).astype(np.float64) - centre
    sphere, _ = ball(48, 24)
    reach = 0.5 * float(hierarchy.cell_size[2])
    expected = reach * emission(hierarchy, index, sphere, params)[:, None] * sphere
    np.testing.assert_allclose(lobe, expected, atol=1e-5)
    block = view._selected.legend
    assert block is not None and block.title == f"light {index:,} of level 2"
    assert f"members: {len(members[0]):,}" in [text for _, text in block.rows]
    view.select_light(hierarchy, None)
    assert actors(view) == before
    with pytest.raises(lab.LabError, match="merged indices"):
        view.select_light(hierarchy, 10**8)


def test_input_lights_can_be_selected_too(view: SceneView, hierarchy: Hierarchy) -> None:
    view.select_light(hierarchy, 0, lab.Params(first_level=1), member_shares(hierarchy, 0))
    block = view._selected.legend
    assert block is not None and "members: 1" in [text for _, text in block.rows]
    assert not any("blend radius" in text for _, text in block.rows), "level 0 is not drawn: no shells"
