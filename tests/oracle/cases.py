"""Sets of lights and points that the tests of hierarchy and lighting share."""

from __future__ import annotations

import numpy as np

from lab.records import GBuffer, Lights


def unit_vectors(rng, count):
    """`count` random unit vectors, float32."""
    v = rng.normal(size=(count, 3))
    return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)


def make_lights(position, flux, normal=None) -> Lights:
    """Lights from arrays of any float type."""
    return Lights(
        np.asarray(position, np.float32),
        np.asarray(flux, np.float32),
        None if normal is None else np.asarray(normal, np.float32),
    )


def cloud(count=300, seed=0, *, oriented=True, scale=1.0, shift=0.0) -> Lights:
    """Lights of very unequal flux in a box of unequal sides, dense in one corner."""
    rng = np.random.default_rng(seed)
    position = rng.uniform(-1, 1, (count, 3)) * [1, 0.6, 0.8]
    position[: count // 3] = position[: count // 3] * 0.1 + [0.4, 0.2, -0.3]
    flux = rng.uniform(0.1, 1, (count, 3)) * rng.lognormal(0, 1.5, (count, 1))
    return make_lights(position * scale + shift, flux, unit_vectors(rng, count) if oriented else None)


def mixed_cloud() -> Lights:
    """Every third light is without a normal."""
    lights = cloud(seed=3)
    normal = lights.normal.copy()
    normal[::3] = 0
    return make_lights(lights.position, lights.flux, normal)


def with_black() -> Lights:
    """Every fourth light has no flux; some give only one colour."""
    lights = cloud(seed=4)
    flux = lights.flux.copy()
    flux[::4] = 0
    flux[1::4, :2] = 0
    return make_lights(lights.position, flux, lights.normal)


def on_faces() -> Lights:
    """Lights on the planes, edges and corners of every grid of four levels, the far faces included."""
    rng = np.random.default_rng(5)
    axis = np.arange(9) / 8
    position = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    position = position[rng.permutation(len(position))[:400]]
    position[:2] = [[0, 0, 0], [1, 1, 1]]
    return make_lights(position, rng.uniform(0.1, 1, (400, 3)), unit_vectors(rng, 400))


def outlier() -> Lights:
    """One light 1e5 away from all others."""
    lights = cloud(seed=6)
    position = lights.position.copy()
    position[17] = [1e5, 0, 0]
    return make_lights(position, lights.flux, lights.normal)


def coincident(count=40, at=(0.3, -2.0, 5.0)) -> Lights:
    """All lights in one point."""
    rng = np.random.default_rng(7)
    return make_lights(np.tile(at, (count, 1)), rng.uniform(0.1, 1, (count, 3)), unit_vectors(rng, count))


def one_light(normal=(0.0, -0.6, 0.8)) -> Lights:
    """One light; `normal` None: isotropic."""
    return make_lights([[0.3, 2.0, -0.7]], [[3.0, 2.0, 0.5]], None if normal is None else [normal])


def points(count=200, seed=1, *, scale=1.0, shift=0.0):
    """Receivers in and around a cloud: position and normal, (count, 3) float32 each."""
    rng = np.random.default_rng(seed)
    position = rng.uniform(-1.5, 1.5, (count, 3)) * scale + shift
    return position.astype(np.float32), unit_vectors(rng, count)


def as_gbuffer(position, normal, shape) -> GBuffer:
    """Points as the pixels of a (height, width) image, row by row."""
    p, n = (np.ascontiguousarray(np.reshape(a, (*shape, 3)), np.float32) for a in (position, normal))
    nothing = np.zeros_like(p)
    return GBuffer(p, n, n, nothing, nothing, np.ones(shape, np.float32), 0.001)


CLOUDS = {
    "oriented": cloud,
    "without_normals": lambda: cloud(seed=2, oriented=False),
    "mixed": mixed_cloud,
    "with_black": with_black,
    "on_faces": on_faces,
    "outlier": outlier,
    "tiny_scene": lambda: cloud(seed=8, scale=1e-3),
    "huge_scene": lambda: cloud(seed=9, scale=1e6),
    "far_away": lambda: cloud(seed=10, scale=100.0, shift=1e5),
}
"""Sets of lights by name, each made by a call."""
