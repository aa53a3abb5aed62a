"""Renders an exported scene with Mitsuba 3, so that another program's picture can be compared with ours.

The picture comes with its noise: it is the mean of many renderings with independent seeds, whose spread tells it.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from ctypes.util import find_library
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.metrics import moments

Doubles = NDArray[np.float64]

SCALAR, LLVM = "scalar_rgb", "llvm_ad_rgb"

_LLVM_RELEASES = (19, 18, 17, 20)
"""LLVM releases to look for. 14 to 16 crash Mitsuba 3.9."""

_MOST_AT_ONCE = 16
"""Samples a pixel of one call of :meth:`Mitsuba.render`: the LLVM backend holds them all in memory."""


@dataclass(frozen=True)
class Layer:
    """(H, W, 3) mean radiance, and the variance of this mean."""

    mean: Doubles
    variance: Doubles


@dataclass(frozen=True)
class Layers:
    """What Mitsuba sees: light straight from the lights (and their own shine), and light that has bounced."""

    direct: Layer
    indirect: Layer
    samples: int
    seconds: float


def installed() -> bool:
    """Whether Mitsuba can be imported."""
    return find_spec("mitsuba") is not None


def llvm_library() -> str | None:
    """The LLVM that Mitsuba can use: the one that DRJIT_LIBLLVM_PATH names, or one that the system finds."""
    named = os.environ.get("DRJIT_LIBLLVM_PATH")
    return named or next(filter(None, (find_library(f"LLVM-{release}") for release in _LLVM_RELEASES)), None)


class Mitsuba:
    """One exported scene, loaded.

    Args:
        xml: what :func:`lab.mitsuba_scene.export_mitsuba` wrote.
        variant: ``scalar_rgb``, or ``llvm_ad_rgb``, which is faster and needs an LLVM library.
        integrator: in place of the scene's own (``path`` is faster where nothing has holes).

    Errors: :class:`LabError` where Mitsuba, or what the variant needs, is missing.
    """

    def __init__(self, xml: Path, variant: str = SCALAR, *, integrator: str | None = None) -> None:
        if not installed():
            raise LabError("mitsuba is not installed; install it with: make setup EXTRA=test")
        if variant == LLVM:
            library = llvm_library()
            if library is None:
                raise LabError(f"{LLVM} needs LLVM 17 or newer (Debian: libllvm19), or use {SCALAR}")
            os.environ["DRJIT_LIBLLVM_PATH"] = library
        import mitsuba

        mitsuba.set_variant(variant)
        mitsuba.set_log_level(mitsuba.LogLevel.Error)  # it warns of samples_per_pass
        self._mitsuba: Any = mitsuba
        self._scene: Any = mitsuba.load_file(str(xml))
        root = ElementTree.parse(xml).getroot()
        found = root.find("integrator")
        depth = root.find("default[@name='max_depth']")
        if found is None or depth is None:
            raise LabError(f"{xml}: names no integrator and max_depth: it is not an export of ours")
        self._integrator = integrator or found.get("type", "path")
        self.max_depth = int(depth.get("value", "0"))

    def render(self, spp: int, seed: int) -> Doubles:
        """One picture of `spp` samples a pixel, (H, W, 3)."""
        parts = list(_parts(spp))
        images = (self._render(part, seed * len(parts) + i, self.max_depth) for i, part in enumerate(parts))
        total: Doubles = np.sum([image * (part / spp) for image, part in zip(images, parts, strict=True)], axis=0)
        return total

    def layers(self, spp: int, *, batches: int = 16, seed: int = 0) -> Layers:
        """Both layers from `batches` pairs of pictures, `spp` samples a pixel in all.

        Indirect light is what more than two segments bring: a picture of all light less one of direct light. Both are
        made of the same random numbers, path by path, so that the noise of the direct light leaves with it.
        """
        start = time.perf_counter()
        each = max(1, spp // batches)
        direct: list[Doubles] = []
        indirect: list[Doubles] = []
        for i in range(batches):
            # Each pass over the image, one a sample, takes up a seed: batches must not share any.
            first = (seed * batches + i) * each
            direct.append(self._render(each, first, 2, **self._own_streams))
            whole = self._render(each, first, self.max_depth, **self._own_streams)
            indirect.append(whole - direct[-1])
        return Layers(_mean(direct), _mean(indirect), each * batches, time.perf_counter() - start)

    @property
    def _own_streams(self) -> dict[str, int]:
        """What gives each path random numbers of its own, as LLVM has it anyway; else one path shifts the next."""
        return {"block_size": 1, "samples_per_pass": 1} if self._mitsuba.variant() == SCALAR else {}

    def _render(self, spp: int, seed: int, max_depth: int, **settings: int) -> Doubles:
        integrator = self._mitsuba.load_dict(
            {"type": self._integrator, "max_depth": max_depth, "rr_depth": 2**30, **settings}
        )
        return np.asarray(self._mitsuba.render(self._scene, integrator=integrator, spp=spp, seed=seed), np.float64)


def _mean(images: list[Doubles]) -> Layer:
    found = moments(images)
    return Layer(found.mean, found.variance / len(images))


def _parts(spp: int) -> Iterator[int]:
    while spp > 0:
        yield min(spp, _MOST_AT_ONCE)
        spp -= _MOST_AT_ONCE
