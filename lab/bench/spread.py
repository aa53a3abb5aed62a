"""Repeated measurements in short: median and quartiles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

Spread = dict[str, Any]
"""``median``, ``q1``, ``q3`` and the number of ``runs``, as a record holds them."""

_DIGITS = 6


def spread(values: Sequence[float]) -> Spread:
    """Of one value or more; quartiles by linear interpolation."""
    q1, median, q3 = (round(float(q), _DIGITS) for q in np.quantile(np.asarray(values, np.float64), (0.25, 0.5, 0.75)))
    return {"median": median, "q1": q1, "q3": q3, "runs": len(values)}


def is_spread(value: object) -> bool:
    """Whether a part of a record is one."""
    return isinstance(value, dict) and {"median", "q1", "q3"} <= value.keys()


def differ(a: Spread, b: Spread) -> bool:
    """Whether more than noise lies between them: half of the runs of one beyond half of the runs of the other."""
    return bool(a["q3"] < b["q1"] or b["q3"] < a["q1"])
