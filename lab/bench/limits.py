"""What this machine could do at best with the work of a frame, measured on the very data of that frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lab import _core
from lab.bench.traffic import traffic
from lab.engine.cpu import CpuEngine
from lab.records import Frame

TRACING = ("trace_vpls", "render_gbuffer", "trace_shadow_rays")
"""Stages whose limit is Embree."""

OWN_KERNEL = "own_light_kernel"
"""Beside the limit of light: what its own kernel takes where lists are perfect."""

STREAM_BYTES, STREAM_PASSES = 256 * 2**20, 4


def stream_rate() -> float:
    """Bytes a second at which all threads read an array much larger than the caches."""
    return _core.stream_rate(STREAM_BYTES, STREAM_PASSES)


@dataclass(frozen=True)
class Work:
    """What a frame had to do.

    Attributes:
        pairs_used: pairs of pixel and light that added light.    pairs_visited: pairs that were evaluated.
        rays: of each stage that traces, by its name.    bytes: of each stage that streams.
    """

    pairs_used: int
    pairs_visited: int
    rays: dict[str, int]
    bytes: dict[str, int]


class Limits:
    """The limits of one frame's stages."""

    def __init__(self, engine: CpuEngine, frame: Frame) -> None:
        """`frame` is the one whose work is to be done."""
        self.engine, self.frame = engine, frame
        # Counting is an instrument: no timed stage does it.
        counted = engine.light(frame.hierarchy, frame.gbuffer, frame.params, counts=True)
        used = int(counted.counts()[1].sum(dtype=np.int64))
        rays = {stage: engine.embree_alone(stage, frame)[0] for stage in TRACING}
        self.work = Work(used, counted.visited, rays, traffic(frame))

    def rays_ms(self, stage: str) -> dict[str, float]:
        """Embree's time for the rays of a stage that traces; lights from a list take none."""
        return {stage: 1e3 * self.engine.embree_alone(stage, self.frame)[1]}

    def light_ms(self) -> dict[str, float]:
        """Two kernels' times for the pairs that add light: the plain one's, and that of the stage's own."""
        frame, used = self.frame, self.work.pairs_used
        lit = frame.hierarchy, frame.gbuffer, frame.params
        rates = {"light": self.engine.plain_light_rate(*lit), OWN_KERNEL: self.engine.light_kernel_rate(*lit)}
        return {name: 1e3 * used / rate if rate > 0 else 0.0 for name, rate in rates.items()}

    def stream_ms(self) -> dict[str, float]:
        """Time to stream what must be read and written."""
        rate = stream_rate()
        return {stage: 1e3 * count / rate for stage, count in self.work.bytes.items()} | {"bytes_per_s": rate}
