"""THE parameters of the method: the one place where a setting is defined.

Every setting is a field of :class:`Params` that carries its own documentation: unit, allowed values,
the paper's symbol and section. The command line (``--set``), saved run records, the C++ struct
(``core_cpp/include/lab/params.h``) and the documentation are all checked against this file.

Sections: "LY19 3.1" is a section of Lin & Yuksel, "Real-Time Rendering with Lighting Grid Hierarchy", I3D 2019.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

from lab.errors import LabError, nearest

Value = int | float | bool | str


@dataclass(frozen=True)
class Setting:
    """What a field of :class:`Params` may be.

    Attributes:
        doc: one line for people.
        kind: ``int``, ``float``, ``bool`` or ``str`` (one of `choices`).
        low, high: inclusive numeric range (`low` exclusive where `open_low`).
        choices: allowed words (kind ``str``) or allowed numbers (kind ``int``), empty for any.
        words: words allowed beside numbers, with the number the C++ core knows them by.
        unit, symbol, section: physical unit, the paper's symbol, where the paper defines it.
    """

    doc: str
    kind: type
    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    choices: tuple[Value, ...] = ()
    words: dict[str, float] = dataclasses.field(default_factory=dict)
    unit: str = ""
    symbol: str = ""
    section: str = ""

    def allowed(self) -> str:
        """The allowed values, as a message shows them."""
        if self.kind is bool:
            return "true or false"
        if self.choices:
            return " | ".join(str(choice) for choice in self.choices)
        bound = f"{'a whole number' if self.kind is int else 'a number'}"
        low, high = math.isfinite(self.low), math.isfinite(self.high)
        least = f"> {self.low:g}" if self.open_low else f">= {self.low:.12g}"
        if low and high and not self.open_low:
            bound += f" from {self.low:.12g} to {self.high:.12g}"
        elif low:
            bound += f" {least}" + (f" and <= {self.high:.12g}" if high else "")
        return " | ".join([bound, *self.words])

    def check(self, name: str, value: object) -> Value:
        """`value` as this setting's type, or a :class:`LabError` that says what is allowed."""
        parsed = self._parse(value)
        if parsed is None or not self._in_range(parsed):
            hint = nearest(str(value), [str(c) for c in self.choices]) if self.kind is str else ""
            raise LabError(f"{name}={value}: allowed is {self.allowed()}{hint} ({self.doc})")
        return parsed

    def _parse(self, value: object) -> Value | None:
        if isinstance(value, str) and value in self.words:
            return value
        if self.kind is bool:
            return value if isinstance(value, bool) else {"true": True, "false": False}.get(str(value).lower())
        if self.kind is str:
            return value if isinstance(value, str) else None
        return None if isinstance(value, bool) else self._parse_number(str(value))

    def _parse_number(self, text: str) -> int | float | None:
        try:
            # Python alone would read 1_000 and digits of other scripts, too.
            number = float(text if text.isascii() and "_" not in text else "")
        except ValueError:
            return None
        if self.kind is float:
            return number
        return int(number) if math.isfinite(number) and number == int(number) else None

    def _in_range(self, value: Value) -> bool:
        if isinstance(value, str) and value in self.words:
            return True
        if self.choices:
            return value in self.choices
        if isinstance(value, bool):
            return True
        if isinstance(value, str) or not math.isfinite(value):
            return False
        return (value > self.low if self.open_low else value >= self.low) and value <= self.high


def _field(default: Value, doc: str, kind: type, **meta: Any) -> Any:
    return dataclasses.field(default=default, metadata={"setting": Setting(doc, kind, **meta)})


def _choice(default: str, doc: str, *choices: str, **meta: Any) -> Any:
    return _field(default, doc, str, choices=choices, **meta)


_OFF = {"none": math.inf}  # a tolerance without bound: this guide does not stop the filter


