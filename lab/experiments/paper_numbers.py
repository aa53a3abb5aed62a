"""What Lin and Yuksel measured on an RTX 2080 at 1280x720 (I3D 2019, Tables 1 to 3 and Figure 1), in milliseconds."""

from __future__ import annotations

CONSTRUCTION = {
    "scatter": {
        "bounds": 1.7, "S1": 2.3, "S2": 2.3, "S3": 4.7, "S4": 23.0, "S5": 107.0, "S6": 405.0, "S7": 1563.0,
        "merge": 0.5, "total": 2110.0,
    },
    "gather": {
        "bounds": 1.7, "S1": 2.3, "S2": 1.0, "S3": 1.0, "S4": 2.0, "S5": 1.0, "S6": 1.1, "S7": 1.5,
        "merge": 0.5, "total": 12.1,
    },
}  # fmt: skip
"""Table 1: the parts of constructing the levels of 100K VPLs."""

VPLS = (1_000, 10_000, 100_000, 1_000_000)

GROWTH = {
    "VPLs": (0.1, 0.2, 0.4, 2.5),
    "build": (7.0, 9.2, 12.1, 32.0),
    "render, shadow_samples=0": (5.6, 8.1, 11.2, 16.0),
    "render, shadow_samples=1": (10.1, 14.3, 18.4, 24.3),
    "render, shadow_samples=4": (15.5, 22.4, 28.5, 37.0),
}
"""Table 2: so many VPLs, not interleaved."""

INTERLEAVES = (1, 2, 4)

INTERLEAVED = {
    "render_gbuffer": (1.1, 1.1, 1.0),
    "light": (24.8, 9.0, 3.8),
    "trace_shadow_rays": (2.3, 2.2, 2.2),
    "filter_shadows": (1.9, 2.8, 2.9),
    "composite": (0.1, 0.1, 0.1),
    "total": (30.2, 15.2, 10.1),
}
"""Table 3: the stages of 100K VPLs with 4 shadow samples, interleaved 1x1, 2x2 and 4x4."""

FIGURE_1 = 24.0
"""Rendering 1M VPLs with alpha 2, interleaved 4x4."""

REGENERATED = 58.8
"""1M VPLs, their levels, and rendering with 1 shadow sample: the sum of Table 2's last column."""
