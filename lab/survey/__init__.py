"""Statistics of whole frames: lights a pixel looks at, where shadow samples go, where light leaks or is missing."""

from __future__ import annotations

from lab.survey.importance import ImportanceComparison, ImportanceSide, compare_importance
from lab.survey.leak_map import EFFORTS, LeakMap, Spot, leak_map, reference_of
from lab.survey.overdraw import CountStatistics, OverdrawSurvey, overdraw_survey
from lab.survey.overdraw_growth import OverdrawGrowth, overdraw_growth
from lab.survey.shadow_distribution import (
    PickedLight,
    ShadowDistribution,
    sampled_distribution,
    shadow_distribution,
)

__all__ = [
    "EFFORTS",
    "CountStatistics",
    "ImportanceComparison",
    "ImportanceSide",
    "LeakMap",
    "OverdrawGrowth",
    "OverdrawSurvey",
    "PickedLight",
    "ShadowDistribution",
    "Spot",
    "compare_importance",
    "leak_map",
    "overdraw_growth",
    "overdraw_survey",
    "reference_of",
    "sampled_distribution",
    "shadow_distribution",
]
