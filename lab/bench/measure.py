"""What is measured of one view of a scene: whole frames, and stages of them with other settings or other lights."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from lab.bench.limits import OWN_KERNEL, TRACING, machine_of
from lab.bench.spread import Spread
from lab.bench.traffic import construction
from lab.bench.turns import Turn
from lab.engine.engine import STAGES
from lab.params import Params
from lab.records import Frame
from lab.renderer import Renderer
from lab.scene.scene import Camera

Record = dict[str, Any]
Found = dict[str, dict[str, Spread]]
T = TypeVar("T")

GROWING = ("light", "trace_shadow_rays", "filter_shadows")
"""Stages whose time may depend on the number of lights only by their logarithm."""

FAST = {"interleave": 4, "shadow_samples": 1}
"""The paper's real-time settings."""


@dataclass(frozen=True)
class Effort:
    """How often is measured, and with how many lights.

    Attributes:
        frames: timed frames.    few, many: VPLs that growth is measured between; `many` for construction, too.
        scattered: VPLs at which gathering and scattering levels are compared.
    """

    frames: int = 32
    few: int = 1_000
    many: int = 1_000_000
    scattered: int = 100_000

    @classmethod
    def in_software(cls, frames: int) -> Effort:
        """For a driver that computes on the processor: a tenth of the lights, so that it comes to an end."""
        return cls(frames, many=100_000, scattered=10_000)

    @property
    def every(self) -> int:
        """Limits and variants of a stage are measured with every so many frames: 8 times, at least twice."""
        return self.frames // max(2, self.frames // 4)

    @property
    def seldom(self) -> int:
        """The same for what takes seconds each time."""
        return self.frames // max(2, self.frames // 8)

    @property
    def rarely(self) -> int:
        """The same for whole frames of many lights."""
        return self.frames // max(2, self.frames // 16)


@dataclass(frozen=True)
class Part:
    """Measurements that belong together, by name, and the part of the record that is made of what they find."""

    turns: dict[str, Turn]
    record: Callable[[Found], Record]


class View:
    """What is measured: one camera's frames, by one renderer."""

    def __init__(self, renderer: Renderer, camera: Camera, size: tuple[int, int], params: Params) -> None:
        self.renderer, self.camera, self.size, self.params = renderer, camera, size, params
        self.engine, self.machine = renderer.engine, machine_of(renderer.engine)

    @property
    def light_list(self) -> bool:
        """Whether the scene is lit by a list of lights: then the number of VPLs is not ours to choose."""
        return self.renderer.scene.light_list is not None

    def frame(self, **changes: object) -> Frame:
        """A whole frame, every stage anew, with changed settings."""
        return self.renderer.render(self.camera, self.size, self.params.replace(**changes), regenerate=True)

    def time_frame(self, **changes: object) -> dict[str, float]:
        """Milliseconds of each stage and of the whole frame by the engine's clock; of a device, the host's beside it.

        ``host``: until the host has handed the frame to the device; ``wall``: until that has finished it.
        """
        start = time.perf_counter()
        frame = self.frame(**changes)
        handed = time.perf_counter()
        times = {stage: frame.stages_ms[stage] for stage in STAGES} | {"frame": frame.total_ms}
        if self.machine.device() is None:
            return times
        done = time.perf_counter()
        return times | {"host": 1e3 * (handed - start), "wall": 1e3 * (done - start)}

    def clock(self, do: Callable[[], T]) -> tuple[T, float]:
        """What `do` returns, and the milliseconds it took by the engine's clock."""
        clock = self.engine.clock()
        with clock.times("work"):
            result = do()
        return result, clock.stages_ms["work"]

    def clocked(self, do: Callable[[], object]) -> dict[str, float]:
        """The milliseconds alone, as a turn returns them; the result's memory is given back."""
        return {"ms": self.clock(do)[1]}


def whole_frames(view: View, every: int, limits_every: int, **changes: object) -> Part:
    """Frames with `changes`, and the limits of their stages."""
    limits = view.machine.limits(view.frame(**changes))
    work, frame = limits.work, limits.frame

    def record(found: Found) -> Record:
        times = found["frame"]
        best = {name: spread for limit in (*TRACING, "light", "stream") for name, spread in found[limit].items()}
        return {
            "settings": changes,
            "stages_ms": {stage: times[stage] for stage in STAGES},
            "frame_ms": times["frame"],
            **{f"{name}_ms": times[name] for name in ("host", "wall") if name in times},
            "limits_ms": {stage: best[stage] for stage in STAGES},
            "own_kernel_ms": best.get(OWN_KERNEL),
            "stream_bytes_per_s": best["bytes_per_s"],
            "counts": {
                "lights": len(frame.lights),
                "grid_lights": len(frame.hierarchy.position) - len(frame.lights),
                "pairs_used": work.pairs_used,
                "pairs_visited": work.pairs_visited,
                "rays": work.rays,
                "bytes": work.bytes,
            },
        }

    # The limits that take little time are taken with every frame.
    turns = {
        "frame": Turn(lambda: view.time_frame(**changes), every),
        "trace_vpls": Turn(lambda: limits.rays_ms("trace_vpls"), every),
        "render_gbuffer": Turn(lambda: limits.rays_ms("render_gbuffer"), every),
        "trace_shadow_rays": Turn(lambda: limits.rays_ms("trace_shadow_rays"), limits_every),
        "light": Turn(limits.light_ms, limits_every),
        "stream": Turn(limits.stream_ms, limits_every),
    }
    return Part(turns, record)


