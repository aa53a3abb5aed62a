"""Layers of a frame: which there are, and that their values are the records'."""

from __future__ import annotations

import numpy as np
import pytest

from gui.layers import LAYERS, FrameLayers, find_layer, layer_names, layer_values, value_at
from lab.colour import luminance
from lab.errors import LabError
from lab.image_io import frame_channels
from lab.layers import known_names
from lab.metrics import flip, rel_mse, relative_error
from lab.pixel_layers import level_irradiance, picked_level, ratio_of
from lab.records import Frame
from lab.survey import leak_map, shadow_distribution

from .scenes import SIZE, engine, frame, reference

WIDTH, HEIGHT = SIZE


def test_values_are_those_of_the_exr_file() -> None:
    made = frame(interleave=2)
    layers = FrameLayers(made)
    channels = frame_channels(made)
    compared = set()
    for name, plane in channels.items():
        base, _, component = name.rpartition(".")
        layer = base if component in "RGBXYZ" else name
        values = layers.values(layer)
        at = "RGB".find(component) if component in "RGB" else "XYZ".find(component)
        own = values[..., at] if values.ndim == 3 else values
        assert np.array_equal(own, plane), name
        compared.add(layer)
    assert {"colour", "indirect", "shadow_ratio", "depth", "position", "overdraw", "overdraw.L0"} <= compared


@pytest.mark.parametrize("name", ["colour", "albedo", "emission", "irradiance", "area_noisy", "depth"])
def test_values_are_the_records_own_arrays(name: str) -> None:
    made = frame(interleave=2)
    own = {
        "colour": made.image.colour,
        "albedo": made.gbuffer.albedo,
        "emission": made.gbuffer.emission,
        "irradiance": made.lighting.irradiance,
        "area_noisy": made.shadows.area,
        "depth": made.gbuffer.depth,
    }
    assert np.shares_memory(layer_values(made, name), own[name])


def test_a_frame_has_the_layers_of_its_settings() -> None:
    plain = layer_names(frame())
    assert "tile" not in plain and "left_out" not in plain and "error.colour" not in plain
    assert not [name for name in plain if name.startswith("level_light")]
    tiled = layer_names(frame(interleave=2, compensation="path"), engine())
    assert {"tile", "irradiance", "left_out", "left_out_noisy", "level_light.L0"} <= set(tiled)
    assert "overdraw.L0" not in layer_names(frame(first_level=1))
    assert "picked_level.3" in plain and "picked_level.4" not in plain
    without = layer_names(frame(shadow_samples=0))
    assert "shadow_ratio" in without and "shadow_ratio_noisy" not in without and "entropy" not in without
    assert not [name for name in layer_names(frame(counts=False)) if name.startswith("overdraw")]
    judged = set(layer_names(frame(), None, reference()))
    assert {"error.colour", "flip.indirect", "reference.unshadowed"} <= judged and "flip.unshadowed" not in judged


@pytest.mark.parametrize("settings", [{}, {"interleave": 4, "shadow_estimator": "ratio_rgb", "compensation": "path"}])
def test_every_layer_has_values_of_the_frames_size(settings: dict[str, object]) -> None:
    layers = FrameLayers(frame(**settings), engine(), reference())
    assert len(layers.names) == len(set(layers.names))
    for name in layers.names:
        values, layer = layers.values(name), find_layer(name)
        assert values.shape[:2] == (HEIGHT, WIDTH), name
        assert values.ndim == (3 if layer.kind in ("light", "colour", "direction", "position") else 2), name
        assert layers.values(name) is values


def test_what_is_missing_is_explained() -> None:
    cases: list[tuple[Frame, str, str]] = [
        (frame(), "overdrow", "no layer 'overdrow'; did you mean 'overdraw'"),
        (frame(), "overdraw.L12", "draws the levels 0 to"),
        (frame(), "picked_level.4", "has 4 picks a pixel"),
        (frame(counts=False), "overdraw", "counts=True"),
        (frame(), "tile", "interleave=1"),
        (frame(), "left_out", "compensation=none"),
        (frame(), "error.colour", "needs a reference"),
        (frame(), "level_light.L0", "needs the engine"),
        (frame(shadow_samples=0), "entropy", "shadow_samples=0"),
    ]
    for made, name, said in cases:
        with pytest.raises(LabError, match=said):
            layer_values(made, name)
    other = reference()
    with pytest.raises(LabError, match="one size"):
        FrameLayers(
            frame(),
            None,
            type(other)(**{**vars(other), "direct": np.zeros((2, 3, 3)), "indirect": np.zeros((2, 3, 3))}),
        )


@pytest.mark.parametrize("settings", [{}, {"interleave": 4}, {"first_level": 1, "alpha": 2.0}])
def test_light_of_the_levels_sums_to_that_of_the_frame(settings: dict[str, object]) -> None:
    layers = FrameLayers(frame(**settings), engine())
    parts = [layers.values(name).astype(np.float64) for name in layers.names if name.startswith("level_light")]
    whole = layers.frame.lighting.irradiance
    assert len(parts) == layers.frame.hierarchy.top + 1 - layers.frame.params.first_level
    np.testing.assert_allclose(sum(parts), whole, rtol=1e-4, atol=1e-5 * whole.max())


