"""A path tracer in float64 numpy, from the rendering equation alone: every ray against every triangle.

Surfaces are flat and of one colour. Every sun, point, spot and listed light is asked at every vertex; of the lamps one
point is drawn, evenly over their area.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..oracle_geometry.direct import spot_share
from ..oracle_geometry.rays import free, nearest
from ..oracle_geometry.scenes import materials_of, triangles_of

LIFT = 3e-5


@dataclass
class Vertex:
    """Points of paths: all (n, 3), normals toward where the path came from."""

    position: np.ndarray
    normal: np.ndarray
    albedo: np.ndarray


class PathTracer:
    def __init__(self, scene, seed):
        self.scene, self.rng = scene, np.random.default_rng(seed)
        self.triangles = triangles_of(scene)
        materials = materials_of(scene)
        self.albedo = np.array([m.base_colour for m in materials], np.float64)
        self.emission = np.array([m.emission for m in materials], np.float64)
        edges = self.triangles[:, 1:] - self.triangles[:, :1]
        cross = np.cross(edges[:, 0], edges[:, 1])
        self.area = np.linalg.norm(cross, axis=1) / 2
        self.normal = cross / (2 * self.area[:, None])
        self.lamps = np.flatnonzero(self.emission.any(axis=1))

    def trace(self, first, bounces):
        """(direct, indirect) radiance toward the viewer, one sample of each point of `first`."""
        direct = first.albedo / np.pi * self.arriving(first)
        indirect, throughput, at = np.zeros_like(direct), first.albedo.copy(), first
        for _ in range(bounces):
            at, met = self.bounce(at)
            throughput = throughput * at.albedo * met[:, None]
            indirect += throughput / np.pi * self.arriving(at)
        return direct, indirect

    def bounce(self, at):
        """The next vertex along a direction drawn by the cosine, and whether there is one."""
        u, v = self.rng.random((2, len(at.position)))
        axis = np.where(np.abs(at.normal[:, :1]) > 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
        s = np.cross(at.normal, axis)
        s /= np.linalg.norm(s, axis=1, keepdims=True)
        t = np.cross(at.normal, s)
        r, angle = np.sqrt(u), 2 * np.pi * v
        parts = (r * np.cos(angle), s), (r * np.sin(angle), t), (np.sqrt(1 - u), at.normal)
        direction = sum(share[:, None] * axis for share, axis in parts)
        distance, triangle, _, _ = nearest(self.triangles, at.position + LIFT * at.normal, direction)
        met = triangle >= 0
        length = np.where(met, distance, 1.0)[:, None]
        normal = self.normal[triangle]
        facing = np.where((normal * direction).sum(axis=1, keepdims=True) <= 0, normal, -normal)
        return Vertex(at.position + length * direction, facing, self.albedo[triangle]), met

    def arriving(self, at):
        """(n, 3) irradiance straight from the lights."""
        total = np.zeros_like(at.position)
        for sun in self.scene.suns:
            to = np.asarray(sun.to_sun, np.float64) / np.linalg.norm(sun.to_sun)
            total += self.from_point(at, at.position + 100 * to, np.asarray(sun.irradiance), distance2=1.0)
        for light in self.scene.points:
            total += self.from_point(at, np.asarray(light.position, np.float64), np.asarray(light.intensity))
        for spot in self.scene.spots:
            to = np.asarray(spot.position, np.float64) - at.position
            share = spot_share(spot, -to / np.linalg.norm(to, axis=1, keepdims=True))[:, None]
            total += self.from_point(at, np.asarray(spot.position, np.float64), share * np.asarray(spot.intensity))
        if self.scene.light_list is not None:
            rows = self.scene.light_list
            for position, flux, normal in zip(rows.position, rows.flux, rows.normal, strict=True):
                to = at.position - position
                along = np.maximum(0, (to * normal).sum(axis=1) / np.linalg.norm(to, axis=1))[:, None]
                intensity = along * flux / np.pi if normal.any() else flux / (4 * np.pi)
                total += self.from_point(at, position.astype(np.float64), intensity)
        if len(self.lamps):
            total += self.from_lamps(at)
        return total

    def from_point(self, at, position, intensity, distance2=None):
        to = position - at.position
        d2 = (to**2).sum(axis=1)
        cosine = np.maximum(0, (to * at.normal).sum(axis=1) / np.sqrt(d2))
        seen, _ = free(self.triangles, at.position + LIFT * at.normal, position + 0 * to)
        return (cosine * seen / (d2 if distance2 is None else distance2))[:, None] * intensity

    def from_lamps(self, at):
        area = self.area[self.lamps]
        chosen = self.rng.choice(self.lamps, len(at.position), p=area / area.sum())
        u, v = self.rng.random((2, len(chosen)))
        u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
        a, b, c = (self.triangles[chosen, i] for i in range(3))
        point = a + u[:, None] * (b - a) + v[:, None] * (c - a)
        to = point - at.position
        d2 = (to**2).sum(axis=1)
        toward = to / np.sqrt(d2)[:, None]
        cosines = np.maximum(0, (toward * at.normal).sum(axis=1)) * np.maximum(
            0, -(toward * self.normal[chosen]).sum(axis=1)
        )
        start = at.position + LIFT * at.normal
        seen, _ = free(self.triangles, start, start + (1 - 1e-4) * (point - start))
        return (cosines * seen / d2 * area.sum())[:, None] * self.emission[chosen]
