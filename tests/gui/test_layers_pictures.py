"""Layers as pictures: colours, scales, legends, wipes, files."""

from __future__ import annotations

import base64
import io
import json
import math

import numpy as np
import pytest
from PIL import Image

from gui.layers import (
    COLOUR_MAPS,
    FrameLayers,
    data_url,
    draw_layer,
    find_layer,
    jpeg_bytes,
    layer_picture,
    png_bytes,
    scale_for,
)
from gui.layers.colour_maps import UNKNOWN, table
from gui.layers.scale import Scale
from gui.legend import draw_legend, even_ticks, legend, log_ticks
from gui.wipe import difference, wipe
from lab.colour import HEAT, heat, to_bytes
from lab.error_picture import SIGNED
from lab.errors import LabError
from lab.level_colours import LEVEL_COLOURS, rgb
from lab.metrics import relative_error
from lab.pixel_stats import pixel_stats

from .scenes import SIZE, engine, frame, reference

WIDTH, HEIGHT = SIZE
RNG = np.random.default_rng(5)


def layers() -> FrameLayers:
    return FrameLayers(frame(interleave=2), engine(), reference())


def test_every_layer_can_be_drawn() -> None:
    own = layers()
    for name in own.names:
        shown = layer_picture(own, name, exposure=0.7)
        assert shown.pixels.shape == (HEIGHT, WIDTH, 3) and shown.pixels.dtype == np.uint8, name
        strip = draw_legend(shown.legend, 500)
        assert strip.shape[1:] == (500, 3) and np.ptp(strip) > 100, name
        json.dumps(shown.legend.to_dict(), allow_nan=False)
        if shown.stats is not None:
            json.dumps(shown.stats.to_dict(), allow_nan=False)
        if shown.scale is not None:
            assert 2 <= len(shown.legend.ticks) <= 8, (name, shown.legend.ticks)
            assert all(-1e-3 <= tick.place <= 1 + 1e-3 for tick in shown.legend.ticks), name


def test_light_is_shown_through_the_tone_map() -> None:
    own = layers()
    assert np.array_equal(layer_picture(own, "colour", exposure=2.0).pixels, to_bytes(own.values("colour"), 2.0))
    seen = own.seen
    shown = layer_picture(own, "unshadowed", exposure=2.0)  # irradiance: as a white surface sends it on
    assert np.array_equal(shown.pixels[seen], to_bytes(own.values("unshadowed"), 2.0 / math.pi)[seen])
    assert shown.legend.note == "exposure 2 / pi"


def test_counts_are_shown_as_in_the_heatmap() -> None:
    own = layers()
    counts = own.values("overdraw")
    shown = layer_picture(own, "overdraw")
    assert shown.scale is not None and (shown.scale.low, shown.scale.high) == (0, counts[own.seen].max())
    assert np.array_equal(shown.pixels[own.seen], heat(counts, float(counts[own.seen].max()))[own.seen])


def test_what_has_no_value_is_grey() -> None:
    values = np.array([[0.0, 1.0], [np.nan, np.inf]], np.float32)
    pixels = draw_layer(values, "scalar")
    assert tuple(pixels[0, 0]) == tuple(HEAT[0]) and tuple(pixels[0, 1]) == tuple(HEAT[-1])
    assert {tuple(pixels[1, 0]), tuple(pixels[1, 1])} <= set(UNKNOWN)
    own = layers()
    grey = np.array(UNKNOWN)
    for name in ("depth", "normal", "overdraw", "shadow_ratio", "picked_level.0", "error.indirect"):
        pixels = layer_picture(own, name).pixels[~own.seen]
        assert (pixels[:, None] == grey).all(axis=-1).any(axis=-1).all(), name
    unseen = np.zeros((2, 2), bool)
    assert {tuple(p) for p in draw_layer(np.ones((2, 2, 3)), "light", seen=unseen).reshape(-1, 3)} <= set(UNKNOWN)


