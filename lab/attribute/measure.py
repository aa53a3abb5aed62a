"""How each number of the error budget comes about."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from lab.attribute.bench import Bench, Picture
from lab.attribute.budget import RUNGS, RUNGS_OF_A_LIST, Effort, ErrorBudget, FrameScore, Row, Rung, Side
from lab.attribute.on_alone import OnAlone, said
from lab.attribute.score import Judge, Score
from lab.attribute.terms import LIGHT, LIGHTS, SHADOWS, TERMS, WHOLE_SHADOWS, applicable
from lab.attribute.work import Part, Work
from lab.errors import LabError
from lab.params import PRESETS, Params, preset
from lab.reference.estimate import Progress
from lab.scene.scene import Camera, Scene


def attribute(
    scene: Scene,
    params: Params | None = None,
    *,
    camera: str | Camera = "",
    size: tuple[int, int] = (640, 360),
    changes: Mapping[str, object] | None = None,
    effort: Effort | None = None,
    cache: bool = True,
    progress: Progress | None = None,
) -> ErrorBudget:
    """Where the error of a frame comes from, term by term.

    Args:
        scene: what is seen.
        params: settings of the frame.
        camera: one of the scene's by name (empty: the first), or a :class:`Camera`.
        size: (width, height).
        changes: settings that the presets are compared with, on top of each preset.
        effort: how long to measure.
        cache: whether the references may be taken from disk, and are kept there.
        progress: called with the share that is done and a line about it.

    Errors: :class:`LabError` as :func:`lab.render` and :func:`lab.reference.render_reference`.
    """
    started = time.perf_counter()
    view = scene.camera(camera) if isinstance(camera, str) else camera
    measurement = _Measurement(Bench(scene, view, size, params or Params(), cache), effort or Effort())
    measurement.plan_exact()
    measurement.plan_terms()
    measurement.plan_presets(dict(changes or {}))
    measurement.work.run(progress)
    budget = measurement.budget()
    budget.seconds = time.perf_counter() - started
    return budget


class _Measurement:
    def __init__(self, bench: Bench, effort: Effort) -> None:
        self.bench, self.effort = bench, effort
        self.work = Work()
        self.rows: list[Row] = []
        self.presets: list[FrameScore] = []
        self.rungs: dict[str, Score] = {}
        self.notes: list[str] = []
        self.frame: FrameScore | None = None
        # Lengths of tasks, roughly in seconds of two cores.
        self.scale = size_of(bench) / (640 * 360)
        self.judge: Judge
        self.alone: OnAlone

    # --- what everything else is compared with

    def plan_exact(self) -> None:
        """The truth, the sum over all lights, and the converged hierarchy."""
        bench, effort = self.bench, self.effort
        lights = bench.params.vpls if bench.scene.light_list is None else len(bench.scene.light_list)
        sums = self.scale * (lights / 6000 + effort.draws / 8)
        truth = sums if bench.light_list else self.scale * effort.paths * 0.8

        def trace_truth(tell: Part) -> None:
            bench.trace_truth(effort.paths, effort.draws, tell)

        def sum_lights(tell: Part) -> None:
            bench.summed = bench.sum_lights(bench.ideal, effort.draws, tell)

        def leave_out(tell: Part) -> None:
            lost = None if bench.light_list else bench.left_out(bench.ideal, effort.short_paths, tell)
            self.judge = Judge(bench, lost)

        def converge(tell: Part) -> None:
            base = bench.shadows(bench.ideal, effort.frames, tell)
            self.alone = OnAlone(bench, self.judge, effort, base)

        def render(tell: Part) -> None:
            self.frame = self.render(bench.params)

        self.work.add(truth, "tracing paths for the truth", trace_truth)
        self.work.add(sums, "summing every light", sum_lights)
        self.work.add(self.scale * effort.short_paths / 8, "tracing what the clamp leaves out", leave_out)
        self.work.add(self.scale * effort.frames * 7, "rendering converged shadows", converge)
        self.work.add(self.scale * 3, "rendering the frame", render)

    def render(self, params: Params) -> FrameScore:
        """A whole frame against the truth."""
        if params == self.bench.params and self.frame:
            return self.frame
        frame = self.bench.frame(params)
        picture = Picture(frame.image.indirect.astype(np.float64))
        colour = frame.image.colour.astype(np.float64)
        score = self.judge.score(picture, self.judge.truth, colour)
        return FrameScore("", params, score, frame.total_ms / 1e3, colour, picture)

    # --- terms

    def plan_terms(self) -> None:
        """Every term on alone and off alone."""
        bench = self.bench
        planned = [applicable(term, light_list=bench.light_list) for term in TERMS]
        at = next(i for i, term in enumerate(planned) if term is not None and term.stage == SHADOWS)
        for term in (*planned[:at], WHOLE_SHADOWS, *planned[at:]):
            if term is None:
                continue
            chosen = {name: bench.params.to_dict()[name] for name in term.settings}
            row = Row(term, term.active(bench.params) or term is WHOLE_SHADOWS, chosen)
            self.rows.append(row)
            length = {LIGHTS: 2, LIGHT: 3, SHADOWS: 2 + 3 * self.effort.frames}[term.stage]
            self.work.add(self.scale * length, f"{term.name} on alone", partial(self.switch_on, row))
            if term is not WHOLE_SHADOWS:
                length = 20 if term.name in ("noise", "vpls", "samples") else 3
                self.work.add(self.scale * length, f"{term.name} off alone", partial(self.switch_off, row))
        self.work.add(self.scale * 2, "summing up", lambda tell: self.climb())

    def switch_on(self, row: Row, tell: Part) -> None:
        """The term alone, from the ideal."""
        row.on = self.alone.side(row.term, tell)

    def switch_off(self, row: Row, tell: Part) -> None:
        """The frame with this term switched alone: off, or on where the frame does without."""
        bench, judge, term = self.bench, self.judge, row.term
        before = self.render(bench.params)
        changed = term.without(bench.params) if row.active else bench.params.replace(**term.approximate)
        try:
            after = self._converged_frame(changed) if row.active and term.name == "noise" else self.render(changed)
        except LabError as error:
            self.notes.append(f"{term.name} off alone was not measured: {error}")
            return
        averaged = self.effort.frames if row.active and term.name == "noise" else 1
        sentence = (
            f"The frame with {said(term, changed)}{f', the mean of {averaged} frames' if averaged > 1 else ''} against "
            "the truth; the effect is the difference to the frame as chosen."
        )
        with_it, without = (before, after) if row.active else (after, before)
        difference = judge.error_map(with_it.indirect, without.indirect)
        row.off = Side.between(sentence, after.score, (with_it.score, without.score), difference, after.seconds)

    def _converged_frame(self, params: Params) -> FrameScore:
        frames = [self.bench.frame(params.replace(frame=(params.frame + i) % 2**32)) for i in range(self.effort.frames)]
        indirect = np.array([frame.image.indirect for frame in frames], np.float64)
        colour = np.array([frame.image.colour for frame in frames], np.float64).mean(axis=0)
        variance = indirect.var(axis=0, ddof=1) / len(frames) if len(frames) > 1 else 0.0
        picture = Picture(indirect.mean(axis=0), variance)
        score = self.judge.score(picture, self.judge.truth, colour)
        seconds = sum(frame.total_ms for frame in frames) / 1e3
        self.rungs["converged"] = score
        return FrameScore("", params, score, seconds, colour, picture)

    # --- sums

    def climb(self) -> None:
        """What has been rendered anyway, in the order from the truth to the frame."""
        bench, judge = self.bench, self.judge
        summed = judge.summed if bench.light_list else judge.compensated
        steps = {"summed": summed, "hierarchy": bench.shown(self.alone.base, own_light=True)}
        if not bench.light_list:
            steps["clamped"] = judge.summed
        for name, picture in steps.items():
            # FLIP compares with the compensated sum itself.
            colour = None if picture is judge.compensated else judge.colour(picture)
            self.rungs[name] = judge.score(picture, judge.truth, colour)
        self.rungs["frame"] = self.render(bench.params).score

    def plan_presets(self, changes: dict[str, object]) -> None:
        """Whole frames of every preset."""
        for name in PRESETS:

            def render(tell: Part, name: str = name) -> None:
                self.presets.append(replace(self.render(preset(name, **changes)), name=name))

            self.work.add(self.scale * 3, f"rendering preset {name}", render)

    def budget(self) -> ErrorBudget:
        """All of it; presets best first."""
        names = RUNGS_OF_A_LIST if self.bench.light_list else RUNGS
        return ErrorBudget(
            self.bench,
            self.judge,
            self.effort,
            self.render(self.bench.params),
            self.rows,
            [Rung(name, said, self.rungs[name]) for name, said in names.items() if name in self.rungs],
            sorted(self.presets, key=lambda found: found.score.rel_mse),
            self.notes,
        )


def size_of(bench: Bench) -> int:
    """Pixels."""
    return bench.size[0] * bench.size[1]
