"""Draped cloth: banners that hang from a rod in folds, and cloths thrown over a rail."""

from __future__ import annotations

import numpy as np

from modelling.mesh import Floats, Part, surface

Window = tuple[float, float, float, float]
"""The part of the cloth texture used: u0, v0, u1, v1."""


def _folds(u: Floats, v: Floats, rng: np.random.Generator, count: float) -> Floats:
    """Height of the folds over (u, v) in 0..1, about -1..1: three trains of waves that wander as they fall."""
    total = np.zeros(np.broadcast_shapes(u.shape, v.shape))
    for scale, weight in ((1.0, 0.6), (1.62, 0.3), (2.7, 0.14)):
        phase, drift, wander = rng.uniform(0, 2 * np.pi, 3)
        bend = 0.5 * np.sin(2.3 * v + drift) + 0.25 * np.sin(5.1 * v + wander)
        total = total + weight * np.sin(2 * np.pi * count * scale * u + phase + bend)
    return total


def banner(
    width: float, length: float, rng: np.random.Generator, window: Window, *,
    rod: float = 0.03, columns: int = 22, rows: int = 25, tail: float = 0.0, folds: float = 2.4, depth: float = 0.1,
) -> Part:  # fmt: skip
    """A cloth `width` x `length` hung over a rod along x at the origin, facing +z.

    It starts behind the rod, wraps over it and falls; folds deepen and the cloth narrows toward the free end, which is
    cut as a swallow tail `tail` deep (negative: a point).
    """
    wrap = 4
    u = np.linspace(0, 1, columns + 1)
    fall = np.linspace(0, 1, rows + 1)[1:]
    turn = np.linspace(np.pi, 0, wrap)
    v = np.concatenate([np.zeros(wrap), fall])[:, None]
    loose = np.clip(v * 3, 0, 1) * (0.35 + 0.65 * v)
    wave = _folds(u[None, :], v * 2.0, rng, folds)
    sway = rng.uniform(-0.06, 0.06) * np.sin(1.7 * v) * length / 3
    narrow = 1 - 0.1 * loose - 0.03 * rng.uniform()
    x = (u[None, :] - 0.5) * width * narrow + 0.012 * width * np.cos(2 * np.pi * folds * u[None, :]) * loose
    cut = tail * (1 - np.abs(2 * u - 1))[None, :] * v**3
    sag = 0.02 * np.sin(np.pi * np.abs(np.sin(2 * np.pi * u * 2)))[None, :] * (1 - v) * (v > 0)
    y = -v * (length - cut) - sag + 0 * x
    z = rod + depth * loose * wave + sway
    top = rod * np.stack([np.sin(turn), np.cos(turn)], axis=1)
    y[:wrap] = top[:, :1]
    z[:wrap] = -top[:, 1:]
    v_texture = np.concatenate([np.full(wrap, 0.0), fall])[:, None] + 0 * x
    u0, v0, u1, v1 = window
    uv = np.stack([u0 + (u1 - u0) * (u[None, :] + 0 * x), v0 + (v1 - v0) * v_texture], axis=-1)
    return surface(np.stack([x, y, z], axis=-1), uv)


def swag(
    span: float, drop: float, sag: float, rng: np.random.Generator, window: Window, *, columns: int = 24, rows: int = 10
) -> Part:
    """A festoon: cloth held at x = -span/2 and span/2, y = 0, that sags by `sag` between, `drop` deep at the middle."""
    s, t = np.linspace(-1, 1, columns + 1)[None, :], np.linspace(0, 1, rows + 1)[:, None]
    hang = sag * (1 - s**2) * (0.25 + 0.75 * t)
    gather = 0.25 + 0.75 * (1 - np.abs(s) ** 2.5)
    pleat = np.sin(2 * np.pi * 4.0 * t + 0.6 * np.sin(2 * s) + rng.uniform(0, 2 * np.pi))
    x = s * span / 2 + 0 * t
    y = -hang - drop * t * gather
    z = 0.05 + 0.07 * np.sin(np.pi * t) + 0.028 * pleat * (0.4 + 0.6 * (1 - np.abs(s))) + 0 * s
    u0, v0, u1, v1 = window
    uv = np.stack([u0 + (u1 - u0) * (t + 0 * s), v0 + (v1 - v0) * (0.5 + 0.5 * s + 0 * t)], axis=-1)
    return surface(np.stack([x, y, z], axis=-1), uv, flip=False)