def test_scales() -> None:
    values = np.array([[0.1, 1.0], [10.0, 100.0]], np.float32)
    ratio = find_layer("depth")
    even = scale_for(ratio, values)
    assert (even.low, even.high) == (pytest.approx(0.1), 100)
    log = scale_for(ratio, values, log=True)
    np.testing.assert_allclose(log.place(values), [[0, 1 / 3], [2 / 3, 1]], atol=1e-6)
    assert np.array_equal(log.colours(values)[1, 0], table("viridis")[170])
    counted = scale_for(find_layer("overdraw"), np.array([[0, 3], [8, 2]]), log=True)
    assert (counted.low, counted.high, counted.beyond_low) == (2, 8, True)
    cut = scale_for(ratio, values, low=0.5, high=20)
    assert cut.beyond_low and cut.beyond_high and cut.place(np.array(20.25)) == pytest.approx(1.0128, abs=1e-4)
    flat = scale_for(ratio, np.full((2, 2), 3.0))
    assert flat.low <= 3 < flat.high
    assert scale_for(find_layer("overdraw"), np.zeros((2, 2), np.uint32)).high == 1
    nothing = scale_for(ratio, np.full((2, 2), np.nan))
    assert nothing.low < nothing.high
    signed = scale_for(find_layer("error.colour"), np.array([[-0.03, 0.01]]))
    assert (signed.low, signed.high) == (-0.05, 0.05)


def test_scales_that_can_not_be() -> None:
    values = np.ones((2, 2))
    cases = [
        ({"low": 2.0, "high": 1.0}, "low end must lie under"),
        ({"low": float("nan")}, "low end must lie under"),
        ({"low": -1.0, "log": True}, "must begin over 0"),
        ({"colour_map": "gray"}, "there are heat, grey.*did you mean 'grey'"),
    ]
    for options, said in cases:
        with pytest.raises(LabError, match=said):
            draw_layer(values, "scalar", **options)
    with pytest.raises(LabError, match=r"light takes \(H, W, 3\) values, got \(2, 2\)"):
        draw_layer(values, "light")
    with pytest.raises(LabError, match="unknown kind"):
        draw_layer(np.ones((2, 2, 3)), "heat")


@pytest.mark.parametrize("name", COLOUR_MAPS)
def test_colour_maps(name: str) -> None:
    colours = table(name)
    assert colours.shape == (256, 3) and colours.dtype == np.uint8
    places = np.linspace(0, 1, 256, dtype=np.float32)[None]
    assert np.array_equal(draw_layer(places, "scalar", colour_map=name, low=0, high=1)[0], colours)


def test_ticks_are_round() -> None:
    assert even_ticks(0, 60) == [0, 10, 20, 30, 40, 50, 60]
    assert even_ticks(0, 3, whole=True) == [0, 1, 2, 3]
    assert even_ticks(-0.05, 0.05) == [-0.04, -0.02, 0, 0.02, 0.04]
    assert log_ticks(0.01, 100) == [0.01, 0.1, 1, 10, 100]
    assert log_ticks(3, 40) == [5, 10, 20]
    for low, high in RNG.uniform(-3, 3, (50, 2)):
        if low < high:
            ticks = even_ticks(low, high)
            assert 2 <= len(ticks) <= 7 and low - 1e-6 <= ticks[0] and ticks[-1] <= high + 1e-6
            ticks = log_ticks(10**low, 10**high)
            assert 2 <= len(ticks) <= 8


def test_legends_say_what_lies_beyond() -> None:
    scale = Scale(0, 1, "grey", beyond_high=True)
    shown = legend(find_layer("shadow_ratio"), scale=scale)
    assert [tick.text for tick in shown.ticks] == ["0", "0.2", "0.4", "0.6", "0.8", "> 1"]
    assert shown.ramp[0] == "#000000" and shown.ramp[-1] == "#ffffff" and shown.css.startswith("linear-gradient(")
    error = legend(find_layer("error.colour"), scale=Scale(-0.5, 0.5, "signed"))
    assert [tick.text for tick in error.ticks] == ["-40", "-20", "0", "+20", "+40"] and error.unit == "%"


def test_light_legends_name_round_radiances_where_they_look_so() -> None:
    shown = legend(find_layer("colour"), exposure=3.0)
    ramp = np.array([rgb(colour) for colour in shown.ramp])
    for tick in shown.ticks:
        bar = np.interp(tick.place * (len(ramp) - 1), np.arange(len(ramp)), ramp[:, 0])
        assert bar == pytest.approx(to_bytes(np.full(3, float(tick.text)), 3.0)[0], abs=3)


def test_categories_have_the_colours_of_their_legend() -> None:
    own = layers()
    shown = layer_picture(own, "picked_level.0")
    level = own.values("picked_level.0")
    swatches = {text: colour for colour, text in shown.legend.swatches}
    for y, x in np.argwhere(own.seen & (level >= 0))[::37]:
        assert tuple(shown.pixels[y, x]) == rgb(swatches[f"level {level[y, x]}"]) == rgb(LEVEL_COLOURS[level[y, x]])
    many = layer_picture(FrameLayers(frame(interleave=8)), "tile").legend
    assert many.swatches == () and many.note == "tiles 0 to 63"


