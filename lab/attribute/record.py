"""The error budget as strict JSON."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

from lab import __version__
from lab.attribute.budget import ErrorBudget, FrameScore, Side
from lab.attribute.score import Score
from lab.metrics import PIXELS_PER_DEGREE
from lab.params import PRESETS
from lab.report import camera_record, core, light_counts, machine

Record = dict[str, Any]

METRICS = {
    "rel_mse": "mean of ((a - b)^2 - v) / (c^2 + epsilon^2) over all values of the indirect layer: a the picture, b "
    "what it is compared with, v the variance of the noise of both references, epsilon 1 % of the truth's mean, c the "
    "sum over all lights with what the clamp leaves out. Noise can make it a little negative.",
    "rel_mse_error": "standard error of rel_mse over the pixels",
    "rel_mse_rest": "rel_mse of all but the worst thousandth of the pixels",
    "energy": "sum of a over sum of b",
    "flip": "mean HDR-FLIP of the colour against c with the exact direct light, whose noise would count otherwise",
    "effect": "rel_mse with the term less rel_mse without it: above 0, the term costs; effect_rest and energy_effect "
    "likewise",
}


def to_record(budget: ErrorBudget, preset: str, overrides: dict[str, str]) -> Record:
    """What DIR/attribution.json says. Numbers that don't exist are None."""
    bench, judge = budget.bench, budget.judge
    scene = bench.scene
    return {
        "scene": {
            "path": str(Path(scene.path).resolve()) if scene.path else "",
            "name": scene.name,
            "triangles": scene.triangles,
            "lights": light_counts(scene),
            "camera": camera_record(bench.camera),
            "size": list(bench.size),
            "overrides": overrides,
        },
        "preset": preset,
        "params": bench.params.to_dict(),
        "metrics": METRICS | {"epsilon": judge.epsilon, "flip_pixels_per_degree": PIXELS_PER_DEGREE},
        "truth": {
            "method": bench.truth.method,
            "samples": bench.truth.samples,
            "relative_error": _number(bench.truth.relative_error),
            "rel_mse_noise": judge.noise(judge.truth),
        },
        "sum": {
            "method": bench.summed.method,
            "samples": bench.summed.samples,
            "relative_error": _number(bench.summed.relative_error),
            "rel_mse_noise": judge.noise(judge.summed),
        },
        "effort": dataclasses.asdict(budget.effort),
        "frame": _frame(budget.frame),
        "ladder": [{"name": rung.name, "what": rung.what, **_score(rung.score)} for rung in budget.ladder],
        "terms": [
            {
                "name": row.term.name,
                "what": row.term.what,
                "stage": row.term.stage,
                "active": row.active,
                "chosen": row.chosen,
                "exact": dict(row.term.exact) | {name: f"x {factor}" for name, factor in row.term.times.items()},
                "approximate": dict(row.term.approximate),
                "on_alone": _side(row.on),
                "off_alone": _side(row.off),
            }
            for row in budget.rows
        ],
        "presets": [
            {"name": found.name, "settings": dict(PRESETS[found.name]), **_frame(found)} for found in budget.presets
        ],
        "machine": machine() | core(),
        "version": __version__,
        "seconds": round(budget.seconds, 3),
        "notes": [*scene.notes, *budget.notes],
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _score(score: Score) -> Record:
    return {name: None if value is None else _number(value) for name, value in dataclasses.asdict(score).items()}


def _frame(found: FrameScore) -> Record:
    return {**_score(found.score), "seconds": round(found.seconds, 4)}


def _side(side: Side | None) -> Record | None:
    if side is None:
        return None
    effects = {name: _number(getattr(side, name)) for name in ("effect", "effect_rest", "energy_effect")}
    time = {} if side.seconds is None else {"seconds": round(side.seconds, 4)}
    return {"compared": side.sentence, **effects, **_score(side.score), **time}
