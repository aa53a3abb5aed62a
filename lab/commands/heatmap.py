"""``lab heatmap``: how many lights each pixel looks at, as BASE.png, BASE.exr and BASE.json."""

from __future__ import annotations

import argparse

from lab.commands.loading import load, progress, render
from lab.commands.render import ENDINGS, output_base, write_text
from lab.commands.request import read_request
from lab.commands.summary import print_summary
from lab.engine.engine import ENGINES
from lab.outputs import beside, write_all


def run(args: argparse.Namespace) -> None:
    """Lights the scene without shadows, and writes the three files, all or none."""
    request = read_request(args, ENGINES)
    base = output_base(args.output, request, "-heatmap")
    params = request.params.replace(shadow_samples=0, direct_samples=0, filter="none")

    from lab.heatmap import Panel, draw_heatmap
    from lab.image_io import count_channels, write_exr, write_png
    from lab.report import add_maxima, image_metadata, run_record, to_json

    paths = [beside(base, ending) for ending in ENDINGS]
    with progress(request.quiet) as tell:
        loaded = load(request, tell, paths)
        frame = render(loaded, params, request, tell)
        tell("writing")
        metadata = image_metadata(loaded.scene, params, frame.camera)
        channels = count_channels(frame.lighting, params.first_level)
        seen = frame.gbuffer.depth > 0
        record = run_record(frame, loaded.scene, loaded.run, base)
        add_maxima(record, channels, seen)
        text = to_json(record)
        rows = [row for row in record["counts"]["levels"] if row["level"] >= params.first_level]
        panels = [
            Panel(
                f"level {row['level']}: {row['grid_lights']:,} lights, "
                f"mean {row['overdraw_mean']:.3g}, max {row['overdraw_max']:,}",
                channels[f"overdraw.L{row['level']}"],
            )
            for row in rows
        ]
        total = record["counts"]["overdraw"]
        title = (
            f"{loaded.scene.name}: overdraw, {sum(row['grid_lights'] for row in rows):,} lights on {len(rows)} levels, "
            f"alpha {params.alpha:g}: mean {total['mean']:.4g}, max {total['max']:,} lights a pixel"
        )
        totals = [Panel(title, channels["overdraw.Y"])]
        if "fragments" in record["counts"]:
            made = record["counts"]["fragments"]
            said = (
                f"fragments that the rasteriser made of the cubes: mean {made['mean']:.4g}, max {made['max']:,} a pixel"
            )
            totals.append(Panel(said, channels["fragments.Y"]))
        pixels = draw_heatmap(totals, panels, seen)
        png, exr, json_file = paths
        write_all(
            {
                png: lambda path: write_png(path, pixels, metadata),
                exr: lambda path: write_exr(path, channels, metadata),
                json_file: lambda path: write_text(path, text),
            }
        )
    if not request.quiet:
        print_summary(record, paths)
