"""An open Vulkan device with all that the stages share: its programs, its memory and its clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar

from lab.engine.vulkan.adapters import Adapter, choose_adapter, import_slangpy, list_adapters, open_device
from lab.engine.vulkan.buffers import BufferPool
from lab.engine.vulkan.driver import Driver, driver_of
from lab.engine.vulkan.program import SHADERS, ComputeProgram, RasterProgram, RasterShaders, RayProgram, RayShaders
from lab.engine.vulkan.shader_cache import cache_options
from lab.engine.vulkan.timing import Clock, Span

if TYPE_CHECKING:
    import slangpy as spy

Program = TypeVar("Program", ComputeProgram, RayProgram, RasterProgram)


class Gpu:
    """A device, and what all stages on it share.

    Attributes:
        device: slangpy's.    adapter: which one it is.
        pool: where buffers come from, and go back to by themselves.    clock: takes the time of spans of work.
        spans: the last recorded span of each stage.

    """

    def __init__(self, wanted: str = "", *, validate: bool = False) -> None:
        """Opens the device that `wanted` names (see :func:`~lab.engine.vulkan.adapters.choose_adapter`).

        `validate`: with the validation layers of Vulkan, which print what they find.
        """
        self.adapter: Adapter = choose_adapter(list_adapters(), wanted)
        self.device: spy.Device = open_device(self.adapter, enable_debug_layers=validate, **_options())
        self.pool = BufferPool(self.device)
        self.clock = Clock(self.device)
        self.spans: dict[str, Span] = {}
        self._collected: list[Span] | None = None
        self._programs: dict[object, Any] = {}

    def program(self, module: str, entry: str, constants: Mapping[str, int] | None = None) -> ComputeProgram:
        """The compute shader `entry` of ``shaders/passes/<module>.slang``; made once.

        `constants`: values of the module's ``extern static const`` numbers, which are compiled in.
        """
        return self._once(ComputeProgram, module, entry, constants)

    def ray_program(self, module: str, shaders: RayShaders, constants: Mapping[str, int] | None = None) -> RayProgram:
        """The ray tracing pipeline of ``shaders/passes/<module>.slang``; made once."""
        return self._once(RayProgram, module, shaders, constants)

    def raster_program(
        self, module: str, shaders: RasterShaders, constants: Mapping[str, int] | None = None
    ) -> RasterProgram:
        """The raster pipeline of ``shaders/passes/<module>.slang``; made once."""
        return self._once(RasterProgram, module, shaders, constants)

    def _once(
        self, kind: Callable[..., Program], module: str, shaders: object, constants: Mapping[str, int] | None
    ) -> Program:
        """A program of this `kind`, the first time, and the same one from then on."""
        key = kind, module, shaders, tuple(sorted((constants or {}).items()))
        if key not in self._programs:
            self._programs[key] = kind(self.device, f"passes/{module}", shaders, constants or {})
        made: Program = self._programs[key]
        return made

    @contextmanager
    def stage(self, name: str) -> Iterator[spy.CommandEncoder]:
        """Records a stage's commands, timed as `name`, and hands them to the device; does not wait for it."""
        encoder = self.device.create_command_encoder()
        span = self.clock.begin(encoder)
        yield encoder
        self.clock.end(encoder, span)
        span.submission = self.device.submit_command_buffer(encoder.finish())
        self.spans[name] = span
        if self._collected is not None:
            self._collected.append(span)

    @contextmanager
    def collecting(self, spans: list[Span]) -> Iterator[None]:
        """While this lasts, `spans` gets the span of every recorded piece of work."""
        before, self._collected = self._collected, spans
        try:
            yield
        finally:
            self._collected = before

    def stages_ms(self) -> dict[str, float]:
        """Milliseconds that the device took for the last run of each stage; waits for them."""
        return {name: span.ms for name, span in self.spans.items()}

    def close(self) -> None:
        """Gives the device back; nothing of it may be used from then on."""
        self._programs.clear()
        self.spans.clear()
        self.pool.close()
        self.device.close()

    def describe(self) -> dict[str, Any]:
        """What a run's record says about the device."""
        found = self.driver
        return {
            "name": self.adapter.name,
            "index": self.adapter.index,
            "kind": found.kind if found else "",
            "driver": found.driver if found else "",
            "slangpy": import_slangpy().__version__,
        }

    @property
    def driver(self) -> Driver | None:
        """Whose driver it is and of what kind, where the Vulkan loader tells."""
        return driver_of(self.adapter.name, self.adapter.luid)

    @property
    def software(self) -> bool:
        """Whether it computes on the processor: a device in name only."""
        return self.driver is not None and self.driver.kind == "software"


@cache
def open_gpu(wanted: str = "") -> Gpu:
    """The device that `wanted` names, opened once in a process and shared by all who ask for it."""
    return Gpu(wanted)


def _options() -> dict[str, Any]:
    spy = import_slangpy()
    options: dict[str, Any] = {
        "enable_hot_reload": False,
        "compiler_options": {
            "include_paths": [SHADERS],
            "matrix_layout": spy.SlangMatrixLayout.row_major,
            "warnings_as_errors": ["all"],
        },
    }
    return options | cache_options()