def test_a_level_that_is_not_there() -> None:
    with pytest.raises(LabError, match="levels 0 to"):
        level_irradiance(engine(), frame(), 40)


def test_picks_by_hand() -> None:
    made = frame(first_shadow_level=1)
    layers, light, f, total = (
        FrameLayers(made),
        made.lighting.light,
        made.lighting.target_weight,
        made.lighting.weight_sum,
    )
    for y, x in np.ndindex(HEIGHT, WIDTH):
        surprise = []
        for s in range(made.params.shadow_samples):
            level, p = layers.values(f"picked_level.{s}")[y, x], layers.values(f"pick_probability.{s}")[y, x]
            if light[y, x, s] < 0:
                assert level == -1 and np.isnan(p)
                continue
            assert made.hierarchy.offset[level] <= light[y, x, s] < made.hierarchy.offset[level + 1]
            assert p == pytest.approx(f[y, x, s] / total[y, x], rel=1e-6)
            surprise.append(-np.log2(float(p)))
        found = layers.values("entropy")[y, x]
        assert np.isnan(found) if not surprise else found == pytest.approx(np.mean(surprise), rel=1e-5, abs=1e-6)
    survey = shadow_distribution(made)
    for name in ("entropy", "effective_lights", "mean_level", "blocked"):
        assert np.array_equal(layers.values(name), getattr(survey, name), equal_nan=True), name
    assert (picked_level(made.hierarchy, made.lighting) >= 1).sum() > HEIGHT * WIDTH


@pytest.mark.parametrize("estimator", ["ratio", "ratio_rgb", "average"])
def test_the_ratio_before_the_filter(estimator: str) -> None:
    shadows = frame(shadow_estimator=estimator).shadows
    found = ratio_of(shadows)
    for y, x in np.ndindex(HEIGHT, WIDTH):
        s, u = shadows.shadowed[y, x].astype(np.float64), shadows.weight[y, x].astype(np.float64)
        expected = float(luminance(s / u)) if (u > 0).all() else np.nan
        assert found[y, x] == pytest.approx(expected, rel=1e-5, abs=1e-7, nan_ok=True)


def test_tiles() -> None:
    tile = layer_values(frame(interleave=4), "tile")
    assert all(tile[y, x] == (y % 4) * 4 + x % 4 for y, x in np.ndindex(HEIGHT, WIDTH))


def test_comparisons_are_those_of_the_metrics() -> None:
    made, truth = frame(), reference()
    layers = FrameLayers(made, None, truth)
    seen = layers.seen
    assert not seen.all() and seen.any()
    for part, own in (("indirect", made.image.indirect), ("unshadowed", made.image.unshadowed)):
        error = relative_error(luminance(own.astype(np.float64)), luminance(getattr(truth, part)))
        assert np.array_equal(layers.values(f"error.{part}"), error)
    assert np.array_equal(layers.values("error.indirect")[seen], leak_map(made, truth).error[seen])
    # The background is the same on both sides.
    assert (layers.values("error.colour")[~seen] == 0).all()
    both = layers.values("colour"), layers.values("reference.colour")
    assert np.array_equal(layers.values("flip.colour"), flip(*both)[1])
    grey = [luminance(np.asarray(x, np.float64)) for x in both]
    assert np.mean(layers.values("error.colour") ** 2) == pytest.approx(rel_mse(*grey))


def test_read_outs() -> None:
    layers = FrameLayers(frame(interleave=2), engine(), reference())
    y, x = (int(i) for i in np.argwhere(layers.seen)[len(np.argwhere(layers.seen)) // 2])
    for name in layers.names:
        assert value_at(layers, name, x, y), name
    r, g, b = layers.values("colour")[y, x]
    assert value_at(layers, "colour", x, y).startswith(f"({r:.4g}  {g:.4g}  {b:.4g}) radiance, luminance ")
    count = int(layers.values("overdraw.L1")[y, x])
    assert value_at(frame(interleave=2), "overdraw.L1", x, y) == f"{count} light{'' if count == 1 else 's'}"
    assert value_at(layers, "depth", x, y) == f"{layers.values('depth')[y, x]:.4g} scene units"
    assert value_at(layers, "tile", x, y) == f"tile {(y % 2) * 2 + x % 2}"
    assert value_at(layers, "error.indirect", x, y).endswith(" %")
    assert value_at(layers, "picked_level.0", x, y) in {f"level {level}" for level in range(13)}
    sky_y, sky_x = (int(i) for i in np.argwhere(~layers.seen)[0])
    assert value_at(layers, "depth", sky_x, sky_y) == "background"
    assert value_at(layers, "colour", sky_x, sky_y).startswith("(0.2  0.3  0.5) radiance")
    for where in ((WIDTH, 0), (0, HEIGHT), (-1, 0)):
        with pytest.raises(LabError, match="outside of the image: x from 0 to 39, y from 0 to 23"):
            value_at(layers, "colour", *where)


def test_every_layer_is_described() -> None:
    for name in {*LAYERS, *known_names(range(3), 2)}:
        layer = find_layer(name)
        assert layer.name == name and layer.title and layer.doc and layer.group
        assert not layer.doc.endswith(".") and len(layer.title) <= 44
