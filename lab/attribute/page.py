"""The error budget as one HTML page that needs nothing beside it: text, bars, and pictures as data."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from html import escape

from lab.attribute.budget import ErrorBudget, FrameScore, Row, Side
from lab.attribute.pictures import Picture, gradient, photograph, signed
from lab.attribute.record import METRICS
from lab.attribute.score import Score
from lab.attribute.style import STYLE
from lab.colour import auto_exposure

_LEAST = 1e-4  # shorter bars are not told apart


def draw_page(budget: ErrorBudget, preset: str) -> str:
    """The whole page."""
    bench = budget.bench
    title = f"Where the error comes from: {bench.scene.name}"
    body = "\n".join(
        [
            _head(budget, preset, title),
            _section("From the truth to the frame", _ladder(budget), _LADDER_NOTE),
            _section("Pictures", _strip(budget)),
            _section("Terms", _table(budget), _TABLE_NOTE),
            _section("Each term", _cards(budget), _CARDS_NOTE),
            _section("Presets", _presets(budget), "Whole frames of each preset, with the same changes, best first."),
            _section("How it was measured", _measured(budget)),
        ]
    )
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{STYLE.replace('GRADIENT', gradient())}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )


_LADDER_NOTE = (
    "Error against the truth as one approximation after the other comes in. Bars are logarithmic. "
    "<em>Rest</em> is all but the worst thousandth of the pixels."
)
_TABLE_NOTE = (
    "<em>On alone</em>: everything exact but this term. <em>Off alone</em>: the frame, but for this term; for terms "
    "that the frame does without (hollow dots), the frame with it. Bars show the effect on relMSE, logarithmic: "
    '<b class="cost">red</b>, the term costs; <b class="gain">blue</b>, it pays. Where both sides differ much, terms '
    "interact. The worst thousandth of the pixels can rule relMSE: <em>rest</em> is the effect without them."
)
_CARDS_NOTE = (
    "Left what the term does on alone, right what it does in the frame: luminance with the term less luminance "
    "without it, relative to the truth. Red: the term makes it brighter."
)


def _section(title: str, content: str, note: str = "") -> str:
    paragraph = f'<p class="note">{note}</p>' if note else ""
    return f"<section>\n<h2>{escape(title)}</h2>\n{paragraph}\n{content}\n</section>"


def _head(budget: ErrorBudget, preset: str, title: str) -> str:
    bench, score = budget.bench, budget.frame.score
    facts = {
        "relMSE": number(score.rel_mse),
        "relMSE, rest": number(score.rel_mse_rest),
        "energy": f"{score.energy:.3f}",
        "FLIP": flip_text(score),
        "time": f"{budget.frame.seconds:.2f} s",
    }
    changed = _changed(budget)
    said = (
        f"{bench.size[0]}x{bench.size[1]} from camera {bench.camera.name!r}, preset {preset}"
        f"{', ' + changed if changed else ''}. Truth: {bench.truth.method}, {bench.truth.samples:,} samples a pixel."
    )
    boxes = "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in facts.items())
    return f"<header>\n<h1>{escape(title)}</h1>\n<p>{escape(said)}</p>\n<dl>{boxes}</dl>\n</header>"


def _changed(budget: ErrorBudget) -> str:
    """What the frame's settings change from the defaults."""
    from lab.params import Params

    values, usual = budget.bench.params.to_dict(), Params().to_dict()
    return " ".join(f"{name}={value}" for name, value in values.items() if value != usual[name])


def number(value: float) -> str:
    """Three digits."""
    return "0" if value == 0 else f"{value:.3g}" if abs(value) >= _LEAST else f"{value:.0e}"


def flip_text(score: Score) -> str:
    """FLIP, or a dash."""
    return "-" if score.flip is None else f"{score.flip:.3f}"


def _bar_length(top: float) -> Callable[[float], float]:
    """From 0 to 1, logarithmic between the least and the greatest magnitude."""
    reach = math.log(max(top, 10 * _LEAST) / _LEAST)
    return lambda value: max(0.0, math.log(abs(value) / _LEAST) / reach) if abs(value) > _LEAST else 0.0


def _bar(value: float, length: Callable[[float], float], kind: str = "") -> str:
    kind = kind or ("cost" if value > 0 else "gain")
    return f'<span class="bar"><i class="{kind}" style="width:{100 * length(value):.1f}%"></i></span>'