@dataclass(frozen=True)
class Params:
    """All settings of one frame. Unknown or out-of-range values raise :class:`LabError`; nothing is clamped."""

    # --- the lights -------------------------------------------------------------------------------
    vpls: int = _field(100_000, "virtual point lights to trace", int, low=1, high=2**31, section="LY19 4")
    max_bounces: int = _field(3, "most bounces of a light path", int, low=1, high=16, section="LY19 4")

    # --- the hierarchy ----------------------------------------------------------------------------
    bounds_scale: float = _field(
        1.0, "top cell over the longest edge of the lights' bounding box", float, low=1, high=2, section="LY19 3.1"
    )
    levels: int | str = _field(
        "auto", "grid levels, Vulkan 10 at most; auto: while |S1| is under half of the lights; demo: while 8^H <= 10 N",
        int, low=1, high=12, words={"auto": 0, "demo": -1}, symbol="l_max", section="LY19 3.1, 4.3",
    )  # fmt: skip
    construction: str = _choice(
        "gather", "how S2 and up are built: gather from S1, or scatter every level from S0",
        "gather", "scatter", section="LY19 3.1",
    )  # fmt: skip
    gather_range: str = _choice(
        "inclusive", "S1 vertices searched around a vertex; half_open (demo) loses flux at its far faces",
        "inclusive", "half_open", section="LY19 3.1",
    )  # fmt: skip
    carry_moments: bool = _field(
        True, "gather carries the S1 lights' own weight and internal moments (law of total variance)", bool,
        section="LY19 3.1",
    )  # fmt: skip
    centre_weight: str = _choice(
        "flux", "what weights the illumination centre: luminance of the flux, or (demo) the trilinear weight alone",
        "flux", "count", section="LY19 3.1",
    )  # fmt: skip

    # --- lighting ---------------------------------------------------------------------------------
    lighting: str = _choice(
        "tiled", "tiles of pixels with culled lists of lights, or (paper; Vulkan only) one rasterised cube a light",
        "tiled", "raster", section="LY19 3.2",
    )  # fmt: skip
    lobe: str = _choice(
        "moments", "emission of a grid light: E[n] and E[n n^T], E[n] with its power kept, or (demo) bare E[n]",
        "moments", "mean_energy", "mean", section="LY19 3.2",
    )  # fmt: skip
    receiver: str = _choice(
        "hard", "receiver's cosine at a grid light's centre, or softened by its position deviation",
        "hard", "soft", section="LY19 3.2",
    )  # fmt: skip
    alpha: float = _field(
        1.0, "blend radius over cell size: accuracy against lights per pixel", float, low=0, high=1e6, open_low=True,
        symbol="alpha", section="LY19 2.2",
    )  # fmt: skip
    first_level: int = _field(
        0, "finest level drawn: 0 the lights themselves, 1 the paper's choice", int, choices=(0, 1), section="LY19 4.1"
    )
    falloff: str = _choice(
        "clamped", "1/max(d^2, c^2), or (demo) 1/(d^2 + c^2)", "clamped", "softened", section="LY19 2.1"
    )
    clamp_distance: float = _field(
        0.01, "c of the falloff", float, low=0, high=1e6, unit="scene radius", symbol="c", section="LY19 2.1"
    )
    compensation: str = _choice(
        "none", "light that the clamp of VPLs leaves out, brought back by short paths (Kollig & Keller 2004)",
        "none", "path", section="LY19 2.1",
    )  # fmt: skip
    compensation_samples: int = _field(4, "short paths a pixel for compensation=path", int, low=1, high=64)

    # --- shadow samples ---------------------------------------------------------------------------
    shadow_samples: int = _field(
        4, "shadow rays a pixel; 0: no shadows", int, low=0, high=64, symbol="k", section="LY19 3.3"
    )
    first_shadow_level: int = _field(
        0, "finest level that shadow samples are picked from", int, low=0, high=12, section="LY19 4.1"
    )
    importance: bool = _field(
        True, "pick lights in proportion to their contribution, or evenly", bool, symbol="f_i", section="LY19 3.3"
    )
    picker: str = _choice(
        "reservoir", "weighted reservoir, or the smallest -ln(u)/f (same distribution, any order)",
        "reservoir", "race", section="LY19 3.3, appendix A",
    )  # fmt: skip
    reservoir_locks: str = _choice(
        "atomic_race",
        "raster: reservoirs that fragments update unguarded (paper) or locked, or picker=race by atomic minima",
        "none", "locked", "atomic_race", section="LY19 4.1",
    )  # fmt: skip
    shadow_points: str = _choice(
        "members", "shadow rays end on an input light drawn from the grid light, or jittered around its centre",
        "members", "jitter", section="LY19 3.3",
    )  # fmt: skip
    deviation_scale: float = _field(
        0.5, "spread of jittered shadow points", float, low=0, high=2, unit="position deviation", section="LY19 3.3"
    )
    shadow_estimator: str = _choice(
        "ratio", "sum of V omega over sum of omega; mean V (paper); RGB ratio (demo); or E times mean V omega",
        "ratio", "average", "ratio_rgb", "corrected", section="LY19 3.3",
    )  # fmt: skip
    omega_max: float | str = _field(
        8.0, "cap of a member's weight omega", float, low=0, open_low=True, words={"none": math.inf}, section="LY19 3.3"
    )
    member_candidates: int = _field(
        3, "members compared for each shadow ray; it goes to one in proportion to their omegas (1: no choice)", int,
        low=1, high=16,
        section="LY19 3.3",
    )  # fmt: skip

    # --- interleaving -----------------------------------------------------------------------------
    interleave: int = _field(
        1, "n: the frame is dealt to n x n tiles, each level's lights to one tile each", int,
        choices=(1, 2, 4, 8), symbol="n", section="LY19 4.3",
    )  # fmt: skip
    deal_all: bool = _field(
        False, "deal levels of fewer than n x n lights too (demo: some tiles see none of them)", bool,
        section="LY19 4.3",
    )  # fmt: skip

    # --- filter -----------------------------------------------------------------------------------
    filter: str = _choice(
        "atrous_variance",
        "edge-stopping wavelet guided by the measured noise; by a fixed tolerance (paper); by plane distance; one "
        "bilateral pass; or none",
        "atrous_variance", "atrous", "atrous_plane", "bilateral", "none", section="LY19 3.3",
    )  # fmt: skip
    filter_backend: str = _choice("fused", "C++ kernel, or kornia on torch", "fused", "kornia", section="LY19 3.3")
    sigma_deviation: float = _field(
        3.0, "filter atrous_variance: tolerated difference of the shadow ratio", float, low=0, open_low=True,
        words=_OFF, unit="its standard deviation",
    )  # fmt: skip
    sigma_shadow: float = _field(
        1.0, "filters atrous, atrous_plane and bilateral: tolerated difference of the shadow ratio", float, low=0,
        open_low=True, words=_OFF, symbol="s_c",
    )  # fmt: skip
    sigma_normal: float = _field(
        0.25, "filter: tolerated difference of unit normals", float, low=0, open_low=True, words=_OFF, symbol="s_n"
    )
    sigma_position: float = _field(
        0.01, "filter: tolerated distance between points", float, low=0, open_low=True, words=_OFF,
        unit="scene radius", symbol="s_p",
    )  # fmt: skip
    sigma_plane: float = _field(
        0.2, "filter atrous_plane: tolerated distance from the pixel's plane", float, low=0, open_low=True, words=_OFF,
        unit="pixel footprint",
    )  # fmt: skip

    # --- direct light and random numbers ----------------------------------------------------------
    direct_samples: int = _field(4, "rays a pixel to emissive triangles", int, low=0, high=64)
    seed: int = _field(0, "seed of every random number", int, low=0, high=2**32 - 1)
    frame: int = _field(0, "frame number: other shadow samples, same lights", int, low=0, high=2**32 - 1)

    def __post_init__(self) -> None:
        for name, setting in SETTINGS.items():
            object.__setattr__(self, name, setting.check(name, getattr(self, name)))

    def replace(self, **changes: object) -> Params:
        """A copy with `changes`; unknown names raise and offer the nearest one."""
        for name in changes:
            if name not in SETTINGS:
                raise LabError(
                    f"{name!r} is not a setting{nearest(name, SETTINGS)} ('lab params' lists all {len(SETTINGS)})"
                )
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]

    def to_dict(self) -> dict[str, Value]:
        """Every setting by name, as saved in a run's JSON."""
        return dataclasses.asdict(self)

    def to_core(self) -> dict[str, Value]:
        """The settings as the C++ struct holds them: words beside numbers become their numbers."""
        values = self.to_dict()
        for name, setting in SETTINGS.items():
            if setting.words:
                value = values[name]
                number = setting.words[value] if isinstance(value, str) else value
                values[name] = setting.kind(number)
        return values


