"""What each stage's result depends on: the one table of which settings and which other stages it reads."""

from __future__ import annotations

from lab.engine.engine import STAGES
from lab.params import Params

LEVEL_SETTINGS = ("bounds_scale", "levels", "construction", "gather_range", "carry_moments", "centre_weight")
"""What the levels of given lights depend on; the other settings of build_hierarchy decide on :func:`draws_members`."""

_TERM = ("alpha", "first_level", "lobe", "receiver", "falloff", "clamp_distance", "interleave", "deal_all")
"""What one grid light sends to one point: ``LightSettings`` of core_cpp, and how it is dealt to tiles."""

STAGE_SETTINGS: dict[str, tuple[str, ...]] = {
    "trace_vpls": ("vpls", "max_bounces", "seed"),
    "build_hierarchy": (*LEVEL_SETTINGS, "shadow_samples", "shadow_points"),
    "render_gbuffer": (),
    "light": (
        *_TERM,
        "lighting",
        "shadow_samples",
        "first_shadow_level",
        "importance",
        "picker",
        "reservoir_locks",
        "seed",
        "frame",
    ),
    "trace_shadow_rays": (
        *_TERM,
        "shadow_samples",
        "shadow_points",
        "deviation_scale",
        "shadow_estimator",
        "omega_max",
        "member_candidates",
        "compensation",
        "compensation_samples",
        "max_bounces",
        "direct_samples",
        "seed",
        "frame",
    ),
    "filter_shadows": (
        "filter",
        "filter_backend",
        "sigma_deviation",
        "sigma_shadow",
        "sigma_normal",
        "sigma_position",
        "sigma_plane",
    ),
    "composite": ("interleave", "shadow_samples"),
}
"""The settings that a stage reads itself; what it reads of other stages' results is in :data:`STAGE_INPUTS`."""

STAGE_INPUTS: dict[str, tuple[str, ...]] = {
    "trace_vpls": (),
    "build_hierarchy": ("trace_vpls",),
    "render_gbuffer": (),
    "light": ("build_hierarchy", "render_gbuffer"),
    "trace_shadow_rays": ("build_hierarchy", "render_gbuffer", "light"),
    "filter_shadows": ("render_gbuffer", "trace_shadow_rays"),
    "composite": ("render_gbuffer", "light", "trace_shadow_rays", "filter_shadows"),
}
"""The stages whose records go into a stage."""


def draws_members(params: Params) -> bool:
    """Whether shadow points are drawn from member lists, which the hierarchy must then have."""
    return params.shadow_samples > 0 and params.shadow_points == "members"


def outdated_by(*stages: str) -> tuple[str, ...]:
    """`stages` and all that depend on them, in a frame's order: what has to be done again when these are."""
    outdated: set[str] = set(stages)
    for stage in STAGES:
        if outdated & set(STAGE_INPUTS[stage]):
            outdated.add(stage)
    return tuple(stage for stage in STAGES if stage in outdated)


def stages_touched(before: Params, after: Params) -> tuple[str, ...]:
    """The stages that are done again after a frame with other settings of the same view, in a frame's order."""
    changed = {name for name, value in before.to_dict().items() if getattr(after, name) != value}
    own = STAGE_SETTINGS | {"build_hierarchy": LEVEL_SETTINGS}
    touched = set(outdated_by(*(stage for stage, settings in own.items() if changed & set(settings))))
    if draws_members(after) and not draws_members(before):
        touched.add("build_hierarchy")  # for the lists alone: the levels stay the same, and what was lit by them
    return tuple(stage for stage in STAGES if stage in touched)
