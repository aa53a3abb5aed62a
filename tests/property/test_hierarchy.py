"""What a hierarchy keeps for any lights and any settings: flux, order, bounds, finite numbers."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import lab
from lab.params import Params

from ..oracle import cases
from ..oracle.pure import luminance

SIDES = [1e-3, 1.0, 37.0, 1e6]


@st.composite
def light_sets(draw):
    """One to forty lights: scattered, on a lattice (faces, edges, doubles), or in one point; any flux, any normals."""
    count = draw(st.integers(1, 40))
    lattice = st.integers(0, 8).map(lambda i: i / 8)
    scattered = st.floats(-1, 1, width=32, allow_subnormal=False)
    side, shift = draw(st.sampled_from(SIDES)), draw(st.sampled_from([0.0, 0.0, 3.0, 1e4]))
    place = draw(st.sampled_from([lattice, scattered, st.just(0.25)]))
    position = draw(arrays(np.float64, (count, 3), elements=place)) * side + shift * side
    bright = st.one_of(st.just(0.0), st.floats(2**-10, 2**10, width=32))
    flux = draw(arrays(np.float32, (count, 3), elements=bright))
    normal = cases.unit_vectors(np.random.default_rng(draw(st.integers(0, 99))), count)
    with_normal = draw(arrays(np.bool_, (count, 1), elements=st.booleans()))
    return cases.make_lights(position, flux, normal * with_normal)


@st.composite
def parameters(draw):
    return Params(
        levels=draw(st.sampled_from(["demo", 1, 2, 3, 5])),
        construction=draw(st.sampled_from(["gather", "scatter"])),
        gather_range=draw(st.sampled_from(["inclusive", "half_open"])),
        carry_moments=draw(st.booleans()),
        centre_weight=draw(st.sampled_from(["flux", "count"])),
        bounds_scale=draw(st.sampled_from([1, 1.1, 2])),
        first_level=draw(st.sampled_from([0, 1])),
        lobe=draw(st.sampled_from(["moments", "mean_energy", "mean"])),
        receiver=draw(st.sampled_from(["hard", "soft"])),
        alpha=draw(st.sampled_from([0.1, 1, 3.5, 1e5])),
        clamp_distance=draw(st.sampled_from([0, 0.01, 1])),
    )


EXAMPLES = settings(max_examples=120, deadline=None)


@EXAMPLES
@given(light_sets(), parameters())
def test_flux_is_kept(lights, params):
    total = lights.flux.astype(np.float64).sum(axis=0)
    for level in lab.build_hierarchy(lights, params).levels:
        flux = level.flux.astype(np.float64).sum(axis=0)
        assert np.all(flux <= total * (1 + 1e-5) + 1e-6 * total.max())
        if level.level < 2 or params.gather_range == "inclusive" or params.construction == "scatter":
            # 2^-32 of the brightest light is one step of S1's sums: a dim colour keeps its flux to that.
            np.testing.assert_allclose(flux, total, rtol=1e-5, atol=1e-6 * total.max() + 1e-30)


@EXAMPLES
@given(light_sets(), parameters())
def test_every_number_is_finite_and_within_bounds(lights, params):
    hierarchy = lab.build_hierarchy(lights, params)
    for name in ("origin", "cell_size", "position", "flux", "normal", "normal_moment", "deviation"):
        assert np.isfinite(getattr(hierarchy, name)).all(), name
    assert hierarchy.flux.min() >= 0 and hierarchy.deviation.min() >= 0
    rounding = 1e-6 * np.abs(lights.position).max()
    low, high = lights.position.min(axis=0), lights.position.max(axis=0)
    for level in hierarchy.levels[1:]:
        size = level.cell_size
        centre = (level.position.astype(np.float64) - hierarchy.origin) / size
        assert np.all(np.abs(centre - level.vertex) <= 1 + (rounding / size + 1e-5)), "a centre is within its cells"
        assert np.all(level.deviation <= 1.5 * size + rounding)
        bright = luminance(level.flux) > 1e-2 * luminance(lights.flux).max()  # the others are a few fixed-point steps
        # Weighted by count, gathering takes those few steps of a dim S1 light for as good as a bright one.
        exact = 1e-4 if params.centre_weight == "flux" else 1e-2
        slack = rounding + exact * size
        assert np.all((level.position[bright] >= low - slack) & (level.position[bright] <= high + slack))
        assert np.all(np.linalg.norm(level.normal[bright], axis=1) <= 1 + exact)
        np.testing.assert_allclose(level.normal_moment[bright, :3].sum(axis=1), 1, atol=exact)


@EXAMPLES
@given(light_sets(), parameters())
def test_levels_are_in_grid_order_and_offsets_agree(lights, params):
    hierarchy = lab.build_hierarchy(lights, params)
    assert sorted(hierarchy.input_index.tolist()) == list(range(len(lights)))
    assert hierarchy.offset[0] == 0 and hierarchy.offset[-1] == len(hierarchy.position)
    assert len(hierarchy.offset) == len(hierarchy.cell_size) + 1 == hierarchy.top + 2
    for level in hierarchy.levels[1:]:
        key = level.vertex[:, ::-1].tolist()
        assert all(a < b for a, b in itertools.pairwise(key))
        assert len(level) <= (2 ** (hierarchy.top - level.level) + 1) ** 3


@settings(max_examples=12, deadline=None)
@given(light_sets())
def test_auto_levels_keep_s1_under_half_of_the_lights(lights):
    hierarchy = lab.build_hierarchy(lights, Params(shadow_samples=0))
    assert hierarchy.top == 1 or 2 * len(hierarchy.levels[1]) < len(lights)


@EXAMPLES
@given(light_sets(), parameters(), st.randoms(use_true_random=False))
def test_order_of_the_lights_does_not_change_a_bit(lights, params, random):
    order = list(range(len(lights)))
    random.shuffle(order)
    shuffled = cases.make_lights(lights.position[order], lights.flux[order], lights.normal[order])
    one, other = lab.build_hierarchy(lights, params), lab.build_hierarchy(shuffled, params)
    n = len(lights)
    assert one.offset.tolist() == other.offset.tolist()
    for name in ("position", "flux", "normal", "normal_moment", "deviation", "vertex", "oriented"):
        assert getattr(one, name)[n:].tobytes() == getattr(other, name)[n:].tobytes(), name


@EXAMPLES
@given(light_sets(), parameters())
def test_member_lists_are_well_formed(lights, params):
    hierarchy = lab.build_hierarchy(lights, params)
    members, n = hierarchy.members, len(lights)
    assert len(members.offset) == len(hierarchy.position) - n + 1
    sizes = np.diff(members.offset)
    assert np.all(sizes >= 1)
    for i, (start, end) in enumerate(itertools.pairwise(members.offset.tolist())):
        assert set(members.slot[start:end, 1]) <= set(members.slot[start:end, 0])
        level = np.searchsorted(hierarchy.offset, n + i, side="right") - 1
        assert members.slot[start:end, :2].max() < hierarchy.offset[level], "members are of finer levels"


@EXAMPLES
@given(light_sets(), parameters(), st.integers(0, 99))
def test_light_is_finite_and_never_negative(lights, params, seed):
    """At points all around, and in the very points of the lights."""
    rng = np.random.default_rng(seed)
    around = rng.normal(size=(40, 3)) * max(np.ptp(lights.position), 1e-3) + lights.position.mean(axis=0)
    position = np.concatenate([around.astype(np.float32), lights.position])
    got = lab.irradiance(lab.build_hierarchy(lights, params), position, cases.unit_vectors(rng, len(position)), params)
    assert np.isfinite(got).all()
    assert got.min() >= 0
