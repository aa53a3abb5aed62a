"""``lab reference``: what a picture should look like, with its error bars, as BASE.exr, BASE.png and BASE.json."""

from __future__ import annotations

import argparse
import math
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.commands.loading import Loaded, load
from lab.commands.progress_bar import Tell, progress_bar
from lab.commands.render import ENDINGS, output_base, scene_stem, write_text
from lab.commands.request import Request, read_request
from lab.errors import LabError, nearest
from lab.outputs import beside, write_all

if TYPE_CHECKING:
    from lab.engine.cpu import CpuEngine
    from lab.reference import Budget, Reference
    from lab.report import Record

LAYERS = ("colour", "direct", "indirect", "colour_variance", "direct_variance", "indirect_variance")

_SECONDS = {"s": 1.0, "m": 60.0, "h": 3600.0}


def run(args: argparse.Namespace) -> None:
    """Refines the reference, from where an earlier run left it, and writes the three files, all or none."""
    from lab.engine.cpu import CpuEngine
    from lab.reference import METHODS, PIXELS

    request = read_request(args)
    method, pixel = _word("--method", args.method, METHODS), _word("--pixel", args.pixel, PIXELS)
    if method == "brute_force" and pixel == "area":
        raise LabError(
            "--pixel area: brute_force sums the lights at the pixels' centres, where the renderer does; only "
            "path_tracer can average over pixels"
        )
    budget = read_budget(args)
    name = Path(request.record).with_suffix("").name if request.record else scene_stem(request.scene)
    beginning = Path(request.record).parent if request.record else Path("out")
    base = output_base(args.output or str(beginning / f"{name}-reference"), request)
    paths = [beside(base, ending) for ending in ENDINGS]
    with progress_bar(request.quiet) as tell:
        loaded = load(request, lambda stage: tell(0.0, stage), paths)
        engine = CpuEngine(loaded.scene)
        how = {"budget": budget, "pixel": pixel, "cache": not args.no_cache, "engine": engine}
        reference = _refine(loaded, request, method, how, tell)
        tell(1.0, "writing")
        record = _record(loaded, request, reference, pixel)
        _write(engine, request, reference, record, paths)
    if not request.quiet:
        _print_summary(record, paths)


def read_budget(args: argparse.Namespace) -> Budget:
    """``--spp``, ``--error`` and ``--time``."""
    from lab.reference import Budget

    spp, error, seconds = args.spp, args.error, args.time
    if spp is not None and not (spp.isdecimal() and len(spp) <= 9 and int(spp) > 0):
        raise LabError(f"--spp {spp}: expected a whole number of samples a pixel, from 1 to 999999999")
    found = None if error is None else re.fullmatch(r"([\d.]+(?:e-?\d+)?)(%?)", error)
    share = math.nan if found is None else _float(found[1]) / (100 if found[2] else 1)
    if error is not None and not 0 < share < math.inf:
        raise LabError(f"--error {error}: expected a relative error over 0, for example --error 0.01 or 1%")
    found = None if seconds is None else re.fullmatch(r"([\d.]+)([smh]?)", seconds)
    length = math.nan if found is None else _float(found[1]) * _SECONDS[found[2] or "s"]
    if seconds is not None and not 0 < length < math.inf:
        raise LabError(f"--time {seconds}: expected seconds, or a number with s, m or h, for example 90s, 2m or 1h")
    return Budget(
        spp=None if spp is None else int(spp),
        error=None if error is None else share,
        seconds=None if seconds is None else length,
    )


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _word(flag: str, given: str | None, allowed: tuple[str, ...]) -> str:
    """The first where nothing is given."""
    if given is not None and given not in allowed:
        raise LabError(f"{flag} {given}: there is {' and '.join(allowed)}{nearest(given, allowed)}")
    return given or allowed[0]


