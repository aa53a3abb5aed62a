"""The command line `lab`.

Only argparse lives here: ``lab --help`` must answer at once, so each command brings its own imports when it runs.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import NoReturn

from lab import interrupts
from lab.errors import LabError

RENDER_EXAMPLES = """examples:
  lab render scenes/atrium/scene.toml
  lab render sponza.glb -o out/sponza --size 1920x1080 --sun 0.3,1,0.2
  lab render scene.toml --set vpls=1000000 alpha=2 --set filter=none
  lab render scene.toml --preset paper --camera gallery
  lab render scene.toml --camera -3,1.6,0:4,2,0:0,1,0:55     eye:target[:up[:vertical angle]]
  lab render --from out/atrium.json                          the same run again, bit for bit
  lab render --from out/atrium.json --set shadow_samples=16  the same but for one setting

Writes BASE.png (tone-mapped), BASE.exr (every layer, linear) and BASE.json (settings, machine, times, counts).
'lab params' lists every setting."""

HEATMAP_EXAMPLES = """examples:
  lab heatmap scenes/atrium/scene.toml -o out/atrium-heat
  lab heatmap sponza.glb -o out/heat --set first_level=1 vpls=10000

overdraw of a pixel = lights whose cube of half-edge 2 r_l contains its point. No shadows are traced and nothing is
filtered: settings of those stages change nothing here.
Writes BASE.png (total and each level, with colour bars), BASE.exr and BASE.json."""

EXPORT_EXAMPLES = """examples:
  lab export scenes/atrium/scene.toml -o out/atrium.vtm   for ParaView: one block a level (needs the extra 'gui')
  lab export sponza.glb -o out/lights.npz                 numpy: L0_position, L0_flux, L1_position, ...
  lab export sponza.glb -o out/lights.ply                 one point cloud, with level, cell_size and flux as fields

Level 0 is the input lights."""

MAIN_EXAMPLES = """examples:
  lab render scenes/atrium/scene.toml          a picture, its layers and its record in out/
  lab heatmap scenes/atrium/scene.toml         how many lights each pixel looks at
  lab export scenes/atrium/scene.toml -o out/atrium.npz
  lab params                                   every setting, what it may be, and what the presets say
  lab info                                     versions, processor, what is installed

