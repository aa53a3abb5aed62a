"""The materials and textures of a glTF document, read by pygltflib, as diffuse surfaces.

glTF 2.0, section 3.9; KHR_materials_emissive_strength, KHR_materials_pbrSpecularGlossiness (its diffuse part),
KHR_texture_transform. A metallic surface is taken as diffuse with its base colour as it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.scene.gltf_container import GltfFile, is_whole, resolve_uri
from lab.scene.parts import Parts
from lab.scene.scene import Material, Vec3
from lab.scene.textures import decode_image, mean_colour
from lab.scene.values import flag, number, vector

_WHITE = (1.0, 1.0, 1.0)
_REPEAT = 10497


@dataclass(frozen=True)
class UvMap:
    """Which texture coordinates a material wants: their `unit`, and the transform put on them.

    `rotation` is in radians, counter-clockwise (KHR_texture_transform).
    """

    unit: int = 0
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    scale: tuple[float, float] = (1.0, 1.0)

    def apply(self, uv: NDArray[Any]) -> NDArray[Any]:
        """`uv` (n, 2) as the texture is looked up."""
        if (self.offset, self.rotation, self.scale) == ((0.0, 0.0), 0.0, (1.0, 1.0)):
            return uv
        cos, sin = math.cos(self.rotation), math.sin(self.rotation)
        u, v = np.asarray(uv, dtype=np.float64).T * np.array(self.scale)[:, None]
        return np.stack([cos * u + sin * v + self.offset[0], -sin * u + cos * v + self.offset[1]], axis=1)


def read_materials(file: GltfFile, model: Any, parts: Parts) -> list[UvMap]:
    """Adds the document's materials and the textures they use to `parts`; one :class:`UvMap` for each material.

    `model` is the pygltflib document. A texture that is missing or broken is left out, with a note.
    """
    images = _Images(file, model, parts)
    maps = []
    for row, source in enumerate(model.materials or []):
        material, uv_map = _material(file, images, row, source)
        parts.materials.append(material)
        maps.append(uv_map)
    return maps


def _material(file: GltfFile, images: _Images, row: int, source: Any) -> tuple[Material, UvMap]:
    where = f"{file.path}: materials[{row}]"
    name = source.name if isinstance(source.name, str) and source.name else f"material{row}"
    factor: object = None
    texture: object = None
    pbr, gloss = source.pbrMetallicRoughness, _extension(source, "KHR_materials_pbrSpecularGlossiness")
    if pbr is not None:
        factor, texture = pbr.baseColorFactor, pbr.baseColorTexture
    if gloss and texture is None:
        factor, texture = gloss.get("diffuseFactor"), gloss.get("diffuseTexture")
    colour, alpha = _factor(where, factor)
    picture, uv_map = images.texture(where, texture)

    mode = source.alphaMode if source.alphaMode is not None else "OPAQUE"
    if mode not in ("OPAQUE", "MASK", "BLEND"):
        raise LabError(f"{where}.alphaMode is {mode!r}: it must be OPAQUE, MASK or BLEND")
    cutoff = {"OPAQUE": 0.0, "BLEND": 0.5}.get(mode)
    if cutoff is None:
        given = source.alphaCutoff
        cutoff = 0.5 if given is None else number(f"{where}.alphaCutoff", given, 0, 1e6)

    emission = source.emissiveFactor
    glow = vector(f"{where}.emissiveFactor", [0.0, 0.0, 0.0] if emission is None else emission, 0, 1e6)
    factor_beyond_1 = _extension(source, "KHR_materials_emissive_strength").get("emissiveStrength", 1.0)
    strength = number(f"{where}.emissiveStrength", factor_beyond_1, 0)
    if max(glow) > 0 and source.emissiveTexture is not None:
        glow = images.tint(where, source.emissiveTexture, glow)
    two_sided = flag(f"{where}.doubleSided", False if source.doubleSided is None else source.doubleSided)
    light = vector(f"{where}: emission", [value * strength for value in glow], 0, 1e30)
    return Material(name, colour, picture, alpha, cutoff, light, two_sided), uv_map


def _factor(where: str, factor: object) -> tuple[Vec3, float]:
    if factor is None:
        return _WHITE, 1.0
    if not isinstance(factor, list) or len(factor) != 4:
        raise LabError(f"{where}.baseColorFactor must be four numbers from 0 to 1")
    return vector(f"{where}.baseColorFactor", factor[:3], 0, 1), number(f"{where}.baseColorFactor", factor[3], 0, 1)


def _extension(holder: Any, name: str) -> dict[str, Any]:
    extensions = holder.get("extensions") if isinstance(holder, dict) else holder.extensions
    found = extensions.get(name) if isinstance(extensions, dict) else None
    return found if isinstance(found, dict) else {}


class _Images:
    """The document's images, each decoded once, when the first material asks for it."""

    def __init__(self, file: GltfFile, model: Any, parts: Parts) -> None:
        self.file, self.model, self.parts = file, model, parts
        self.rows: dict[int, int] = {}
        self.pictures: dict[int, NDArray[np.uint8] | None] = {}

    def texture(self, where: str, info: Any) -> tuple[int, UvMap]:
        """Row of ``parts.textures`` (-1: none) and the texture coordinates for the textureInfo `info`."""
        if info is None:
            return -1, UvMap()
        image = self._image_of(where, info)
        if image is None or self.picture(image) is None:
            return -1, UvMap()
        if image not in self.rows:
            self.rows[image] = len(self.parts.textures)
            self.parts.textures.append(self.picture(image))  # type: ignore[arg-type]
        return self.rows[image], self._uv_map(where, info)

    def tint(self, where: str, info: Any, glow: Vec3) -> Vec3:
        """`glow` times the mean colour of its texture: the core's triangles emit evenly."""
        image = self._image_of(where, info)
        picture = None if image is None else self.picture(image)
        if picture is None:
            return glow
        mean = mean_colour(picture)
        self.parts.note(f"{where}: its emissive texture was averaged to one colour")
        return (glow[0] * float(mean[0]), glow[1] * float(mean[1]), glow[2] * float(mean[2]))

    def _image_of(self, where: str, info: Any) -> int | None:
        number_of_texture = info.get("index") if isinstance(info, dict) else info.index
        texture = self.file.item("textures", number_of_texture, where)
        webp = _extension(texture, "EXT_texture_webp").get("source")
        image = texture.get("source") if webp is None else webp
        if image is None:
            self.parts.note(f"{where}: its texture is in a format that is not read; its plain colour is used")
            return None
        self.file.item("images", image, f"textures[{number_of_texture}]")
        if texture.get("sampler") is not None:
            sampler = self.file.item("samplers", texture["sampler"], f"textures[{number_of_texture}]")
            if any(sampler.get(axis, _REPEAT) != _REPEAT for axis in ("wrapS", "wrapT")):
                self.parts.note(f"{where}: its texture asks not to repeat; it is repeated all the same")
        assert isinstance(image, int)  # item() has checked it
        return image

    def _uv_map(self, where: str, info: Any) -> UvMap:
        unit = info.get("texCoord") if isinstance(info, dict) else info.texCoord
        change = _extension(info, "KHR_texture_transform")
        unit = change.get("texCoord", unit) or 0
        if not is_whole(unit):
            raise LabError(f"{where}: texCoord is {unit!r}, it must be a whole number of 0 or more")
        pairs = []
        for key, default in (("offset", 0.0), ("scale", 1.0)):
            value = change.get(key, [default, default])
            if not isinstance(value, list) or len(value) != 2:
                raise LabError(f"{where}: the texture transform's {key} must be two numbers")
            pairs.append((number(f"{where}: {key}", value[0]), number(f"{where}: {key}", value[1])))
        return UvMap(unit, pairs[0], number(f"{where}: rotation", change.get("rotation", 0.0)), pairs[1])

    def picture(self, image: int) -> NDArray[np.uint8] | None:
        """Image `image`, decoded; None, with a note, where it is missing or broken."""
        if image not in self.pictures:
            self.pictures[image] = self._decode(image, self.file.item("images", image, "a texture"))
        return self.pictures[image]

    def _decode(self, image: int, source: dict[str, Any]) -> NDArray[np.uint8] | None:
        where = f"{self.file.path}: images[{image}]"
        uri = source.get("uri")
        if uri is not None:
            data = resolve_uri(self.file.path, uri, where)
            if data is None:
                self.parts.note(f"{where}: there is no file {uri!r}; the plain colour is used")
                return None
        else:
            data = self.file.view(source.get("bufferView"), f"images[{image}]")
        picture = decode_image(data)
        if picture is None:
            self.parts.note(f"{where} ({source.get('name', 'no name')}) is broken; the plain colour is used")
        return picture
