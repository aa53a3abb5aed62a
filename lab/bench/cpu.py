"""The processor as a benchmark sees it: Embree, two light kernels, and the memory."""

from __future__ import annotations

import numpy as np

from lab import _core
from lab.bench import limits
from lab.bench.limits import OWN_KERNEL, TRACING, Work
from lab.bench.traffic import traffic
from lab.engine.cpu import CpuEngine
from lab.records import Frame


class CpuLimits:
    """See :class:`~lab.bench.limits.Limits`."""

    def __init__(self, machine: CpuMachine, frame: Frame) -> None:
        self._machine, self._engine, self.frame = machine, machine.engine, frame
        # Counting is an instrument: no timed stage does it.
        counted = self._engine.light(frame.hierarchy, frame.gbuffer, frame.params, counts=True)
        used = int(counted.counts()[1].sum(dtype=np.int64))
        rays = {stage: self._engine.embree_alone(stage, frame)[0] for stage in TRACING}
        self.work = Work(used, counted.visited, rays, traffic(frame))

    def rays_ms(self, stage: str) -> dict[str, float]:
        """Embree's."""
        return {stage: 1e3 * self._engine.embree_alone(stage, self.frame)[1]}

    def light_ms(self) -> dict[str, float]:
        """Two kernels': the plain one's, and that of the stage's own."""
        frame, used = self.frame, self.work.pairs_used
        lit = frame.hierarchy, frame.gbuffer, frame.params
        rates = {"light": self._engine.plain_light_rate(*lit), OWN_KERNEL: self._engine.light_kernel_rate(*lit)}
        return {name: 1e3 * used / rate if rate > 0 else 0.0 for name, rate in rates.items()}

    def stream_ms(self) -> dict[str, float]:
        """All threads'."""
        return limits.stream_ms(self.work, self._machine.stream_rate())


class CpuMachine:
    """See :class:`~lab.bench.limits.Machine`."""

    def __init__(self, engine: CpuEngine) -> None:
        self.engine = engine

    def limits(self, frame: Frame) -> CpuLimits:
        """Those of the stages of `frame`."""
        return CpuLimits(self, frame)

    def stream_rate(self) -> float:
        """All threads'."""
        return _core.stream_rate(limits.STREAM_BYTES, limits.STREAM_PASSES)

    def device(self) -> None:
        """None: it is the processor itself."""
