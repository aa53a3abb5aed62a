"""What a command was asked to do: every flag checked before anything is read, rendered or written."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, field
from pathlib import Path

from lab.engine.engine import check_device, check_lighting
from lab.errors import LabError, nearest
from lab.params import PRESETS, Params, parse_assignments, preset
from lab.report import Record, read_record

LARGEST_SIDE = 16384
LARGEST_IMAGE = 64 * 2**20
MOST_THREADS = 1024
_MOST_DIGITS = 9


@dataclass(frozen=True)
class Request:
    """Checked flags.

    Attributes:
        scene: path of the scene's file.    size: width and height in pixels.
        overrides: ``camera``, ``sun``, ``exposure`` as given by hand, where given.
        threads: None for all.    device: a Vulkan device's name or number; empty for the first.
        record: path of the record that is repeated, if any.

    """

    scene: str
    params: Params
    preset: str
    size: tuple[int, int]
    engine: str
    threads: int | None
    quiet: bool
    device: str = ""
    overrides: dict[str, str] = field(default_factory=dict)
    record: str | None = None


def read_request(args: argparse.Namespace, engines: tuple[str, ...] = ("cpu",)) -> Request:
    """The flags of a command that renders; what they leave open comes from the record of ``--from``.

    `engines`: those that the command works with.
    """
    path = getattr(args, "record", None)
    record = read_record(path) if path else {}
    old_scene: Record = record.get("scene", {})
    given = {name: getattr(args, name, None) for name in ("camera", "sun", "exposure")}
    overrides = dict(_texts(old_scene.get("overrides", {}))) | {k: v for k, v in given.items() if v is not None}
    if "exposure" in overrides:
        _number("--exposure", overrides["exposure"])
    preset_name = str(record.get("preset", "ours")) if args.preset is None else args.preset
    engine = str(record.get("engine", "cpu")) if args.engine is None else args.engine
    device = getattr(args, "device", None) or ""
    check_device(engine, device)
    if engine not in engines:
        raise LabError(f"--engine {engine}: lab {args.command} works with --engine {' or '.join(engines)} alone")
    params = _params(args, record, preset_name)
    check_lighting(engine, params)
    return Request(
        scene=args.scene or _recorded_scene(str(path), old_scene),
        params=params,
        preset=preset_name,
        size=_size(getattr(args, "size", None), old_scene.get("size")),
        engine=engine,
        device=device,
        threads=None if args.threads is None else whole_number("--threads", args.threads, 1, MOST_THREADS),
        quiet=args.quiet,
        overrides=overrides,
        record=path,
    )


def _params(args: argparse.Namespace, record: Record, preset_name: str) -> Params:
    changes: dict[str, object] = dict(parse_assignments(args.assignments))
    if args.seed is not None:
        changes["seed"] = args.seed
    if record and args.preset is None:
        if preset_name not in PRESETS:
            raise LabError(f"--from: unknown preset {preset_name!r}{nearest(preset_name, PRESETS)}")
        return Params().replace(**record["params"]).replace(**changes)
    return preset(preset_name, **changes)


def _recorded_scene(record_path: str, scene: Record) -> str:
    """The scene's path as recorded, or where it lies relative to the record when both were moved."""
    path = scene.get("path")
    if not isinstance(path, str):
        raise LabError(f"--from {record_path}: names no scene; give one: lab render SCENE --from {record_path}")
    moved = scene.get("relative_path")
    if not Path(path).exists() and isinstance(moved, str) and (Path(record_path).parent / moved).exists():
        return str(Path(record_path).parent / moved)
    return path


def _texts(values: object) -> dict[str, str]:
    if not isinstance(values, dict) or not all(isinstance(value, str) for value in values.values()):
        raise LabError(f"--from: 'overrides' must hold camera, sun and exposure as text, got {values}")
    return {name: value for name, value in values.items() if name in ("camera", "sun", "exposure")}


def _size(text: str | None, recorded: object) -> tuple[int, int]:
    if text is None and recorded is None:
        return 1280, 720
    if text is None:
        text = "x".join(str(side) for side in recorded) if isinstance(recorded, list) else str(recorded)
    width, cross, height = text.lower().partition("x")
    if not (cross and all(side.isdecimal() and len(side) <= _MOST_DIGITS for side in (width, height))):
        raise LabError(f"--size {text}: expected WIDTHxHEIGHT in pixels, for example --size 1280x720")
    size = int(width), int(height)
    if not all(1 <= side <= LARGEST_SIDE for side in size):
        raise LabError(f"--size {text}: each side must be from 1 to {LARGEST_SIDE} pixels")
    if size[0] * size[1] > LARGEST_IMAGE:
        raise LabError(f"--size {text}: at most {LARGEST_IMAGE // 2**20} megapixels (2^20 each) fit one frame")
    return size


def whole_number(flag: str, text: str, low: int, high: int) -> int:
    """The number of a flag, checked."""
    if not (text.isdecimal() and len(text) <= _MOST_DIGITS) or not low <= int(text) <= high:
        raise LabError(f"{flag} {text}: expected a whole number from {low} to {high}")
    return int(text)


def _number(flag: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise LabError(f"{flag} {text}: expected a number over 0")
    return value


def exposure_of(request: Request) -> float | None:
    """The exposure given by hand, as :func:`lab.scene.load.override` takes it."""
    text = request.overrides.get("exposure")
    return None if text is None else _number("--exposure", text)