def lighting(view: View, every: int) -> Part:
    """The lighting stage alone, with other numbers of picks and interleaved, on the same lights and pixels."""
    frame, base = view.frame(), view.params

    def timed(params: Params) -> Turn:
        lit = frame.hierarchy, frame.gbuffer, params
        return Turn(lambda: view.clocked(lambda: view.engine.light(*lit, counts=False)), every)

    turns = {f"shadow_samples={k}": timed(base.replace(shadow_samples=k)) for k in (0, 1, 4)}
    turns |= {f"interleave={n}": timed(base.replace(interleave=n)) for n in (1, 4)}
    return Part(turns, _times)


def construction_of_many(view: View, effort: Effort) -> Part:
    """Levels of many lights by gather, without and with member lists, beside streaming these lights."""
    plain = _without_members(view.params)
    listed = plain.replace(shadow_samples=1, shadow_points="members")
    lights = view.engine.trace_vpls(plain.replace(vpls=effort.many))
    count, build = construction(lights), view.engine.build_hierarchy
    turns = {
        "gather": Turn(lambda: view.clocked(lambda: build(lights, plain)), effort.seldom),
        "gather_with_members": Turn(lambda: view.clocked(lambda: build(lights, listed)), effort.seldom),
        "stream": Turn(lambda: {"ms": 1e3 * count / view.machine.stream_rate()}, effort.seldom),
    }
    return Part(turns, lambda found: {"lights": len(lights), "bytes": count, **_times(found)})


def construction_by_scatter(view: View, effort: Effort) -> Part:
    """Levels by gather from S1, and by scattering every level from the lights."""
    plain = _without_members(view.params)
    scatter = plain.replace(construction="scatter")
    lights, build = view.engine.trace_vpls(plain.replace(vpls=effort.scattered)), view.engine.build_hierarchy
    turns = {
        "gather": Turn(lambda: view.clocked(lambda: build(lights, plain)), effort.every),
        "scatter": Turn(lambda: view.clocked(lambda: build(lights, scatter)), effort.every),
    }
    return Part(turns, lambda found: {"lights": len(lights), **_times(found)})


def growth(view: View, vpls: int, every: int) -> Part:
    """The stages that many lights burden, at so many VPLs."""
    frame = view.frame(vpls=vpls)

    def take() -> dict[str, float]:
        engine, g, params = view.engine, frame.gbuffer, frame.params
        lighting, light_ms = view.clock(lambda: engine.light(frame.hierarchy, g, params, counts=False))
        shadows, rays_ms = view.clock(lambda: engine.trace_shadow_rays(frame.hierarchy, g, lighting, params))
        _, filter_ms = view.clock(lambda: engine.filter_shadows(g, shadows, params))
        times = dict(zip(GROWING, (light_ms, rays_ms, filter_ms), strict=True))
        return times | {"sum": sum(times.values())}

    def record(found: Found) -> Record:
        times = found["stages"]
        return {
            "lights": len(frame.lights),
            "stages_ms": {stage: times[stage] for stage in GROWING},
            "sum_ms": times["sum"],
        }

    return Part({"stages": Turn(take, every)}, record)


def regenerated(view: View, effort: Effort) -> Part:
    """Whole frames of many lights that are all made anew: VPLs, construction and rendering, as of a moving scene."""
    settings = [{"interleave": n, "shadow_samples": k} for n in (1, 4) for k in (1, 4)]
    many = {} if view.light_list else {"vpls": effort.many}

    def timed(changes: dict[str, int]) -> Turn:
        return Turn(lambda: view.time_frame(**changes, **many), effort.rarely)

    turns = {" ".join(f"{name}={value}" for name, value in changes.items()): timed(changes) for changes in settings}

    def record(found: Found) -> Record:
        return {
            "vpls": many.get("vpls"),
            "frames": {
                name: {
                    "stages_ms": {stage: times[stage] for stage in STAGES},
                    **{f"{what}_ms": times[what] for what in ("frame", "host", "wall") if what in times},
                }
                for name, times in found.items()
            },
        }

    return Part(turns, record)


def _without_members(params: Params) -> Params:
    return params.replace(construction="gather", shadow_samples=0)


def _times(found: Found) -> Record:
    return {name: times["ms"] for name, times in found.items()}
