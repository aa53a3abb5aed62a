"""The pure functions of the method in float64 and exact integers, written from the definitions alone."""

from __future__ import annotations

import math

import numpy as np

WRAP = 0xFFFFFFFF


def pcg4d(keys):
    """PCG4D of Jarzynski & Olano, JCGT 9(3), 2020, in Python's own integers: (n, 4) -> (n, 4) uint32."""
    return np.array([_pcg4d_of(*map(int, key)) for key in keys], np.uint32).reshape(-1, 4)


def _pcg4d_of(x, y, z, w):
    x, y, z, w = ((v * 1664525 + 1013904223) & WRAP for v in (x, y, z, w))
    x, y, z, w = _mixed(x, y, z, w)
    x, y, z, w = (v ^ (v >> 16) for v in (x, y, z, w))
    return _mixed(x, y, z, w)


def _mixed(x, y, z, w):
    x = (x + y * w) & WRAP
    y = (y + z * x) & WRAP
    z = (z + x * y) & WRAP
    w = (w + y * z) & WRAP
    return x, y, z, w


def blend_weight(distance, radius, first, top):
    """B of one level (LY19 2.2): up on [r/2, r] (the first level: 1 below r), down on [r, 2r] (the top: 1 beyond r)."""
    d = np.asarray(distance, np.float64)
    inside = np.ones_like(d) if first else np.interp(d, [radius / 2, radius], [0.0, 1.0])
    beyond = np.ones_like(d) if top else np.interp(d, [radius, 2 * radius], [1.0, 0.0])
    return np.where(d <= radius, inside, beyond)


def luminance(rgb):
    """Rec. 709 luminance of linear (..., 3)."""
    return np.asarray(rgb, np.float64) @ np.array([0.2126, 0.7152, 0.0722])


def matrix(six):
    """(..., 6) as xx yy zz xy xz yz to (..., 3, 3)."""
    six = np.asarray(six, np.float64)
    return six[..., [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(*six.shape[:-1], 3, 3)


def emission(direction, lobe, normal, normal_moment, oriented):
    """Emission of lights toward unit directions: arguments broadcast over their leading axes; oriented is boolean.

    The result is per unit of intensity flux / pi, so that its integral over the sphere is pi where power is kept.
    """
    w, m = np.asarray(direction, np.float64), np.asarray(normal, np.float64)
    along = np.sum(m * w, axis=-1)
    if lobe == "mean":
        value = np.maximum(0, along)
    elif lobe == "mean_energy":
        value = np.maximum(0, along) + (1 - np.linalg.norm(m, axis=-1)) / 4
    else:
        moment = matrix(normal_moment)
        k = 1 - 0.201 * (1 - np.trace(moment @ moment, axis1=-2, axis2=-1))
        spread = np.einsum("...i,...ij,...j->...", w, moment, w)
        value = np.maximum(0, (along + k * np.sqrt(np.maximum(0, spread))) / 2)
    return np.where(oriented, value, 0.25)


def falloff(d2, kind, clamp):
    """G of squared distances: 1 / max(d^2, c^2), or softened 1 / (d^2 + c^2)."""
    return 1 / (np.maximum(d2, clamp**2) if kind == "clamped" else d2 + clamp**2)


def pcg(seed):
    """RXS-M-XS of O'Neill, "PCG", 2014, in Python's own integers: the endless sequence from one 32-bit state."""
    state = int(seed)
    while True:
        state = (state * 747796405 + 2891336453) & WRAP
        word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737 & WRAP
        yield word >> 22 ^ word


def records(seed, exponent):
    """The records of a sample in [2^exponent, 2^(exponent + 1)), falling: each a uniform share of the one before."""
    bits, found = pcg(int(seed) + (exponent + 127) * 0x9E3779B9 & WRAP), []
    record = 2.0 ** (exponent + 1)
    while (record := record * ((next(bits) >> 8) / 2**24)) >= 2.0**exponent:
        found.append(record)
    return found


def last_record(below, seed):
    """The last record of each sample below its sum: (n,) sums and seeds -> (n,) float64; 0 where there is none."""
    return np.array([_last_record_of(float(sum_), seed) for sum_, seed in zip(below, seed, strict=True)])


def _last_record_of(below, seed):
    if below <= 0:
        return 0.0
    for exponent in range(math.frexp(below)[1] - 1, -127, -1):
        for record in records(seed, exponent):
            if record < below:
                return record
    return 0.0


def reservoir_picks(weight, seed):
    """What samples with (m,) seeds pick from (n,) weights: the light in whose stretch of the sum the last record is."""
    ends = np.cumsum(np.asarray(weight, np.float64))
    if not len(ends) or ends[-1] == 0:
        return np.full(len(seed), -1)
    return np.searchsorted(ends, last_record(np.full(len(seed), ends[-1]), seed), side="right")


def raised_cosine_cdf(x):
    """Integral of (1 + cos(pi t)) / 2 from -1 to x."""
    return (x + 1 + np.sin(np.pi * x) / np.pi) / 2


def sphere_directions(count):
    """`count` unit vectors of a Fibonacci lattice: means over them are integrals over the sphere / 4 pi."""
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)
