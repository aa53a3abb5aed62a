"""Exports hold every level, unchanged, in each format; nothing is half-written."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lab.errors import LabError
from lab.export import FIELDS, display_colours, export_hierarchy
from lab.records import Hierarchy

COUNTS = (50, 12, 8)
METADATA = {"params": '{"alpha": 1.0}', "scene": "Café"}


@pytest.fixture
def hierarchy() -> Hierarchy:
    rng = np.random.default_rng(3)
    total = sum(COUNTS)

    def rows(columns: int) -> np.ndarray:
        return rng.random((total, columns)).astype(np.float32)

    return Hierarchy(
        origin=np.zeros(3, np.float32),
        cell_size=np.array([0.5, 1, 2], np.float32),
        offset=np.cumsum([0, *COUNTS]).astype(np.int64),
        position=rows(3),
        flux=rows(3),
        normal=rows(3) - np.float32(0.5),
        normal_moment=rows(6),
        deviation=rows(3),
        vertex=np.zeros((total, 3), np.uint16),
        oriented=np.ones(total, np.uint8),
        input_index=rng.permutation(COUNTS[0]).astype(np.uint32),
    )


def test_npz_has_every_field_of_every_level(tmp_path: Path, hierarchy: Hierarchy) -> None:
    path = tmp_path / "new" / "h.npz"
    assert export_hierarchy(path, hierarchy, METADATA) == [path]
    with np.load(path, allow_pickle=False) as saved:
        for level in hierarchy.levels:
            for name in ("position", *FIELDS):
                np.testing.assert_array_equal(saved[f"L{level.level}_{name}"], getattr(level, name))
            assert saved[f"L{level.level}_cell_size"] == level.cell_size
        np.testing.assert_array_equal(saved["input_index"], hierarchy.input_index)
        assert json.loads(str(saved["metadata"])) == METADATA
    assert list(path.parent.iterdir()) == [path]


def test_ply_is_one_cloud_with_fields(tmp_path: Path, hierarchy: Hierarchy) -> None:
    import open3d as o3d

    path = tmp_path / "h.ply"
    export_hierarchy(path, hierarchy, METADATA)
    cloud = o3d.t.io.read_point_cloud(path).point
    np.testing.assert_array_equal(cloud["positions"].numpy(), hierarchy.position)
    np.testing.assert_array_equal(cloud["level"].numpy()[:, 0], np.repeat(range(len(COUNTS)), COUNTS))
    flux = np.concatenate([cloud[f"flux_{c}"].numpy() for c in "rgb"], axis=1)
    np.testing.assert_array_equal(flux, hierarchy.flux)
    normal = cloud["normals"].numpy() * cloud["normal_length"].numpy()
    np.testing.assert_allclose(normal, hierarchy.normal, atol=1e-6)
    np.testing.assert_array_equal(cloud["cell_size"].numpy()[:, 0], np.repeat(hierarchy.cell_size, COUNTS))
    assert list(tmp_path.iterdir()) == [path]


def test_vtm_has_one_block_a_level(tmp_path: Path, hierarchy: Hierarchy) -> None:
    import pyvista

    path = tmp_path / "h.vtm"
    stranger = tmp_path / "h" / "keep.txt"
    stranger.parent.mkdir()
    stranger.write_text("mine")
    for _ in range(2):
        files = export_hierarchy(path, hierarchy, METADATA)
    assert all(file.is_file() for file in files) and files[0] == path
    blocks = pyvista.read(path)
    assert blocks.keys() == ["L0", "L1", "L2"]
    for level, block in zip(hierarchy.levels, blocks, strict=True):
        np.testing.assert_array_equal(block.points, level.position)
        for name in FIELDS:
            np.testing.assert_array_equal(block.point_data[name], getattr(level, name))
        assert block.field_data["level"][0] == level.level
        assert block.field_data["scene"][0] == "Caf\\xe9"
    assert stranger.read_text() == "mine"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["h", "h.vtm"]


@pytest.mark.parametrize("name", ["h.vtu", "h", "h.npzz", "h.exr"])
def test_other_endings_are_refused(tmp_path: Path, hierarchy: Hierarchy, name: str) -> None:
    with pytest.raises(LabError, match=r"\.vtm, \.npz, \.ply"):
        export_hierarchy(tmp_path / name, hierarchy, METADATA)
    assert not list(tmp_path.iterdir())


def test_vtm_without_pyvista_names_the_extra(
    tmp_path: Path, hierarchy: Hierarchy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(LabError, match="make setup EXTRA=gui"):
        export_hierarchy(tmp_path / "h.vtm", hierarchy, METADATA)


def test_display_colours_use_their_range() -> None:
    flux = np.geomspace(1e-9, 1e-6, 100)[:, None] * np.ones(3)
    colours = display_colours(flux)
    assert colours.min() < 60 and colours.max() > 180
    assert display_colours(np.zeros((4, 3))).max() == 0
    assert display_colours(np.zeros((0, 3))).shape == (0, 3)
