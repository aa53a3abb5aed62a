"""The XML itself, and all its files written together."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from lab.mitsuba_scene.elements import child, put, put_lookat, put_rgb
from lab.mitsuba_scene.emitters import add_emitters, check_light_list
from lab.mitsuba_scene.geometry import Part, parts, reversed_behind, write_ply
from lab.mitsuba_scene.surfaces import Files, Texture, add_bsdf, has_holes
from lab.outputs import check_no_input, check_writable, write_all
from lab.params import Params
from lab.scene.scene import Camera, Scene

SAMPLES = 64
"""Paths a pixel unless ``mitsuba -D spp=N`` says otherwise."""


@dataclass(frozen=True)
class MitsubaScene:
    """What was written: the XML first, then the files beside it; and `notes` on what is not quite the same."""

    files: list[Path]
    notes: list[str] = field(default_factory=list)


def export_mitsuba(
    path: str | Path, scene: Scene, camera: Camera, size: tuple[int, int], params: Params
) -> MitsubaScene:
    """Writes `scene`, seen by `camera` at `size` = (width, height), as the Mitsuba 3 scene `path`.

    Meshes (.ply) and textures (.png, .pfm) go into the folder ``NAME-mitsuba`` beside it. Of `params` only
    ``max_bounces`` and ``seed`` count: paths have the same bounces as our path tracer's. The XML takes ``-D spp=``,
    ``max_depth=``, ``seed=``, ``width=`` and ``height=``.

    Errors: :class:`lab.errors.LabError` where it can't be written, where a file would overwrite one that the scene is
    read from, and for a light list that is too long. Nothing is half-written.
    """
    path = Path(path)
    check_light_list(scene)
    check_writable(path)
    notes: list[str] = []
    # Mitsuba takes a $ in a value for a parameter, and XML allows no control characters.
    files = Files(re.sub(r"[^\w .+-]", "_", path.stem) + "-mitsuba")
    root = Element("scene", version="3.0.0")
    _add_defaults(root, size, params)
    _add_contents(root, scene, camera, files, notes)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode") + "\n"
    targets = {path.parent / name: writer for name, writer in files.writers.items()}
    # The index comes last: it never names a file that is not there yet.
    targets[path] = lambda target: _write_text(target, text)
    for target in targets:
        check_writable(target)
    check_no_input(targets, scene.files)
    write_all(targets)
    return MitsubaScene([path, *(target for target in targets if target != path)], list(dict.fromkeys(notes)))


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _add_defaults(root: Element, size: tuple[int, int], params: Params) -> None:
    defaults = {
        "spp": SAMPLES,
        # Mitsuba counts segments: light that bounced b times before the point seen has come b + 2 segments far.
        "max_depth": params.max_bounces + 2,
        "seed": params.seed,
        "width": size[0],
        "height": size[1],
    }
    for name, value in defaults.items():
        child(root, "default", name=name).set("value", str(value))


def _add_contents(root: Element, scene: Scene, camera: Camera, files: Files, notes: list[str]) -> None:
    low, high = scene.bounds
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low) / 2)
    found = parts(scene, notes)
    holes = any(has_holes(part.material, scene.textures) for part in found)
    integrator = child(root, "integrator", "volpath" if holes else "path")
    put(integrator, "max_depth", "$max_depth")
    put(integrator, "rr_depth", 2**30)
    _add_sensor(root, camera, float(np.linalg.norm(np.subtract(camera.eye, centre))) + radius)
    for part in found:
        _add_shape(root, part, scene.textures, files)
        if part.emits and part.material.two_sided:
            _add_shape(root, reversed_behind(part, 1e-5 * radius), scene.textures, files)
    add_emitters(root, scene, radius, files, notes)
    if any(scene.background):
        notes.append("the background is left out: in Mitsuba it would light the scene")


def _add_sensor(root: Element, camera: Camera, farthest: float) -> None:
    """`farthest`: no point of the scene is farther from the camera."""
    sensor = child(root, "sensor", "perspective")
    put(sensor, "fov", float(camera.fov_y_deg))
    put(sensor, "fov_axis", "y")
    put(sensor, "near_clip", farthest * 1e-5)
    put(sensor, "far_clip", farthest * 2)
    put_lookat(sensor, camera.eye, camera.target, camera.up)
    sampler = child(sensor, "sampler", "independent")
    put(sampler, "sample_count", "$spp")
    put(sampler, "seed", "$seed")
    film = child(sensor, "film", "hdrfilm")
    put(film, "width", "$width")
    put(film, "height", "$height")
    put(film, "pixel_format", "rgb")
    put(film, "component_format", "float32")
    child(film, "rfilter", "box")


def _add_shape(root: Element, part: Part, textures: list[Texture], files: Files) -> None:
    shape = child(root, "shape", "ply")
    name = f"mesh-{sum(path.endswith('.ply') for path in files.writers):03d}.ply"
    put(shape, "filename", files.add(name, lambda: partial(write_ply, part=part)))
    put(shape, "face_normals", part.normal is None)
    add_bsdf(shape, part, textures, files)
    if part.emits:
        put_rgb(child(shape, "emitter", "area"), "radiance", part.material.emission)
