"""The table of approximations: it names settings and values that exist, and forgets none."""

from __future__ import annotations

import dataclasses

import pytest

from lab.attribute.terms import LIGHT, LIGHTS, SHADOWS, TERMS, UNRELATED, WHOLE_SHADOWS, Term, applicable, ideal
from lab.params import PRESETS, SETTINGS, Params, preset

BY_NAME = {term.name: term for term in TERMS}


@pytest.mark.parametrize("term", TERMS, ids=lambda term: term.name)
def test_settings_and_values_exist(term: Term) -> None:
    for settings in (term.exact, term.approximate, term.needs):
        for name, value in settings.items():
            assert SETTINGS[name].check(name, value) == value, f"{name}={value}"
    for name, factor in term.times.items():
        assert SETTINGS[name].kind in (int, float) and factor > 1
    assert term.what and term.stage in (LIGHTS, LIGHT, SHADOWS)
    assert set(term.approximate) == set(term.exact), "each says what the other is"
    assert term.exact or term.times
    for name, value in term.exact.items():
        assert term.approximate[name] != value, "or it would not change anything"


def test_names_are_unique() -> None:
    assert len(BY_NAME) == len(TERMS) and WHOLE_SHADOWS.name not in BY_NAME


def test_no_setting_is_forgotten() -> None:
    """A new setting belongs to a term, or to the list of those that are no approximation."""
    covered = {name for term in TERMS for name in term.settings}
    assert covered | set(UNRELATED) == set(SETTINGS), "put it into TERMS or UNRELATED of lab/attribute/terms.py"
    assert not covered & set(UNRELATED)


def test_all_that_the_issue_asks_for_is_there() -> None:
    wanted = {
        "vpls", "clamp", "first_level", "construction", "hierarchy", "lobe", "receiver", "interleave", "shadow_level",
        "shadow_points", "average", "samples", "filter",
    }  # fmt: skip
    assert wanted <= set(BY_NAME)


@pytest.mark.parametrize("name", PRESETS)
def test_off_and_on(name: str) -> None:
    params = preset(name)
    for term in TERMS:
        without = term.without(params)
        if term.times:
            assert term.active(params) and without != params
            continue
        assert not term.active(without)
        assert term.active(params.replace(**term.approximate))
        changed = {key for key, value in without.to_dict().items() if value != params.to_dict()[key]}
        assert changed <= set(term.exact)
        assert term.variant or bool(changed) == term.active(params)


def test_what_the_presets_approximate() -> None:
    active = {name: {term.name for term in TERMS if term.active(preset(name))} for name in PRESETS}
    assert {"first_level", "lobe", "shadow_points", "average", "shadow_level"} <= active["paper"] - active["ours"]
    assert {"falloff", "gathering", "centre", "levels", "ratio_rgb"} <= active["demo"] - active["paper"]
    assert "average" not in active["demo"], "another variant of the same setting"
    assert {"vpls", "hierarchy", "samples"} <= active["ours"]


@pytest.mark.parametrize("name", PRESETS)
def test_the_ideal_has_no_approximation_but_the_hierarchy(name: str) -> None:
    params = preset(name, alpha=1.5, vpls=777, seed=5, sigma_normal=0.1)
    base = ideal(params)
    assert [term.name for term in TERMS if term.active(base)] == ["vpls", "clamp", "hierarchy"]
    assert (base.alpha, base.vpls, base.seed, base.sigma_normal) == (1.5, 777, 5, 0.1)
    assert ideal(base) == base
    # Every preset is measured from the same one.
    assert base == ideal(Params(alpha=1.5, vpls=777, seed=5, sigma_normal=0.1))


def test_one_alone_is_as_in_the_frame_or_as_usual() -> None:
    for params in (Params(), preset("paper"), Params(filter="bilateral", shadow_samples=1, interleave=8)):
        base = ideal(params)
        for term in TERMS:
            alone = term.among(base, params)
            differing = {key for key, value in alone.to_dict().items() if value != base.to_dict()[key]}
            assert differing <= {*term.settings, *term.needs}, term.name
            values = alone.to_dict()
            if term.active(params):
                assert all(values[name] == params.to_dict()[name] for name in term.settings)
            else:
                assert all(values[name] == value for name, value in term.approximate.items())
            assert term.active(alone)
    alone = BY_NAME["filter"].among(ideal(Params(filter="bilateral")), Params(filter="bilateral"))
    assert alone.filter == "bilateral"
    assert BY_NAME["deal_all"].among(ideal(Params()), Params()).interleave == 4, "what it needs is there"


def test_whole_numbers_stay_whole() -> None:
    assert BY_NAME["vpls"].without(Params(vpls=1000)).vpls == 10_000
    assert BY_NAME["hierarchy"].without(Params(alpha=0.5)).alpha == 2.0


def test_a_light_list_has_no_virtual_lights() -> None:
    found = {term.name: applicable(term, light_list=True) for term in TERMS}
    assert found["vpls"] is None
    clamp = found["clamp"]
    assert clamp is not None and clamp.exact == {"clamp_distance": 0.0} and clamp.active(Params())
    assert all(found[name] is BY_NAME[name] for name in found if name not in ("vpls", "clamp"))
    assert all(applicable(term, light_list=False) is term for term in TERMS)


def test_terms_can_not_be_changed() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        TERMS[0].name = "other"  # type: ignore[misc]
