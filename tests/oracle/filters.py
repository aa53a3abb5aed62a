"""The filters of the shadow ratio in float64: every tap of every pixel by explicit index, by the definitions alone."""

from __future__ import annotations

import math

import numpy as np

from lab.params import Params
from lab.records import FilteredShadows, GBuffer, ShadowSamples

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
STEPS = (1, 2, 4, 8, 16)


def oracle(gbuffer: GBuffer, shadows: ShadowSamples, params: Params, scene_radius: float) -> FilteredShadows:
    """What a filter other than `none` makes of the signals; irradiance is a ratio over 1 on surfaces, 0 elsewhere."""
    run = by_variance if params.filter == "atrous_variance" else by_distance
    shadowed, weight = run(gbuffer, params, scene_radius, shadows.shadowed.astype(float), shadows.weight.astype(float))
    hit = (gbuffer.depth > 0)[..., None]

    def light(noisy, params=params):
        noisy = noisy.astype(float)
        if not noisy.any():
            return noisy
        mean = (noisy @ LUMINANCE)[hit[..., 0]].mean()
        over, under = run(gbuffer, params, scene_radius, noisy, np.repeat(hit, 3, axis=2).astype(float), mean)
        return np.divide(over, under, out=np.zeros_like(noisy), where=hit)

    left_out = shadows.left_out
    if left_out is not None:  # found by few short paths: guided by geometry alone
        left_out = light(left_out, params.replace(sigma_shadow="none", sigma_deviation="none"))
    return FilteredShadows(shadowed, weight, light(shadows.area), left_out)


def tap_table(length, step, radius):
    """(length, 2 radius + 1): the pixels read by each pixel's taps; np.pad does the reflection of each sub-image."""
    table = np.empty((length, 2 * radius + 1), int)
    for residue in range(min(step, length)):
        members = np.arange(residue, length, step)
        mode = "reflect" if len(members) > 1 else "edge"
        padded = np.pad(members, radius, mode=mode)
        for i, pixel in enumerate(members):
            table[pixel] = padded[i : i + 2 * radius + 1]
    return table


def windows(height, width, step, radius):
    """(taps, H, W) rows and columns of each pixel's window, and the (dy, dx) of its taps."""
    rows, columns = tap_table(height, step, radius), tap_table(width, step, radius)
    offsets = [(dy, dx) for dy in range(-radius, radius + 1) for dx in range(-radius, radius + 1)]
    at = [np.ix_(rows[:, dy + radius], columns[:, dx + radius]) for dy, dx in offsets]
    both = [np.broadcast_arrays(*one) for one in at]
    return np.stack([r for r, _ in both]), np.stack([c for _, c in both]), offsets


def one_over(sigma):
    return 0.0 if sigma == "none" else 1 / sigma


def bright(signal):
    return signal @ LUMINANCE if signal.shape[-1] == 3 else signal[..., 0]


# --- atrous, atrous_plane, bilateral: one Gaussian of a distance -----------------------------------------------------


def one_pass(gbuffer, params, scene_radius, numerator, denominator, value, step):
    kind = params.filter
    radius, sigma = (8, 4.0) if kind == "bilateral" else (2, 1.0)
    b3 = {-2: 1, -1: 4, 0: 6, 1: 4, 2: 1}
    height, width = value.shape
    rows, columns = tap_table(height, step, radius), tap_table(width, step, radius)
    position, normal = gbuffer.position.astype(float), gbuffer.normal.astype(float)
    hit = gbuffer.depth > 0
    sums = [np.zeros_like(numerator), np.zeros_like(denominator)]
    weights = np.zeros((height, width))
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            q = np.ix_(rows[:, dy + radius], columns[:, dx + radius])
            difference = (value[q] - value) * one_over(params.sigma_shadow)
            turned = np.linalg.norm(normal[q] - normal, axis=2) * one_over(params.sigma_normal)
            moved = position[q] - position
            if kind == "atrous_plane":
                space = b3[dy] * b3[dx] / 256
                footprint = np.where(hit, gbuffer.depth.astype(float) * gbuffer.pixel_angle, 1)
                off = np.sum(normal * moved, axis=2) / (footprint * step) * one_over(params.sigma_plane)
            else:
                space = math.exp(-(dx * dx + dy * dy) / (2 * sigma**2))
                off = np.linalg.norm(moved, axis=2) / scene_radius * one_over(params.sigma_position)
            weight = space * np.exp(-0.5 * (difference**2 + turned**2 + off**2))
            if kind == "atrous_plane" and (dx, dy) != (0, 0):
                weight = weight * hit * hit[q]
            weights += weight
            sums[0] += weight[..., None] * numerator[q]
            sums[1] += weight[..., None] * denominator[q]
    return sums[0] / weights[..., None], sums[1] / weights[..., None]


