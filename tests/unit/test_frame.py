"""Whole frames: repeatable for any thread count, finite for every setting, the same with either filter backend."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

import lab
from lab import _core
from lab.engine import STAGES
from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import PRESETS, SETTINGS, Params, preset
from lab.records import Frame
from lab.scene.scene import Camera, Material, PointLight

from ..oracle_geometry.scenes import box, lamp_room, occluded_room, scene_of, soup, wall_lights

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
SIZE = (24, 14)
SMALL = {"vpls": 400}


@cache
def engine() -> CpuEngine:
    """Of a room with every kind of light."""
    return CpuEngine(lamp_room())


def frame(size: tuple[int, int] = SIZE, **settings: Any) -> Frame:
    return lab.render(engine().scene, Params(**SMALL | settings), camera=CAMERA, size=size, engine=engine())


def arrays(record: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every array of a record and of the records in it, by its dotted name."""
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray):
            yield prefix + field.name, value
        elif dataclasses.is_dataclass(value) and field.name not in ("params", "camera"):
            yield from arrays(value, f"{prefix}{field.name}.")


def differences(a: Frame, b: Frame) -> list[str]:
    mine, other = dict(arrays(a)), dict(arrays(b))
    assert mine.keys() == other.keys() and len(mine) > 30
    return [name for name in mine if not np.array_equal(mine[name], other[name])]


def check(f: Frame) -> None:
    """Finite everywhere, no negative light, and light at all."""
    for name, array in arrays(f):
        if array.dtype.kind == "f":
            assert np.isfinite(array).all(), name
    for name in ("colour", "direct", "unshadowed", "indirect", "shadow_ratio"):
        assert (getattr(f.image, name) >= 0).all(), name
    assert f.image.colour.max() > 0 and f.image.indirect.max() > 0


@pytest.fixture
def threads() -> Iterator[Any]:
    """Sets the number of threads, and puts it back."""
    before = _core.info()["threads"]
    yield _core.set_threads
    _core.set_threads(before)


@pytest.mark.parametrize("settings", [
    {"vpls": 3000, "compensation": "path"},
    {"vpls": 3000, "filter": "atrous"},
    {"vpls": 3000, "construction": "scatter", "picker": "race", "filter": "atrous_plane"},
    {"interleave": 4, "filter": "bilateral", "shadow_estimator": "ratio_rgb"},
    {"shadow_points": "jitter", "lobe": "mean", "first_level": 1},
])  # fmt: skip
def test_any_number_of_threads_gives_the_same_bits(settings: dict[str, Any], threads: Any) -> None:
    frames = []
    for count in (1, 2, 3):
        threads(count)
        frames.append(frame((37, 21), **settings))
    assert differences(frames[0], frames[1]) == []
    assert differences(frames[0], frames[2]) == []


def test_seed_and_frame() -> None:
    """Same seed, same frame; another frame keeps the lights and changes the picks; another seed changes both."""
    first = frame()
    assert differences(first, frame()) == []
    later = set(differences(first, frame(frame=1)))
    assert {"lighting.light", "shadows.member", "shadows.area", "image.colour"} <= later
    kept = ("lights.", "hierarchy.", "gbuffer.", "lighting.irradiance", "lighting.overdraw", "image.unshadowed")
    assert not [name for name in later if name.startswith(kept)]
    other = set(differences(first, frame(seed=1)))
    assert {"lights.position", "hierarchy.position", "lighting.light", "image.unshadowed"} <= other
    assert not [name for name in other if name.startswith("gbuffer.")]


def test_the_engine_keeps_no_state() -> None:
    """A frame is the same after others with other settings, and from a new engine."""
    first = frame()
    frame((9, 5), vpls=50, interleave=8, shadow_samples=1)
    assert differences(first, frame()) == []
    fresh = lab.render(engine().scene, Params(**SMALL), camera=CAMERA, size=SIZE)
    assert differences(first, fresh) == []


def test_every_stage_is_timed_once_and_in_order() -> None:
    seen: list[str] = []
    f = lab.render(engine().scene, Params(**SMALL), camera=CAMERA, size=SIZE, engine=engine(), progress=seen.append)
    assert tuple(f.stages_ms) == tuple(seen) == STAGES
    assert len(STAGES) == 7
    assert all(ms > 0 for ms in f.stages_ms.values())
    assert f.total_ms == pytest.approx(sum(f.stages_ms.values()))
    assert f.camera is CAMERA and f.params == Params(**SMALL)


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("interleave", [1, 4])
def test_presets(name: str, interleave: int) -> None:
    f = lab.render(
        engine().scene, preset(name, **SMALL, interleave=interleave), camera=CAMERA, size=SIZE, engine=engine()
    )
    check(f)


ELSEWHERE = ("kornia", "raster")  # need torch, and a Vulkan device
CHOICES = [(name, word) for name, s in SETTINGS.items() for word in (*s.choices, *s.words) if word not in ELSEWHERE]
CHOICES += [(name, word) for name, s in SETTINGS.items() if s.kind is bool for word in (False, True)]


@pytest.mark.parametrize(("name", "word"), CHOICES, ids=str)
def test_every_choice_of_every_setting(name: str, word: Any) -> None:
    settings = {name: word}
    if name == "sigma_plane":
        settings["filter"] = "atrous_plane"
    check(frame(**settings))


