"""Records of a pixel as rows of text: nothing is computed here, only written out."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from gui.layers.read_out import number_text
from lab.colour import luminance
from lab.pixel import Account, ExactShadow, PickTrials, Probe, ProbedLights

Table = tuple[list[str], list[list[str]]]
MOST_ROWS = 60


def percent(value: float) -> str:
    """A share, with what can be read of it."""
    return f"{100 * value:.2f} %" if value >= 1e-4 else f"{100 * value:.1e} %" if value > 0 else "0"


def light_rows(lights: ProbedLights, rows: Iterable[int]) -> list[dict[str, Any]]:
    """Rows of the light table; `rows` of `lights`, which are sorted by share."""
    lightness = luminance(lights.contribution)
    cumulative = lights.cumulative_share
    return [
        {
            "index": int(lights.index[i]),
            "cells": [
                f"{int(lights.index[i])}",
                f"{int(lights.level[i])}",
                number_text(float(lights.distance[i])),
                f"{float(lights.blend_weight[i]):.3f}",
                f"{float(lights.receiver_cosine[i]):.3f}",
                f"{float(lights.emission[i]):.3f}",
                number_text(float(lightness[i])),
                number_text(float(lights.target_weight[i])),
                f"{float(lights.probability[i]):.4f}",
                percent(float(lights.share[i])),
                percent(float(cumulative[i])),
            ],
        }
        for i in rows
    ]


def summary(probe: Probe, exact: ExactShadow | None, trials: PickTrials | None) -> list[list[str]]:
    """What the pixel is: pairs of a name and a value."""
    image, shadow = probe.image, probe.shadow
    pairs = [
        ["pixel", f"{probe.x}, {probe.y}"],
        ["point", _vector(probe.point)],
        ["normal", _vector(probe.normal)],
        ["albedo", _vector(probe.albedo)],
        ["colour", _vector(image.colour)],
        ["unshadowed E", _vector(image.unshadowed)],
        ["ratio, noisy", _vector(shadow.noisy_ratio)],
        ["ratio, filtered", _vector(shadow.filtered_ratio)],
    ]
    if exact is not None:
        pairs.append(["ratio, every ray", _vector(exact.ratio) + _error(exact.ratio_error)])
        pairs.append(["visible, every ray", f"{exact.mean_visibility:.4f}"])
    if trials is not None:
        pairs.append(["ratio, sampled", _vector(trials.ratio) + _error(trials.ratio_error)])
        pairs.append(["visible, sampled", f"{trials.mean_visibility:.4f}{_error([trials.mean_visibility_error])}"])
        pairs.append(["chi-square p", f"{trials.p_value:.3g} ({trials.freedom + 1} bins)"])
    pairs.append(["overdraw", _counts(probe.overdraw)])
    pairs.append(["lights used", _counts(probe.lights_used)])
    if probe.params.interleave > 1:
        pairs.append(["tile", f"{probe.tile[0]}, {probe.tile[1]}"])
    return pairs


def picks_text(probe: Probe) -> list[str]:
    """One line a pick of the frame."""
    picks = probe.picks
    return [
        f"{n + 1}: light {picks.light[n]} (level {picks.level[n]}), p {picks.probability[n]:.4f}, "
        f"omega {picks.omega[n]:.3g}, {_fate(bool(picks.traced[n]), bool(picks.visible[n]))}"
        if picks.light[n] >= 0
        else f"{n + 1}: nothing picked"
        for n in range(len(picks))
    ]


def trials_table(trials: PickTrials, exact: ExactShadow | None) -> Table:
    """The lights most often picked: drawn against expected, and how often their rays were free."""
    heads = ["light", "level", "drawn", "expected", "free", "every ray"]
    every = {} if exact is None else dict(zip(exact.index.tolist(), exact.visible_share.tolist(), strict=True))
    order = trials.probability.argsort()[::-1][:MOST_ROWS]
    return heads, [
        [
            f"{trials.index[i]}",
            f"{trials.level[i]}",
            f"{trials.count[i]}",
            f"{trials.draws * trials.probability[i]:.1f}",
            percent(float(trials.visible_share[i])) if trials.count[i] else "-",
            percent(every[int(trials.index[i])]) if int(trials.index[i]) in every else "-",
        ]
        for i in order
    ]


def account_table(found: Account) -> Table:
    """The lights that answer for most of the difference, and the rows that make it whole. Luminances."""
    heads = ["light", "level", "B", "sends", "shadowed", "stands for", "difference"]
    best = found.sorted()
    rows = [
        [
            f"{best.index[i]}",
            f"{best.level[i]}",
            f"{best.blend_weight[i]:.3f}",
            *(_lightness(column[i]) for column in (best.sent, best.shadowed, best.stands_for, best.difference)),
        ]
        for i in range(min(MOST_ROWS, len(best.index)))
    ]
    rest = found.difference.sum(axis=0)
    total = found.frame - found.truth
    return heads, [
        ["all lights", "", "", "", "", "", _lightness(rest)],
        ["held by none", "", "", "", "", "", _lightness(found.remainder)],
        ["from other tiles", "", "", "", "", "", _lightness(found.recombination)],
        ["frame - truth", "", "", "", _lightness(found.frame), _lightness(found.truth), _lightness(total)],
        *rows,
    ]


def _lightness(rgb: Any) -> str:
    return number_text(float(luminance(rgb)))


def _vector(values: Any) -> str:
    return "  ".join(number_text(float(value)) for value in values)


def _error(values: Any) -> str:
    largest = max((float(value) for value in values), default=0.0)
    return f" ± {number_text(largest)}" if largest > 0 else ""


def _counts(counts: Any) -> str:
    return f"{int(counts.sum())}: " + " ".join(str(int(count)) for count in counts)


def _fate(traced: bool, visible: bool) -> str:
    return ("free" if visible else "blocked") if traced else "faces away"
