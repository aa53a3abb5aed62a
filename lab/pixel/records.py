"""What is known about one pixel: plain records, that save themselves as JSON or CSV."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.params import Params
from lab.records import Floats

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class ProbedLights:
    """Grid lights that light a pixel, one row each; ascending merged index until :meth:`sorted`.

    Attributes:
        index: (n,) merged index.    level: (n,).    distance: (n,) from the pixel's point to the light's centre.
        blend_weight: (n,) B.    receiver_cosine: (n,), softened where ``receiver=soft``.
        emission: (n,) of the light's lobe toward the pixel, 1 = Lambertian along its normal.
        falloff: (n,) G, 1 / length^2.    scale: (n,) what an interleaved light counts for, n^2 or 1.
        contribution: (n, 3) irradiance, B * cosine * emission * G * scale * flux / pi.
        share: (n,) of the luminance of all contributions.
        target_weight: (n,) f.    probability: (n,) of each pick, f / F among the levels picked from, else 0.
        position: (n, 3) centre.    flux: (n, 3).
    """

    index: NDArray[np.int64]
    level: NDArray[np.int32]
    distance: Floats
    blend_weight: Floats
    receiver_cosine: Floats
    emission: Floats
    falloff: Floats
    scale: Floats
    contribution: Floats
    share: Doubles
    target_weight: Floats
    probability: Doubles
    position: Floats
    flux: Floats

    def __len__(self) -> int:
        return len(self.index)

    @property
    def cumulative_share(self) -> Doubles:
        """(n,) sum of `share` down to each row."""
        return np.cumsum(self.share)

    def take(self, rows: NDArray[Any]) -> ProbedLights:
        """The lights `rows`, by number or by mask."""
        return ProbedLights(*(getattr(self, field.name)[rows] for field in fields(self)))

    def sorted(self) -> ProbedLights:
        """The greatest share first."""
        return self.take(np.argsort(-self.share, kind="stable"))

    def by_level(self) -> dict[int, ProbedLights]:
        """The lights of each level that has any."""
        return {int(level): self.take(self.level == level) for level in np.unique(self.level)}


@dataclass(frozen=True)
class ProbedPicks:
    """A pixel's k shadow samples, one row each.

    Attributes:
        light: (k,) merged index, -1 for none.    level: (k,), -1 for none.    target_weight: (k,) f.
        probability: (k,) of this pick.    point: (k, 3) where its ray ends.
        member: (k,) merged index of the input light that the ray goes to; -1: a jittered point, or none.
        omega: (k,) weight of the sample.    traced: (k,) whether there was a ray (none where omega is 0).
        visible: (k,) whether it was free.
    """

    light: NDArray[np.int32]
    level: NDArray[np.int32]
    target_weight: Floats
    probability: Doubles
    point: Floats
    member: NDArray[np.int32]
    omega: Floats
    traced: NDArray[np.bool_]
    visible: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.light)


@dataclass(frozen=True)
class PixelShadow:
    """A pixel's shadow before and after the filter, (c,) each: c = 3 for ``ratio_rgb``, else 1; NaN where unknown.

    Attributes:
        shadowed, weight: S, and what it is relative to (U for the ratios).    noisy_ratio: S / weight.
        filtered_shadowed, filtered_weight: the same after the filter.    filtered_ratio: their ratio.
        ratio: the image's, of all interleaving tiles recombined: what the unshadowed light is multiplied by.
    """

    shadowed: Doubles
    weight: Doubles
    noisy_ratio: Doubles
    filtered_shadowed: Doubles
    filtered_weight: Doubles
    filtered_ratio: Doubles
    ratio: Doubles


@dataclass(frozen=True)
class PixelValues:
    """The image at the pixel, (3,) linear RGB each: see :class:`lab.records.Image`."""

    colour: Floats
    direct: Floats
    indirect: Floats
    unshadowed: Floats


@dataclass(frozen=True)
class Probe:
    """Why a pixel looks as it does. A pixel that sees no surface has depth 0 and no lights.

    Attributes:
        x, y: the pixel, from the upper left.    tile: its interleaving tile, (x mod n, y mod n).
        point, normal, geometric_normal, albedo: (3,) of the surface seen.    depth: along the camera's axis.
        params: of the frame.    lights: every grid light that lights the pixel.
        irradiance: (3,) their sum: of the pixel's own lights, before tiles are recombined.
        weight_sum: F that picks are made from.
        overdraw, lights_used: (L,) lights whose cube contains the point, and those of `lights`.
        picks: the k shadow samples.    shadow: S, U and their ratio.    image: what is shown.
    """

    x: int
    y: int
    tile: tuple[int, int]
    point: Floats
    normal: Floats
    geometric_normal: Floats
    albedo: Floats
    depth: float
    params: Params
    lights: ProbedLights
    irradiance: Doubles
    weight_sum: float
    overdraw: NDArray[np.uint32]
    lights_used: NDArray[np.uint32]
    picks: ProbedPicks
    shadow: PixelShadow
    image: PixelValues

    def to_record(self) -> dict[str, Any]:
        """Everything as JSON knows it; lights by their share, the greatest first."""
        from lab.pixel.tables import light_columns, plain, rows_of

        names = ("x", "y", "tile", "point", "normal", "geometric_normal", "albedo", "depth", "irradiance", "weight_sum")
        return {name: plain(getattr(self, name)) for name in (*names, "overdraw", "lights_used")} | {
            "image": plain(self.image),
            "shadow": plain(self.shadow),
            "picks": rows_of({field.name: getattr(self.picks, field.name) for field in fields(self.picks)}),
            "lights": rows_of(light_columns(self.lights.sorted())),
            "params": self.params.to_dict(),
        }

    def to_json(self) -> str:
        """:meth:`to_record` as strict JSON; what is not known is null."""
        from lab.report import to_json

        return to_json(self.to_record())

    def to_csv(self) -> str:
        """The table of lights with a head line, the greatest share first."""
        from lab.pixel.tables import csv_of, light_columns

        return csv_of(light_columns(self.lights.sorted()))

    def write(self, path: str | Path) -> None:
        """Writes ``.json`` or ``.csv``, whole or not at all."""
        from lab.pixel.tables import check_ending, write_text

        target = check_ending(path)
        write_text(target, self.to_csv() if target.suffix.lower() == ".csv" else self.to_json())