SETTINGS: dict[str, Setting] = {f.name: f.metadata["setting"] for f in dataclasses.fields(Params)}

GROUPS: dict[str, tuple[str, ...]] = {
    "Lights": ("vpls", "max_bounces"),
    "Hierarchy": ("bounds_scale", "levels", "construction", "gather_range", "carry_moments", "centre_weight"),
    "Lighting": (
        "lighting", "alpha", "first_level", "lobe", "receiver", "falloff", "clamp_distance", "compensation",
        "compensation_samples",
    ),
    "Shadow samples": (
        "shadow_samples", "first_shadow_level", "importance", "picker", "reservoir_locks", "shadow_points",
        "deviation_scale", "shadow_estimator", "omega_max", "member_candidates",
    ),
    "Interleaving": ("interleave", "deal_all"),
    "Filter": (
        "filter", "filter_backend", "sigma_deviation", "sigma_shadow", "sigma_normal", "sigma_position", "sigma_plane",
    ),
    "Direct light and random numbers": ("direct_samples", "seed", "frame"),
}  # fmt: skip
"""Every setting, in the order of the frame, under the title that people see."""

_PAPER: dict[str, Value] = {
    "lobe": "mean",
    "first_level": 1,
    "filter": "atrous",
    "first_shadow_level": 2,
    "reservoir_locks": "none",
    "shadow_points": "jitter",
    "shadow_estimator": "average",
    "deal_all": True,
}

PRESETS: dict[str, dict[str, Value]] = {
    "ours": {},
    "paper": _PAPER,
    "demo": {
        **_PAPER,
        "bounds_scale": 1.1,
        "levels": "demo",
        "gather_range": "half_open",
        "carry_moments": False,
        "centre_weight": "count",
        "falloff": "softened",
        "shadow_estimator": "ratio_rgb",
    },
}
"""What a preset changes from the defaults: ``ours`` nothing, ``paper`` LY19's text, ``demo`` the authors' demo."""


def preset(name: str, **changes: object) -> Params:
    """The preset `name` (``ours``, ``paper`` or ``demo``) with `changes` on top."""
    if name not in PRESETS:
        raise LabError(f"unknown preset {name!r}: there are {', '.join(PRESETS)}{nearest(name, PRESETS)}")
    return Params().replace(**{**PRESETS[name], **changes})


def parse_assignments(assignments: list[str]) -> dict[str, str]:
    """``["alpha=2", "filter=none"]`` to ``{"alpha": "2", "filter": "none"}``."""
    changes = {}
    for text in assignments:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise LabError(f"--set {text}: expected name=value, for example --set alpha=2")
        changes[name.strip()] = value.strip()
    return changes
