"""The legend in a corner of the 3D view: one picture, so that its blocks never overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyvista
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from vtkmodules.vtkRenderingCore import vtkPolyDataMapper2D, vtkTexturedActor2D

from gui.scene_view.colours import BACKGROUND, QUIET, TEXT, Bytes, Rgb
from lab.figure import font

_LINE, _EDGE, _SWATCH, _GAP = 17, 8, 10, 9
_BAR_WIDTH, _BAR_HEIGHT = 168, 9
_TAB = 58
_CORNER = 8  # from the window's edges
_SIZE = 12
_PAPER = (*BACKGROUND, 205)


@dataclass(frozen=True)
class Bar:
    """A colour scale: (n, 3) `ramp`, lowest first, and labels at places from 0 to 1."""

    title: str
    ramp: Bytes
    ticks: Sequence[tuple[float, str]]


@dataclass(frozen=True)
class Block:
    """What the legend says of one part: a title, rows of a colour (None: no mark) and what it means, a scale.

    A tab in a row's text begins a second column.
    """

    title: str
    rows: Sequence[tuple[Rgb | None, str]] = ()
    bar: Bar | None = None

    @property
    def height(self) -> int:
        """In pixels."""
        return _LINE * (1 + len(self.rows)) + (2 * _LINE + _BAR_HEIGHT if self.bar else 0)


def draw_legend(blocks: Sequence[Block], tallest: int) -> NDArray[np.uint8]:
    """The blocks in columns of up to `tallest` pixels, as (h, w, 4) RGBA."""
    columns: list[list[Block]] = [[]]
    for block in blocks:
        used = sum(other.height + _GAP for other in columns[-1])
        if columns[-1] and used + block.height + 2 * _EDGE > tallest:
            columns.append([])
        columns[-1].append(block)
    pictures = [_draw_column(column) for column in columns]
    width = sum(picture.width for picture in pictures) + 4 * (len(pictures) - 1)
    page = Image.new("RGBA", (width, max(picture.height for picture in pictures)))
    x = 0
    for picture in pictures:
        page.paste(picture, (x, page.height - picture.height))
        x += picture.width + 4
    return np.asarray(page)


def _draw_column(blocks: Sequence[Block]) -> Image.Image:
    letters = font(_SIZE)
    width = 2 * _EDGE + round(max(_width(block, letters) for block in blocks))
    height = 2 * _EDGE + sum(block.height for block in blocks) + _GAP * (len(blocks) - 1)
    picture = Image.new("RGBA", (width, height), _PAPER)
    draw = ImageDraw.Draw(picture)
    y = _EDGE
    for block in blocks:
        draw.text((_EDGE, y + _LINE / 2), block.title, fill=TEXT, font=letters, anchor="lm")
        for i, (colour, text) in enumerate(block.rows, 1):
            top = y + i * _LINE
            if colour is not None:
                mark = (_EDGE, top + (_LINE - _SWATCH) / 2, _EDGE + _SWATCH, top + (_LINE + _SWATCH) / 2)
                draw.rounded_rectangle(mark, radius=3, fill=colour)
            for column, words in enumerate(text.split("\t")):
                at = _EDGE + _SWATCH + 7 + column * _TAB, top + _LINE / 2
                draw.text(at, words, fill=QUIET, font=letters, anchor="lm")
        if block.bar:
            _draw_scale(picture, block.bar, y + _LINE * (1 + len(block.rows)), letters)
        y += block.height + _GAP
    return picture


def _width(block: Block, letters: Any) -> float:
    texts = [text.split("\t") for _, text in block.rows]
    rows = [letters.getlength(words[-1]) + _SWATCH + 7 + (len(words) - 1) * _TAB for words in texts]
    scale = [_BAR_WIDTH + 30, letters.getlength(block.bar.title)] if block.bar else []
    return float(max(letters.getlength(block.title), *rows, *scale, 0))


def _draw_scale(picture: Image.Image, bar: Bar, y: int, letters: Any) -> None:
    draw = ImageDraw.Draw(picture)
    draw.text((_EDGE, y + _LINE / 2), bar.title, fill=QUIET, font=letters, anchor="lm")
    ramp = Image.fromarray(np.repeat(bar.ramp[None], _BAR_HEIGHT, axis=0))
    left, top = _EDGE + 12, y + _LINE
    picture.paste(ramp.resize((_BAR_WIDTH, _BAR_HEIGHT), Image.Resampling.BILINEAR), (left, top))
    for place, label in bar.ticks:
        x = left + place * (_BAR_WIDTH - 1)
        draw.line([(x, top + _BAR_HEIGHT), (x, top + _BAR_HEIGHT + 3)], fill=QUIET)
        draw.text((x, top + _BAR_HEIGHT + 4 + _LINE / 2 - 2), label, fill=QUIET, font=letters, anchor="mm")


class Legend:
    """The picture of :func:`draw_legend` at the left edge of a window, at its lower or its upper end."""

    def __init__(self, renderer: Any, *, upper: bool = False) -> None:
        self._renderer, self._upper = renderer, upper
        self._actor: Any = None

    def show(self, blocks: Sequence[Block], window_height: int) -> None:
        """Shows `blocks` in place of what was there."""
        self.clear()
        if not blocks:
            return
        pixels = draw_legend(blocks, window_height - 2 * _CORNER)
        height, width = pixels.shape[:2]
        left, right = float(_CORNER), float(_CORNER + width)
        low = -float(_CORNER + height) if self._upper else float(_CORNER)
        corners = np.array([[left, low, 0], [right, low, 0], [right, low + height, 0], [left, low + height, 0]])
        quad = pyvista.PolyData(corners.astype(np.float32), faces=np.array([4, 0, 1, 2, 3]))
        quad.active_texture_coordinates = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        mapper, self._actor = vtkPolyDataMapper2D(), vtkTexturedActor2D()
        mapper.SetInputData(quad)
        self._actor.SetMapper(mapper)
        origin = self._actor.GetPositionCoordinate()
        origin.SetCoordinateSystemToNormalizedViewport()
        origin.SetValue(0, 1 if self._upper else 0)
        texture: Any = pyvista.Texture(np.ascontiguousarray(pixels))  # type: ignore[no-untyped-call]
        texture.SetInterpolate(False)
        self._actor.SetTexture(texture)
        self._renderer.AddViewProp(self._actor)

    def clear(self) -> None:
        """Removes the legend."""
        if self._actor is not None:
            self._renderer.RemoveViewProp(self._actor)
            self._actor.ReleaseGraphicsResources(self._renderer.GetRenderWindow())
            self._actor = None
