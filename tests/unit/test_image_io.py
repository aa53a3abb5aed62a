"""EXR layers and PNGs: channels named as documented, read back bit for bit; tone and colour maps."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lab import colour
from lab.errors import LabError
from lab.image_io import count_channels, frame_channels, read_exr, read_exr_attributes, write_exr, write_png
from lab.params import Params
from lab.records import Lighting

H, W, LEVELS = 5, 7, 4


def frame(first_level: int = 0, ratio_channels: int = 1) -> Any:
    """A stand-in with a frame's arrays, all different."""
    rng = np.random.default_rng(7)

    def layer(c: int) -> np.ndarray:
        return rng.normal(size=(H, W, c)).astype(np.float32)

    return SimpleNamespace(
        image=SimpleNamespace(
            colour=layer(3), direct=layer(3), unshadowed=layer(3), indirect=layer(3), shadow_ratio=layer(ratio_channels)
        ),
        gbuffer=SimpleNamespace(albedo=layer(3), normal=layer(3), position=layer(3), depth=layer(1)[..., 0]),
        lighting=Lighting(
            irradiance=layer(3),
            overdraw=rng.integers(0, 9, (LEVELS, H, W)).astype(np.uint32),
            lights_used=rng.integers(0, 9, (LEVELS, H, W)).astype(np.uint32),
            light=np.zeros((H, W, 0), np.int32),
            target_weight=layer(0),
            weight_sum=layer(1)[..., 0],
        ),
        params=Params(first_level=first_level),
    )


def test_layers_and_channel_names_are_the_documented_ones() -> None:
    names = set(frame_channels(frame()))
    expected = {f"{layer}.{c}" for layer in ("colour", "direct", "unshadowed", "indirect", "albedo") for c in "RGB"}
    expected |= {f"{layer}.{c}" for layer in ("normal", "position") for c in "XYZ"}
    expected |= {"shadow_ratio.Y", "depth.Z", "overdraw.Y", "lights_used.Y"}
    expected |= {f"{layer}.L{level}" for layer in ("overdraw", "lights_used") for level in range(LEVELS)}
    assert names == expected


def test_only_drawn_levels_are_counted() -> None:
    made = frame(first_level=1)
    channels = count_channels(made.lighting, 1)
    assert "overdraw.L0" not in channels and "overdraw.L1" in channels
    np.testing.assert_array_equal(channels["overdraw.Y"], made.lighting.overdraw[1:].sum(axis=0))
    np.testing.assert_array_equal(channels["lights_used.Y"], made.lighting.lights_used[1:].sum(axis=0))


def test_exr_reads_back_bit_for_bit(tmp_path: Any) -> None:
    made = frame(ratio_channels=3)
    path = tmp_path / "a.exr"
    write_exr(path, frame_channels(made), {"params": json.dumps(made.params.to_dict()), "seed": str(2**32 - 1)})
    layers = read_exr(path)
    for name in ("colour", "direct", "unshadowed", "indirect"):
        np.testing.assert_array_equal(layers[name], getattr(made.image, name))
    for name in ("albedo", "normal", "position", "depth"):
        np.testing.assert_array_equal(layers[name], getattr(made.gbuffer, name))
    assert layers["overdraw.L2"].dtype == np.uint32
    np.testing.assert_array_equal(layers["overdraw.L2"], made.lighting.overdraw[2])
    np.testing.assert_array_equal(layers["overdraw"], made.lighting.overdraw.sum(axis=0))
    np.testing.assert_allclose(
        layers["shadow_ratio"], made.image.shadow_ratio.astype(float) @ [0.2126, 0.7152, 0.0722], rtol=1e-6, atol=1e-6
    )
    attributes = read_exr_attributes(path)
    assert json.loads(attributes["params"]) == made.params.to_dict()
    assert attributes["seed"] == "4294967295"


def test_the_same_run_gives_the_same_bytes(tmp_path: Any) -> None:
    for name in ("a.exr", "b.exr"):
        write_exr(tmp_path / name, frame_channels(frame()), {"params": "{}"})
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


