"""Layers as the window shows them, made on the device: the pictures that the inspector draws of the same records."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import lab
from gui.layers.frame_layers import FrameLayers
from gui.layers.picture import draw
from gui.layers.scale import Scale
from lab.colour import auto_exposure, srgb_decode, srgb_encode, to_bytes
from lab.engine.vulkan.engine import VulkanEngine
from lab.engine.vulkan.window.layer_values import layer_names
from lab.engine.vulkan.window.present import Presenter
from lab.errors import LabError
from lab.layers import COUNT, SCALAR, find_layer
from lab.params import Params
from lab.records import Frame
from lab.scene.scene import Camera

from ..oracle_geometry.scenes import lamp_room

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
SIZE = (37, 22)
PARAMS = Params(vpls=300, shadow_samples=2, interleave=2, compensation="path")
EXPOSURE = 1.7

Render = Callable[..., Frame]


@pytest.fixture(scope="module")
def render(gpu: Any) -> Render:
    engine = VulkanEngine(lamp_room(), gpu)

    def made(params: Params = PARAMS, counts: bool = True) -> Frame:
        return lab.render(engine.scene, params, camera=CAMERA, size=SIZE, engine=engine, counts=counts)

    return made


@pytest.fixture(scope="module")
def frame(render: Render) -> Frame:
    return render()


def expected(frame: Frame, name: str) -> tuple[np.ndarray, tuple[float, float]]:
    """What the inspector draws of a layer, with the ends of its scale."""
    layers, layer = FrameLayers(frame), find_layer(name)
    values, seen = layers.values(name), None if layer.everywhere else layers.seen
    low = high = 0.0
    scale = None
    if layer.kind in (SCALAR, COUNT):
        known = values[layers.seen]
        known = known[np.isfinite(known)]
        low = float(known.min()) if layer.low is None else layer.low
        high = float(known.max()) if layer.high is None else layer.high
        high = high if high > low else low + (abs(low) or 1.0)
        scale = Scale(low, high, "grey" if layer.colour_map == "grey" else "heat")
    return draw(values, layer.kind, scale, seen, EXPOSURE), (low, high)


def test_every_layer_is_the_inspectors_picture(gpu: Any, frame: Frame) -> None:
    presenter = Presenter(gpu)
    names = layer_names(PARAMS, frame.hierarchy.top)
    assert len(names) > 35
    for name in names:
        picture, ends = expected(frame, name)
        shown = presenter.pixels(frame, name, EXPOSURE)
        difference = np.abs(shown.astype(int) - picture)
        assert difference.max() <= 8, f"{name}: {difference.max()}"  # the next colour of a map, at a tie
        assert (difference > 1).mean() < 0.002, name
        if find_layer(name).kind in (SCALAR, COUNT):
            np.testing.assert_allclose(presenter.ends(), ends, rtol=1e-5, err_msg=name)


def test_the_image_is_the_png_of_lab_render(gpu: Any, frame: Frame) -> None:
    for exposure in (0.2, auto_exposure(frame.image.colour, frame.gbuffer.depth > 0), 30.0):
        shown = Presenter(gpu).pixels(frame, "colour", exposure)
        difference = np.abs(shown.astype(int) - to_bytes(frame.image.colour, exposure))
        assert difference.max() <= 1
        assert len(np.unique(shown)) > 50


def test_colours_are_encoded_once(gpu: Any, frame: Frame) -> None:
    def pixels(encode: bool) -> np.ndarray:
        encoder = gpu.device.create_command_encoder()
        picture = Presenter(gpu).record(encoder, frame, "colour", EXPOSURE, bar=0, encode=encode)
        gpu.device.submit_command_buffer(encoder.finish())
        return picture.to_numpy()[..., :3]

    np.testing.assert_allclose(pixels(True), srgb_encode(pixels(False)), atol=2e-6)
    np.testing.assert_allclose(srgb_decode(pixels(True)), pixels(False), atol=2e-6)


def test_a_colour_bar_where_colours_mean_numbers(gpu: Any, frame: Frame) -> None:
    def pixels(name: str, bar: int) -> np.ndarray:
        encoder = gpu.device.create_command_encoder()
        picture = Presenter(gpu).record(encoder, frame, name, EXPOSURE, bar=bar)
        gpu.device.submit_command_buffer(encoder.finish())
        return picture.to_numpy()[..., :3]

    np.testing.assert_array_equal(pixels("colour", 3), pixels("colour", 0))
    barred, plain = pixels("depth", 3), pixels("depth", 0)
    np.testing.assert_array_equal(barred[:-12], plain[:-12])
    row = barred[-6, 1:-1]  # the window is narrower than the bar
    assert (barred[-1] == 0).all() and (np.diff(row.sum(axis=-1)) >= 0).mean() > 0.95
    levels = pixels("picked_level.0", 3)[-6, 1:-1]
    assert len(np.unique(levels, axis=0)) == 3


def test_a_frame_without_counts_says_so(gpu: Any, render: Render) -> None:
    with pytest.raises(LabError, match="without counting"):
        Presenter(gpu).pixels(render(counts=False), "overdraw", 1.0)


@pytest.mark.parametrize("vpls", [1, 300])
def test_counts_of_as_many_levels_as_there_are(gpu: Any, render: Render, vpls: int) -> None:
    frame = render(Params(vpls=vpls, shadow_samples=0, first_level=1))
    picture, ends = expected(frame, "overdraw")
    presenter = Presenter(gpu)
    difference = np.abs(presenter.pixels(frame, "overdraw", 1.0).astype(int) - picture)
    assert ends[1] >= 1 and presenter.ends() == ends and (difference > 1).mean() < 0.002


def test_an_rgb_ratio_and_a_frame_without_shadows(gpu: Any, render: Render) -> None:
    presenter = Presenter(gpu)
    coloured = render(PARAMS.replace(shadow_estimator="ratio_rgb", interleave=1, compensation="none"))
    for name in ("shadow_ratio", "shadow_ratio_noisy", "shadowed"):
        difference = np.abs(presenter.pixels(coloured, name, 1.0).astype(int) - expected(coloured, name)[0])
        assert (difference > 1).mean() < 0.002, name
    bare = render(PARAMS.replace(shadow_samples=0, interleave=1, compensation="none"))
    for name in layer_names(bare.params, bare.hierarchy.top):
        presenter.pixels(bare, name, 1.0)
