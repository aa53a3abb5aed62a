"""LY19 Figures 7 and 8: shadow samples picked by importance, and evenly, side by side."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from lab.engine.engine import Engine
from lab.records import Frame, Image
from lab.reference.estimate import Progress
from lab.survey.shadow_distribution import ShadowDistribution, sampled_distribution, shadow_distribution


@dataclass(frozen=True)
class ImportanceSide:
    """A frame with one way to pick.

    Attributes:
        frame: with ``params.importance`` as this side has it; the one that was made for the comparison has no times.
           unfiltered: its picture without the shadow filter.
        distribution: where its picks go.
    """

    frame: Frame
    unfiltered: Image
    distribution: ShadowDistribution


@dataclass(frozen=True)
class ImportanceComparison:
    """The same frame with lights picked in proportion to their contribution (`on`), and evenly (`off`)."""

    on: ImportanceSide
    off: ImportanceSide


def compare_importance(
    engine: Engine, frame: Frame, picks: int | None = None, progress: Progress | None = None
) -> ImportanceComparison:
    """Both ways to pick, on the frame's lights and pixels.

    Args:
        engine: of the frame's scene.
        frame: one side as it stands; the other is made with its settings.
        picks: of the distributions; None: each frame's own ``shadow_samples``.
        progress: called with the share that is done and a line; may raise to end it.

    Errors: :class:`lab.LabError` where the frame has no shadow samples, and for an impossible number of picks.
    """
    sides = []
    for i, importance in enumerate((True, False)):

        def tell(share: float, line: str, i: int = i) -> None:
            if progress:
                progress((i + share) / 2, f"{'evenly' if i else 'by importance'}: {line}")

        tell(0.0, "picking")
        side = frame if frame.params.importance == importance else _picked(engine, frame, importance)
        plain = side.params.replace(filter="none")
        unfiltered = engine.filter_shadows(side.gbuffer, side.shadows, plain)
        image = engine.composite(side.gbuffer, side.lighting, side.shadows, unfiltered, plain)
        found = shadow_distribution(side) if picks is None else sampled_distribution(engine, side, picks, tell)
        sides.append(ImportanceSide(side, image, found))
    if progress:
        progress(1.0, "done")
    return ImportanceComparison(*sides)


def _picked(engine: Engine, frame: Frame, importance: bool) -> Frame:
    """The frame with its lights picked the other way: the stages from lighting on."""
    params = frame.params.replace(importance=importance)
    counts = frame.lighting.overdraw is not None
    lighting = engine.light(frame.hierarchy, frame.gbuffer, params, counts)
    shadows = engine.trace_shadow_rays(frame.hierarchy, frame.gbuffer, lighting, params)
    filtered = engine.filter_shadows(frame.gbuffer, shadows, params)
    image = engine.composite(frame.gbuffer, lighting, shadows, filtered, params)
    return dataclasses.replace(
        frame, image=image, lighting=lighting, shadows=shadows, filtered=filtered, params=params, stages_ms={}
    )
