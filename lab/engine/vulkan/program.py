"""Programs of the device: compute shaders, ray tracing and raster pipelines, with checked parameters.

A barrier follows each dispatch, and must follow each render pass. slangpy sets barriers by itself, but those between a
shader that writes a buffer and one that only reads it, either way round, are made for fragment shaders: compute and ray
shaders do not wait for them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.engine.vulkan.adapters import import_slangpy
from lab.engine.vulkan.bindings import Bindings
from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.reflection import ShaderError
from lab.engine.vulkan.shader_cache import forget_modules
from lab.errors import LabError, nearest

if TYPE_CHECKING:
    import slangpy as spy


def shader_folder(package: Path) -> Path:
    """Where the shaders of `package` are: in it where it is installed from a wheel, beside it in a checkout."""
    inside = package / "shaders"
    return inside if inside.is_dir() else package.parent / "shaders"


SHADERS = shader_folder(Path(__file__).resolve().parents[2])
"""``lib/`` to import from, ``passes/`` with the entry points."""


class ComputeProgram:
    """A compute shader, ready to be dispatched."""

    def __init__(self, device: spy.Device, module: str, entry: str, constants: Mapping[str, int]) -> None:
        """Compiles and links `entry` of `module`; `constants`: see :meth:`lab.engine.vulkan.device.Gpu.program`."""
        self.title = f"{module}.slang, {entry}"
        linked = _link(device, module, [entry], constants)
        self._pipeline = device.create_compute_pipeline(linked, label=self.title)
        self._bindings = Bindings(device, linked, self.title)

    @property
    def names(self) -> list[str]:
        """Its parameters."""
        return self._bindings.names

    def dispatch(self, encoder: spy.CommandEncoder, threads: Sequence[int], /, **values: Any) -> None:
        """Records a run over at least so many threads along each axis; `values` binds every parameter by name."""
        self._bindings.set(values)
        if min(threads) == 0:
            return
        with encoder.begin_compute_pass() as work:
            work.bind_pipeline(self._pipeline, self._bindings.root)
            work.dispatch(list(threads))
        encoder.global_barrier()

    def dispatch_indirect(self, encoder: spy.CommandEncoder, groups: DeviceBuffer, row: int, /, **values: Any) -> None:
        """The same, but over as many *groups* of threads as row `row` of `groups` says (x, y, z; uint32).

        The device reads it when it comes to run, so shaders may have written it just before.
        """
        self._bindings.set(values)
        offset = import_slangpy().BufferOffsetPair(groups.raw, row * groups.dtype.itemsize)
        with encoder.begin_compute_pass() as work:
            work.bind_pipeline(self._pipeline, self._bindings.root)
            work.dispatch_compute_indirect(offset)
        encoder.global_barrier()


@dataclass(frozen=True)
class RayShaders:
    """The entry points of a ray tracing pipeline.

    Attributes:
        ray_generation: what runs once a ray of a dispatch.
        misses: by number, as TraceRay counts them.
        hit_groups: (name, closest hit, any hit) by number, as above, "" for no such entry point. Rays that only ask
            whether anything is hit need a group all the same, of two "".
        payload_bytes: of the largest payload.

    """

    ray_generation: str
    misses: tuple[str, ...]
    hit_groups: tuple[tuple[str, str, str], ...]
    payload_bytes: int = 64

    def entries(self) -> list[str]:
        """All entry points, once each."""
        hits = (entry for _, *group in self.hit_groups for entry in group if entry)
        return list(dict.fromkeys([self.ray_generation, *self.misses, *hits]))


class RayProgram:
    """A ray tracing pipeline. Parameters are the module's globals: entry points of rays have none of their own."""

    def __init__(self, device: spy.Device, module: str, shaders: RayShaders, constants: Mapping[str, int]) -> None:
        """Compiles and links `module`; `constants`: see :meth:`lab.engine.vulkan.device.Gpu.program`."""
        spy = import_slangpy()
        self.title = f"{module}.slang, {shaders.ray_generation}"
        linked = _link(device, module, shaders.entries(), constants)
        self._pipeline = device.create_ray_tracing_pipeline(
            program=linked,
            hit_groups=[spy.HitGroupDesc(*group) for group in shaders.hit_groups],
            max_recursion=1,
            max_ray_payload_size=shaders.payload_bytes,
            label=self.title,
        )
        names = [name for name, *_ in shaders.hit_groups]
        self._table = device.create_shader_table(linked, [shaders.ray_generation], list(shaders.misses), names)
        self._bindings = Bindings(device, linked, self.title)

    @property
    def names(self) -> list[str]:
        """Its parameters."""
        return self._bindings.names

    def dispatch(self, encoder: spy.CommandEncoder, rays: Sequence[int], /, **values: Any) -> None:
        """Records a run of the ray generation shader over so many rays along each axis."""
        self._bindings.set(values)
        if min(rays) == 0:
            return
        with encoder.begin_ray_tracing_pass() as work:
            work.bind_pipeline(self._pipeline, self._table, self._bindings.root)
            work.dispatch_rays(0, list(rays))
        encoder.global_barrier()


