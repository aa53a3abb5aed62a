"""What a picture's colours mean: data for the browser, and the same drawn as a bar."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from gui.layers.colour_maps import table
from gui.layers.read_out import number_text
from gui.layers.scale import Scale
from lab.colour import to_bytes
from lab.figure import INK, PAPER, font
from lab.layers import COLOUR, COUNT, DIRECTION, LEVEL, LIGHT, POSITION, SIGNED, TILE, Layer
from lab.level_colours import category_colours, rgb

_STOPS, _MOST_SWATCHES = 33, 16
_AXES = (
    ("#ff8080", "+x"), ("#80ff80", "+y"), ("#8080ff", "+z"), ("#008080", "-x"), ("#800080", "-y"), ("#808000", "-z"),
)  # fmt: skip

_DARKEST, _BRIGHTEST = 0.005, 8.0
"""Ends of the bar of light, in exposed radiance: all but black, and all but white."""


@dataclass(frozen=True)
class Tick:
    """A mark on the bar: its place from 0 to 1, and its text."""

    place: float
    text: str


@dataclass(frozen=True)
class Legend:
    """Either a bar with ticks or coloured names.

    Attributes:
        title: the layer's.    unit: of the ticks.    ramp: ``#rrggbb``, even steps, lowest first.
        ticks: along the ramp.    swatches: colours and what they stand for.    note: a line beside them.
    """

    title: str
    unit: str = ""
    ramp: tuple[str, ...] = ()
    ticks: tuple[Tick, ...] = ()
    swatches: tuple[tuple[str, str], ...] = ()
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """As JSON takes it."""
        return asdict(self) | {"css": self.css}

    @property
    def css(self) -> str:
        """The bar as a CSS background, lowest at the left; "" without one."""
        return f"linear-gradient(to right, {', '.join(self.ramp)})" if self.ramp else ""


def legend(
    layer: Layer,
    values: NDArray[Any] | None = None,
    *,
    scale: Scale | None = None,
    exposure: float = 1.0,
    seen: NDArray[np.bool_] | None = None,
) -> Legend:
    """The legend of a layer drawn on `scale`, or of light at `exposure`; `values` tell which categories occur."""
    if scale is not None:
        colours = table(scale.colour_map)[np.linspace(0, 255, _STOPS).round().astype(int)]
        shown = Legend(layer.title, layer.unit, _hex(colours), _scale_ticks(scale, layer.kind))
    elif layer.kind == LIGHT:
        shown = _light_legend(layer, exposure)
    elif layer.kind == DIRECTION:
        shown = Legend(layer.title, swatches=_AXES, note="red, green, blue: x, y, z")
    elif layer.kind == POSITION:
        shown = _position_legend(layer, values, seen)
    elif layer.kind in (LEVEL, TILE) and values is not None:
        shown = _category_legend(layer, values if seen is None else values[seen])
    else:
        note = "linear RGB from 0 to 1, shown as sRGB" if layer.kind == COLOUR else ""
        shown = Legend(layer.title, layer.unit, note=note)
    return shown


def _category_legend(layer: Layer, values: NDArray[Any]) -> Legend:
    found = [int(v) for v in np.unique(values) if v >= 0]
    if len(found) > _MOST_SWATCHES:
        return Legend(layer.title, note=f"{layer.kind}s {found[0]} to {found[-1]}")
    colours = category_colours(layer.kind)
    return Legend(layer.title, swatches=tuple((colours[v % len(colours)], f"{layer.kind} {v}") for v in found))


def _light_legend(layer: Layer, exposure: float) -> Legend:
    shown = shown_exposure(layer, exposure)
    low, high = _DARKEST / shown, _BRIGHTEST / shown
    grey = np.repeat(np.geomspace(low, high, _STOPS)[:, None], 3, axis=1)
    ticks = tuple(
        Tick(math.log(value / low) / math.log(high / low), number_text(value)) for value in log_ticks(low, high)
    )
    note = f"exposure {exposure:.4g}" + (" / pi" if shown != exposure else "")
    return Legend(layer.title, layer.unit, _hex(to_bytes(grey, shown)), ticks, note=note)


def shown_exposure(layer: Layer, exposure: float) -> float:
    """Irradiance is shown as the radiance that a white surface makes of it, E / pi."""
    return exposure / math.pi if layer.unit == "irradiance" else exposure


def _position_legend(layer: Layer, values: NDArray[Any] | None, seen: NDArray[np.bool_] | None) -> Legend:
    chosen = None if values is None else (values.reshape(-1, 3) if seen is None else values[seen])
    if chosen is None or len(chosen) == 0:
        return Legend(layer.title, layer.unit, note="red, green, blue: x, y, z")
    low, high = chosen.min(axis=0), chosen.max(axis=0)
    colours = ("#e0483e", "#3aa655", "#4c7dd9")
    texts = (f"{axis}: {low[i]:.4g} to {high[i]:.4g}" for i, axis in enumerate("xyz"))
    return Legend(layer.title, layer.unit, swatches=tuple(zip(colours, texts, strict=True)))


def _scale_ticks(scale: Scale, kind: str) -> tuple[Tick, ...]:
    values = log_ticks(scale.low, scale.high) if scale.log else even_ticks(scale.low, scale.high, kind == COUNT)
    ticks = []
    for value in values:
        text = f"{100 * value:+.3g}" if kind == SIGNED else f"{value:,.6g}"
        at_low = scale.beyond_low and math.isclose(value, scale.low, abs_tol=1e-12)
        at_high = scale.beyond_high and math.isclose(value, scale.high)
        text = "0" if value == 0 else text
        sign = "< " if at_low else "> " if at_high else ""
        ticks.append(Tick(float(scale.place(np.array(value))), f"{sign}{text}"))
    return tuple(ticks)


def even_ticks(low: float, high: float, whole: bool = False, most: int = 6) -> list[float]:
    """Round values in steps of 1, 2 or 5 times a power of ten, at most `most` + 1 of them, from `low` to `high`."""
    span = high - low
    step = 10.0 ** math.floor(math.log10(span / most))
    step = next(step * times for times in (1, 2, 5, 10) if span / (step * times) <= most)
    if whole:
        step = max(1.0, step)
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    return [round(i * step, 12) for i in range(first, last + 1)]


def log_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Powers of ten between the ends; where there are less than three, 1, 2 and 5 times them; at most `most` + 1."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    every = max(1, math.ceil((last - first) / most))
    powers = [10.0**i for i in range(first, last + 1, every)]
    inside = [p for p in powers if low * (1 - 1e-9) <= p <= high * (1 + 1e-9)]
    if len(inside) >= 3:
        return inside
    finer = [10.0**i * times for i in range(first, last + 1) for times in (1, 2, 5)]
    inside = [p for p in finer if low * (1 - 1e-9) <= p <= high * (1 + 1e-9)]
    return inside if len(inside) >= 2 else [low, high]


def draw_legend(shown: Legend, width: int = 640) -> NDArray[np.uint8]:
    """The legend as a strip of `width` pixels, (h, width, 3) sRGB bytes: title and unit, then bar or swatches."""
    height = 64 if shown.ramp else 48
    canvas = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(canvas)
    unit = f", {shown.unit}" if shown.unit and shown.ramp else ""
    draw.text((12, 16), f"{shown.title}{unit}", fill=INK, font=font(14), anchor="lm")
    draw.text((width - 12, 16), shown.note, fill=(107, 107, 114), font=font(12), anchor="rm")
    if shown.ramp:
        left, right = 24, width - 24
        ramp = np.array([rgb(colour) for colour in shown.ramp], np.uint8)
        bar = Image.fromarray(ramp[None]).resize((right - left, 14), Image.Resampling.BILINEAR)
        canvas.paste(bar, (left, 28))
        for tick in shown.ticks:
            x = left + round(tick.place * (right - left - 1))
            draw.line([(x, 42), (x, 46)], fill=INK)
            draw.text((x, 54), tick.text, fill=INK, font=font(12), anchor="mm")
        return np.asarray(canvas)
    x = 12
    for colour, text in shown.swatches:
        draw.rectangle((x, 29, x + 12, 41), fill=colour)
        draw.text((x + 18, 35), text, fill=INK, font=font(12), anchor="lm")
        x += 18 + round(font(12).getlength(text)) + 16
    return np.asarray(canvas)


def _hex(colours: NDArray[np.uint8]) -> tuple[str, ...]:
    return tuple(f"#{r:02x}{g:02x}{b:02x}" for r, g, b in colours)
