"""What an engine's machine could do at best with the work of a frame, measured on the very data of that frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from lab.engine.engine import Engine
from lab.records import Frame

TRACING = ("trace_vpls", "render_gbuffer", "trace_shadow_rays")
"""Stages whose limit is the ray tracer."""

OWN_KERNEL = "own_light_kernel"
"""Beside the limit of light, on the processor: what its own kernel takes where lists are perfect."""

STREAM_BYTES, STREAM_PASSES = 256 * 2**20, 4
"""Bytes that streaming reads at a time, and how often; the best time counts."""


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


class Limits(Protocol):
    """The limits of one frame's stages; each method measures once, in milliseconds by name."""

    frame: Frame
    work: Work

    def rays_ms(self, stage: str) -> dict[str, float]:
        """The ray tracer's time for the rays of a stage that traces; lights from a list take none."""

    def light_ms(self) -> dict[str, float]:
        """A kernel's time for the pairs that add light, ``light``, and maybe :data:`OWN_KERNEL`."""

    def stream_ms(self) -> dict[str, float]:
        """Time to stream what must be read and written, and ``bytes_per_s``."""


class Machine(Protocol):
    """What an engine computes on."""

    def limits(self, frame: Frame) -> Limits:
        """Those of the stages of `frame`."""

    def stream_rate(self) -> float:
        """Bytes a second at which it reads an array much larger than its caches."""

    def device(self) -> dict[str, Any] | None:
        """The graphics card, as a record says it; None for the processor."""


def machine_of(engine: Engine) -> Machine:
    """The machine that `engine` runs on."""
    from lab.engine.cpu import CpuEngine

    if isinstance(engine, CpuEngine):
        from lab.bench.cpu import CpuMachine

        return CpuMachine(engine)
    from lab.bench.vulkan import VulkanMachine
    from lab.engine.vulkan.engine import VulkanEngine

    if isinstance(engine, VulkanEngine):
        return VulkanMachine(engine)
    raise TypeError(f"nobody knows the limits of {type(engine).__name__}")


def stream_ms(work: Work, rate: float) -> dict[str, float]:
    """Of each stage that streams, at so many bytes a second, which is there as well."""
    return {stage: 1e3 * count / rate for stage, count in work.bytes.items()} | {"bytes_per_s": rate}