EXTREMES: list[dict[str, Any]] = [
    {"vpls": 1}, {"vpls": 2, "levels": 12}, {"max_bounces": 1}, {"max_bounces": 16}, {"bounds_scale": 2.0},
    {"levels": 1}, {"levels": 7}, {"alpha": 1e-6}, {"alpha": 1e6}, {"clamp_distance": 0.0}, {"clamp_distance": 1e6},
    {"shadow_samples": 0}, {"shadow_samples": 1}, {"shadow_samples": 64}, {"first_shadow_level": 12},
    {"shadow_points": "jitter", "deviation_scale": 0.0}, {"shadow_points": "jitter", "deviation_scale": 2.0},
    {"omega_max": 1e-3}, {"shadow_estimator": "corrected", "omega_max": "none"}, {"direct_samples": 0},
    {"direct_samples": 64}, {"seed": 2**32 - 1}, {"frame": 2**32 - 1}, {"sigma_normal": 1e-6},
    {"sigma_position": 1e-6}, {"sigma_deviation": 1e-6}, {"sigma_deviation": 1e38},
    {"filter": "atrous", "sigma_shadow": 1e-6}, {"compensation": "path", "compensation_samples": 64},
    {"compensation": "path", "clamp_distance": 1e6},
    {"alpha": 1e-6, "first_level": 1, "receiver": "soft", "lobe": "mean_energy"},
    {"clamp_distance": 0.0, "falloff": "softened", "receiver": "soft"}, {"shadow_samples": 0, "interleave": 8},
]  # fmt: skip


@pytest.mark.parametrize("settings", EXTREMES, ids=str)
def test_extreme_values(settings: dict[str, Any]) -> None:
    f = frame(**settings)
    check(f)
    if settings.get("shadow_samples") == 0:
        seen = f.gbuffer.depth > 0
        assert (f.image.shadow_ratio[seen] == 1).all()


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (5, 1), (17, 3)])
@pytest.mark.parametrize("interleave", [1, 8])
def test_tiny_images(size: tuple[int, int], interleave: int) -> None:
    f = frame(size, interleave=interleave)
    assert f.image.colour.shape == (size[1], size[0], 3)
    check(f)


@pytest.mark.parametrize("bounces", [1, 3])
def test_no_direct_light_is_counted_twice(bounces: int) -> None:
    """Indirect light comes from VPLs, direct light from the lights themselves: a black room has the second alone."""
    black = [Material("black", (0.0, 0.0, 0.0)), Material("white", (0.9, 0.9, 0.9))]
    room, block = box((-1, -1, -1), (1, 1, 1), inward=True), box((-0.2, -0.2, -0.2), (0.2, 0.2, 0.2), 1)
    scene = scene_of([room, block], black, points=[PointLight((0.0, 0.8, 0.0), (1.0, 1.0, 1.0))])
    view = Camera("c", (0.5, 0.9, 0.5), (0.0, 0.0, 0.0))
    f = lab.render(scene, Params(vpls=100, max_bounces=bounces), camera=view, size=(16, 16))
    top = (f.gbuffer.normal[..., 1] > 0.9) & (f.gbuffer.albedo[..., 0] > 0.5)
    assert top.sum() > 5
    assert (f.image.direct[top] > 0).all() and not f.image.indirect[top].any()


# --- either filter backend ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", SETTINGS["filter"].choices)
@pytest.mark.parametrize("size", [(32, 16), (27, 17)])
def test_kornia_gives_the_same_picture(kind: str, size: tuple[int, int]) -> None:
    pytest.importorskip("kornia")
    # Pixels are far apart in a picture this small: the filter's reach must span them.
    settings = {"filter": kind, "sigma_position": 0.1, "compensation": "path", "clamp_distance": 0.1}
    fused, kornia = (frame(size, filter_backend=backend, **settings).image for backend in ("fused", "kornia"))
    assert np.abs(fused.colour - kornia.colour).max() < 1e-4 * fused.colour.max()
    assert np.abs(fused.shadow_ratio - kornia.shadow_ratio).max() < 1e-4
    if kind != "none":
        plain = frame(size, **settings | {"filter": "none"}).image
        for name in ("shadow_ratio", "direct", "indirect"):
            mine, other = getattr(fused, name), getattr(plain, name)
            assert np.abs(mine - other).max() > 0.1 * other.mean(), f"the filter does nothing to {name} here"


# --- bad input ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(0, 10), (10, 0), (-3, 4)])
def test_images_need_a_size(size: tuple[int, int]) -> None:
    with pytest.raises(LabError, match="size"):
        frame(size)


def test_unknown_names() -> None:
    with pytest.raises(LabError, match="front"):
        lab.render(engine().scene, Params(**SMALL), camera="frnt", size=SIZE)
    with pytest.raises(LabError, match="cpu"):
        lab.render(engine().scene, Params(**SMALL), size=SIZE, engine="cpus")


def test_a_light_list_lights_the_scene_without_vpls() -> None:
    lights = wall_lights(4, 30)
    f = lab.render(occluded_room(lights), Params(), camera=CAMERA, size=SIZE)
    check(f)
    assert f.lights is lights and f.lights.paths_launched == 0
    assert not f.image.direct.any()


def test_a_scene_without_light_is_an_error() -> None:
    with pytest.raises(LabError, match="no light"):
        lab.render(scene_of([soup(1, 5)]), Params(**SMALL), size=SIZE)
