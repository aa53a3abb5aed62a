"""The scene's own lights on the device, and how light paths choose among them (core_cpp/src/light_paths.cpp)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.colour import luminance
from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.scene import DeviceScene
from lab.scene.scene import Scene

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu

SUN = np.dtype([("to_sun", "3f4"), ("unused0", "u4"), ("irradiance", "3f4"), ("unused1", "u4")])
POINT = np.dtype([("position", "3f4"), ("unused0", "u4"), ("intensity", "3f4"), ("unused1", "u4")])
SPOT = np.dtype(
    [
        ("position", "3f4"),
        ("cos_inner", "f4"),
        ("direction", "3f4"),
        ("cos_outer", "f4"),
        ("intensity", "3f4"),
        ("unused", "u4"),
    ]
)
EMITTER = np.dtype(
    [
        ("radiance", "3f4"),
        ("triangle", "u4"),
        ("area", "f4"),
        ("cumulative", "f4"),
        ("two_sided", "u4"),
        ("unused", "u4"),
    ]
)
SOURCE = np.dtype(
    [
        ("kind", "u4"),
        ("index", "u4"),
        ("threshold", "u4"),
        ("probability", "f4"),
        ("axis", "3f4"),
        ("spread", "f4"),
    ]
)
EVENT_SOURCE = np.dtype([("spot", "u4"), ("index", "u4"), ("threshold", "u4"), ("probability", "f4")])
SUN_SOURCE, POINT_SOURCE, SPOT_SOURCE, EMITTER_SOURCE = range(4)
"""``SourceKind`` of shaders/lib/light_paths.slang."""


@dataclass(frozen=True)
class DeviceLights:
    """The lights, and the tables by which they are chosen.

    Attributes:
        uniform: the value of a shader's ``LightBuffers``.
        sources: rows of ``Source``, as light paths choose.    event_sources: of ``EventSource``, as points that are
            lit choose among point and spot lights.

    """

    uniform: dict[str, Any]
    sources: DeviceBuffer
    event_sources: DeviceBuffer


def upload_lights(gpu: Gpu, scene: Scene, device_scene: DeviceScene) -> DeviceLights:
    """All lights of the scene but its list."""
    suns, points, spots = _suns(scene), _points(scene), _spots(scene)
    emitters = _emitters(device_scene)
    sources = _sources(device_scene, suns, points, spots, emitters)
    uniform: dict[str, Any] = {
        "suns": gpu.pool.upload(suns, "suns"),
        "points": gpu.pool.upload(points, "point lights"),
        "spots": gpu.pool.upload(spots, "spot lights"),
        "emitters": gpu.pool.upload(emitters, "emissive triangles"),
        "count": (len(suns), len(points), len(spots), len(emitters)),
    }
    return DeviceLights(
        uniform,
        gpu.pool.upload(sources, "sources of light"),
        gpu.pool.upload(_event_sources(points, spots), "point and spot lights by power"),
    )


def _unit(v: Any) -> NDArray[np.float32]:
    given = np.array(v, np.float32)
    unit: NDArray[np.float32] = given / np.sqrt(np.square(given).sum(dtype=np.float32))
    return unit


def _suns(scene: Scene) -> NDArray[Any]:
    rows = np.zeros(len(scene.suns), SUN)
    for row, sun in zip(rows, scene.suns, strict=True):
        row["to_sun"], row["irradiance"] = _unit(sun.to_sun), sun.irradiance
    return rows


def _points(scene: Scene) -> NDArray[Any]:
    rows = np.zeros(len(scene.points), POINT)
    for row, point in zip(rows, scene.points, strict=True):
        row["position"], row["intensity"] = point.position, point.intensity
    return rows


def _spots(scene: Scene) -> NDArray[Any]:
    rows = np.zeros(len(scene.spots), SPOT)
    for row, spot in zip(rows, scene.spots, strict=True):
        row["position"], row["direction"], row["intensity"] = spot.position, _unit(spot.direction), spot.intensity
        row["cos_inner"] = np.cos(np.float32(spot.inner_angle))
        row["cos_outer"] = np.cos(np.float32(spot.outer_angle))
    return rows


def _emitters(scene: DeviceScene) -> NDArray[Any]:
    """In the order of the scene's own triangles, which decides what a uniform number chooses."""
    glows = scene.materials["emission"].max(axis=1) > 0 if len(scene.materials) else np.zeros(0, bool)
    found = np.flatnonzero(glows[scene.triangles["material"]])
    found = found[np.argsort(scene.order[found])]
    material = scene.materials[scene.triangles["material"][found]]
    a, b, c = (scene.corner_position[found, k].astype(np.float64) for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    power = area * luminance(material["emission"]) * np.where(material["two_sided"] > 0, 2, 1)
    found, material, area, power = (values[power > 0] for values in (found, material, area, power))
    rows = np.zeros(len(found), EMITTER)
    rows["triangle"], rows["area"] = found, area
    rows["radiance"], rows["two_sided"] = material["emission"], material["two_sided"]
    if len(rows):
        cumulative = np.cumsum(power)
        rows["cumulative"] = cumulative / cumulative[-1]
        rows["cumulative"][-1] = 1
    return rows


def _sources(
    scene: DeviceScene, suns: NDArray[Any], points: NDArray[Any], spots: NDArray[Any], emitters: NDArray[Any]
) -> NDArray[Any]:
    everywhere = np.array([0, 0, 1], np.float32), 2.0
    disc = math.pi * scene.radius**2
    found: list[tuple[int, int, float, tuple[NDArray[np.float32], float]]] = []
    for i, sun in enumerate(suns):
        found.append((SUN_SOURCE, i, float(luminance(sun["irradiance"])) * disc, everywhere))
    for i, point in enumerate(points):
        power = float(luminance(point["intensity"])) * 4 * math.pi
        found.append((POINT_SOURCE, i, power, _toward_scene(scene, point["position"])))
    for i, spot in enumerate(spots):
        # Solid angle weighted by its attenuation: full inside, a squared ramp over cosines at the edge.
        inner, outer = float(spot["cos_inner"]), float(spot["cos_outer"])
        power = float(luminance(spot["intensity"])) * 2 * math.pi * ((1 - inner) + (inner - outer) / 3)
        cone = _toward_scene(scene, spot["position"])
        own = spot["direction"], float(np.float32(1) - spot["cos_outer"])
        found.append((SPOT_SOURCE, i, power, min(own, cone, key=lambda c: c[1])))
    emitted = emitters["area"].astype(np.float64) * luminance(emitters["radiance"]) * math.pi
    emitted = emitted * np.where(emitters["two_sided"] > 0, 2, 1)
    found.append((EMITTER_SOURCE, 0, float(emitted.sum()), everywhere))
    found = [source for source in found if source[2] > 0]
    rows = np.zeros(len(found), SOURCE)
    for row, (kind, index, _, (axis, spread)) in zip(rows, found, strict=True):
        row["kind"], row["index"], row["axis"], row["spread"] = kind, index, axis, spread
    _set_shares(rows, [power for _, _, power, _ in found])
    return rows


def _event_sources(points: NDArray[Any], spots: NDArray[Any]) -> NDArray[Any]:
    found = [
        (spot, index, float(luminance(light["intensity"])) * 4 * math.pi)
        for spot, lights in enumerate((points, spots))
        for index, light in enumerate(lights)
    ]
    found = [source for source in found if source[2] > 0]
    rows = np.zeros(len(found), EVENT_SOURCE)
    for row, (spot, index, _) in zip(rows, found, strict=True):
        row["spot"], row["index"] = spot, index
    _set_shares(rows, [power for _, _, power in found])
    return rows


def _set_shares(rows: NDArray[Any], powers: list[float]) -> None:
    total, before = sum(powers), 0.0
    for row, power in zip(rows, powers, strict=True):
        before += power
        row["probability"] = power / total
        # A number of 32 bits is below the share exactly where it is below this.
        row["threshold"] = min(2**32 - 1, math.ceil(before / total * 2**32))


def _toward_scene(scene: DeviceScene, position: NDArray[np.float32]) -> tuple[NDArray[np.float32], float]:
    """The directions from `position` that can meet the scene, as axis and 1 - cos of their half angle."""
    to = scene.centre.astype(np.float64) - position.astype(np.float64)
    distance = float(np.linalg.norm(to))
    sine = scene.radius * 1.001 / distance if distance > 0 else math.inf
    if not sine < 1:
        return np.array([0, 0, 1], np.float32), 2.0  # inside: every direction
    # 1 - cos without the cancellation, for lamps far off.
    return (to / distance).astype(np.float32), sine * sine / (1 + math.sqrt(1 - sine * sine))