def _ladder(budget: ErrorBudget) -> str:
    length = _bar_length(max(rung.score.rel_mse for rung in budget.ladder))
    rows = "".join(
        f"<tr><th>{escape(rung.what)}</th><td>{_bar(rung.score.rel_mse, length, 'plain')}</td>"
        f"<td class=n>{number(rung.score.rel_mse)}</td><td class=n>{number(rung.score.rel_mse_rest)}</td>"
        f"<td class=n>{rung.score.energy:.3f}</td><td class=n>{flip_text(rung.score)}</td></tr>"
        for rung in budget.ladder
    )
    return (
        '<div class="wide"><table class="ladder"><thead><tr><th>picture</th><th></th><th>relMSE</th><th>rest</th>'
        f"<th>energy</th><th>FLIP</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _figure(picture: Picture, caption: str) -> str:
    """`caption` is HTML."""
    bar = ""
    if picture.scale:
        ends = f"{100 * picture.scale:g} %"
        bar = f'<span class="scale"><b>-{ends}</b><i></i><b>+{ends}</b></span>'
    image = f'<img src="{picture.uri}" width="{picture.width}" height="{picture.height}" alt="">'
    return f"<figure>{image}<figcaption>{caption}{bar}</figcaption></figure>"


def _strip(budget: ErrorBudget) -> str:
    bench, judge = budget.bench, budget.judge
    exact = judge.colour(judge.compensated)
    exposure = bench.scene.exposure or auto_exposure(exact, bench.seen)
    truth = bench.truth
    summed = "all lights, every shadow ray" + ("" if bench.light_list else ", with what the clamp leaves out")
    pictures = [
        _figure(
            photograph(judge.colour(judge.truth), exposure), f"the truth: {truth.method}, {truth.samples:,} samples"
        ),
        _figure(photograph(judge.colour(judge.summed if bench.light_list else judge.compensated), exposure), summed),
        _figure(photograph(budget.frame.colour, exposure), f"the frame, {budget.frame.seconds:.2f} s"),
        _figure(
            signed(judge.error_map(budget.frame.indirect, judge.compensated)),
            "the frame's indirect light against the " + ("truth" if bench.light_list else "second picture"),
        ),
    ]
    return f'<div class="strip">{"".join(pictures)}</div>'


def _table(budget: ErrorBudget) -> str:
    sides = [side for row in budget.rows for side in (row.on, row.off) if side is not None]
    length = _bar_length(max(abs(side.effect) for side in sides))
    rows = "".join(_row(row, length) for row in budget.rows)
    head = "<th>effect</th><th></th><th>rest</th><th>relMSE</th><th>energy</th><th>FLIP</th>"
    return (
        '<div class="wide"><table class="terms"><thead><tr><th rowspan=2>term</th><th rowspan=2>in the frame</th>'
        '<th colspan=6 class="group">on alone, against the exact</th>'
        '<th colspan=7 class="group">off alone, against the truth</th></tr>'
        f"<tr>{head}{head}<th>s</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _row(row: Row, length: Callable[[float], float]) -> str:
    chosen = "<br>".join(escape(f"{name}={value}") for name, value in row.chosen.items()) or "alpha"
    dot = "on" if row.active else "out"
    name = f'<a href="#{row.term.name}">{row.term.name}</a><small>{escape(row.term.what)}</small>'
    cells = _cells(row.on, length) + _cells(row.off, length)
    time = "" if row.off is None or row.off.seconds is None else f"{row.off.seconds:.2f}"
    return (
        f'<tr><th><i class="dot {dot}"></i>{name}</th><td class="set">{chosen}</td>{cells}<td class=n>{time}</td></tr>'
    )


def _cells(side: Side | None, length: Callable[[float], float]) -> str:
    if side is None:
        return '<td class="n group">-</td>' + "<td></td>" * 5
    return (
        f'<td class="n group">{side.effect:+.2g}</td><td>{_bar(side.effect, length)}</td>'
        f"<td class=n>{side.effect_rest:+.2g}</td><td class=n>{number(side.score.rel_mse)}</td>"
        f"<td class=n>{side.score.energy:.3f}</td><td class=n>{flip_text(side.score)}</td>"
    )


def _cards(budget: ErrorBudget) -> str:
    return "".join(_card(row) for row in budget.rows)


def _card(row: Row) -> str:
    pictures = "".join(
        _figure(signed(side.difference), f"<b>{name}: {side.effect:+.2g}</b> {escape(side.sentence)}")
        for name, side in (("on alone", row.on), ("off alone" if row.active else "on in the frame", row.off))
        if side is not None
    )
    dot = "on" if row.active else "out"
    return (
        f'<article id="{row.term.name}"><h3><i class="dot {dot}"></i>{row.term.name} '
        f'<small>{escape(row.term.what)}</small></h3><div class="strip">{pictures}</div></article>'
    )


def _presets(budget: ErrorBudget) -> str:
    bench, judge = budget.bench, budget.judge
    exposure = bench.scene.exposure or auto_exposure(judge.colour(judge.compensated), bench.seen)

    def figures(found: FrameScore) -> str:
        score = found.score
        said = (
            f"<b>{escape(found.name)}</b> relMSE {number(score.rel_mse)} (rest {number(score.rel_mse_rest)}), energy "
            f"{score.energy:.3f}, FLIP {flip_text(score)}, {found.seconds:.2f} s"
        )
        error = signed(judge.error_map(found.indirect, judge.compensated))
        return _figure(photograph(found.colour, exposure), said) + _figure(error, "its error")

    return "".join(f'<div class="strip">{figures(found)}</div>' for found in budget.presets)


def _measured(budget: ErrorBudget) -> str:
    bench, judge, effort = budget.bench, budget.judge, budget.effort
    rows: Iterable[tuple[str, str]] = METRICS.items()
    definitions = "".join(f"<dt>{name}</dt><dd>{escape(text)}</dd>" for name, text in rows)
    facts = [
        f"epsilon is {judge.epsilon:.4g}; the noise of the truth alone would make a relMSE of "
        f"{number(judge.noise(judge.truth))}, that of the sum {number(judge.noise(judge.summed))}, before it is taken "
        "off.",
        f"The sum over all lights draws {bench.summed.samples:,} lights a pixel, what the clamp leaves out takes "
        f"{effort.short_paths} short paths, converged shadows {effort.frames} frames of 64 samples without a filter.",
        f"All of it took {budget.seconds:.0f} s.",
        *bench.scene.notes,
        *budget.notes,
    ]
    listed = "".join(f"<li>{escape(fact)}</li>" for fact in facts)
    return f'<dl class="definitions">{definitions}</dl><ul>{listed}</ul>'
