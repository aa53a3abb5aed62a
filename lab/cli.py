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
from lab.bench.definitions import HELP as BENCH_EXAMPLES
from lab.commands import probe_flags
from lab.errors import LabError
from lab.examples import (
    ATTRIBUTE_EXAMPLES,
    COMPARE_EXAMPLES,
    EXPORT_EXAMPLES,
    HEATMAP_EXAMPLES,
    INSPECT_EXAMPLES,
    MAIN_EXAMPLES,
    REFERENCE_EXAMPLES,
    RENDER_EXAMPLES,
    VIEW_EXAMPLES,
)


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

    export = add(
        "export", "save the lights and every level of the hierarchy, or the scene, for other programs", EXPORT_EXAMPLES
    )
    export.add_argument("-o", dest="output", metavar="FILE", required=True, help="ends in .vtm, .npz, .ply or .xml")
    _add_method_flags(export)
    _add_camera_flags(export)

    reference = add(
        "reference", "render what a picture should look like: path traced, or every light summed", REFERENCE_EXAMPLES
    )
    _add_reference_flags(reference)
    _add_method_flags(reference)
    _add_view_flags(reference, "out/SCENE-reference")

    attribute = add(
        "attribute", "tell where a frame's error comes from, approximation by approximation", ATTRIBUTE_EXAMPLES
    )
    attribute.add_argument("-o", dest="output", metavar="DIR", help="folder (default: out/SCENE-attribution)")
    attribute.add_argument("--no-cache", action="store_true", help="neither use nor keep earlier references")
    _add_method_flags(attribute)
    _add_camera_flags(attribute, "640x360")

    bench = add("bench", "measure the stages of a frame against the limits of this machine", BENCH_EXAMPLES)
    _add_bench_flags(bench)

    probe = add("probe", "tell why a pixel looks as it does: its lights, picks and shadows", probe_flags.EXAMPLES)
    _add_method_flags(probe, count=None)
    probe_flags.add_flags(probe)
    _add_camera_flags(probe)

    inspect = add("inspect", "look into the hierarchy and a frame's every pixel, in the browser", INSPECT_EXAMPLES)
    _add_inspect_flags(inspect)

    view = add("view", "fly through a scene in real time, in a window (Vulkan)", VIEW_EXAMPLES)
    _add_view_window_flags(view)

    compare = add("compare", "measure how far an image is from a reference, layer by layer", COMPARE_EXAMPLES)
    compare.add_argument("a", metavar="A.exr", help="the image")
    compare.add_argument("b", metavar="B.exr", help="its reference, of the same size")
    compare.add_argument("--layer", metavar="L", help="default: colour, or plain R G B where a file has no layers")
    compare.add_argument(
        "--region", metavar="X,Y,W,H", action="append", default=[],
        help="measure this rectangle too, in pixels from the upper left corner; may be repeated",
    )  # fmt: skip
    compare.add_argument("--per-channel", action="store_true", help="the numbers of each channel, too")
    compare.add_argument("-o", dest="output", metavar="DIR", help="folder for pictures of the difference")

    params = add("params", "list every setting: default, allowed values, unit, the paper's symbol and section, presets")
    params.add_argument("--json", action="store_true", help="as JSON")
    add("info", "tell versions, processor, and which optional parts are installed")
    return parser


def _add_method_flags(
    parser: argparse.ArgumentParser, count: str | None = "?", engines: str = "cpu (default) or vulkan"
) -> None:
    """Flags of every command that builds a hierarchy; values are checked where they are used, by one rule each."""
    # Optional to argparse only: see _scene_after_settings.
    name = "scenes" if count == "*" else "scene"
    parser.add_argument(name, metavar="SCENE", nargs=count, help="a .toml scene, or a bare .glb, .gltf, .obj or .ply")
    parser.add_argument(
        "--set", dest="assignments", metavar="KEY=VALUE", nargs="+", action="extend", default=[],
        help="change settings; see 'lab params'",
    )  # fmt: skip
    parser.add_argument("--preset", metavar="P", help="start from: ours (default), paper, demo")
    parser.add_argument("--engine", metavar="E", help=engines)
    parser.add_argument("--device", metavar="D", help="with --engine vulkan: a device's name or number (lab info)")
    parser.add_argument("--sun", metavar="X,Y,Z", help="direction to the sun, instead of the scene's")
    parser.add_argument("--seed", metavar="N", help="seed of every random number")
    parser.add_argument("--threads", metavar="N", help="threads to use; results don't depend on it")
    parser.add_argument("--quiet", action="store_true", help="no progress, no summary")


