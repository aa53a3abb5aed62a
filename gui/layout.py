"""The page: bar of actions, settings at the left, picture and scene side by side, panels below."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from trame.ui.html import DivLayout
from trame.widgets import client, html
from trame.widgets import vuetify3 as v3

from gui.panels.all import TITLES

if TYPE_CHECKING:
    from gui.inspector import Inspector

WEB = Path(__file__).parent / "web"


def build_page(app: Inspector) -> None:
    """Builds the whole page of `app`, once."""
    with DivLayout(app.server) as layout:
        layout.root.classes = "lab-page"
        client.Style((WEB / "style.css").read_text(encoding="utf-8"))
        with v3.VApp(classes="lab-app"), html.Div(classes="lab-grid"):
            _bar(app)
            with html.Div(classes="lab-left"):
                app.params.build()
            with html.Div(classes=("`lab-views lab-split-${split}`",)):
                for name in ("picture", "scene"):
                    with html.Div(classes=f"lab-view lab-view-{name}", id=f"view-{name}"):
                        if name in app.panels:
                            app.panels[name].build()
            _lower(app)
            v3.VSnackbar(
                "{{ message }}", v_model=("message_open", False), color=("message_colour",), timeout=9000,
                location="bottom", multi_line=True, id="message",
            )  # fmt: skip


def _bar(app: Inspector) -> None:
    with html.Div(classes="lab-top"):
        html.Span("many-lights laboratory", classes="lab-brand")
        html.Span("{{ scene_name }}", classes="lab-scene", title=("scene_notes.join('\\n')",))
        with html.Div(classes="lab-busy", v_show=("busy",), id="busy"):
            v3.VProgressCircular(indeterminate=True, size=16, width=2)
            html.Span("{{ busy }}")
            _button("mdi-close", "cancel", app.jobs.cancel, "cancel")
        v3.VSpacer()
        with v3.VBtnToggle(
            model_value=("split",), density="compact", mandatory=True, variant="outlined",
            update_modelValue=(lambda split: app.look(split=split), "[$event]"),
        ):  # fmt: skip
            for value, icon, title in (
                ("image", "mdi-image", "picture alone"),
                ("both", "mdi-view-split-vertical", "picture and scene"),
                ("scene", "mdi-cube-outline", "scene alone"),
            ):
                v3.VBtn(icon=icon, value=value, title=title, size="small", id=f"split-{value}")
        _button("mdi-undo", "undo the last change of a setting", app.undo, "undo", "undo_steps == 0")
        _button("mdi-redo", "redo", app.redo, "redo", "redo_steps == 0")
        _button("mdi-restore", "all settings as the preset says", app.reset, "reset")


def _button(icon: str, title: str, click: object, testid: str, disabled: str = "false") -> None:
    v3.VBtn(
        icon=icon, title=title, click=click, size="small", variant="text", density="comfortable",
        id=testid, disabled=(disabled,),
    )  # fmt: skip


def _lower(app: Inspector) -> None:
    with html.Div(classes="lab-lower"):
        with v3.VTabs(
            model_value=("panel",), density="compact", update_modelValue=(lambda name: app.look(panel=name), "[$event]")
        ):
            for name, title in TITLES.items():
                if name in app.panels:
                    v3.VTab(title, value=name, id=f"tab-{name}")
        for name in TITLES:
            if name in app.panels:
                with html.Div(v_show=(f"panel == '{name}'",), classes="lab-panel", id=f"panel-{name}"):
                    app.panels[name].build()
