"""Rows of device buffers as numpy types, the counterparts of ``shaders/lib/records.slang``."""

from __future__ import annotations

import numpy as np

LEVEL_SLOTS = 16
"""Levels 0 to 12, and the end."""

INPUT_LIGHT = np.dtype(
    [
        ("position", "3f4"),
        ("unused0", "u4"),
        ("flux", "3f4"),
        ("unused1", "u4"),
        ("normal", "3f4"),
        ("unused2", "u4"),
    ]
)

GRID_LIGHT = np.dtype(
    [
        ("position", "3f4"),
        ("moment_xx", "f4"),
        ("flux", "3f4"),
        ("moment_yy", "f4"),
        ("normal", "3f4"),
        ("moment_zz", "f4"),
        ("deviation", "3f4"),
        ("moment_xy", "f4"),
        ("moment_xz", "f4"),
        ("moment_yz", "f4"),
        ("vertex_xy", "u4"),
        ("vertex_z_oriented", "u4"),
    ]
)

HIERARCHY_INFO = np.dtype(
    [
        ("origin", "3f4"),
        ("top_size", "f4"),
        ("flux_scale", "f4"),
        ("top", "i4"),
        ("inputs", "u4"),
        ("overflow", "u4"),
        ("offset", "u4", LEVEL_SLOTS),
        ("cell_size", "f4", LEVEL_SLOTS),
    ]
)

SIGNAL_SCALE = np.dtype([("mean", "f4"), ("per_denominator", "f4"), ("unused0", "f4"), ("unused1", "f4")])
"""Of stage filter_shadows: what a signal is measured in."""

BUILD_STATE = np.dtype(
    [
        ("inverse_top", "f4"),
        ("candidate", "u4"),
        ("done", "u4"),
        ("s1_words", "u4"),
        ("counted", "u4", 16),
        ("unweighted", "u4", 16),
        ("bounds", "u4", 8),
    ]
)
"""Of stage build_hierarchy: shaders/lib/build_state.slang."""