@pytest.mark.parametrize("content", [b"", b"hello", b"\x76\x2f\x31\x01\x02\x00\x00\x00 broken"])
def test_what_is_no_exr_is_named(tmp_path: Any, content: bytes) -> None:
    path = tmp_path / "a.exr"
    path.write_bytes(content)
    with pytest.raises(LabError, match=r"a\.exr"):
        read_exr(path)
    with pytest.raises(LabError, match="no such"):
        read_exr(tmp_path / "missing.exr")


def test_png_carries_its_metadata(tmp_path: Any) -> None:
    pixels = np.arange(H * W * 3, dtype=np.uint8).reshape(H, W, 3)
    write_png(tmp_path / "a.png", pixels, {"params": '{"alpha": 1.0}', "scene": "Café"})
    with Image.open(tmp_path / "a.png") as image:
        assert image.text == {"params": '{"alpha": 1.0}', "scene": "Café"}
        np.testing.assert_array_equal(np.asarray(image), pixels)


def test_srgb_encoding_matches_the_standard() -> None:
    linear = np.linspace(0, 1, 1001)
    expected = [12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055 for x in linear]
    np.testing.assert_allclose(colour.srgb_encode(linear), expected, atol=1e-12)


def test_tone_map_keeps_the_middle_and_rolls_off_the_rest() -> None:
    grey = np.linspace(0, 100, 20001)[:, None] * np.ones(3)
    mapped = colour.tone_map(grey)
    low = grey[:, 0] <= 0.5
    np.testing.assert_allclose(mapped[low], grey[low], rtol=1e-6)
    assert (np.diff(mapped[:, 0]) > 0).all()
    assert mapped.max() < 1
    slope = np.diff(mapped[:, 0]) / np.diff(grey[:, 0])
    knee = int(np.argmin(low))
    assert slope[knee] == pytest.approx(1, abs=0.03)
    np.testing.assert_allclose(colour.tone_map(grey / 3, exposure=3), mapped, rtol=1e-4)


def test_tone_map_keeps_hue_order_and_bleaches_highlights() -> None:
    red = np.array([[1.0, 0.1, 0.1]])
    saturation = [1 - m[0, 1] / m[0, 0] for m in (colour.tone_map(red * s) for s in (0.4, 2, 20, 200))]
    assert saturation == sorted(saturation, reverse=True)
    assert saturation[0] == pytest.approx(0.9, abs=1e-6)
    assert saturation[-1] < 0.1


def test_pixels_that_are_no_numbers_do_not_break_the_picture() -> None:
    strange = np.array([[[np.nan, 0.2, 0.2], [np.inf, np.inf, np.inf], [-1.0, 0.2, 0.2]]], dtype=np.float32)
    assert colour.to_bytes(strange).tolist() == [[[0, 124, 124], [255, 255, 255], [0, 124, 124]]]


def test_heat_map_climbs_in_even_steps_of_lightness() -> None:
    table = colour.HEAT.astype(float) / 255
    linear = np.where(table <= 0.04045, table / 12.92, ((table + 0.055) / 1.055) ** 2.4)
    long, medium, short = np.cbrt(
        np.array(
            [
                [0.41222147, 0.53633254, 0.05144599],
                [0.21190350, 0.68069955, 0.10739696],
                [0.08830246, 0.28171884, 0.62997870],
            ]
        )
        @ linear.T
    )  # fmt: skip
    lightness = 0.2104542553 * long + 0.7936177850 * medium - 0.0040720468 * short
    assert np.abs(np.diff(lightness) - np.diff(lightness).mean()).max() < 0.006
    assert colour.heat(np.array([-1, 0, 10, 99]), 10).tolist() == [
        *[colour.HEAT[0].tolist()] * 2,
        *[colour.HEAT[-1].tolist()] * 2,
    ]
    assert colour.heat(np.zeros((2, 2)), 0).shape == (2, 2, 3)
