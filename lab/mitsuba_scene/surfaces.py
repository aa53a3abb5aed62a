"""Materials as Mitsuba's BSDFs, and their textures as files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from lab.image_io import write_png
from lab.mitsuba_scene.elements import child, put, put_rgb
from lab.mitsuba_scene.geometry import Part
from lab.outputs import Writer
from lab.scene.scene import Material
from lab.scene.textures import bytes_to_linear

FINEST_MASK = 4096
"""Texels a side that a mask's finer map may have."""

MASK_SCALE = 4
"""How much finer the map of a mask is than its texture, where :data:`FINEST_MASK` allows."""

Texture = NDArray[np.uint8]


@dataclass
class Files:
    """The files beside the XML: what writes each, by its path as the XML names it."""

    folder: str
    writers: dict[str, Writer] = field(default_factory=dict)

    def add(self, name: str, writer: Callable[[], Writer]) -> str:
        """The path of `name`; it is written once, however often it is added."""
        path = f"{self.folder}/{name}"
        if path not in self.writers:
            self.writers[path] = writer()
        return path


def has_holes(material: Material, textures: list[Texture]) -> bool:
    """Whether any of the surface is cut away; interpolated alpha never lies below its smallest texel."""
    if material.alpha_cutoff <= 0 or material.texture < 0:
        return False
    return bool(material.alpha * float(textures[material.texture][..., 3].min()) / 255 < material.alpha_cutoff)


def add_bsdf(shape: Element, part: Part, textures: list[Texture], files: Files) -> None:
    """A two-sided diffuse surface under `shape`, behind a mask where it has holes."""
    material, parent = part.material, shape
    if has_holes(material, textures):
        parent = child(shape, "bsdf", "mask")
        _bitmap(parent, "opacity", _opacity_file(material, textures[material.texture], files), "nearest", raw=True)
    diffuse = child(child(parent, "bsdf", "twosided"), "bsdf", "diffuse")
    if material.texture >= 0:
        path, raw = _texture_file(part, textures[material.texture], files)
        _bitmap(diffuse, "reflectance", path, "bilinear", raw=raw)
    elif part.colour is not None:
        put(child(diffuse, "texture", "mesh_attribute", "reflectance"), "name", "vertex_color")
    else:
        put_rgb(diffuse, "reflectance", part.tint)


def _bitmap(parent: Element, name: str, path: str, filter_type: str, *, raw: bool, wrap: str = "repeat") -> None:
    texture = child(parent, "texture", "bitmap", name)
    put(texture, "filename", path)
    put(texture, "filter_type", filter_type)
    put(texture, "wrap_mode", wrap)
    put(texture, "raw", raw)


def add_projection(parent: Element, path: str) -> None:
    """The texture of a spot's ramp."""
    _bitmap(parent, "texture", path, "bilinear", raw=True, wrap="clamp")


def _texture_file(part: Part, texels: Texture, files: Files) -> tuple[str, bool]:
    """The texture as it is, or, as linear floats, times the tint; and whether it is linear already."""
    row, tint = part.material.texture, np.asarray(part.tint)
    if (tint == 1).all():

        def picture() -> Writer:
            return lambda path: write_png(path, texels[..., :3], {})

        return files.add(f"texture-{row:03d}.png", picture), False

    def tinted() -> Writer:
        return lambda path: write_pfm(path, bytes_to_linear(texels[..., :3]) * tint)

    shade = "-".join(f"{value:.6g}" for value in tint)
    return files.add(f"texture-{row:03d}-times-{shade}.pfm", tinted), True


def _opacity_file(material: Material, texels: Texture, files: Files) -> str:
    def cut() -> Writer:
        scale = max(1, min(MASK_SCALE, FINEST_MASK // max(texels.shape[:2])))
        opaque = alpha_between(texels[..., 3], scale) * material.alpha >= material.alpha_cutoff
        return lambda path: write_png(path, np.where(opaque, 255, 0).astype(np.uint8), {})

    return files.add(f"opacity-{material.texture:03d}-{material.alpha:.6g}-{material.alpha_cutoff:.6g}.png", cut)


def write_pfm(path: Path, pixels: NDArray[np.floating]) -> None:
    """Writes (h, w, 3) or (h, w) linear values as a portable float map.

    Not as OpenEXR: while it loads several of these at once, Mitsuba 3.9 may wait for its own threads for ever.
    """
    kind = "PF" if pixels.ndim == 3 else "Pf"
    header = f"{kind}\n{pixels.shape[1]} {pixels.shape[0]}\n-1.0\n"  # -1: little-endian
    path.write_bytes(header.encode("ascii") + pixels[::-1].astype("<f4").tobytes())  # bottom row first


def alpha_between(alpha: NDArray[np.uint8], scale: int) -> NDArray[np.float32]:
    """(h, w) bytes as (h * scale, w * scale) alpha in [0, 1]: bilinear, wrapped, at the centres of the finer texels."""
    fine = alpha.astype(np.float32) / np.float32(255)
    for axis in (0, 1):
        size = fine.shape[axis]
        place = (np.arange(size * scale) + 0.5) / scale - 0.5
        low = np.floor(place).astype(np.intp)
        share = (place - low).astype(np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        fine = np.take(fine, low % size, axis) * (1 - share) + np.take(fine, (low + 1) % size, axis) * share
    return fine
