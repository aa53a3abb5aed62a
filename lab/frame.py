"""One frame, top to bottom: the seven stages in order, each timed. The page to read first."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from lab.engine import Engine
from lab.params import Params
from lab.records import Frame
from lab.scene.scene import Camera

P = ParamSpec("P")
R = TypeVar("R")
Progress = Callable[[str], None]


def render_frame(
    engine: Engine,
    camera: Camera,
    size: tuple[int, int],
    params: Params,
    progress: Progress | None = None,
    *,
    counts: bool = True,
) -> Frame:
    """Renders the engine's scene from `camera` at `size` = (width, height).

    `progress` is called with a stage's name as it begins; `counts`: whether lights are counted pixel by pixel. The
    times are those of the engine's clock: a graphics card is not waited for, until somebody looks at them.
    Errors: :class:`lab.errors.LabError` where lights reach no surface.
    """
    clock = engine.clock()

    def timed(stage: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        name = stage.__name__
        if progress:
            progress(name)
        with clock.times(name):
            return stage(*args, **kwargs)

    lights = timed(engine.trace_vpls, params)
    hierarchy = timed(engine.build_hierarchy, lights, params)
    gbuffer = timed(engine.render_gbuffer, camera, size)
    lighting = timed(engine.light, hierarchy, gbuffer, params, counts)
    shadows = timed(engine.trace_shadow_rays, hierarchy, gbuffer, lighting, params)
    filtered = timed(engine.filter_shadows, gbuffer, shadows, params)
    image = timed(engine.composite, gbuffer, lighting, shadows, filtered, params)

    return Frame(image, lights, hierarchy, gbuffer, lighting, shadows, filtered, params, camera, clock.stages_ms)
