"""References kept on disk, and taken up again: by scene, view, settings and the very code that made them."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from lab import _core
from lab.caches import cache_root
from lab.engine.cpu import CpuEngine
from lab.errors import LabError, nearest
from lab.outputs import write_all
from lab.params import Params
from lab.reference.brute_force import BruteForce
from lab.reference.estimate import Budget, Estimator, Progress, Reference, refine
from lab.reference.memory import check_memory
from lab.reference.path_tracer import PathTracer
from lab.scene.scene import Camera, Scene

METHODS = ("path_tracer", "brute_force")
SETTINGS_THAT_COUNT = {
    "path_tracer": ("max_bounces", "seed"),
    "brute_force": ("vpls", "max_bounces", "seed", "falloff", "clamp_distance", "compensation"),
}


def render_reference(
    scene: Scene,
    method: str = "path_tracer",
    params: Params | None = None,
    *,
    camera: str | Camera = "",
    size: tuple[int, int] = (1280, 720),
    budget: Budget | None = None,
    pixel: str = "centre",
    cache: bool = True,
    engine: CpuEngine | None = None,
    progress: Progress | None = None,
) -> Reference:
    """The reference of a view, from disk as far as it was computed before; what is missing is added and kept.

    A stored reference is found by the content of the scene, the camera, the size, the settings that count and the
    compiled core: whatever changes any of them makes another one, so none is ever stale. An interrupted run is kept,
    too. The files lie in :func:`cache_folder`; they can be deleted at any time.

    Args:
        scene: what is seen.
        method: ``path_tracer`` or ``brute_force``; see :func:`lab.reference.path_traced`, :func:`~.brute_force`.
        params: the settings; which count depends on the method.
        camera: one of the scene's by name (empty: the first), or a :class:`Camera`.
        size: (width, height).
        budget: how long to refine; its ``spp`` and ``error`` count what earlier runs did, its ``seconds`` don't.
        pixel: ``centre`` or ``area``, for the path tracer.
        cache: False: neither read nor kept.
        engine: one for `scene`, if there is one already.
        progress: see :data:`lab.reference.estimate.Progress`.

    Errors: :class:`LabError` for an unknown method, camera or pixel, where lights reach no surface, where the memory
    does not suffice, and where nothing can be kept on disk.
    """
    if method not in METHODS:
        raise LabError(f"unknown method {method!r}: there are {', '.join(METHODS)}{nearest(method, METHODS)}")
    params, budget = params or Params(), budget or Budget()
    lights = params.vpls if scene.light_list is None else len(scene.light_list)
    check_memory(size, lights if method == "brute_force" else 0)
    view = scene.camera(camera) if isinstance(camera, str) else camera
    ready = engine or CpuEngine(scene)
    estimator: Estimator = (
        PathTracer(ready, view, size, params, pixel)
        if method == "path_tracer"
        else BruteForce(ready, view, size, params)
    )
    if not cache:
        return refine(estimator, budget, progress)
    path = cache_folder() / f"{_key(scene, method, params, (view, size, pixel))}.npz"
    _check_folder(path.parent)
    _take_up(estimator, path)
    reached = estimator.samples

    def keep() -> None:
        values = estimator.state()
        # A disk that is full by now is no reason to throw away what was computed.
        with suppress(OSError):
            write_all({path: lambda target: _write(target, values)})

    reference = refine(estimator, budget, progress, keep)
    return dataclasses.replace(reference, reused=reached)


def cache_folder() -> Path:
    """Where references are kept: ``LAB_CACHE``, or ``many-lights-lab`` in the user's cache folder."""
    return cache_root() / "references"


def _check_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise LabError(
            f"{folder}: references can't be kept there ({error.strerror}); name another folder in the environment "
            "variable LAB_CACHE, or keep none (--no-cache, in Python cache=False)"
        ) from error


def _key(scene: Scene, method: str, params: Params, view: tuple[Camera, tuple[int, int], str]) -> str:
    camera, size, pixel = view
    settings = params.to_dict()
    description = {
        "scene": scene_digest(scene),
        "method": method,
        "camera": dataclasses.asdict(camera) | {"name": ""},
        "size": list(size),
        "pixel": pixel if method == "path_tracer" else "centre",
        "settings": {name: settings[name] for name in SETTINGS_THAT_COUNT[method]},
        "code": _code_digest(),
    }
    return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()[:32]


def scene_digest(scene: Scene) -> str:
    """A hash of everything in a scene that light depends on."""
    digest = hashlib.blake2b(digest_size=16)

    def add(value: object) -> None:
        if isinstance(value, np.ndarray):
            digest.update(f"{value.dtype}{value.shape}".encode())
            digest.update(np.ascontiguousarray(value).data)
        elif dataclasses.is_dataclass(value) and not isinstance(value, type):
            for field in dataclasses.fields(value):
                if field.name != "name":
                    digest.update(field.name.encode())
                    add(getattr(value, field.name))
        elif isinstance(value, list):
            digest.update(f"[{len(value)}".encode())
            for item in value:
                add(item)
        else:
            digest.update(repr(value).encode())

    for name in ("meshes", "materials", "textures", "suns", "points", "spots", "light_list"):
        digest.update(name.encode())
        add(getattr(scene, name))
    return digest.hexdigest()


@cache
def _code_digest() -> str:
    """A hash of the code that makes references: the compiled core, how it is called, and this package."""
    digest = hashlib.blake2b(digest_size=16)
    package = Path(__file__).parent
    for path in [Path(str(_core.__file__)), package.parent / "engine" / "cpu.py", *sorted(package.glob("*.py"))]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _take_up(estimator: Estimator, path: Path) -> None:
    """Restores a stored state; leaves the estimator at its beginning where there is none, or a damaged one."""
    fresh = estimator.state()
    # Whatever a damaged archive makes of numpy and zipfile, the reference is computed anew and replaces it.
    with suppress(Exception), path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
        state = {name: file[name] for name in fresh}
        if all(np.shape(state[name]) == np.shape(value) for name, value in fresh.items()):
            estimator.restore(state)


def _write(path: Path, state: dict[str, Any]) -> None:
    writer: Callable[..., None] = np.savez
    with path.open("wb") as file:
        writer(file, **state)