def _refine(loaded: Loaded, request: Request, method: str, how: dict[str, Any], tell: Tell) -> Reference:
    """The reference; what was reached when it is interrupted is kept, and that is told."""
    from lab.reference import cache_folder, render_reference

    reached = ""

    def said(share: float, line: str) -> None:
        nonlocal reached
        reached = line
        tell(share, line)

    try:
        return render_reference(loaded.scene, method, request.params, size=request.size, progress=said, **how)
    except KeyboardInterrupt:
        if how["cache"] and reached:
            sys.stderr.write(f"lab: {reached} kept in {cache_folder()}; run the same command again to go on\n")
        raise


def _record(loaded: Loaded, request: Request, reference: Reference, pixel: str) -> Record:
    """What BASE.json says, but for the exposure."""
    from lab import __version__
    from lab.reference import SETTINGS_THAT_COUNT, cache_folder
    from lab.report import camera_record, core, light_counts, machine

    scene, params = loaded.scene, request.params.to_dict()
    error = reference.relative_error
    return {
        "method": reference.method,
        "samples": reference.samples,
        "reused_samples": reference.reused,
        "exact": reference.exact,
        "relative_error": error if math.isfinite(error) else None,
        "seconds": round(reference.seconds, 3),
        "pixel": pixel,
        "settings": {name: params[name] for name in SETTINGS_THAT_COUNT[reference.method]},
        "params": params,
        "preset": request.preset,
        "engine": request.engine,
        "scene": {
            "path": str(Path(scene.path).resolve()),
            "name": scene.name,
            "triangles": scene.triangles,
            "lights": light_counts(scene),
            "camera": camera_record(scene.camera()),
            "size": list(request.size),
            "overrides": request.overrides,
        },
        "cache": str(cache_folder()),
        "machine": machine() | core(),
        "version": __version__,
        "load_ms": round(loaded.run.load_ms, 3),
        "notes": list(scene.notes),
    }


def _write(engine: CpuEngine, request: Request, reference: Reference, record: Record, paths: list[Path]) -> None:
    """Writes the files, all or none."""
    import numpy as np

    from lab.colour import auto_exposure, to_bytes
    from lab.image_io import Channels, write_exr, write_png
    from lab.report import image_metadata, to_json

    scene = engine.scene
    seen = engine.render_gbuffer(scene.camera(), request.size).depth > 0
    # As in a frame: the background shines behind everything, and is in no other layer.
    colour = np.where(seen[..., None], reference.colour, reference.colour + np.asarray(scene.background))
    exposure = scene.exposure if scene.exposure is not None else auto_exposure(colour, seen)
    record["scene"]["exposure"] = exposure
    layers = {"colour": colour} | {name: getattr(reference, name) for name in LAYERS[1:]}
    with np.errstate(over="ignore"):  # infinite, as is the variance of a single sample
        channels: Channels = {
            f"{layer}.{component}": np.ascontiguousarray(values[..., i], np.float32)
            for layer, values in layers.items()
            for i, component in enumerate("RGB")
        }
    said = {"method": reference.method, "samples": str(reference.samples), "pixel": record["pixel"]}
    metadata = image_metadata(scene, request.params, scene.camera()) | said
    png, exr, json_file = paths
    pixels, text = to_bytes(colour, exposure), to_json(record)
    write_all(
        {
            png: lambda path: write_png(path, pixels, metadata),
            exr: lambda path: write_exr(path, channels, metadata),
            json_file: lambda path: write_text(path, text),
        }
    )


def _print_summary(record: Record, paths: list[Path]) -> None:
    from rich.console import Console
    from rich.markup import escape

    console = Console(highlight=False, soft_wrap=True)
    scene, error = record["scene"], record["relative_error"]
    noise = "exact" if record["exact"] else "one sample has no error bar" if error is None else f"{error:.2%}"
    console.print(
        f"[bold]{escape(scene['name'])}[/] {scene['size'][0]}x{scene['size'][1]}, {record['method']}: "
        f"[bold]{record['samples']:,}[/] samples a pixel, relative error of the indirect light {noise}, "
        f"{record['seconds']:.1f} s"
    )
    if record["reused_samples"]:
        console.print(f"reused {record['reused_samples']:,} of {record['samples']:,} samples from an earlier run")
    for note in record["notes"]:
        console.print(f"note: {escape(note)}")
    console.print(f"wrote {', '.join(escape(str(path)) for path in paths)}")
