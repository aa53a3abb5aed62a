"""The approximations between the path-traced truth and a real-time frame, one by one, as settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from lab.params import Params, Value

Settings = Mapping[str, Value]

LIGHTS, LIGHT, SHADOWS = "lights", "light", "shadows"
"""Where a term acts: on the virtual lights themselves, on the unshadowed light, or on the shadows."""


@dataclass(frozen=True)
class Term:
    """One approximation.

    Attributes:
        name: short, unique.    what: in plain words.    stage: where it acts.
        exact: settings without it.    approximate: settings with it, for a frame that does without.
        needs: settings without which it changes nothing, or can't be told apart.
        times: settings that are multiplied where it is switched off, as they are never exact.
        variant: one of several ways to be inexact: a frame has it only with the very values of `approximate`.
    """

    name: str
    what: str
    stage: str
    exact: Settings = field(default_factory=dict)
    approximate: Settings = field(default_factory=dict)
    needs: Settings = field(default_factory=dict)
    times: Mapping[str, int] = field(default_factory=dict)
    variant: bool = False

    @property
    def settings(self) -> tuple[str, ...]:
        """Names of the settings that it is about."""
        return tuple(dict.fromkeys([*self.times, *self.exact]))

    def active(self, params: Params) -> bool:
        """Whether a frame of `params` has the approximation."""
        values = params.to_dict()
        if self.variant:
            return all(values[name] == value for name, value in self.approximate.items())
        return bool(self.times) or any(values[name] != value for name, value in self.exact.items())

    def without(self, params: Params) -> Params:
        """`params` without the approximation, or with so much less of it as is practical."""
        values = params.to_dict()
        more = {name: _times(values[name], factor) for name, factor in self.times.items()}
        return params.replace(**self.exact, **more)

    def among(self, ideal: Params, params: Params) -> Params:
        """`ideal` with this approximation alone, as `params` has it, or as it usually is."""
        values = params.to_dict()
        chosen = {name: values[name] for name in self.settings} if self.active(params) else dict(self.approximate)
        return ideal.replace(**{**self.needs, **chosen})


def _times(value: Value, factor: int) -> Value:
    return value if isinstance(value, str | bool) else value * factor


_USUAL_FILTER: Settings = {"filter": Params().filter}

# In the order of a frame. Where none of the values is exact, `exact` is the one that the others are measured against.
TERMS = (
    Term("vpls", "finitely many virtual lights", LIGHTS, times={"vpls": 10}),
    Term(
        "clamp", "the falloff of virtual lights is clamped nearby", LIGHTS,
        {"compensation": "path", "compensation_samples": 64}, {"compensation": "none", "compensation_samples": 4},
    ),
    Term(
        "falloff", "softened in place of clamped falloff", LIGHTS,
        {"falloff": "clamped"}, {"falloff": "softened"}, {"compensation": "none"},
    ),
    Term("hierarchy", "grid lights in place of far lights (alpha)", LIGHT, times={"alpha": 4}),
    Term("first_level", "S1 in place of the lights themselves, S0", LIGHT, {"first_level": 0}, {"first_level": 1}),
    Term(
        "construction", "coarse levels gathered from S1, not scattered from S0", LIGHT,
        {"construction": "scatter"}, {"construction": "gather"},
    ),
    Term(
        "gathering", "gathering without moments and without far faces, as the demo does", LIGHT,
        {"carry_moments": True, "gather_range": "inclusive"}, {"carry_moments": False, "gather_range": "half_open"},
        {"construction": "gather"},
    ),
    Term(
        "centre", "illumination centres that don't weigh by flux", LIGHT,
        {"centre_weight": "flux"}, {"centre_weight": "count"},
    ),
    Term(
        "levels", "the demo's number of levels and larger cells", LIGHT,
        {"levels": "auto", "bounds_scale": 1.0}, {"levels": "demo", "bounds_scale": 1.1},
    ),
    Term("lobe", "a mean normal in place of two moments", LIGHT, {"lobe": "moments"}, {"lobe": "mean"}, variant=True),
    Term(
        "lobe_energy", "a mean normal, with its power kept", LIGHT,
        {"lobe": "moments"}, {"lobe": "mean_energy"}, variant=True,
    ),
    Term(
        "receiver", "the receiver's cosine softened by the deviation", LIGHT,
        {"receiver": "hard"}, {"receiver": "soft"},
    ),
    Term("interleave", "each pixel sees one tile's share of the lights", LIGHT, {"interleave": 1}, {"interleave": 4}),
    Term(
        "deal_all", "coarsest levels are dealt to tiles, too", LIGHT,
        {"deal_all": False}, {"deal_all": True}, {"interleave": 4},
    ),
    Term(
        "shadow_level", "no shadow samples from the finest levels", SHADOWS,
        {"first_shadow_level": 0}, {"first_shadow_level": 2},
    ),
    Term(
        "shadow_points", "shadow rays to jittered points, not to member lights", SHADOWS,
        {"shadow_points": "members"}, {"shadow_points": "jitter"},
    ),
    Term(
        "average", "mean visibility in place of the weighted ratio", SHADOWS,
        {"shadow_estimator": "ratio"}, {"shadow_estimator": "average"}, variant=True,
    ),
    Term(
        "ratio_rgb", "a ratio for each channel, samples weighted by what they send", SHADOWS,
        {"shadow_estimator": "ratio"}, {"shadow_estimator": "ratio_rgb"}, variant=True,
    ),
    Term(
        "corrected", "shadows that also weigh the light itself", SHADOWS,
        {"shadow_estimator": "ratio"}, {"shadow_estimator": "corrected"}, variant=True,
    ),
    Term("omega", "the weight of members is capped", SHADOWS, {"omega_max": "none"}, {"omega_max": 2.0}),
    Term(
        "importance", "lights are picked evenly, not by contribution", SHADOWS,
        {"importance": True}, {"importance": False},
    ),
    Term("samples", "few shadow samples a pixel, unfiltered", SHADOWS, {"shadow_samples": 64}, {"shadow_samples": 4}),
    Term("filter", "shadows are filtered over neighbouring pixels", SHADOWS, {"filter": "none"}, _USUAL_FILTER),
    Term(
        "noise", "few shadow samples, and the filter that smooths them", SHADOWS,
        {"shadow_samples": 64, "filter": "none"}, {"shadow_samples": 4, **_USUAL_FILTER},
    ),
)  # fmt: skip

WHOLE_SHADOWS = Term("hierarchy_shadows", "shadow samples of grid lights in place of all lights", SHADOWS)
"""The hierarchy once more, as the shadows see it: no setting of its own."""

UNRELATED = {
    "max_bounces": "the truth has the same bounces",
    "clamp_distance": "belongs to clamp, and is its exact value where lights are a list",
    "picker": "both pick by one distribution",
    "lighting": "both add up the same light",
    "reservoir_locks": "of lighting=raster; what no lock costs depends on the graphics card (race_laboratory)",
    "member_candidates": "one mean with more or less noise, which is that of samples",
    "deviation_scale": "belongs to shadow_points",
    "filter_backend": "both give one result",
    "sigma_deviation": "belongs to filter",
    "sigma_shadow": "belongs to filter",
    "sigma_normal": "belongs to filter",
    "sigma_position": "belongs to filter",
    "sigma_plane": "belongs to filter",
    "direct_samples": "of the direct light",
    "seed": "other noise, no other approximation",
    "frame": "other noise, no other approximation",
}
"""Settings that no term is about, and why."""


def ideal(params: Params) -> Params:
    """`params` with its hierarchy and nothing else approximated: the state that single terms are added to."""
    exact = {name: value for term in TERMS for name, value in term.exact.items()}
    # Here the processor adds up the light, in tiles.
    return params.replace(**{**exact, "compensation": "none", "lighting": "tiled", "reservoir_locks": "atomic_race"})


def applicable(term: Term, *, light_list: bool) -> Term | None:
    """The term in a scene lit by a list of lights: those are not virtual, and clamped against nothing."""
    if not light_list or term.name not in ("vpls", "clamp"):
        return term
    if term.name == "vpls":
        return None
    return replace(
        term,
        what="the falloff of lights is clamped nearby",
        exact={"clamp_distance": 0.0},
        approximate={"clamp_distance": 0.01},
    )
