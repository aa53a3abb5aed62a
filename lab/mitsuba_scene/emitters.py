"""The scene's lights as Mitsuba's emitters."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.mitsuba_scene.elements import child, put, put_lookat, put_point, put_rgb
from lab.mitsuba_scene.surfaces import Files, add_projection, write_pfm
from lab.outputs import Writer
from lab.records import Lights
from lab.scene.scene import Scene, SpotLight

MOST_LIGHTS = 100_000
"""Lights of a list that one XML may hold; Mitsuba makes an object of each."""

WIDEST_PROJECTION = math.radians(80)
"""Widest half angle of a spot whose ramp is projected: nearer 90 degrees the picture would grow without end."""

DISC_RADIUS = 1e-4
"""Radius of the disc that stands for a Lambertian point light, in scene radii."""

_RAMP_TEXELS = 512

Row = NDArray[np.floating]


def check_light_list(scene: Scene) -> None:
    """Raises :class:`LabError` where the scene's list is too long for an XML."""
    if scene.light_list is not None and len(scene.light_list) > MOST_LIGHTS:
        raise LabError(
            f"{scene.name}: its light list has {len(scene.light_list):,} lights; an .xml holds {MOST_LIGHTS:,} at "
            "most, each as an element of its own: give the scene a shorter list"
        )


def add_emitters(root: Element, scene: Scene, radius: float, files: Files, notes: list[str]) -> None:
    """Every light of `scene` that is no surface; `radius` is the scene's."""
    for sun in scene.suns:
        emitter = child(root, "emitter", "directional")
        put_point(emitter, "vector", "direction", [-value for value in sun.to_sun])
        put_rgb(emitter, "irradiance", sun.irradiance)
    for point in scene.points:
        _add_point(root, point.position, point.intensity)
    for spot in scene.spots:
        _add_spot(root, spot, files, notes)
    if scene.light_list is not None:
        _add_list(root, scene.light_list, DISC_RADIUS * radius, notes)


def _add_point(root: Element, position: object, intensity: object) -> None:
    emitter = child(root, "emitter", "point")
    put_point(emitter, "point", "position", np.asarray(position))
    put_rgb(emitter, "intensity", np.asarray(intensity))


def _add_list(root: Element, lights: Lights, disc: float, notes: list[str]) -> None:
    normal = np.zeros_like(lights.position) if lights.normal is None else lights.normal
    oriented = normal.any(axis=1)
    for position, flux in zip(lights.position[~oriented], lights.flux[~oriented], strict=True):
        if flux.any():
            _add_point(root, position, flux.astype(np.float64) / (4 * math.pi))
    for position, flux, facing in zip(lights.position[oriented], lights.flux[oriented], normal[oriented], strict=True):
        if flux.any():
            _add_disc(root, position, flux, facing, disc)
    if oriented.any():
        notes.append(
            f"{int(oriented.sum()):,} Lambertian point lights are written as discs of radius {disc:.3g}, "
            "which a camera can see"
        )


def _add_disc(root: Element, position: Row, flux: Row, facing: Row, radius: float) -> None:
    """A black disc whose front shines with all of `flux`, a tenth of its radius off the light's place."""
    shape = child(root, "shape", "disk")
    at = position.astype(np.float64) + 0.1 * radius * facing
    put_lookat(shape, at, at + facing, _across(facing), scale=radius)
    put_rgb(child(shape, "bsdf", "diffuse"), "reflectance", (0, 0, 0))
    emitter = child(shape, "emitter", "area")
    put_rgb(emitter, "radiance", flux.astype(np.float64) / (math.pi**2 * radius**2))


def _across(direction: Row) -> NDArray[np.float64]:
    """A unit vector that is not along `direction`."""
    across = np.zeros(3)
    across[int(np.argmin(np.abs(direction)))] = 1
    return across


def _add_spot(root: Element, spot: SpotLight, files: Files, notes: list[str]) -> None:
    emitter = child(root, "emitter", "spot")
    origin, direction = np.asarray(spot.position), np.asarray(spot.direction)
    put_lookat(emitter, origin, origin + direction / np.linalg.norm(direction), _across(direction))
    put_rgb(emitter, "intensity", spot.intensity)
    inner, outer = spot.inner_angle, spot.outer_angle
    projected = outer <= WIDEST_PROJECTION
    # The ramp is in the texture: Mitsuba's own must not fade as well. It may not be of no width at all.
    full = outer * (1 - 1e-6) if projected else min(inner, outer * (1 - 1e-6))
    put(emitter, "cutoff_angle", math.degrees(outer))
    put(emitter, "beam_width", math.degrees(full))
    if projected:

        def ramp() -> Writer:
            return lambda path: write_pfm(path, spot_ramp(inner, outer))

        add_projection(emitter, files.add(f"spot-{inner:.6g}-{outer:.6g}.pfm", ramp))
    else:
        notes.append(
            f"a spot of {math.degrees(outer):.3g} degrees is too wide to be exact: "
            "Mitsuba fades it linearly over the angle"
        )


def spot_ramp(inner: float, outer: float) -> NDArray[np.float32]:
    """(512, 512): the share of a spot's intensity, as seen on a plane that its cone just fills (angles in radians)."""
    across = (np.arange(_RAMP_TEXELS) + 0.5) / _RAMP_TEXELS * 2 - 1
    tangent = np.hypot(*np.meshgrid(across, across)) * math.tan(outer)
    cosine, narrow, wide = 1 / np.sqrt(1 + tangent**2), math.cos(inner), math.cos(outer)
    ramp = np.clip((cosine - wide) / max(1e-6, narrow - wide), 0, 1)
    return (ramp**2).astype(np.float32)