'lab COMMAND --help' tells more. Exit codes: 0 done, 1 failed, 2 bad input, 130 interrupted."""


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, like every other error of this program."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"lab: error: {message} (see '{self.prog} --help')\n")


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from lab import __version__

        sys.stdout.write(f"lab {__version__}\n")
        parser.exit(0)


def build_parser() -> argparse.ArgumentParser:
    """The whole grammar of the command line."""
    common = _Parser(add_help=False)
    common.add_argument(
        "--debug", action="store_true", default=argparse.SUPPRESS, help="show the traceback of any error"
    )
    parser = _Parser(
        prog="lab",
        description="The many-lights laboratory: rendering with lighting grid hierarchies, to see into and to measure.",
        epilog=MAIN_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        parents=[common],
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    def add(name: str, summary: str, examples: str = "") -> argparse.ArgumentParser:
        return commands.add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
            epilog=examples,
            formatter_class=argparse.RawDescriptionHelpFormatter,
            parents=[common],
            allow_abbrev=False,
        )

    render = add("render", "render a scene to a picture, its layers and a record of the run", RENDER_EXAMPLES)
    render.add_argument("--from", dest="record", metavar="BASE.json", help="repeat a run; other flags change it")
    _add_method_flags(render)
    _add_view_flags(render, "out/SCENE, with --from RECORD-again")
    render.add_argument(
        "--exposure", metavar="X", help="factor on the colour of the PNG, instead of the scene's or the automatic one"
    )

    heatmap = add(
        "heatmap", "draw how many lights each pixel looks at (overdraw), in total and per level", HEATMAP_EXAMPLES
    )
    _add_method_flags(heatmap)
    _add_view_flags(heatmap, "out/SCENE-heatmap")

    export = add("export", "save the lights and every level of the hierarchy for other programs", EXPORT_EXAMPLES)
    export.add_argument("-o", dest="output", metavar="FILE", required=True, help="ends in .vtm, .npz or .ply")
    _add_method_flags(export)

    params = add("params", "list every setting: default, allowed values, unit, the paper's symbol and section, presets")
    params.add_argument("--json", action="store_true", help="as JSON")
    add("info", "tell versions, processor, and which optional parts are installed")
    return parser


def _add_method_flags(parser: argparse.ArgumentParser) -> None:
    """Flags of every command that builds a hierarchy; values are checked where they are used, by one rule each."""
    # Optional to argparse only: see _scene_after_settings.
    parser.add_argument("scene", metavar="SCENE", nargs="?", help="a .toml scene, or a bare .glb, .gltf, .obj or .ply")
    parser.add_argument(
        "--set", dest="assignments", metavar="KEY=VALUE", nargs="+", action="extend", default=[],
        help="change settings; see 'lab params'",
    )  # fmt: skip
    parser.add_argument("--preset", metavar="P", help="start from: ours (default), paper, demo")
    parser.add_argument("--engine", metavar="E", help="cpu")
    parser.add_argument("--sun", metavar="X,Y,Z", help="direction to the sun, instead of the scene's")
    parser.add_argument("--seed", metavar="N", help="seed of every random number")
    parser.add_argument("--threads", metavar="N", help="threads to use; results don't depend on it")
    parser.add_argument("--quiet", action="store_true", help="no progress, no summary")


def _add_view_flags(parser: argparse.ArgumentParser, base: str) -> None:
    parser.add_argument("-o", dest="output", metavar="BASE", help=f"base name of the files (default: {base})")
    parser.add_argument("--camera", metavar="C", help="a camera's name, or eye:target[:up[:fov]], vectors as x,y,z")
    parser.add_argument("--size", metavar="WxH", help="pixels (default: 1280x720)")


def _join_negative_vectors(arguments: list[str]) -> list[str]:
    """``--sun -1,2,0`` as ``--sun=-1,2,0``: argparse would take the vector for a flag."""
    joined: list[str] = []
    for argument in arguments:
        if joined and joined[-1] in ("--sun", "--camera") and re.match(r"-[\d.]", argument):
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


def _scene_after_settings(args: argparse.Namespace) -> None:
    """Gives SCENE back when ``--set alpha=2 SCENE`` has swallowed it, and checks that there is one."""
    if not hasattr(args, "scene"):
        return
    if args.scene is None and args.assignments and "=" not in args.assignments[-1]:
        args.scene = args.assignments.pop()
    if args.scene is None and getattr(args, "record", None) is None:
        raise LabError(f"{args.command}: no scene given; for example: lab {args.command} scenes/atrium/scene.toml")


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit code: 0 done, 1 failed, 2 bad input, 130 interrupted."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        args = build_parser().parse_args(_join_negative_vectors(arguments))
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 1
    try:
        with interrupts.remembered():
            _scene_after_settings(args)
            import_module(f"lab.commands.{args.command}").run(args)
    except KeyboardInterrupt:
        return _say("interrupted", 130)
    except (BrokenPipeError, SystemExit):  # rich leaves by SystemExit then
        # The reader of our output has left (`lab params | head`): nothing is wrong, and nobody listens.
        sys.stderr.close()
        return 0
    except Exception as error:
        if getattr(args, "debug", False):
            raise
        if interrupts.pressed() or isinstance(error, LabError):  # a library may make an ImportError of Ctrl-C
            return _say("interrupted", 130) if interrupts.pressed() else _say(f"error: {error}", 2)
        kind = "out of memory" if isinstance(error, MemoryError) else type(error).__name__
        detail = " ".join(str(error).split())
        return _say(f"failed: {kind}{': ' if detail else ''}{detail} (--debug shows where)", 1)
    return 0


def _say(message: str, code: int) -> int:
    sys.stderr.write(f"lab: {message}\n")
    return code
