"""What ``lab bench`` reports, exactly as it is computed. Only text: ``lab bench --help`` loads nothing else."""

from __future__ import annotations

from typing import NamedTuple


class Definition(NamedTuple):
    """One ratio.

    Attributes:
        formula: how it is computed.    aim: what it should be on two cores, for Sponza at 1280x720.
        higher_is_better: which way is better.    engines: those that it means something for.
    """

    formula: str
    aim: str
    higher_is_better: bool
    engines: tuple[str, ...] = ("cpu", "vulkan")


RATIOS = {
    "lighting_vs_kernel": Definition("limit of light / time of light", ">= 0.6", True),
    "lighting_vs_own_kernel": Definition(
        "time that the stage's own kernel needs for the pairs used, on the same perfect lists / time of light",
        "",
        True,
        ("cpu",),
    ),
    "gbuffer_vs_embree": Definition("limit of render_gbuffer / its time", ">= 0.85", True, ("cpu",)),
    "shadow_rays_vs_embree": Definition("limit of trace_shadow_rays / its time", ">= 0.85", True, ("cpu",)),
    "gbuffer_vs_pipeline": Definition("limit of render_gbuffer / its time", "", True, ("vulkan",)),
    "shadow_rays_vs_pipeline": Definition("limit of trace_shadow_rays / its time", "", True, ("vulkan",)),
    "visited_per_used": Definition(
        "pairs of pixel and light that light evaluates, masked lanes too / pairs that add light", "<= 2", False
    ),
    "interleave4_speedup": Definition("time of light at interleave=1 / at interleave=4", ">= 8; paper 6.5", True),
    "k1_overhead": Definition(
        "time of light with shadow_samples=1 / with 0: no picks", "<= 1.5; paper's frame 1.64", False
    ),
    "k4_overhead": Definition(
        "time of light with shadow_samples=4 / with 0: no picks", "<= 2.5; paper's frame 2.54", False
    ),
    "construction_vs_stream": Definition(
        "levels of 1M VPLs by gather, no member lists / one streaming read of these lights, 36 bytes each",
        "<= 20",
        False,
    ),
    "construction_with_members_vs_stream": Definition(
        "the same with the member lists that shadow rays draw from", "", False
    ),
    "gather_vs_scatter": Definition(
        "levels of 100K VPLs by gather / by scattering every level, no member lists", "", False
    ),
    "growth_1k_1m": Definition(
        "light + trace_shadow_rays + filter_shadows at 1M VPLs / at 1K", "<= 2.4; paper 2.39", False
    ),
    "frame_vs_limits": Definition(
        "all seven stages at interleave=4 shadow_samples=1 / sum of the seven limits there", "<= 1.4", False
    ),
}


class Limit(NamedTuple):
    """The least time a stage could take on this machine: what measures it, and on what."""

    by: str
    of: str


LIMITS = {
    "trace_vpls": Limit("raw rays", "of the light paths"),
    "build_hierarchy": Limit("streaming", "of the lights read, and of the levels and member lists written"),
    "render_gbuffer": Limit("raw rays", "of the pixels"),
    "light": Limit("plain kernel", "with the same lobe and picker on perfect lists: pairs used / its rate"),
    "trace_shadow_rays": Limit("raw rays", "of samples, sun and lamps"),
    "filter_shadows": Limit("streaming", "of what each pass of the filter must read and write"),
    "composite": Limit("streaming", "of what must be read and written"),
}

SWEEPS = ("vpls", "interleave", "shadow_samples", "threads")


def ratios_of(engine: str) -> dict[str, Definition]:
    """Those that mean something for `engine`."""
    return {name: definition for name, definition in RATIOS.items() if engine in definition.engines}


def _ratio_lines() -> str:
    def of(definition: Definition) -> str:
        return f" ({definition.engines[0]})" if len(definition.engines) == 1 else ""

    return "\n".join(f"  {name}{of(definition)}\n      {definition.formula}" for name, definition in RATIOS.items())


def _limit_lines() -> str:
    return "\n".join(f"  {stage:18}{limit.by} {limit.of}" for stage, limit in LIMITS.items())


HELP = f"""examples:
  lab bench                                               the atrium, about two minutes on two cores
  lab bench sponza.glb breakfast.glb --json out/bench.json
  lab bench sponza.glb --quick --set vpls=1000000         fewer frames, wider quartiles
  lab bench sponza.glb --sweep vpls --sweep threads       the stages over a setting, with a picture each
  lab bench sponza.glb --compare before.json              what got faster or slower, and whether that is more than noise
  lab bench sponza.glb --engine vulkan                    the same on the graphics card, by its own clock

After a warm-up, N frames are rendered, every stage anew each time, by a renderer that keeps its memory (lab.Renderer).
N is 32; with --engine vulkan 256, or 8 where the driver has no card and computes on the processor (a tenth of the VPLs
stands for 1M and 100K then); --quick: a quarter.
Times are medians, with the quartiles beside them. What is compared is measured in turns (A B A B ...): limits with
every frame, or every fourth where they take long. Counts of overdraw are an instrument: they are taken once, and no
timed stage counts. The share of the processors that other programs had is measured, too, and told where it is over 5 %.

The limit of a stage is the least time that this machine needs for it, measured in the same run:
{_limit_lines()}
Raw rays: the very same rays, traced without anything else: by Embree, or (vulkan) by a ray tracing pipeline that reads
them from a buffer.
Streaming: bytes / the bandwidth at which all threads read an array of 256 MB (a card: 1 GB) once, the best of several.
Member lists count for build_hierarchy where shadow points are drawn from them.

With --engine vulkan all times are the device's, by timestamps. Beside the sum of a frame's stages stand the host's time
(until the frame is handed over) and the whole (until the device has finished it). There is no sweep over threads, and
the ratios marked (cpu) mean nothing there: there is no Embree, and no kernel of light apart from its culling.

Regenerated: whole frames of 1M VPLs, with VPLs and construction, as of a scene that moves (the paper: about 58 ms).

Ratios (those marked are of one engine):
{_ratio_lines()}

Writes BASE.png (stages and limits as bars), BASE.json (or FILE of --json) and BASE-SETTING.png of each sweep. The JSON
holds every number that the ratios are computed from; of several scenes it is {{"scenes": [...]}}."""
