"""Bytes that a stage must read and write at least once, whatever it does in between."""

from __future__ import annotations

import dataclasses

import numpy as np

from lab.records import Frame, Lights

BYTES_A_LIGHT = 36
"""Position, flux and normal of one light."""

PASSES = {"atrous_variance": 5, "atrous": 5, "atrous_plane": 5, "bilateral": 1, "none": 0}
"""Passes over the image that each filter is made of."""


def traffic(frame: Frame) -> dict[str, int]:
    """Bytes of the stages whose limit is streaming, for this frame's records."""
    return {
        "build_hierarchy": construction(frame.lights) + _bytes(frame.hierarchy) + _bytes(frame.hierarchy.members),
        "filter_shadows": _filter(frame),
        "composite": _composite(frame),
    }


def construction(lights: Lights) -> int:
    """Of the lights alone, read once."""
    return BYTES_A_LIGHT * len(lights)


def _filter(frame: Frame) -> int:
    """Every pass reads position, normal and depth, and reads and writes what it filters."""
    g, shadows, params = frame.gbuffer, frame.shadows, frame.params
    values = _bytes(shadows.shadowed, shadows.weight) if params.shadow_samples > 0 else 0
    if shadows.area.any():
        values += _bytes(shadows.area)
    if shadows.left_out is not None:
        values += _bytes(shadows.left_out)
    guides = _bytes(g.position, g.normal, g.depth) if values else 0
    return PASSES[params.filter] * (guides + 2 * values)


def _composite(frame: Frame) -> int:
    """Reads surfaces, light and shadows, writes the image; interleaved tiles are recombined by position and normal."""
    g, lighting, shadows, filtered = frame.gbuffer, frame.lighting, frame.shadows, frame.filtered
    read = _bytes(g.albedo, g.emission, g.depth, lighting.irradiance, shadows.direct, filtered.area)
    read += _bytes(filtered.shadowed, filtered.weight, filtered.left_out)
    if frame.params.interleave > 1:
        read += _bytes(g.position, g.normal)
    return read + _bytes(frame.image)


def _bytes(*parts: object) -> int:
    total = 0
    for part in parts:
        if isinstance(part, np.ndarray):
            total += part.nbytes
        elif dataclasses.is_dataclass(part):
            values = [getattr(part, field.name) for field in dataclasses.fields(part)]
            total += sum(value.nbytes for value in values if isinstance(value, np.ndarray))
    return total