def test_wipe() -> None:
    a, b = np.zeros((60, 100, 3), np.uint8), np.full((60, 100, 3), 200, np.uint8)
    both = wipe(a, b, 0.4, ("one", "two"))
    assert (both[30:, :37] == 0).all() and (both[30:, 43:] == 200).all() and (both[30:, 39:41] == 255).all()
    assert np.array_equal(wipe(a, b, 0, ("", ""))[:, 3:], b[:, 3:])
    assert np.array_equal(wipe(a, b, 1, ("", ""))[:, :-3], a[:, :-3])
    assert (both[:25, :40] != 0).any(), "the label"
    with pytest.raises(LabError, match="one size"):
        wipe(a, b[:10], 0.5)
    with pytest.raises(LabError, match="from 0 to 1"):
        wipe(a, b, 1.5)


def test_differences() -> None:
    own = layers()
    light = find_layer("indirect")
    found = difference(own.values("indirect"), own.values("reference.indirect"), light, own.seen)
    assert np.array_equal(found.values, own.values("error.indirect"))
    depth = find_layer("depth")
    a, b = np.array([[1.0, 2.0, 3.0]]), np.array([[1.0, 4.0, 2.0]])
    found = difference(a, b, depth)
    assert found.values.tolist() == [[0, -2, 1]] and found.legend.unit == "scene units"
    assert np.array_equal(found.pixels[0, 1], SIGNED[0])
    assert np.abs(found.pixels[0, 0].astype(int) - SIGNED[128]).max() <= 1
    same = difference(a, a, depth)
    assert (same.values == 0).all()
    normal = difference(np.zeros((1, 1, 3)), np.array([[[0.1, -0.5, 0.2]]]), find_layer("normal"))
    assert normal.values.tolist() == [[0.5]]
    with pytest.raises(LabError, match="one size"):
        difference(a, b[:, :2], depth)
    assert relative_error(a, b)[0, 1] == pytest.approx(-0.5, rel=1e-3)


def test_files_in_memory() -> None:
    pixels = RNG.integers(0, 256, (36, 64, 3), np.uint8)
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(png_bytes(pixels)))), pixels)
    smooth = np.broadcast_to(np.arange(64, dtype=np.uint8)[None, :, None] * 3, (36, 64, 3))
    back = np.asarray(Image.open(io.BytesIO(jpeg_bytes(smooth))))
    assert np.abs(back.astype(int) - smooth).max() <= 4
    kind, data = data_url(pixels).split(",")
    assert kind == "data:image/png;base64" and base64.b64decode(data) == png_bytes(pixels)
    assert data_url(pixels, jpeg=True).startswith("data:image/jpeg;base64,")


def test_statistics() -> None:
    values = RNG.normal(size=(30, 40)).astype(np.float32)
    values[0, 0], values[0, 1] = np.nan, np.inf
    seen = RNG.random((30, 40)) < 0.7
    seen[0, :2] = True
    found = pixel_stats(values, seen)
    chosen = values[seen].astype(np.float64)
    chosen = chosen[np.isfinite(chosen)]
    assert (found.count, found.left_out) == (len(chosen), 2) and found.counts.sum() == len(chosen)
    assert found.mean == pytest.approx(chosen.mean()) and (found.minimum, found.maximum) == (chosen.min(), chosen.max())
    assert found.percentiles[95] == pytest.approx(np.percentile(chosen, 95))
    cut = pixel_stats(values, seen, low=-1, high=1, bins=10)
    assert cut.below == (chosen < -1).sum() and cut.above == (chosen > 1).sum()
    assert cut.counts.sum() + cut.below + cut.above == len(chosen)


def test_statistics_of_whole_numbers_and_of_nothing() -> None:
    counts = RNG.integers(0, 9, (20, 20)).astype(np.uint32)
    found = pixel_stats(counts)
    assert np.array_equal(found.edges, np.arange(10) - 0.5)
    assert found.counts.tolist() == [int((counts == i).sum()) for i in range(9)]
    wide = pixel_stats(counts * 100, bins=8)
    assert len(wide.counts) <= 8 and wide.counts.sum() == 400
    empty = pixel_stats(counts, np.zeros((20, 20), bool))
    assert empty.count == 0 and math.isnan(empty.mean) and empty.to_dict()["mean"] is None
    assert pixel_stats(np.full((3, 3), 2.0)).counts.sum() == 9
    rgb_values = RNG.random((4, 5, 3))
    grey = rgb_values @ np.array([0.2126, 0.7152, 0.0722])
    assert pixel_stats(rgb_values).mean == pytest.approx(grey.mean())
    with pytest.raises(LabError, match="at least 1"):
        pixel_stats(counts, bins=0)
