"""The sun that is put in where a scene needs one and nobody said how bright it is."""

from __future__ import annotations

from lab.scene.scene import SunLight, Vec3
from lab.scene.values import direction

SUN_IRRADIANCE: Vec3 = (6.0, 5.6, 5.0)
"""Irradiance (linear RGB) of every sun whose brightness is not given: white plaster in the sun, albedo 0.55, comes out
at a radiance of 1, a little warm."""

SUN_DIRECTION: Vec3 = (0.4, 0.8, 0.45)


def automatic_sun() -> SunLight:
    """High, from the front right: light and shade on every side that is seen."""
    return SunLight(direction("the automatic sun", SUN_DIRECTION), SUN_IRRADIANCE)
