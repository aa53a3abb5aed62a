"""What is particular to the command line of ``lab probe``; argparse only, so that ``lab --help`` answers at once."""

from __future__ import annotations

import argparse

EXAMPLES = """examples:
  lab probe scenes/atrium/scene.toml 640 360
  lab probe sponza.glb 320 180 --size 640x360 --sample 4096 --exact
  lab probe scene.toml 12 34 --preset paper --account --top 10 -o out/pixel.json

Renders the frame and tells of pixel X Y (from the upper left) every grid light that lights it: distance, blend weight
B, receiver's cosine, the lobe's emission, falloff G, what it counts for in its interleaving tile (x), irradiance and
its share, target weight f and the probability p of a pick; the k shadow samples; the shadow ratio before and after the
filter.

  --sample N  draws the pixel's picks N times by the same stages: against p, with S, U and their ratio
  --exact     what the shadow estimator expects: a ray to each input light (jitter: to many points of each light)
  --account   who answers for the difference to the sum over all input lights, each with its own shadow ray

-o FILE.json keeps everything, -o FILE.csv the table of lights. In Python: lab.probe(scene, params, x, y)."""


def add_flags(parser: argparse.ArgumentParser) -> None:
    """The pixel, and what to tell of it."""
    parser.add_argument("x", metavar="X", help="column of the pixel, from 0 at the left")
    parser.add_argument("y", metavar="Y", help="row of the pixel, from 0 at the top")
    parser.add_argument("--top", metavar="N", default="16", help="rows of each table of lights (default: 16)")
    parser.add_argument("--sample", metavar="N", help="draw the pixel's picks N times")
    parser.add_argument("--exact", action="store_true", help="the all-rays value of its shadow")
    parser.add_argument("--account", action="store_true", help="which lights answer for its error")
    parser.add_argument("-o", dest="output", metavar="FILE", help="ends in .json or .csv")


def pixel_after_settings(arguments: list[str]) -> list[str]:
    """``probe --set alpha=2 SCENE X Y`` with SCENE X Y behind a ``--``, where argparse would take them for settings."""
    if arguments[:1] != ["probe"] or "--" in arguments:
        return arguments
    kept: list[str] = []
    moved: list[str] = []
    in_settings = False
    for argument in arguments:
        in_settings = argument == "--set" or (in_settings and not argument.startswith("-"))
        is_setting = argument == "--set" or "=" in argument
        (moved if in_settings and not is_setting else kept).append(argument)
    return [*kept, "--", *moved] if moved else kept
