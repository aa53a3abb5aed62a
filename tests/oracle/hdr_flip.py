"""HDR-FLIP in float64 numpy, from the papers alone: plain two-dimensional convolutions, one step after the other.

FLIP: Andersson et al., HPG 2020 (constants of its tables 1 and 2). HDR-FLIP: Andersson et al., Eurographics 2021.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float64]

# Contrast sensitivity as sums of Gaussians a sqrt(pi / b) exp(-pi^2 r^2 / b), r in degrees: [(a, b), ...] a channel.
SENSITIVITY = [[(1.0, 0.0047)], [(1.0, 0.0053)], [(34.1, 0.04), (13.5, 0.025)]]

TO_XYZ = np.array(
    [
        [10135552, 8788810, 4435075],
        [5226144, 17577620, 1774030],
        [1425312 / 3, 8788810 / 3, 70074185 / 3],
    ]
) / np.array([[24577794], [24577794], [24577794]])  # fmt: skip
WHITE = TO_XYZ.sum(axis=1)

QC, PC, PT, W, QF = 0.7, 0.4, 0.95, 0.082, 0.5


def hdr_flip(image: Array, reference: Array, pixels_per_degree: float) -> Array:
    """(H, W) map for two (H, W, 3) images of linear light."""
    start, stop = exposures(reference)
    count = max(2, math.ceil(stop - start))
    maps = []
    for exposure in np.linspace(start, stop, count):
        shown = [np.clip(aces(x * 2.0**exposure), 0, 1) for x in (image, reference)]
        maps.append(ldr_flip(*shown, pixels_per_degree))
    return np.max(maps, axis=0)


def aces(x: Array) -> Array:
    """Narkowicz's fit of the ACES curve, at its usual exposure of 0.6."""
    x = 0.6 * x
    return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)


def exposures(reference: Array) -> tuple[float, float]:
    """Stops at which the brightest and the median pixel come to 85 % of white."""
    low, high = 0.0, 1e3
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if aces(np.array(middle)) < 0.85 else (low, middle)
    seen = np.sort((reference @ np.array([0.2126, 0.7152, 0.0722])).ravel())
    return math.log2(low / seen[-1]), math.log2(low / seen[len(seen) // 2])


def ldr_flip(image: Array, reference: Array, pixels_per_degree: float) -> Array:
    """(H, W) map for two images in [0, 1], linear."""
    opponents = [ycxcz(x) for x in (image, reference)]
    colour = redistributed(hyab(*(hunt_lab(filtered(x, pixels_per_degree)) for x in opponents)))
    greys = [(x[..., 0] + 16) / 116 for x in opponents]
    edges, points = ([features(grey, pixels_per_degree, order) for grey in greys] for order in (1, 2))
    feature = np.maximum(abs(edges[0] - edges[1]), abs(points[0] - points[1])) / math.sqrt(2)
    return colour ** (1 - feature**QF)


def ycxcz(rgb: Array) -> Array:
    x, y, z = np.moveaxis(rgb @ TO_XYZ.T / WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def filtered(opponent: Array, pixels_per_degree: float) -> Array:
    """The image as the eye resolves it, back in linear RGB and cut to the screen's gamut."""
    widest = max(b for channel in SENSITIVITY for _, b in channel)
    radius = math.ceil(3 * math.sqrt(widest / (2 * math.pi**2)) * pixels_per_degree)
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1] / pixels_per_degree
    r2 = x**2 + y**2
    seen = np.empty_like(opponent)
    for c, channel in enumerate(SENSITIVITY):
        kernel = sum(a * math.sqrt(math.pi / b) * np.exp(-(math.pi**2) * r2 / b) for a, b in channel)
        seen[..., c] = ndimage.convolve(opponent[..., c], kernel / kernel.sum(), mode="nearest")
    luma = (seen[..., 0] + 16) / 116
    xyz = np.stack([luma + seen[..., 1] / 500, luma, luma - seen[..., 2] / 200], axis=-1) * WHITE
    return np.clip(xyz @ np.linalg.inv(TO_XYZ).T, 0, 1)


def hunt_lab(rgb: Array) -> Array:
    """CIELab with the chroma scaled by the lightness (Hunt effect)."""
    t = rgb @ TO_XYZ.T / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    lightness = 116 * f[..., 1] - 16
    chroma = np.stack([500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)
    return np.concatenate([lightness[..., None], 0.01 * lightness[..., None] * chroma], axis=-1)


def hyab(a: Array, b: Array) -> Array:
    return abs(a[..., 0] - b[..., 0]) + np.hypot(a[..., 1] - b[..., 1], a[..., 2] - b[..., 2])


def redistributed(distance: Array) -> Array:
    """Distances to [0, 1]: most of the range goes to those below the share PC of the greatest, green against blue."""
    green, blue = (hunt_lab(np.array(rgb, np.float64)) for rgb in ([0, 1, 0], [0, 0, 1]))
    most = hyab(green, blue) ** QC
    powered, knee = distance**QC, PC * most
    return np.where(powered < knee, PT / knee * powered, PT + (powered - knee) / (most - knee) * (1 - PT))


def features(grey: Array, pixels_per_degree: float, order: int) -> Array:
    """Magnitude of edges (order 1) or points (order 2): derivatives of a Gaussian, both signs normalised to 1."""
    sigma = 0.5 * W * pixels_per_degree
    radius = math.ceil(3 * sigma)
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1].astype(np.float64)
    gauss = np.exp(-(x**2 + y**2) / (2 * sigma**2))
    kernel = -x * gauss if order == 1 else (x**2 / sigma**2 - 1) * gauss
    kernel = np.where(kernel > 0, kernel / kernel[kernel > 0].sum(), kernel / -kernel[kernel < 0].sum())
    along = [ndimage.correlate(grey, k, mode="nearest") for k in (kernel, kernel.T)]
    return np.hypot(*along)
