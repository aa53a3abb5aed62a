"""Metrics: errors against a reference, errors over many seeds, and whether a difference is more than noise."""

from __future__ import annotations

from lab.metrics.chi_square import ChiSquare, chi_square, pooled
from lab.metrics.error import energy_ratio, floor_of, mse, rel_mse, rel_mse_noise, relative_error, rmse
from lab.metrics.hdr_flip import PIXELS_PER_DEGREE, flip, flip_exposures
from lab.metrics.seeds import BiasVariance, Moments, bias_variance, moments, temporal
from lab.metrics.significance import Sidak, sidak, welch_test, z_test

__all__ = [
    "PIXELS_PER_DEGREE",
    "BiasVariance",
    "ChiSquare",
    "Moments",
    "Sidak",
    "bias_variance",
    "chi_square",
    "energy_ratio",
    "flip",
    "flip_exposures",
    "floor_of",
    "moments",
    "mse",
    "pooled",
    "rel_mse",
    "rel_mse_noise",
    "relative_error",
    "rmse",
    "sidak",
    "temporal",
    "welch_test",
    "z_test",
]
