"""Two squares that see each other: form factors in closed form, and a camera that sees the one from all of the other.

Formulas: Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", C-11 (parallel) and C-14 (one edge in
common); here for a height or width of 1 along the common side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.scene.scene import Camera, Material, Scene, Vec3

from .direct import form_factor
from .scenes import quad, scene_of

Array = NDArray[np.float64]


def parallel_squares(distance: float) -> float:
    """Form factor between two unit squares that face each other at `distance`."""
    x = 1 / distance
    y = 1 + x * x
    root = np.sqrt(y)
    total = np.log(np.sqrt(y * y / (1 + 2 * x * x))) + 2 * x * root * np.arctan(x / root) - 2 * x * np.arctan(x)
    return float(2 * total / (np.pi * x * x))


def common_edge(width: float, height: float) -> float:
    """Form factor from a rectangle of 1 x `width` to one of 1 x `height`, perpendicular along their edge of 1."""
    w, h = width**2, height**2
    s = w + h
    angles = width * np.arctan(1 / width) + height * np.arctan(1 / height) - np.sqrt(s) * np.arctan(1 / np.sqrt(s))
    logs = np.log((1 + w) * (1 + h) / (1 + s))
    logs += w * np.log(w * (1 + s) / ((1 + w) * s)) + h * np.log(h * (1 + s) / ((1 + h) * s))
    return float((angles + logs / 4) / (np.pi * width))


@dataclass(frozen=True)
class TwoPatches:
    """Unit squares: `lit` sends light, `seen` receives it and fills the camera's picture exactly.

    Attributes:
        lit, seen: (4, 3) corners, counter-clockwise from the side that faces the other.
        factor: form factor from `seen` to `lit`, in closed form.
        to_sun: a sun that shines on `lit` alone, unshadowed.
    """

    lit: Array
    seen: Array
    camera: Camera
    factor: float
    to_sun: Vec3

    def scene(self, lit: Material, seen: Material, **more: object) -> Scene:
        return scene_of([quad(*self.lit, 0), quad(*self.seen, 1)], [lit, seen], **more)

    def cosine(self) -> float:
        """Of the sun on `lit`."""
        n = np.cross(self.lit[1] - self.lit[0], self.lit[3] - self.lit[0])
        return float(n @ np.asarray(self.to_sun) / np.linalg.norm(n) / np.linalg.norm(self.to_sun))

    def points_on_lit(self, rng: np.random.Generator, across: int) -> Array:
        """(across^2, 3) points, one at random in each cell of a grid: uniform, with little noise."""
        cell = np.stack(np.meshgrid(np.arange(across), np.arange(across), indexing="ij"), axis=-1).reshape(-1, 2)
        u, v = ((cell + rng.random(cell.shape)) / across).T[..., None]
        return np.asarray(self.lit[0] + u * (self.lit[1] - self.lit[0]) + v * (self.lit[3] - self.lit[0]))

    def factors(self, position: Array, normal: Array) -> Array:
        """(H, W) form factors from the points (H, W, 3) of a G-buffer to `lit`."""
        shape = position.shape[:2]
        return form_factor(position.reshape(-1, 3), normal.reshape(-1, 3), self.lit).reshape(shape)

    def there_and_back(self, position: Array, factors: Array) -> Array:
        """(H, W) irradiance of `seen` by light that went from it to `lit` and back, albedos and radiosity being 1.

        `position`: (H, W, 3) points of the picture, an even grid on `seen`; `factors`: what they got at first.
        """
        seen, cells = position.reshape(-1, 3), 2 * position.shape[1]
        u, v = np.stack(np.meshgrid(*[(np.arange(cells) + 0.5) / cells] * 2), axis=-1).reshape(-1, 2).T[..., None]
        lit = self.lit[0] + u * (self.lit[1] - self.lit[0]) + v * (self.lit[3] - self.lit[0])
        to = lit[None] - seen[:, None]
        d2 = (to**2).sum(axis=-1)
        cosines = [to @ np.cross(c[1] - c[0], c[3] - c[0]) for c in (self.seen, self.lit)]  # times the distance
        kernel = np.abs(cosines[0] * cosines[1]) / (np.pi * d2**2)
        back = kernel.T @ factors.ravel() / len(seen)  # the patches' areas are 1
        return np.asarray((kernel @ back / len(lit)).reshape(factors.shape))


def facing(distance: float) -> TwoPatches:
    """A floor and the ceiling over it; the sun comes in low between them."""
    lit = np.array([(-0.5, 0, 0.5), (0.5, 0, 0.5), (0.5, 0, -0.5), (-0.5, 0, -0.5)], np.float64)
    seen = lit[::-1] + np.array([0, distance, 0])
    fov = float(np.degrees(2 * np.arctan(1.0)))  # from half a unit away: the whole square
    eye, target = (0.0, distance - 0.5, 0.0), (0.0, distance, 0.0)
    camera = Camera("below", eye, target, (0.0, 0.0, 1.0), fov)
    return TwoPatches(lit, seen, camera, parallel_squares(distance), (1.0, 0.4 * distance, 0.0))


def cornered(gap: float) -> TwoPatches:
    """A wall, and a floor that begins `gap` before it; the sun shines along the wall."""
    lit = np.array([(gap, 0, 0.5), (1 + gap, 0, 0.5), (1 + gap, 0, -0.5), (gap, 0, -0.5)], np.float64)
    seen = np.array([(0, 0, 0.5), (0, 0, -0.5), (0, 1, -0.5), (0, 1, 0.5)], np.float64)
    camera = Camera("before", (0.5, 0.5, 0.0), (0.0, 0.5, 0.0), fov_y_deg=90.0)
    # The floor from the wall on, less the part in the gap.
    factor = common_edge(1.0, 1 + gap) - common_edge(1.0, gap)
    return TwoPatches(lit, seen, camera, factor, (0.0, 0.8, 0.6))