@dataclass(frozen=True)
class RasterShaders:
    """The entry points of a raster pipeline, and what it does with their results.

    Attributes:
        vertex, fragment: entry points. All triangles are drawn, or, in a `strip`, those whose clockwise side is seen.
        adds_to: formats of the colour targets (names of ``slangpy.Format``), which fragments are added to.
        writes_depth: into a depth target, whatever it holds; else what is farther than it holds is not drawn.

    """

    vertex: str
    fragment: str
    strip: bool = False
    adds_to: tuple[str, ...] = ()
    writes_depth: bool = False


class RasterProgram:
    """A raster pipeline over float depth, 1 at the eye. Parameters are the module's globals."""

    def __init__(self, device: spy.Device, module: str, shaders: RasterShaders, constants: Mapping[str, int]) -> None:
        """Compiles and links `module`; `constants`: see :meth:`lab.engine.vulkan.device.Gpu.program`."""
        spy = import_slangpy()
        self.title = f"{module}.slang, {shaders.fragment}"
        linked = _link(device, module, [shaders.vertex, shaders.fragment], constants)
        strips, one = spy.PrimitiveTopology.triangle_strip, spy.BlendFactor.one
        add = {"src_factor": one, "dst_factor": one, "op": spy.BlendOp.add}
        compare = spy.ComparisonFunc.always if shaders.writes_depth else spy.ComparisonFunc.less_equal
        self._pipeline = device.create_render_pipeline(
            linked,
            input_layout=None,
            primitive_topology=strips if shaders.strip else spy.PrimitiveTopology.triangle_list,
            targets=[
                {"format": getattr(spy.Format, name), "enable_blend": True, "color": add, "alpha": add}
                for name in shaders.adds_to
            ],
            depth_stencil={
                "format": spy.Format.d32_float,
                "depth_test_enable": True,
                "depth_write_enable": shaders.writes_depth,
                "depth_func": compare,
            },
            rasterizer={
                "cull_mode": spy.CullMode.front if shaders.strip else spy.CullMode.none,
                "front_face": spy.FrontFaceMode.counter_clockwise,
                # Near the eye depth stays at 1: a face that the eye all but touches is drawn, too.
                "depth_clip_enable": False,
                "scissor_enable": True,
            },
            label=self.title,
        )
        self._bindings = Bindings(device, linked, self.title)

    @property
    def names(self) -> list[str]:
        """Its parameters."""
        return self._bindings.names

    def draw(
        self,
        work: spy.RenderPassEncoder,
        area: tuple[int, int, int, int],
        count: int | DeviceBuffer,
        /,
        **values: Any,
    ) -> None:
        """Records a draw into x, y, width, height of the targets; `values` binds every parameter by name.

        `count`: vertices, or a buffer whose first row (4u4) has what a draw takes, as the device finds it then.
        """
        spy = import_slangpy()
        self._bindings.set(values)
        x, y, width, height = area
        work.bind_pipeline(self._pipeline, self._bindings.root)
        work.set_render_state(
            {
                "viewports": [spy.Viewport({"x": x, "y": y, "width": width, "height": height})],
                "scissor_rects": [spy.ScissorRect({"min_x": x, "min_y": y, "max_x": x + width, "max_y": y + height})],
            }
        )
        if isinstance(count, DeviceBuffer):
            work.draw_indirect(1, spy.BufferOffsetPair(count.raw, 0))
        else:
            work.draw({"vertex_count": count})


def _link(device: spy.Device, module: str, entries: list[str], constants: Mapping[str, int]) -> spy.ShaderProgram:
    """The program; errors of the compiler come as :class:`ShaderError`, with its words."""
    spy = import_slangpy()
    try:
        loaded = device.load_module(module)
        known = [entry.name for entry in loaded.entry_points]
        for entry in entries:
            if entry not in known:
                raise ShaderError(f"{module}.slang has no entry point {entry!r}{nearest(entry, known)}")
        exported = _export(module, constants) if constants else None
        return device.load_program(module, entries, additional_source=exported)
    except (spy.SlangCompileError, RuntimeError) as error:
        if "assert failure" in str(error):  # of the compiler, which found nonsense where it had kept a module
            raise LabError(
                f"{module}.slang: what was compiled before is damaged. {forget_modules()} was deleted: try again"
            ) from error
        raise ShaderError(f"{module}.slang does not compile:\n{error}") from error


def _export(module: str, constants: Mapping[str, int]) -> str:
    """Slang source that gives ``extern static const`` numbers, the module's and its imports', their values."""
    types = _constants(module, set())
    for name in constants:
        if name not in types:
            raise ShaderError(f"{module}.slang has no 'extern static const' {name!r}{nearest(name, types)}")
    typed = ((types[name], name, value) for name, value in constants.items())
    return "".join(f"export static const {kind} {name} = {kind}({value});\n" for kind, name, value in typed)


def _constants(module: str, seen: set[str]) -> dict[str, str]:
    """Types of the numbers by name."""
    seen.add(module)
    source = (SHADERS / f"{module}.slang").read_text(encoding="utf-8")
    declared = re.findall(r"^(?:public )?extern static const (\w+) (\w+)", source, flags=re.MULTILINE)
    types = {name: kind for kind, name in declared}
    for imported in re.findall(r"^import ([\w.]+);", source, flags=re.MULTILINE):
        path = imported.replace(".", "/")
        if path not in seen:
            types |= _constants(path, seen)
    return types
