"""A probe's tables, for people."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from lab.colour import luminance
from lab.pixel import Account, ExactShadow, PickTrials, Probe

Doubles = NDArray[np.float64]
NARROWEST = 160


def print_probe(
    probe: Probe,
    scene: str,
    *,
    top: int,
    trials: PickTrials | None = None,
    exact: ExactShadow | None = None,
    accounted: Account | None = None,
) -> None:
    """Prints everything that is given; of each table of lights the first `top` rows."""
    # A row that is cut short says nothing: narrow windows wrap it.
    console = Console(highlight=False, soft_wrap=True, width=max(Console().width, NARROWEST))
    console.print(f"[bold]{escape(scene)}[/] pixel {probe.x},{probe.y}")
    if probe.depth == 0:
        console.print("sees no surface: no light of the hierarchy is seen here")
        return
    console.print(
        f"point {_numbers(probe.point)}, normal {_numbers(probe.normal)}, albedo {_numbers(probe.albedo)}, "
        f"depth {probe.depth:.4g}" + (f", tile {probe.tile}" if probe.params.interleave > 1 else "")
    )
    image = probe.image
    console.print(
        f"colour {_numbers(image.colour)} = direct {_numbers(image.direct)} + indirect {_numbers(image.indirect)}; "
        f"unshadowed irradiance {_numbers(image.unshadowed)}"
    )
    shadow = probe.shadow
    console.print(
        f"shadow ratio {_numbers(shadow.ratio)}; S {_numbers(shadow.shadowed)} of {_numbers(shadow.weight)} before the "
        f"filter, {_numbers(shadow.filtered_shadowed)} of {_numbers(shadow.filtered_weight)} after it"
    )
    console.print(f"{len(probe.lights)} lights, F = {probe.weight_sum:.4g}\n")
    tables = [_levels(probe), _lights(probe, top, trials, exact)]
    for table in tables + ([_picks(probe)] if len(probe.picks) else []):
        console.print(table)
        console.print()
    if trials is not None:
        _print_trials(console, trials)
    if exact is not None:
        _print_exact(console, exact)
    if accounted is not None:
        _print_account(console, accounted, top)


def _numbers(values: Iterable[float]) -> str:
    return " ".join("-" if np.isnan(value) else f"{value:.4g}" for value in values)


def _with_error(values: Iterable[float], errors: Iterable[float]) -> str:
    return " ".join(f"{value:.4g} ± {error:.2g}" for value, error in zip(values, errors, strict=True))


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    for name in columns:
        table.add_column(name, justify="right")
    return table


def _levels(probe: Probe) -> Table:
    table = _table("levels", "level", "overdraw", "lights used", "irradiance", "share", "p")
    by_level = probe.lights.by_level()
    for level, (cubes, used) in enumerate(zip(probe.overdraw, probe.lights_used, strict=True)):
        lights = by_level.get(level)
        if lights is None:
            table.add_row(str(level), str(cubes), str(used), "", "", "")
            continue
        sent = float(luminance(lights.contribution.sum(axis=0, dtype=np.float64)))
        share, p = lights.share.sum(), lights.probability.sum()
        table.add_row(str(level), str(cubes), str(used), f"{sent:.4g}", f"{share:.2%}", f"{p:.2%}")
    return table


def _lights(probe: Probe, top: int, trials: PickTrials | None, exact: ExactShadow | None) -> Table:
    ranked = probe.lights.sorted()
    shown = min(top, len(ranked))
    columns = ["light", "level", "distance", "B", "cosine", "emission", "G", "x"]
    columns += ["irradiance", "share", "sum", "f", "p"]
    if trials is not None:
        columns += ["picked", "expected", "seen"]
    if exact is not None:
        columns += ["V", "omega", "V omega"]
    title = f"lights by what they send, {shown} of {len(ranked)}"
    table = _table(title, *columns)
    irradiance, sums = luminance(ranked.contribution), ranked.cumulative_share
    for i in range(shown):
        index = int(ranked.index[i])
        row = [
            str(index),
            str(ranked.level[i]),
            *(f"{column[i]:.4g}" for column in (ranked.distance, ranked.blend_weight, ranked.receiver_cosine)),
            *(f"{column[i]:.4g}" for column in (ranked.emission, ranked.falloff, ranked.scale, irradiance)),
            f"{ranked.share[i]:.2%}",
            f"{sums[i]:.1%}",
            f"{ranked.target_weight[i]:.4g}",
            f"{ranked.probability[i]:.2%}",
        ]
        if trials is not None:
            row += _drawn(trials, index)
        if exact is not None:
            at = int(np.searchsorted(exact.index, index))
            means = exact.visible_share[at], exact.light_weight[at], exact.light_shadowed[at]
            row += [f"{value:.3f}" for value in means]
        table.add_row(*row)
    return table


def _drawn(trials: PickTrials, index: int) -> list[str]:
    at = int(np.searchsorted(trials.index, index))
    if at == len(trials.index) or trials.index[at] != index:
        return ["", "", ""]
    seen = trials.visible_share[at]
    expected = trials.draws * trials.probability[at]
    return [str(trials.count[at]), f"{expected:.1f}", "" if np.isnan(seen) else f"{seen:.0%}"]


def _picks(probe: Probe) -> Table:
    picks = probe.picks
    table = _table("shadow samples", "sample", "light", "level", "p", "member", "to", "omega", "ray")
    for i, light in enumerate(picks.light):
        if light < 0:
            table.add_row(str(i), "none", "", "", "", "", "", "")
            continue
        member = str(picks.member[i]) if picks.member[i] >= 0 else "jittered"
        ray = ("free" if picks.visible[i] else "blocked") if picks.traced[i] else "none: omega is 0"
        p, omega = f"{picks.probability[i]:.2%}", f"{picks.omega[i]:.3g}"
        table.add_row(str(i), str(light), str(picks.level[i]), p, member, _numbers(picks.point[i]), omega, ray)
    return table


def _print_trials(console: Console, trials: PickTrials) -> None:
    if trials.draws == 0:
        return
    console.print(
        f"[bold]drawn {trials.draws:,} times[/]: picks follow p with chi-square {trials.statistic:.4g} of "
        f"{trials.freedom} degrees of freedom, p-value {trials.p_value:.3g}"
    )
    console.print(
        f"  S {_with_error(trials.shadowed, trials.shadowed_error)}, "
        f"of {_with_error(trials.weight, trials.weight_error)}, "
        f"ratio {_with_error(trials.ratio, trials.ratio_error)}, "
        f"mean visibility {_with_error([trials.mean_visibility], [trials.mean_visibility_error])}\n"
    )


def _print_exact(console: Console, exact: ExactShadow) -> None:
    how = "every ray" if exact.points == 0 else f"{exact.points} points a light"
    console.print(f"[bold]all-rays value[/] ({exact.rays:,} rays, {how}):")
    seen = f"{exact.mean_visibility:.4g}"
    ratio = _numbers(exact.ratio)
    if exact.points:
        seen += f" ± {exact.mean_visibility_error:.2g}"
        ratio = _with_error(exact.ratio, exact.ratio_error)
    console.print(
        f"  S {_numbers(exact.shadowed)}, of {_numbers(exact.weight)}, ratio {ratio}, mean visibility {seen}\n"
    )


def _print_account(console: Console, accounted: Account, top: int) -> None:
    error = float(luminance(accounted.frame - accounted.truth))
    truth = float(luminance(accounted.truth))
    relative = f" ({error / truth:+.1%})" if truth > 0 else ""
    console.print(
        f"[bold]against the sum over all lights[/] (luminance of indirect irradiance): frame "
        f"{float(luminance(accounted.frame)):.4g}, truth {truth:.4g}, difference {error:+.4g}{relative}; "
        f"the pixel's lights hold each input light {accounted.times_held:.2f} times\n"
    )
    shown = min(top, len(accounted.index))
    title = f"who answers for it, {shown} of {len(accounted.index)}"
    names = "light", "level", "B", "sends", "shadowed", "by its own rays", "stands for", "difference"
    table = _table(title, *names)
    columns = [luminance(column) for column in _account_columns(accounted)]
    for i in range(shown):
        values = [f"{column[i]:.4g}" for column in columns[:-1]]
        head = str(accounted.index[i]), str(accounted.level[i])
        table.add_row(*head, f"{accounted.blend_weight[i]:.3g}", *values, f"{columns[-1][i]:+.4g}")
    for name, value in (("held by none", accounted.remainder), ("recombination", accounted.recombination)):
        table.add_row(name, *[""] * 6, f"{float(luminance(value)):+.4g}")
    console.print(table)


def _account_columns(a: Account) -> tuple[Doubles, ...]:
    return a.sent, a.shadowed, a.shadowed_alone, a.stands_for, a.difference