def _add_view_flags(parser: argparse.ArgumentParser, base: str) -> None:
    parser.add_argument("-o", dest="output", metavar="BASE", help=f"base name of the files (default: {base})")
    _add_camera_flags(parser)


def _add_camera_flags(parser: argparse.ArgumentParser, size: str = "1280x720") -> None:
    parser.add_argument("--camera", metavar="C", help="a camera's name, or eye:target[:up[:fov]], vectors as x,y,z")
    parser.add_argument("--size", metavar="WxH", help=f"pixels (default: {size})")


def _add_bench_flags(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", dest="output", metavar="BASE", help="base name of the files (default: out/SCENE-bench)")
    parser.add_argument("--json", metavar="FILE", help="where the JSON goes, instead of BASE.json")
    parser.add_argument("--frames", metavar="N", help="timed frames (default: 32; see below)")
    parser.add_argument("--quick", action="store_true", help="a quarter of the frames")
    parser.add_argument(
        "--sweep", metavar="S", action="append", default=[],
        help="also over: vpls, interleave, shadow_samples or threads; may be repeated",
    )  # fmt: skip
    parser.add_argument("--compare", metavar="OTHER.json", help="tell what changed since that run")
    _add_method_flags(parser, count="*")
    _add_camera_flags(parser)


def _add_reference_flags(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--from", dest="record", metavar="BASE.json", help="of the frame of that run")
    parser.add_argument("--method", metavar="M", help="path_tracer (default) or brute_force")
    parser.add_argument("--spp", metavar="N", help="samples a pixel: paths, or lights drawn")
    parser.add_argument("--error", metavar="E", help="relative error to reach, for example 0.01 or 1%%")
    parser.add_argument("--time", metavar="T", help="time to spend, for example 90s, 2m or 1h")
    parser.add_argument(
        "--pixel", metavar="P", help="centre (default): where a frame looks; area: the mean over each pixel"
    )
    parser.add_argument("--no-cache", action="store_true", help="neither use nor keep earlier samples")


def _add_inspect_flags(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--host", metavar="H", help="address to listen at (default: 127.0.0.1, this machine alone)")
    parser.add_argument("--port", metavar="N", help="port to listen at (default: 8642, or a free one); 0: a free one")
    parser.add_argument("--window", action="store_true", help="a desktop window with the 3D view, no browser")
    parser.add_argument("--screenshot", metavar="DIR", help="write every view as DIR/NAME.png and end")
    parser.add_argument("--state", metavar="FILE", help="start as saved by the inspector; other flags change it")
    _add_method_flags(parser)
    _add_camera_flags(parser, "640x360")


def _add_view_window_flags(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--frames", metavar="N", help="render so many frames, tell their times and end")
    parser.add_argument(
        "--screenshot", metavar="FILE.png", help="with --frames: save the last one; F12 saves to FILE-1.png ..."
    )
    parser.add_argument("--regenerate", action="store_true", help="make the lights anew every frame, too")
    parser.add_argument(
        "--exposure", metavar="X", help="factor on the colour, instead of the scene's or the automatic one"
    )
    _add_method_flags(parser, engines="vulkan: there is no other")
    _add_camera_flags(parser)


def _join_negative_vectors(arguments: list[str]) -> list[str]:
    """``--sun -1,2,0`` as ``--sun=-1,2,0``: argparse would take the vector for a flag."""
    joined: list[str] = []
    for argument in arguments:
        if joined and joined[-1] in ("--sun", "--camera", "--region") and re.match(r"-[\d.]", argument):
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


def _scene_after_settings(args: argparse.Namespace) -> None:
    """Gives SCENE back when ``--set alpha=2 SCENE`` has swallowed it, and checks that there is one."""
    if hasattr(args, "scenes"):
        swallowed: list[str] = []
        while args.assignments and "=" not in args.assignments[-1]:
            swallowed.insert(0, args.assignments.pop())
        args.scenes += swallowed
    if not hasattr(args, "scene"):
        return
    if args.scene is None and args.assignments and "=" not in args.assignments[-1]:
        args.scene = args.assignments.pop()
    if args.scene is None and not any(getattr(args, source, None) for source in ("record", "state")):
        raise LabError(f"{args.command}: no scene given; for example: lab {args.command} scenes/atrium/scene.toml")


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit code: 0 done, 1 failed, 2 bad input, 130 interrupted."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        args = build_parser().parse_args(probe_flags.pixel_after_settings(_join_negative_vectors(arguments)))
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