def by_distance(gbuffer, params, scene_radius, numerator, denominator, mean=0.0):
    for step in (1,) if params.filter == "bilateral" else STEPS:
        ratio = np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)
        value = bright(ratio)
        if mean:
            value = value / (value + mean)
        numerator, denominator = one_pass(gbuffer, params, scene_radius, numerator, denominator, value, step)
    return numerator, denominator


# --- atrous_variance: values told apart by their own noise -----------------------------------------------------------


def likeness(gbuffer, params, scene_radius, rows, columns):
    """(taps, H, W), 0 to 1: how much the surfaces of a pixel and of each tap are one. A pixel is always like itself."""
    normal, position = gbuffer.normal.astype(float), gbuffer.position.astype(float)
    hit = gbuffer.depth > 0
    turned = ((normal[rows, columns] - normal) ** 2).sum(-1) * one_over(params.sigma_normal) ** 2
    moved = ((position[rows, columns] - position) ** 2).sum(-1) * (one_over(params.sigma_position) / scene_radius) ** 2
    like = np.exp(-0.5 * (turned + moved)) * hit * hit[rows, columns]
    like[len(like) // 2] = 1
    return like


def variance_of_values(like, over, under):
    """Variance of single pixels' values over / under; `over`, `under` (taps, H, W).

    Of a ratio of means, to first order: the mean square of over - ratio * under, over the squared mean of under.
    """
    share = like / like.sum(axis=0)
    mean_under = (share * under).sum(axis=0)
    known = mean_under > 0
    safe = np.where(known, mean_under, 1)
    ratio = np.where(known, (share * over).sum(axis=0) / safe, 0)
    return np.where(known, (share * (over - ratio * under) ** 2).sum(axis=0) / safe**2, 0)


def by_variance(gbuffer, params, scene_radius, numerator, denominator, scale=1.0):
    height, width = gbuffer.depth.shape
    tolerance = math.inf if params.sigma_deviation == "none" else params.sigma_deviation

    def surroundings(radius):
        near = windows(height, width, 1, radius)[:2]
        like = likeness(gbuffer, params, scene_radius, *near)
        return near, np.where(like > 2.0**-20, like, 0)  # nothing is known from pixels less alike

    near, like = surroundings(2)
    variance = variance_of_values(like, bright(numerator)[near] / scale, bright(denominator)[near])
    gauss = {d: math.exp(-d * d / 2) for d in range(-2, 3)}
    for step in STEPS:
        near, like = surroundings(1 if step == 1 else 0)
        below = (like * bright(denominator)[near]).sum(axis=0)
        above = (like * bright(numerator)[near]).sum(axis=0) / scale
        value = np.divide(above, below, out=np.zeros_like(above), where=below > 0)
        deviation = np.sqrt((like * variance[near]).sum(axis=0) / like.sum(axis=0))

        rows, columns, offsets = windows(height, width, step, 2)
        weight = likeness(gbuffer, params, scene_radius, rows, columns)
        if math.isfinite(tolerance):
            apart = np.abs(value[rows, columns] - value) / (tolerance * deviation + 0.02)
            weight *= np.where(below > 0, np.exp(-apart), 1)
        weight *= np.array([gauss[dy] * gauss[dx] for dy, dx in offsets])[:, None, None]
        weight[len(offsets) // 2] = 1
        share = weight / weight.sum(axis=0)
        numerator = (share[..., None] * numerator[rows, columns]).sum(axis=0)
        denominator = (share[..., None] * denominator[rows, columns]).sum(axis=0)
        variance = (share**2 * variance[rows, columns]).sum(axis=0)
    return numerator, denominator
