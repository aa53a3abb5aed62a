"""Images in files: a frame's layers as one OpenEXR file, pictures as PNG, both with what made them written inside."""

from __future__ import annotations

import io
from collections.abc import Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.colour import luminance
from lab.errors import LabError
from lab.records import Frame, Lighting
from lab.scene.quiet import native_quiet

Channels = dict[str, NDArray[np.float32] | NDArray[np.uint32]]
Counts = dict[str, NDArray[np.uint32]]

_COMPONENTS = {"normal": "XYZ", "position": "XYZ"}


def frame_channels(frame: Frame) -> Channels:
    """Every layer of a frame as EXR channels, (H, W) each.

    ``colour direct unshadowed indirect albedo`` have R G B, ``normal position`` X Y Z (float32); ``shadow_ratio.Y``
    (the luminance of an RGB ratio) and ``depth.Z`` are float32; :func:`count_channels` are added.
    """
    image, gbuffer = frame.image, frame.gbuffer
    layers = {
        "colour": image.colour,
        "direct": image.direct,
        "unshadowed": image.unshadowed,
        "indirect": image.indirect,
        "albedo": gbuffer.albedo,
        "normal": gbuffer.normal,
        "position": gbuffer.position,
    }
    channels: Channels = {}
    for layer, values in layers.items():
        for i, component in enumerate(_COMPONENTS.get(layer, "RGB")):
            channels[f"{layer}.{component}"] = np.ascontiguousarray(values[..., i], dtype=np.float32)
    channels["shadow_ratio.Y"] = np.ascontiguousarray(luminance(image.shadow_ratio), dtype=np.float32)
    channels["depth.Z"] = np.ascontiguousarray(gbuffer.depth, dtype=np.float32)
    channels.update(count_channels(frame.lighting, frame.params.first_level))
    return channels


def count_channels(lighting: Lighting, first_level: int) -> Counts:
    """``overdraw`` and ``lights_used`` as uint32 channels: ``.Y`` the total, ``.L1`` ... each level drawn.

    ``fragments.Y`` comes with them where lights were rasterised.
    """
    channels: Counts = {}
    for layer, counts in zip(("overdraw", "lights_used"), lighting.counts(), strict=True):
        drawn = range(min(first_level, len(counts) - 1), len(counts))
        channels[f"{layer}.Y"] = np.sum([counts[level] for level in drawn], axis=0, dtype=np.uint32)
        for level in drawn:
            channels[f"{layer}.L{level}"] = np.ascontiguousarray(counts[level], dtype=np.uint32)
    if lighting.fragments is not None:
        channels["fragments.Y"] = lighting.fragments
    return channels


def write_exr(path: Path, channels: Channels | Counts, attributes: Mapping[str, str]) -> None:
    """Writes (H, W) float32 or uint32 channels as one part, ZIP-compressed, with `attributes` in its header.

    The bytes depend on the arguments alone: the same run gives the same file.
    """
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    with OpenEXR.File(header, dict(channels)) as file:
        file.write(str(path))


def read_exr(path: str | Path) -> Channels:
    """The layers of an EXR file by name.

    Three channels ``colour.R .G .B`` (or X Y Z) become one (H, W, 3) array ``colour``; ``depth.Z`` and ``overdraw.Y``
    become (H, W) arrays ``depth`` and ``overdraw``; any other channel keeps its whole name (``overdraw.L1``).
    """
    planes = {name: channel.pixels for name, channel in _open_exr(path)[1].items()}
    layers: Channels = {}
    for name, pixels in planes.items():
        layer, _, component = name.rpartition(".")
        triple = next((t for t in ("RGB", "XYZ") if all(f"{layer}.{c}" in planes for c in t)), "")
        if layer and component in triple:
            layers[layer] = np.stack([planes[f"{layer}.{c}"] for c in triple], axis=-1)
        else:
            layers[layer if layer and component in ("Y", "Z") else name] = pixels
    return layers


def read_exr_attributes(path: str | Path) -> dict[str, str]:
    """The text attributes in an EXR file's header, ours among them (``params``, ``seed``, ``lab_version`` ...)."""
    return {name: value for name, value in _open_exr(path)[0].items() if isinstance(value, str)}


def _open_exr(path: str | Path) -> tuple[dict[str, Any], dict[str, Any]]:
    import OpenEXR

    if not Path(path).is_file():
        raise LabError(f"{path}: there is no such EXR file")
    said = io.StringIO()
    try:
        # Of damaged pixels OpenEXR tells on stdout and stderr alone; the exception that follows names another reason.
        with native_quiet(), redirect_stdout(said), OpenEXR.File(str(path), separate_channels=True) as file:
            return dict(file.header()), dict(file.channels())
    except Exception as error:
        reason = " ".join(said.getvalue().split()) or error
        raise LabError(f"{path}: can't be read as OpenEXR ({reason})") from error


def write_png(path: Path, pixels: NDArray[np.uint8], metadata: Mapping[str, str]) -> None:
    """Writes 8 bit pixels, (H, W, 3) sRGB or (H, W) grey, with `metadata` as text chunks."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    text = PngInfo()
    for key, value in metadata.items():
        text.add_itxt(key, value)
    Image.fromarray(np.ascontiguousarray(pixels)).save(path, format="PNG", pnginfo=text)
