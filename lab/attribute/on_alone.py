"""Each term switched on alone, from the ideal: everything exact but what the term needs to act on."""

from __future__ import annotations

from dataclasses import replace

from lab.attribute.bench import CONVERGED_SAMPLES, Bench, Picture, Shadows
from lab.attribute.budget import Effort, Side
from lab.attribute.score import Judge
from lab.attribute.terms import LIGHT, LIGHTS, SHADOWS, WHOLE_SHADOWS, Term
from lab.attribute.work import Part
from lab.params import Params, Value


class OnAlone:
    """Measures terms on alone.

    Terms of the lights are told by short paths and by the sum over all lights, terms of the unshadowed light by that
    light with exact shadows, terms of the shadows by converged shadows on exact light: so none sees another's error.
    """

    def __init__(self, bench: Bench, judge: Judge, effort: Effort, base: Shadows) -> None:
        self.bench, self.judge, self.effort, self.base = bench, judge, effort, base
        self._light: dict[Params, Picture] = {}

    def side(self, term: Term, tell: Part) -> Side:
        """The term alone."""
        by_stage = {LIGHTS: self._on_lights, LIGHT: self._on_light, SHADOWS: self._on_shadows}
        return by_stage[term.stage](term, tell)

    def _side(
        self, sentence: str, with_it: Picture, without: Picture | None, exact: Picture, shown: Picture | None = None
    ) -> Side:
        """`without` None: the exact picture itself. FLIP is that of `shown`, or of the picture with the term."""
        judge = self.judge
        score = judge.score(with_it, exact, judge.colour(shown or with_it))
        if without is None:
            difference = judge.error_map(with_it, exact)
            return Side(sentence, score, score.rel_mse, score.rel_mse_rest, score.energy - 1, difference)
        return Side.between(sentence, score, (score, judge.score(without, exact)), judge.error_map(with_it, without))

    def _on_lights(self, term: Term, tell: Part) -> Side:
        bench, judge = self.bench, self.judge
        settings = term.among(bench.ideal, bench.params)
        noiseless = Picture(judge.truth.radiance)
        if term.name == "vpls":
            sentence = (
                f"The sum over all {bench.params.vpls:,} virtual lights with every shadow ray, and with what their "
                "clamp leaves out, against the truth, whose noise the picture shows, too."
            )
            found = self._side(sentence, judge.compensated, None, judge.truth)
            return replace(found, score=replace(found.score, flip=None))  # FLIP compares with that very sum
        if bench.light_list:
            summed = bench.summed
            if term.name == "falloff":
                summed = bench.sum_lights(settings, self.effort.draws, tell)
            sentence = (
                f"The sum over all lights with {said(term, settings)} against the sum with a clamp distance of 0."
            )
            with_it = Picture(summed.indirect, summed.indirect_variance)
            return self._side(sentence, with_it, judge.summed if term.name == "falloff" else None, judge.truth)
        assert self.judge.left_out is not None
        clamped = Picture(noiseless.radiance - self.judge.left_out.radiance, self.judge.left_out.variance)
        if term.name == "clamp":
            sentence = "The truth less what short paths say the clamp leaves out, against the truth: the expected loss."
            return self._side(sentence, clamped, None, noiseless, judge.summed)
        lost = bench.left_out(settings, max(2, self.effort.short_paths // 4), tell)
        sentence = (
            f"The truth less what the falloff leaves out with {said(term, settings)}, against the truth; the effect is "
            "beyond that of the clamped falloff."
        )
        with_it = Picture(noiseless.radiance - lost.radiance, lost.variance)
        shown = Picture(judge.compensated.radiance - lost.radiance)
        return self._side(sentence, with_it, clamped, noiseless, shown)

    def _lit(self, params: Params) -> Picture:
        if params not in self._light:
            self._light[params] = self.bench.exactly_shadowed(params)
        return self._light[params]

    def _on_light(self, term: Term, tell: Part) -> Side:
        bench, judge = self.bench, self.judge
        settings = term.among(bench.ideal, bench.params)
        with_it, exact = self._lit(settings), judge.summed
        # Both bear the noise of the sum itself, pixel by pixel the same.
        with_it, exact = Picture(with_it.radiance), Picture(exact.radiance)
        if term.name == "hierarchy":
            sentence = (
                f"The hierarchy's unshadowed light with {said(term, settings)} and nothing else approximated, times "
                "the exact shadows, against the sum over all virtual lights."
            )
            return self._side(sentence, with_it, None, exact)
        without = Picture(self._lit(bench.ideal.replace(**term.needs)).radiance)
        sentence = (
            f"The hierarchy's unshadowed light with {said(term, settings)}, times the exact shadows, against the sum "
            f"over all virtual lights; the effect is beyond that of the same with {said(term, bench.ideal)}."
        )
        return self._side(sentence, with_it, without, exact)

    def _on_shadows(self, term: Term, tell: Part) -> Side:
        bench, exact = self.bench, self.judge.summed
        without = bench.shown(self.base)
        if term is WHOLE_SHADOWS:
            sentence = (
                f"The exact unshadowed light with the shadows that {CONVERGED_SAMPLES * self.effort.frames} unfiltered "
                "samples a pixel of the hierarchy's lights give it, against the sum over all virtual lights."
            )
            return self._side(sentence, without, None, exact)
        settings = term.among(bench.ideal, bench.params)
        own = settings.shadow_estimator == "corrected"
        if settings.shadow_samples != CONVERGED_SAMPLES or settings.filter != bench.ideal.filter:
            with_it = bench.once(settings)
        else:
            with_it = bench.shown(bench.shadows(settings, self.effort.frames, tell), own_light=own)
        if own:  # it changes the light as well, and makes sense only with the hierarchy's own
            without = bench.shown(self.base, own_light=True)
        light = "The hierarchy's own light" if own else "The exact unshadowed light"
        sentence = (
            f"{light} with the hierarchy's shadows with {said(term, settings)}, against the sum over all virtual "
            f"lights; the effect is beyond that of the same with {said(term, bench.ideal)} and converged shadows."
        )
        return self._side(sentence, with_it, without, exact)


def said(term: Term, params: Params) -> str:
    """The term's settings as people read them."""
    values: dict[str, Value] = params.to_dict()
    return " ".join(
        f"{name}={values[name]}" for name in (*term.settings, *(n for n in term.needs if n not in term.settings))
    )
