"""Stacked bars: where the milliseconds of a frame go, and how few they could be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from lab.engine.engine import STAGES
from lab.figure import INK, LINE, MARGIN, PAPER, draw_title, font, nice_ticks

Record = dict[str, Any]
Pixels = NDArray[np.uint8]

# Told apart by people with any colour vision (Okabe and Ito 2008), in the order of the frame.
COLOURS = dict(
    zip(
        STAGES,
        [(0, 114, 178), (86, 180, 233), (0, 158, 115), (240, 200, 40), (213, 94, 0), (204, 121, 167), (120, 120, 124)],
        strict=True,
    )
)

_NAMES, _BARS, _TOTALS = 330, 900, 110
_BAR, _SPACE, _GROUP = 26, 8, 20
_GRID, _SOFT = (226, 224, 218), (107, 107, 114)
_MOST_TICKS = 8


@dataclass(frozen=True)
class Bar:
    """One bar: its name, and the median milliseconds of the stages it is made of; pale where it is a limit."""

    name: str
    ms: dict[str, float]
    limit: bool = False

    @property
    def total(self) -> float:
        """Its length in milliseconds."""
        return sum(self.ms.values())


@dataclass(frozen=True)
class Group:
    """Bars that belong together, under a title."""

    title: str
    bars: list[Bar]


def draw_bars(title: str, groups: Sequence[Group]) -> Pixels:
    """All groups on one scale, with a legend; (h, w, 3) sRGB bytes."""
    longest = max((bar.total for group in groups for bar in group.bars), default=0.0) or 1.0
    rows = sum(len(group.bars) for group in groups)
    width = MARGIN + _NAMES + _BARS + _TOTALS + MARGIN
    top = MARGIN + 2 * LINE + 12
    height = top + rows * (_BAR + _SPACE) + len(groups) * (LINE + _GROUP) + LINE + MARGIN
    canvas = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(canvas)
    draw_title(canvas, title, font(20), (MARGIN, MARGIN - 6))
    _draw_legend(draw, (MARGIN, MARGIN + LINE + 4))
    left, bottom = MARGIN + _NAMES, height - MARGIN - LINE
    ticks = nice_ticks(longest, _MOST_TICKS, least=1e-3)
    for tick in ticks:
        x = left + round(_BARS * tick / longest)
        draw.line([(x, top), (x, bottom)], fill=_GRID)
        draw.text((x, bottom + 6), f"{tick:,.6g}", fill=_SOFT, font=font(13), anchor="ma")
    draw.text((left + _BARS + 12, bottom + 6), "ms", fill=_SOFT, font=font(13), anchor="la")
    y = top
    for group in groups:
        draw_title(canvas, group.title, font(16), (MARGIN, y))
        y += LINE + 6
        for bar in group.bars:
            _draw_bar(draw, bar, (left, y), _BARS / longest)
            y += _BAR + _SPACE
        y += _GROUP - 6
    return np.asarray(canvas)


def _draw_bar(draw: ImageDraw.ImageDraw, bar: Bar, corner: tuple[int, int], scale: float) -> None:
    left, y = corner
    draw.text((left - 12, y + _BAR // 2), bar.name, fill=_SOFT if bar.limit else INK, font=font(14), anchor="rm")
    at = 0.0
    for stage, ms in bar.ms.items():
        x0, x1 = left + round(at * scale), left + round((at + ms) * scale)
        at += ms
        if x1 <= x0:
            continue
        colour = _pale(COLOURS[stage]) if bar.limit else COLOURS[stage]
        draw.rectangle((x0, y, x1 - 1, y + _BAR - 1), fill=colour)
        label, letters = f"{ms:,.3g}" if ms < 1000 else f"{ms:,.0f}", font(12)
        if letters.getlength(label) + 6 < x1 - x0:
            ink = INK if bar.limit or sum(colour) > 400 else PAPER
            draw.text(((x0 + x1) / 2, y + _BAR / 2), label, fill=ink, font=letters, anchor="mm")
    x = left + round(at * scale) + 8
    draw.text((x, y + _BAR // 2), f"{bar.total:,.1f}", fill=_SOFT if bar.limit else INK, font=font(14), anchor="lm")


def _draw_legend(draw: ImageDraw.ImageDraw, corner: tuple[int, int]) -> None:
    x, y = corner
    for stage, colour in COLOURS.items():
        draw.rectangle((x, y, x + 13, y + 13), fill=colour)
        draw.text((x + 20, y + 7), stage, fill=INK, font=font(13), anchor="lm")
        x += 20 + round(font(13).getlength(stage)) + 22


def _pale(colour: tuple[int, int, int]) -> tuple[int, int, int]:
    r, g, b = (round(0.45 * c + 0.55 * paper) for c, paper in zip(colour, PAPER, strict=True))
    return r, g, b


def machine_line(record: Record) -> str:
    """What the times of a record are of."""
    machine, device = record["machine"], record["device"]
    if device is not None:
        return f"{device['name']}, {device['driver']}"
    threads = f"{machine['threads']} thread{'' if machine['threads'] == 1 else 's'}"
    return f"{machine['cpu']}, {threads}, {machine['simd']}"


def medians(stages_ms: Record) -> dict[str, float]:
    """Of every stage, in the frame's order."""
    return {stage: float(stages_ms[stage]["median"]) for stage in STAGES if stage in stages_ms}


def vpls_of(record: Record) -> str:
    """The lights of the frames that are all made anew."""
    return f"{record['regenerated']['vpls'] or record['counts']['lights']:,}"


def scene_groups(record: Record) -> list[Group]:
    """The frames of one scene beside their limits, and the stages that more lights burden."""
    scene, fast = record["scene"], record["fast_frame"]
    name = f"{scene['name']}, {scene['size'][0]}x{scene['size'][1]}, {record['counts']['lights']:,} lights"
    settings = " ".join(f"{key}={value}" for key, value in fast["settings"].items())
    groups = [
        Group(
            f"{name}, shadow_samples={record['params']['shadow_samples']} interleave={record['params']['interleave']}",
            [
                Bar("measured", medians(record["stages_ms"])),
                Bar("limit of this machine", medians(record["limits"]["stages_ms"]), limit=True),
            ],
        ),
        Group(
            f"{name}, {settings}",
            [
                Bar("measured", medians(fast["stages_ms"])),
                Bar("limit of this machine", medians(fast["limits_ms"]), limit=True),
            ],
        ),
    ]
    frames = record["regenerated"]["frames"]
    bars = [Bar(name, medians(found["stages_ms"])) for name, found in frames.items()]
    groups.append(Group(f"{scene['name']}: everything made anew, {vpls_of(record)} lights", bars))
    growth = [side for side in record["growth"].values() if side is not None]
    if growth:
        bars = [Bar(f"{side['lights']:,} lights", medians(side["stages_ms"])) for side in growth]
        groups.append(Group(f"{scene['name']}: what more lights cost", bars))
    return groups


def sweep_group(record: Record, name: str) -> Group:
    """One sweep of one scene, a bar a value."""
    found = record["sweeps"][name]
    bars = [
        Bar(f"{name}={value:,}", medians(ms)) for value, ms in zip(found["values"], found["stages_ms"], strict=True)
    ]
    return Group(f"{record['scene']['name']}, {record['scene']['size'][0]}x{record['scene']['size'][1]}", bars)
