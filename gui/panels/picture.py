"""The picture: any layer of the frame, alone or against another, under one zoom; a click probes a pixel."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v3

from gui.layers import FrameLayers, LayerPicture, data_url, layer_picture, png_bytes
from gui.panels.panel import DENSE, Panel
from gui.sources import KEPT, THIS, TITLES
from gui.view_state import COLOUR_MAPS
from gui.web import Picture
from gui.wipe import Difference, difference, wipe
from lab import LabError
from lab.layers import LIGHT, SIGNED, find_layer
from lab.reference import METHODS

MOST_STOPS = 20.0
KEPT_PICTURES = 4
HELP = (
    ("1-9", "show that layer of the list"),
    ("Shift + 1-9", "compare with that layer"),
    ("left, right", "the layer before, after"),
    ("E, Shift+E", "brighter, darker by half a stop"),
    ("R", "automatic exposure again"),
    ("W", "wipe between the two on, off"),
    ("D", "their difference on, off"),
    ("F", "fit the picture to its place"),
    ("wheel, drag", "zoom, move"),
    ("click", "probe a pixel"),
    ("?", "these keys"),
)


@dataclass(frozen=True)
class Shown:
    """What is on the screen: layer A, and B or the difference where they are compared."""

    a: LayerPicture
    b: LayerPicture | None = None
    difference: Difference | None = None


class PicturePanel(Panel):
    """The picture with its bar of choices, its legend and the numbers under the pointer."""

    _shown: Shown | None = None

    def build(self) -> None:
        """Choices above, the picture, legend and numbers below."""
        self._drawn: dict[Hashable, tuple[LayerPicture, str]] = {}
        state = self.state
        state.layer_items, state.other_items, state.source_items = [], [], []
        state.picture_a = state.picture_b = state.title_a = state.title_b = state.hovered = state.compare_note = ""
        state.picture_size, state.pixel, state.marks = list(self.app.view.size), None, []
        state.legend, state.help_open, state.light_shown = {}, False, True
        with html.Div(classes="lab-picture-panel"):
            self._choices()
            with html.Div(classes="lab-picture-place", id="picture"):
                Picture(
                    a=("picture_a",), b=("picture_b",), title_a=("title_a",), title_b=("title_b",),
                    wipe=("wipe", 0.5), zoom=("zoom", 1.0), centre=("centre", [0.5, 0.5]), size=("picture_size",),
                    pixel=("pixel",), marks=("marks",),
                    view=(self._looked, "[$event]"), wipe_to=(lambda at: self.app.look(wipe=at), "[$event]"),
                    pixel_at=(self.app.select_pixel, "[$event]"), hover=(self._hover, "[$event]"),
                    action=(self._action, "[$event]"),
                )  # fmt: skip
            self._legend()
        self._help()

    # --- what is shown ----------------------------------------------------------------------------

    def show(self) -> None:
        """Draws what the view state asks for; what has yet to be rendered follows as soon as it is there."""
        layers, view = self.app.sources.layers(), self.app.view
        if layers is None:
            return
        state = self.state
        state.layer_items = _items(layers)
        state.source_items = [{"title": TITLES[name], "value": name} for name in self.app.sources.names()]
        layer = view.layer if view.layer in layers.names else "colour"
        a = self._draw(layers, layer)
        self._shown, state.compare_note = Shown(a), ""
        if view.compare != "off":
            self._show_other(a)
        self._send(layer)

    def _show_other(self, a: LayerPicture) -> None:
        view, sources = self.app.view, self.app.sources
        try:
            other = sources.other(view.other_source)
            if other is None:
                self._make(view.other_source)
                return
            name = self._other_layer(other)
            self.state.other_items = _items(other)
            if view.compare == "wipe":
                self._shown = Shown(a, b=self._draw(other, name))
            else:
                layer = find_layer(name)
                values = other.values(name)
                if values.shape != a.values.shape or layer.kind not in (a.layer.kind, LIGHT):
                    raise LabError(f"{a.layer.title} and {layer.title} have no difference: choose layers of one kind")
                self._shown = Shown(a, difference=difference(a.values, values, a.layer, other.seen))
        except LabError as error:
            self.state.compare_note = str(error)

    def _other_layer(self, other: FrameLayers) -> str:
        """The layer of B: the chosen one where B has it; of a reference, its part."""
        view = self.app.view
        wanted = view.other_layer
        if view.other_source in METHODS:
            part = wanted.rpartition(".")[2]
            wanted = f"reference.{part}" if f"reference.{part}" in other.names else "reference.colour"
        return wanted if wanted in other.names else "colour"

    def _make(self, source: str) -> None:
        """Has `source` rendered beside the page; the picture shows A alone meanwhile."""
        self.state.compare_note = f"{TITLES[source]} is being made"

        def done(put: Any) -> None:
            put()
            self.show()

        self.app.run("compare", self.app.sources.maker(source), done)

    def _draw(self, layers: FrameLayers, name: str) -> LayerPicture:
        view, layer = self.app.view, find_layer(name)
        colour_map = None if layer.kind == SIGNED else view.colour_map
        usual = layer.colour_map != "heat" and view.colour_map == "heat"
        colours = None if usual else colour_map
        key = layers, name, self.app.exposure, colours, view.log_scale
        if key not in self._drawn:
            shown = layer_picture(layers, name, exposure=self.app.exposure, colour_map=colours, log=view.log_scale)
            self._drawn[key] = shown, data_url(shown.pixels)
            while len(self._drawn) > KEPT_PICTURES:
                self._drawn.pop(next(iter(self._drawn)))
        return self._drawn[key][0]

    def _url(self, shown: LayerPicture) -> str:
        return next((url for drawn, url in self._drawn.values() if drawn is shown), "") or data_url(shown.pixels)

    def _send(self, layer: str) -> None:
        state, view, shown = self.state, self.app.view, self._shown
        if shown is None:
            return
        diff = shown.difference
        state.picture_a = data_url(diff.pixels) if diff else self._url(shown.a)
        state.picture_b = self._url(shown.b) if shown.b else ""
        state.title_a = "A - B" if diff else shown.a.layer.title
        state.title_b = f"{TITLES[view.other_source]}: {shown.b.layer.title}" if shown.b else ""
        state.legend = (diff.legend if diff else shown.a.legend).to_dict()
        state.light_shown = shown.a.layer.kind == LIGHT
        height, width = shown.a.pixels.shape[:2]
        state.picture_size = [width, height]
        state.hovered = ""
        state.layer, state.other_layer, state.other_source = layer, view.other_layer, view.other_source
        state.compare, state.wipe, state.exposure = view.compare, view.wipe, round(view.exposure, 2)
        state.colour_map, state.log_scale = view.colour_map, view.log_scale
        state.zoom, state.centre = view.zoom, list(view.centre)
        state.pixel = list(self.app.pixel) if self.app.pixel else None

    def screenshot(self) -> bytes:
        """The picture as it is compared, pixel by pixel, without zoom."""
        shown = self._shown
        if shown is None:
            return b""
        if shown.difference:
            return png_bytes(shown.difference.pixels)
        if shown.b:
            return png_bytes(wipe(shown.a.pixels, shown.b.pixels, self.app.view.wipe))
        return png_bytes(shown.a.pixels)

    # --- what the user does -------------------------------------------------------------------------

    def _looked(self, at: dict[str, Any]) -> None:
        self.app.look(zoom=float(at["zoom"]), centre=(float(at["centre"][0]), float(at["centre"][1])))

    def _hover(self, at: list[int]) -> None:
        shown, (x, y) = self._shown, (int(at[0]), int(at[1]))
        if shown is None or not (0 <= x < shown.a.pixels.shape[1] and 0 <= y < shown.a.pixels.shape[0]):
            return
        said = f"({x}, {y})  {shown.a.layer.title}: {shown.a.value_at(x, y)}"
        if shown.b:
            said += f"   |   B, {shown.b.layer.title}: {shown.b.value_at(x, y)}"
        with self.state:
            self.state.hovered = said

    def _action(self, action: dict[str, Any]) -> None:
        """A key of the picture."""
        view, number = self.app.view, action["number"]
        names = [item["value"] for item in self.state.layer_items if "value" in item]
        match action["name"]:
            case "layer" if number <= len(names):
                self.app.look(layer=names[number - 1])
            case "other" if number <= len(names):
                self.app.look(other_layer=names[number - 1], compare="wipe" if view.compare == "off" else view.compare)
            case "next" if names:
                at = names.index(self.state.layer) if self.state.layer in names else 0
                self.app.look(layer=names[(at + number) % len(names)])
            case "exposure":
                stops = view.exposure + number if number else 0.0
                self.app.look(exposure=max(-MOST_STOPS, min(MOST_STOPS, stops)))
            case "wipe" | "difference" as wanted:
                self.app.look(compare="off" if view.compare == wanted else wanted)
            case "help":
                with self.state:
                    self.state.help_open = not self.state.help_open

    def _keep(self) -> None:
        """Sets the frame aside, to compare later ones with."""
        self.app.sources.kept = self.app.frame
        self.app.look(other_source=KEPT)

    def _set_exposure(self, text: str) -> None:
        with self.state:
            self.state.exposure = text  # so that what is refused is replaced as soon as the picture is drawn anew
        try:
            self.app.look(exposure=float(text))
        except ValueError:
            self.app.say(f"exposure {text}: expected a number of stops, for example 1.5")

    # --- widgets ------------------------------------------------------------------------------------

    def _choices(self) -> None:
        look = self.app.look
        with html.Div(classes="lab-choices"):
            v3.VSelect(
                model_value=("layer", "colour"), items=("layer_items",), label="layer", id="layer", **DENSE,
                update_modelValue=(lambda name: look(layer=name), "[$event]"), classes="lab-wide",
            )  # fmt: skip
            with v3.VBtnToggle(
                model_value=("compare", "off"), density="compact", variant="outlined", mandatory=True,
                update_modelValue=(lambda how: look(compare=how), "[$event]"),
            ):  # fmt: skip
                for value, icon, title in (
                    ("off", "mdi-square-outline", "A alone"),
                    ("wipe", "mdi-compare", "wipe between A and B (W)"),
                    ("difference", "mdi-minus-box-outline", "difference A - B (D)"),
                ):
                    v3.VBtn(icon=icon, value=value, title=title, size="small", id=f"compare-{value}")
            with html.Div(v_show=("compare != 'off'",), classes="lab-other"):
                v3.VSelect(
                    model_value=("other_source", THIS), items=("source_items",), label="B of", id="other-source",
                    update_modelValue=(lambda name: look(other_source=name), "[$event]"), **DENSE,
                )  # fmt: skip
                v3.VSelect(
                    model_value=("other_layer", "unshadowed"), items=("other_items",), label="layer of B",
                    update_modelValue=(lambda name: look(other_layer=name), "[$event]"), id="other-layer", **DENSE,
                )  # fmt: skip
            v3.VTextField(
                model_value=("exposure", 0), label="stops", id="exposure", **DENSE, v_show=("light_shown",),
                change=(self._set_exposure, "[$event.target.value]"), classes="lab-narrow",
                title="exposure over the automatic one, in stops (E, Shift+E)",
            )  # fmt: skip
            with html.Div(v_show=("!light_shown",), classes="lab-other lab-maps"):
                v3.VSelect(
                    model_value=("colour_map", "heat"), items=(f"{list(COLOUR_MAPS)}",), label="colours",
                    update_modelValue=(lambda name: look(colour_map=name), "[$event]"), id="colour-map", **DENSE,
                )  # fmt: skip
                v3.VCheckbox(
                    model_value=("log_scale", False), label="log", density="compact", hide_details=True, id="log-scale",
                    update_modelValue=(lambda on: look(log_scale=bool(on)), "[$event]"),
                )  # fmt: skip
            v3.VBtn(
                icon="mdi-pin-outline", title="keep this frame, to compare later ones with", size="small",
                variant="text", density="comfortable", click=self._keep, id="keep",
            )  # fmt: skip
            v3.VBtn(
                icon="mdi-help-circle-outline", title="keys (?)", size="small", variant="text", density="comfortable",
                click="help_open = true", id="help",
            )  # fmt: skip

    def _legend(self) -> None:
        with html.Div(classes="lab-legend", id="legend"):
            with html.Div(v_if=("legend.css",), classes="lab-ramp-row"):
                html.Span("{{ legend.title }}{{ legend.unit ? ', ' + legend.unit : '' }}", classes="lab-legend-title")
                with html.Div(classes="lab-ramp-place"):
                    html.Div(classes="lab-ramp", style=("{ background: legend.css }",))
                    html.Span(
                        "{{ tick.text }}", v_for="tick in legend.ticks", key="tick.place", classes="lab-tick",
                        style=("{ left: 100 * tick.place + '%' }",),
                    )  # fmt: skip
            with (
                html.Div(v_if=("(legend.swatches || []).length",), classes="lab-swatches"),
                html.Span(v_for="swatch in legend.swatches", key="swatch[1]"),
            ):
                html.I(style=("{ background: swatch[0] }",))
                html.Span("{{ swatch[1] }}")
            html.Div("{{ compare_note || hovered || legend.note || ' ' }}", classes="lab-hovered", id="hovered")

    def _help(self) -> None:
        with (
            v3.VDialog(v_model=("help_open", False), max_width=420),
            v3.VCard(title="Keys of the picture"),
            v3.VCardText(),
            html.Table(classes="lab-keys"),
        ):
            for key, what in HELP:
                with html.Tr():
                    html.Td(key)
                    html.Td(what)


def _items(layers: FrameLayers) -> list[dict[str, Any]]:
    """The layers of a menu, by group."""
    items: list[dict[str, Any]] = []
    group = ""
    for name in layers.names:
        layer = find_layer(name)
        if layer.group != group:
            group = layer.group
            items.append({"type": "subheader", "title": group})
        items.append({"title": layer.title, "value": name, "props": {"title": layer.title, "density": "compact"}})
    return items
