"""The page: bar of actions, settings at the left, picture and scene side by side, panels below."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trame.ui.html import DivLayout
from trame.widgets import client, html
from trame.widgets import vuetify3 as v3

from gui import web
from gui.panels.all import TITLES

if TYPE_CHECKING:
    from gui.inspector import Inspector


def build_page(app: Inspector) -> None:
    """Builds the whole page of `app`, once."""
    app.server.enable_module(web)
    with DivLayout(app.server) as layout:
        layout.root.classes = "lab-page"
        client.Style(web.STYLE.read_text(encoding="utf-8"))
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
        _files(app)
        _button("mdi-undo", "undo the last change of a setting", app.undo, "undo", "undo_steps == 0")
        _button("mdi-redo", "redo", app.redo, "redo", "redo_steps == 0")
        _button("mdi-restore", "all settings as the preset says", app.reset, "reset")


def _files(app: Inspector) -> None:
    """Saving, restoring, copying, exporting. Files travel through the browser: the server may be another machine."""
    app.ctrl.trigger("saved")(app.saved)
    app.ctrl.trigger("restore")(app.restore)
    app.ctrl.trigger("exported")(app.exported)
    app.ctrl.trigger("screenshot")(app.screenshot)
    stem = app.workbench.scene.name
    v3.VBtn(
        icon="mdi-content-save", title="save the whole state to a file", size="small", variant="text", id="save",
        density="comfortable", click=f"utils.download('{stem}-inspector.json', trigger('saved'), 'application/json')",
    )  # fmt: skip
    html.Input(
        type="file", ref="restore_file", style="display: none", accept=".json,application/json", id="restore-file",
        change="$event.target.files[0].text().then((text) => "
        "trigger('restore', [text, $event.target.files[0].name]).then(() => { $event.target.value = '' }))",
    )  # fmt: skip
    v3.VBtn(
        icon="mdi-folder-open", title="restore a saved state", size="small", variant="text", id="restore",
        density="comfortable", click="trame.refs.restore_file.click()",
    )  # fmt: skip
    with v3.VMenu():
        with html.Template(v_slot_activator="{ props }"):
            v3.VBtn(
                icon="mdi-download", title="pictures and data", size="small", variant="text", v_bind="props",
                id="downloads", density="comfortable",
            )  # fmt: skip
        with v3.VList(density="compact"):
            for name, title in (
                ("picture", "picture as PNG"),
                ("scene", "scene view as PNG"),
                ("panel", "panel as PNG"),
            ):
                click = f"utils.download('{stem}-{name}.png', trigger('screenshot', ['{name}']), 'image/png')"
                v3.VListItem(title=title, click=click, id=f"screenshot-{name}")
            for ending, title in ((".vtm", "levels for ParaView (.vtm in a zip)"), (".npz", "levels for numpy (.npz)")):
                file = f"{stem}.zip" if ending == ".vtm" else f"{stem}{ending}"
                click = f"utils.download('{file}', trigger('exported', ['{ending}']), 'application/octet-stream')"
                v3.VListItem(title=title, click=click, id=f"export-{ending[1:]}")
    with v3.VDialog(max_width=760):
        with html.Template(v_slot_activator="{ props }"):
            v3.VBtn(
                icon="mdi-code-tags", title="these settings as a command line and as Python", size="small",
                variant="text", v_bind="props", id="code", density="comfortable",
            )  # fmt: skip
        with v3.VCard(title="This frame elsewhere"), v3.VCardText():
            for name, title in (("command", "in a shell"), ("python", "in Python")):
                with html.Div(classes="lab-code-head"):
                    html.Span(title)
                    v3.VBtn(
                        "copy", size="x-small", variant="tonal", id=f"copy-{name}",
                        click=f"utils.get('navigator.clipboard').writeText({name}_text)",
                    )  # fmt: skip
                html.Pre(f"{{{{ {name}_text }}}}", classes="lab-code", id=f"code-{name}")


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
