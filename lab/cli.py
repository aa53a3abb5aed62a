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
  lab export sponza.glb -o out/sponza.xml --size 640x360  the scene itself, for Mitsuba 3: mitsuba out/sponza.xml

Level 0 is the input lights. Of an .xml the meshes and textures lie in NAME-mitsuba beside it; paths there have
max_bounces bounces, as ours do, and what Mitsuba can't do alike is noted."""

COMPARE_EXAMPLES = """examples:
  lab compare out/ours.exr out/reference.exr                      the layer 'colour', as JSON
  lab compare ours.exr reference.exr --layer indirect -o out/cmp  with pictures: side by side, signed error, FLIP
  lab compare ours.exr mitsuba.exr                                plain R G B of other programs is taken as 'colour'
  lab compare ours.exr reference.exr --region 100,40,64,64 --per-channel

B is the reference. Over all values a of A and b of B:
  rel_mse       mean of (a - b)^2 / (b^2 + epsilon^2), epsilon = 1 % of the mean of B's layer
  mse, rmse     mean of (a - b)^2, and its square root
  energy_ratio  sum of A over sum of B: 1 where no light is lost or invented
  flip          mean HDR-FLIP, 0 (looks the same) to 1, at 67 pixels a degree, exposures from B; RGB light only
  rel_mse_noise the part of rel_mse that is B's own noise, where B has the layer's variance (as 'lab reference' writes)
A region's numbers use the whole layer's epsilon and FLIP map. What has no value is null, and 'notes' say why.
-o DIR writes side_by_side.png, error.png (red: A too bright, blue: too dark), flip.png and comparison.json."""

REFERENCE_EXAMPLES = """examples:
  lab reference scenes/cornell/scene.toml --size 640x360
  lab reference sponza.glb --error 1% -o out/sponza-truth          until the relative error is 1 %
  lab reference sponza.glb --time 10m                              until ten minutes are over
  lab reference scene.toml --method brute_force --spp 4096 --set vpls=1000000 compensation=path
  lab reference --from out/atrium.json                             what that frame should have looked like

Methods:
  path_tracer   no virtual lights: paths from the camera, with rays to the scene's lights at every bounce. Of the
                settings max_bounces and seed count. A sample is a path a pixel (default: 256).
  brute_force   every virtual light (or light of the scene's list), with a shadow ray to each. vpls, max_bounces, seed,
                falloff, clamp_distance and compensation count. A sample is a light drawn a pixel (default: 1024) in
                proportion to what it sends; a pixel that fewer lights reach is exact.
Of --spp, --error and --time whichever is met first ends it. --error is that of the indirect light: the mean standard
error of a pixel over the mean.

Writes BASE.exr (colour, direct, indirect, and the variance of each: colour_variance ...), BASE.png and BASE.json. What
was computed is kept in the folder LAB_CACHE, or that of your caches: more samples add to it, after Ctrl-C too, and
another scene, view, setting or version of the program never finds it. It may be deleted at any time."""

ATTRIBUTE_EXAMPLES = """examples:
  lab attribute scenes/atrium/scene.toml
  lab attribute sponza.glb -o out/sponza-budget --size 320x180
  lab attribute scene.toml --preset paper --set vpls=10000

Each approximation is switched on alone, everything else being exact, and off alone in the whole frame: where the two
differ, approximations interact. Error is relMSE of the indirect light against the path-traced truth (or the sum over
all virtual lights, where that tells a term apart) with the noise of both taken off; energy ratio and HDR-FLIP beside
it. Every row of the page says what was compared with what. The presets ours, paper and demo are ranked with the same
--set. The references are kept as those of 'lab reference' are; Sponza takes some minutes on two cores.
Writes DIR/index.html (one page, pictures inside) and DIR/attribution.json."""

MAIN_EXAMPLES = """examples:
  lab render scenes/atrium/scene.toml          a picture, its layers and its record in out/
  lab heatmap scenes/atrium/scene.toml         how many lights each pixel looks at
  lab export scenes/atrium/scene.toml -o out/atrium.npz
  lab reference scenes/atrium/scene.toml       what the picture should look like, path traced
  lab attribute scenes/atrium/scene.toml       where its error comes from, term by term
  lab bench                                    each stage's time against the limits of this machine
  lab compare out/a.exr out/b.exr              how far a picture is from another, in numbers and pictures
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

    export = add(
        "export", "save the lights and every level of the hierarchy, or the scene, for other programs", EXPORT_EXAMPLES
    )
    export.add_argument("-o", dest="output", metavar="FILE", required=True, help="ends in .vtm, .npz, .ply or .xml")
    _add_method_flags(export)
    _add_camera_flags(export)

    reference = add(
        "reference", "render what a picture should look like: path traced, or every light summed", REFERENCE_EXAMPLES
    )
    reference.add_argument("--from", dest="record", metavar="BASE.json", help="of the frame of that run")
    reference.add_argument("--method", metavar="M", help="path_tracer (default) or brute_force")
    reference.add_argument("--spp", metavar="N", help="samples a pixel: paths, or lights drawn")
    reference.add_argument("--error", metavar="E", help="relative error to reach, for example 0.01 or 1%%")
    reference.add_argument("--time", metavar="T", help="time to spend, for example 90s, 2m or 1h")
    reference.add_argument(
        "--pixel", metavar="P", help="centre (default): where a frame looks; area: the mean over each pixel"
    )
    reference.add_argument("--no-cache", action="store_true", help="neither use nor keep earlier samples")
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


def _add_method_flags(parser: argparse.ArgumentParser, several: bool = False) -> None:
    """Flags of every command that builds a hierarchy; values are checked where they are used, by one rule each."""
    # Optional to argparse only: see _scene_after_settings.
    name, count = ("scenes", "*") if several else ("scene", "?")
    parser.add_argument(name, metavar="SCENE", nargs=count, help="a .toml scene, or a bare .glb, .gltf, .obj or .ply")
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
    _add_camera_flags(parser)


def _add_camera_flags(parser: argparse.ArgumentParser, size: str = "1280x720") -> None:
    parser.add_argument("--camera", metavar="C", help="a camera's name, or eye:target[:up[:fov]], vectors as x,y,z")
    parser.add_argument("--size", metavar="WxH", help=f"pixels (default: {size})")


def _add_bench_flags(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", dest="output", metavar="BASE", help="base name of the files (default: out/SCENE-bench)")
    parser.add_argument("--json", metavar="FILE", help="where the JSON goes, instead of BASE.json")
    parser.add_argument("--frames", metavar="N", help="timed frames (default: 32, with --quick 8)")
    parser.add_argument("--quick", action="store_true", help="a quarter of the frames")
    parser.add_argument(
        "--sweep", metavar="S", action="append", default=[],
        help="also over: vpls, interleave, shadow_samples or threads; may be repeated",
    )  # fmt: skip
    parser.add_argument("--compare", metavar="OTHER.json", help="tell what changed since that run")
    _add_method_flags(parser, several=True)
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
