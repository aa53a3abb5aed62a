"""Which layers there are: name, title, meaning, unit and kind of each."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

from lab.errors import LabError, nearest

LIGHT, COLOUR, DIRECTION, POSITION = "light", "colour", "direction", "position"
SCALAR, COUNT, SIGNED, LEVEL, TILE = "scalar", "count", "signed", "level", "tile"
"""Kinds. Light is tone-mapped; colours and directions have a fixed range; positions, scalars and counts a scale;
signed values one that is symmetric about 0; levels and tiles are categories."""


@dataclass(frozen=True)
class Layer:
    """What a layer of a frame is.

    Attributes:
        name: as in the EXR files where it stands there, too (``overdraw.L3``).    title, doc: for people.
        unit: of its values, "" for none.    kind: see :data:`LIGHT` and the others.    group: heading in menus.
        colour_map: the usual one.    low, high: ends of the usual scale, None: those of the values.
        everywhere: it has a value where the camera sees the background, too.
    """

    name: str
    title: str
    doc: str
    kind: str
    unit: str = ""
    group: str = "image"
    colour_map: str = "heat"
    low: float | None = None
    high: float | None = None
    everywhere: bool = False


_RADIANCE, _IRRADIANCE, _LENGTH = "radiance", "irradiance", "scene units"

_IMAGE = (
    Layer("colour", "colour", "direct + indirect, and the background", LIGHT, _RADIANCE, everywhere=True),
    Layer("direct", "direct", "emission and light straight from the scene's lights", LIGHT, _RADIANCE),
    Layer("indirect", "indirect", "light of the grid lights, shadowed", LIGHT, _RADIANCE),
    Layer("unshadowed", "unshadowed light", "light of the grid lights without shadows, E", LIGHT, _IRRADIANCE),
    Layer(
        "irradiance", "unshadowed light of the own tile", "E as stage light leaves it, before interleaved tiles are "
        "recombined", LIGHT, _IRRADIANCE,
    ),
)  # fmt: skip

_SHADOWS = tuple(
    dataclasses.replace(layer, group="shadows")
    for layer in (
        Layer(
            "shadow_ratio", "shadow ratio", "after the filter, tiles recombined: 1 is lit, 0 is in shadow", SCALAR,
            colour_map="grey", low=0, high=1,
        ),
        Layer(
            "shadow_ratio_noisy", "shadow ratio before the filter", "S / U of the pixel's own shadow rays", SCALAR,
            colour_map="grey", low=0, high=1,
        ),
        Layer("shadowed_noisy", "S before the filter", "mean of V omega over the pixel's shadow rays", SCALAR, low=0),
        Layer("weight_noisy", "U before the filter", "what S is relative to: the mean of omega for ratios", SCALAR,
              low=0),
        Layer("shadowed", "S after the filter", "filtered mean of V omega", SCALAR, low=0),
        Layer("weight", "U after the filter", "filtered weight of S", SCALAR, low=0),
        Layer("sun_and_lamps", "light from sun, points and spots", "direct light of the scene's own lights, "
              "without noise", LIGHT, _IRRADIANCE),
        Layer("area_noisy", "light from emitters, before the filter", "emissive triangles by a few rays a pixel",
              LIGHT, _IRRADIANCE),
        Layer("area", "light from emitters", "emissive triangles, filtered", LIGHT, _IRRADIANCE),
        Layer("left_out_noisy", "compensation, before the filter", "irradiance that the clamped falloff leaves out",
              LIGHT, _IRRADIANCE),
        Layer("left_out", "compensation", "irradiance that the clamped falloff leaves out, filtered", LIGHT,
              _IRRADIANCE),
    )
)  # fmt: skip

_SURFACE = tuple(
    dataclasses.replace(layer, group="surface")
    for layer in (
        Layer("albedo", "albedo", "share of light that the surface sends back", COLOUR),
        Layer("normal", "normal", "interpolated, turned to the viewer's side", DIRECTION),
        Layer("geometric_normal", "geometric normal", "of the triangle, turned toward the viewer", DIRECTION),
        Layer("depth", "depth", "distance along the camera's axis", SCALAR, _LENGTH, colour_map="viridis"),
        Layer("position", "position", "of the surface point; each axis from its least to its greatest", POSITION,
              _LENGTH),
        Layer("emission", "emission", "radiance that the surface itself sends", LIGHT, _RADIANCE),
    )
)  # fmt: skip

_COUNTS = (
    Layer("overdraw", "overdraw", "lights whose cube of half-edge 2 r holds the point", COUNT, "lights",
          "lights per pixel", low=0),
    Layer("lights_used", "lights used", "lights with a contribution", COUNT, "lights", "lights per pixel", low=0),
)  # fmt: skip

_PICKS = tuple(
    dataclasses.replace(layer, group="picks")
    for layer in (
        Layer("entropy", "entropy of the picks", "mean of -log2 p over the pixel's picks, whose expectation is the "
              "entropy of p", SCALAR, "bits", low=0),
        Layer("effective_lights", "effective number of lights", "1 / mean p of the pixel's picks: so many lights, "
              "picked evenly, would vary as much", SCALAR, "lights", low=0),
        Layer("mean_level", "mean level of the picks", "of the grid lights that were picked", SCALAR, low=0),
        Layer("blocked", "blocked shadow rays", "share of the pixel's rays", SCALAR, colour_map="grey", low=0, high=1),
        Layer("tile", "interleaving tile", "(y mod n) n + x mod n: pixels of a tile share their lights", TILE),
    )
)  # fmt: skip

_REFERENCE = tuple(
    dataclasses.replace(layer, group="reference")
    for part, title, unit in (
        ("colour", "colour", _RADIANCE),
        ("direct", "direct", _RADIANCE),
        ("indirect", "indirect", _RADIANCE),
        ("unshadowed", "unshadowed light", _IRRADIANCE),
    )
    for layer in (
        Layer(f"reference.{part}", f"reference: {title}", "what the frame should show; behind it the frame's own "
              "background", LIGHT, unit, everywhere=part == "colour"),
        Layer(f"error.{part}", f"error of {title}", "signed, of the luminance, relative to the reference's; red: too "
              "bright, blue: too dark", SIGNED, "%", colour_map="signed"),
        Layer(f"flip.{part}", f"FLIP of {title}", "difference that a person sees when flipping between the two: 0 none",
              SCALAR, colour_map="magma", low=0, high=1),
    )
)  # fmt: skip

LAYERS = {layer.name: layer for layer in (*_IMAGE, *_SHADOWS, *_SURFACE, *_COUNTS, *_PICKS, *_REFERENCE)}
"""Layers with a fixed name. Those of one level or one pick are made by :func:`find_layer`."""

_OF_LEVEL = {
    "overdraw": dataclasses.replace(LAYERS["overdraw"]),
    "lights_used": dataclasses.replace(LAYERS["lights_used"]),
    "level_light": Layer(
        "level_light", "unshadowed light", "unshadowed light of this level's lights alone", LIGHT, _IRRADIANCE, "levels"
    ),
}

_OF_PICK = {
    "picked_level": Layer("picked_level", "level of pick", "level of the grid light that was picked", LEVEL, "",
                          "picks"),
    "pick_probability": Layer("pick_probability", "probability of pick", "p = f / F of the light that was picked",
                              SCALAR, "", "picks", low=0, high=1),
}  # fmt: skip


def find_layer(name: str) -> Layer:
    """The layer called `name`; ``overdraw.L3`` is level 3's, ``picked_level.0`` that of the first pick."""
    if name in LAYERS:
        return LAYERS[name]
    base, _, number = name.rpartition(".")
    if base in _OF_LEVEL and number[:1] == "L" and number[1:].isdecimal():
        layer = _OF_LEVEL[base]
        return dataclasses.replace(layer, name=name, title=f"{layer.title} of level {int(number[1:])}")
    if base in _OF_PICK and number.isdecimal():
        layer = _OF_PICK[base]
        return dataclasses.replace(layer, name=name, title=f"{layer.title} {int(number) + 1}")
    raise LabError(f"there is no layer {name!r}{nearest(name, known_names())}")


def known_names(levels: range = range(1), picks: int = 1) -> Iterator[str]:
    """Every layer's name, in the order of menus, for these levels and this many picks."""
    yield from (layer.name for layer in (*_IMAGE, *_SHADOWS, *_SURFACE))
    for base in ("overdraw", "lights_used"):
        yield base
        yield from (f"{base}.L{level}" for level in levels)
    yield from (f"level_light.L{level}" for level in levels)
    yield from (f"{base}.{pick}" for base in _OF_PICK for pick in range(picks))
    yield from (layer.name for layer in (*_PICKS, *_REFERENCE))
