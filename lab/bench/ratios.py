"""The ratios, from nothing but the record's own numbers."""

from __future__ import annotations

from typing import Any

from lab.bench.definitions import ratios_of
from lab.engine.engine import STAGES

Record = dict[str, Any]


def ratios(record: Record) -> dict[str, float | None]:
    """Every ratio of the record's engine; None where it lacks what they are made of, or would divide by nothing."""
    found = _of_frames(record) | _of_lighting(record["lighting_ms"]) | _of_construction(record["construction_ms"])
    growth = record["growth"]
    found["growth_1k_1m"] = _over(_median(growth, "many", "sum_ms"), _median(growth, "few", "sum_ms"))
    return {name: found[name] for name in ratios_of(record["engine"])}


def _of_frames(record: Record) -> dict[str, float | None]:
    limits, fast = record["limits"]["stages_ms"], record["fast_frame"]

    def reached(stage: str) -> float | None:
        return _over(_median(limits, stage), _median(record["stages_ms"], stage))

    counts = record["counts"]
    return {
        "lighting_vs_kernel": reached("light"),
        "lighting_vs_own_kernel": _over(
            _median(record["limits"], "own_light_kernel_ms"), _median(record["stages_ms"], "light")
        ),
        "gbuffer_vs_embree": reached("render_gbuffer"),
        "gbuffer_vs_pipeline": reached("render_gbuffer"),
        "shadow_rays_vs_embree": reached("trace_shadow_rays"),
        "shadow_rays_vs_pipeline": reached("trace_shadow_rays"),
        "visited_per_used": _over(counts["pairs_visited"], counts["pairs_used"]),
        "frame_vs_limits": _over(
            fast["frame_ms"]["median"], sum(fast["limits_ms"][stage]["median"] for stage in STAGES)
        ),
    }


def _of_lighting(ms: Record) -> dict[str, float | None]:
    none = _median(ms, "shadow_samples=0")
    return {
        "interleave4_speedup": _over(_median(ms, "interleave=1"), _median(ms, "interleave=4")),
        "k1_overhead": _over(_median(ms, "shadow_samples=1"), none),
        "k4_overhead": _over(_median(ms, "shadow_samples=4"), none),
    }


def _of_construction(ms: Record) -> dict[str, float | None]:
    stream = _median(ms, "many", "stream")
    return {
        "construction_vs_stream": _over(_median(ms, "many", "gather"), stream),
        "construction_with_members_vs_stream": _over(_median(ms, "many", "gather_with_members"), stream),
        "gather_vs_scatter": _over(_median(ms, "scattered", "gather"), _median(ms, "scattered", "scatter")),
    }


def _median(record: Record | None, *path: str) -> float | None:
    part: Any = record
    for name in (*path, "median"):
        if part is None:
            return None
        part = part.get(name)
    return None if part is None else float(part)


def _over(a: float | None, b: float | None) -> float | None:
    return None if a is None or not b or a == 0 else a / b
