"""Stage light against a float64 sum over every grid light: irradiance, and the counts that make the overdraw images."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import lab
from lab import _core
from lab.params import Params

from ..oracle import cases
from ..oracle import lighting as oracle

RADIUS = 1.5  # of the scene, for clamp_distance
KINDS = list(itertools.product(["moments", "mean_energy", "mean"], ["hard", "soft"], ["clamped", "softened"]))


def hierarchy_of(lights, **settings):
    return lab.build_hierarchy(lights, Params(**{"shadow_samples": 0, **settings}))


def light(hierarchy, position, normal, shape=None, **settings):
    """The stage's record over points laid out as an image: (height, width), one row when left out; and its settings."""
    params = Params(**{"shadow_samples": 0, **settings})
    gbuffer = cases.as_gbuffer(position, normal, shape or (1, len(position)))
    return _core.light(hierarchy, gbuffer, params.to_core(), RADIUS), params


def assert_same_light(got, want):
    np.testing.assert_allclose(got, want, rtol=1e-4, atol=1e-4 * np.mean(want) + 1e-30)


@pytest.fixture(scope="module")
def hierarchy():
    """Lights with and without normals, bright, dim and black, in four levels."""
    lights = cases.mixed_cloud()
    flux = lights.flux.copy()
    flux[1::4] = 0
    flux[2::4, :2] = 0
    return hierarchy_of(cases.make_lights(lights.position, flux, lights.normal), levels=4)


@pytest.mark.parametrize("lobe, receiver, falloff", KINDS)
@pytest.mark.parametrize("alpha", [0.5, 1, 2])
@pytest.mark.parametrize("first_level", [0, 1])
def test_irradiance_is_the_blended_sum(hierarchy, lobe, receiver, falloff, alpha, first_level):
    settings = {"lobe": lobe, "receiver": receiver, "falloff": falloff, "alpha": alpha, "first_level": first_level}
    position, normal = cases.points(130)
    got, params = light(hierarchy, position, normal, clamp_distance=0.05, **settings)
    want = oracle.light(hierarchy, position, normal, params, RADIUS)
    assert want.irradiance.mean() > 0.1
    assert_same_light(got["irradiance"][0], want.irradiance)


@pytest.mark.parametrize("name", ["outlier", "tiny_scene", "huge_scene", "far_away", "on_faces", "without_normals"])
def test_irradiance_in_scenes_of_any_size_and_place(name):
    lights = cases.CLOUDS[name]()
    hierarchy = hierarchy_of(lights, levels=4)
    rng = np.random.default_rng(3)
    spread = 0.05 * np.median(np.ptp(lights.position, axis=0))
    position = lights.position[rng.integers(0, len(lights), 150)] + rng.normal(0, spread, (150, 3))
    position, normal = position.astype(np.float32), cases.unit_vectors(rng, 150)
    got, params = light(hierarchy, position, normal, clamp_distance=spread / RADIUS)
    assert_same_light(got["irradiance"][0], oracle.light(hierarchy, position, normal, params, RADIUS).irradiance)


@pytest.mark.parametrize("lobe, receiver, falloff", KINDS)
@pytest.mark.parametrize("alpha", [0.5, 2])
@pytest.mark.parametrize("first_level", [0, 1])
def test_counts_match_their_definition(hierarchy, lobe, receiver, falloff, alpha, first_level):
    settings = {"lobe": lobe, "receiver": receiver, "falloff": falloff, "alpha": alpha, "first_level": first_level}
    position, normal = cases.points(130, seed=2)
    got, params = light(hierarchy, position, normal, **settings)
    want = oracle.light(hierarchy, position, normal, params, RADIUS)
    for name in ("overdraw", "used"):
        counted = got["lights_used" if name == "used" else name][:, 0].astype(int)
        exact, least, most = (getattr(want, name + end) for end in ("", "_least", "_most"))
        assert exact.max() > 5
        assert np.all((least <= counted) & (counted <= most)), f"{name}: beyond what rounding allows"
        if name == "overdraw" or (receiver, lobe) == ("hard", "mean"):
            assert np.mean(counted != exact) < 1e-3, "equal but for rare ties"
        elif receiver == "hard":
            assert np.mean(counted[0] != exact[0]) < 1e-2, "input lights: equal but for rare ties"
    assert not got["overdraw"][:first_level].any() and not got["lights_used"][:first_level].any()


def test_the_top_level_overdraws_every_pixel():
    hierarchy = hierarchy_of(cases.cloud(), levels=4)
    far = np.array([[1e4, -2e4, 3e4]], np.float32)
    got, _ = light(hierarchy, far, [[0, 1, 0]])
    assert got["overdraw"][:, 0, 0].tolist() == [0, 0, 0, 0, len(hierarchy.levels[4])]
    assert got["irradiance"].min() > 0


def test_lights_that_face_away_are_not_used():
    """A wall of lights with one normal, seen from behind, is dark: not one of them counts, at any level."""
    rng = np.random.default_rng(4)
    for n in cases.unit_vectors(rng, 10):
        wall = cases.make_lights(rng.uniform(-1, 1, (400, 3)), rng.uniform(0.1, 1, (400, 3)), np.tile(n, (400, 1)))
        hierarchy = hierarchy_of(wall, levels=2)  # no vertex so dim that its moments are a few fixed-point steps
        behind = rng.uniform(-1, 1, (64, 3)) - 6 * n
        for settings in (
            {"alpha": 100},
            {"alpha": 1},
            {"alpha": 4, "first_level": 1},
            {"alpha": 100, "first_level": 1},
        ):
            got, _ = light(hierarchy, behind, np.tile(n, (64, 1)), **settings)
            assert not got["irradiance"].any() and not got["lights_used"].any()


def test_tiling_changes_nothing(hierarchy):
    position, normal = cases.points(300, seed=5)
    row, _ = light(hierarchy, position, normal, alpha=4)
    order = np.lexsort(position.T)
    for shape, perm in (((300, 1), order), ((12, 25), np.arange(300)), ((25, 12), order), ((1, 300), order[::-1])):
        image, _ = light(hierarchy, position[perm], normal[perm], shape, alpha=4)
        for name in ("overdraw", "lights_used"):
            np.testing.assert_array_equal(image[name].reshape(5, -1), row[name][:, 0, perm])
        np.testing.assert_allclose(image["irradiance"].reshape(-1, 3), row["irradiance"][0, perm], rtol=1e-6)


def test_counts_are_an_instrument(hierarchy):
    """Without them nothing else changes; what was evaluated is known either way."""
    position, normal = cases.points(300, seed=8)
    gbuffer = cases.as_gbuffer(position, normal, (12, 25))
    settings = Params(shadow_samples=3).to_core()
    counted, plain = (_core.light(hierarchy, gbuffer, settings, RADIUS, counts) for counts in (True, False))
    assert plain["overdraw"] is None and plain["lights_used"] is None
    for name in ("irradiance", "light", "target_weight", "weight_sum"):
        np.testing.assert_array_equal(counted[name], plain[name])
    assert counted["visited"] == plain["visited"] >= counted["lights_used"].sum()


def test_kernel_rate_is_a_rate(hierarchy):
    rng = np.random.default_rng(9)  # points so near to each other that the same lights reach them
    position = np.array([0.2, 0.1, 0.5]) + rng.normal(0, 1e-3, (400, 3))
    gbuffer = cases.as_gbuffer(position, np.tile([0.6, 0.0, -0.8], (400, 1)), (20, 20))
    for samples in (0, 4):
        settings = Params(shadow_samples=samples, alpha=4).to_core()
        assert _core.light_kernel_rate(hierarchy, gbuffer, settings, RADIUS, 0.01) > 1e6
        assert _core.plain_light_rate(hierarchy, gbuffer, settings, RADIUS, 0.01) > 1e6
    gbuffer.depth[:] = 0
    for rate in (_core.light_kernel_rate, _core.plain_light_rate):
        assert rate(hierarchy, gbuffer, Params().to_core(), RADIUS, 0.01) == 0


@pytest.mark.parametrize(
    "settings", [{}, {"shadow_samples": 0}, {"falloff": "softened"}, {"receiver": "soft"}, {"picker": "race"}]
)
def test_both_kernels_do_the_same_work(hierarchy, settings):
    """The plain one is a yardstick of the stage's own only if what they find on perfect lists is the same."""
    rng = np.random.default_rng(9)
    position = np.array([0.2, 0.1, 0.5]) + rng.normal(0, 1e-3, (400, 3))
    gbuffer = cases.as_gbuffer(position, np.tile([0.6, 0.0, -0.8], (400, 1)), (20, 20))
    lit = hierarchy, gbuffer, Params(alpha=4, **settings).to_core(), RADIUS
    own, plain = _core.light_kernel_sums(*lit), _core.plain_light_sums(*lit)
    assert own.shape == plain.shape and len(own) >= 16 and (own > 0).all()
    np.testing.assert_allclose(plain, own, rtol=1e-5)


@pytest.mark.parametrize("settings", [{}, {"interleave": 4}, {"picker": "race"}, {"first_shadow_level": 2}])
def test_instruction_sets_agree(hierarchy, settings):
    """To rounding, of which the greatest share is a root's; picks differ only where it decides."""
    position, normal = cases.points(1024, seed=10)
    gbuffer = cases.as_gbuffer(position, normal, (32, 32))
    core = Params(shadow_samples=4, **settings).to_core()
    chosen, found = _core.info()["simd"], {}
    try:
        for name in _core.info()["simd_choices"]:
            _core.set_simd(name)
            found[name] = _core.light(hierarchy, gbuffer, core, RADIUS)
    finally:
        _core.set_simd(chosen)
    first, *others = found.values()
    for other in others:
        assert_same_light(other["irradiance"], first["irradiance"])
        np.testing.assert_array_equal(other["overdraw"], first["overdraw"])
        assert np.mean(other["lights_used"] != first["lights_used"]) < 1e-3
        assert np.mean(other["light"] != first["light"]) < 1e-2


@pytest.mark.parametrize("settings", [{}, {"interleave": 4}, {"picker": "race"}])
def test_threads_change_nothing(hierarchy, settings):
    position, normal = cases.points(3 * 70 * 140, seed=11)
    gbuffer = cases.as_gbuffer(position, normal, (210, 140))
    core = Params(shadow_samples=2, **settings).to_core()
    found, usual = [], _core.info()["threads"]
    try:
        for threads in (1, 2, 3, 5):
            _core.set_threads(threads)
            found.append(_core.light(hierarchy, gbuffer, core, RADIUS))
    finally:
        _core.set_threads(usual)
    for other in found[1:]:
        for name, values in found[0].items():
            np.testing.assert_array_equal(other[name], values)


def test_pixels_that_see_nothing_stay_empty():
    hierarchy = hierarchy_of(cases.cloud(), levels=4)
    position, normal = cases.points(20)
    gbuffer = cases.as_gbuffer(position, normal, (4, 5))
    gbuffer.depth[1, 2] = gbuffer.depth[3, 4] = 0
    got = _core.light(hierarchy, gbuffer, Params(shadow_samples=2).to_core(), RADIUS)
    hit = gbuffer.depth > 0
    assert (
        not got["irradiance"][~hit].any() and not got["overdraw"][:, ~hit].any() and not got["weight_sum"][~hit].any()
    )
    assert (got["light"][~hit] == -1).all()
    assert got["overdraw"][-1][hit].min() == len(hierarchy.levels[-1])
    nothing = cases.as_gbuffer(position, normal, (4, 5))
    nothing.depth[:] = 0
    assert not _core.light(hierarchy, nothing, Params().to_core(), RADIUS)["irradiance"].any()


@pytest.mark.parametrize("falloff", ["clamped", "softened"])
@pytest.mark.parametrize("receiver", ["hard", "soft"])
@pytest.mark.parametrize("first_level", [0, 1])
def test_a_receiver_in_the_very_point_of_a_light(falloff, receiver, first_level):
    """It gets nothing from that light, and no NaN: with clamp_distance 0 as well."""
    lights = cases.cloud(120)
    hierarchy = hierarchy_of(lights, levels=3)
    normal = cases.unit_vectors(np.random.default_rng(6), len(hierarchy.position))
    settings = {"falloff": falloff, "receiver": receiver, "clamp_distance": 0, "first_level": first_level}
    got, params = light(hierarchy, hierarchy.position, normal, **settings)
    assert np.isfinite(got["irradiance"]).all()
    want = oracle.light(hierarchy, hierarchy.position, normal, params, RADIUS)
    apart = np.ptp(lights.position, axis=0).max() * 1e-5  # grid lights of one input light lie in the same point
    to_others = np.linalg.norm(hierarchy.position[:, None] - hierarchy.position[None], axis=2)
    clear = ~np.any((to_others > 0) & (to_others < apart), axis=1)
    assert clear.sum() > 100
    assert_same_light(got["irradiance"][0][clear], want.irradiance[clear])


def test_clamp_distance_bounds_the_light_nearby():
    hierarchy = hierarchy_of(cases.one_light(None))
    near = hierarchy.position[:1] + np.array([[0, -1e-4, 0]], np.float32)
    for clamp in (0.1, 0.01):
        got, _ = light(hierarchy, near, [[0, 1, 0]], clamp_distance=clamp)
        flux = hierarchy.flux[0] / np.pi / 4
        np.testing.assert_allclose(got["irradiance"][0, 0], flux / (clamp * RADIUS) ** 2, rtol=1e-3)


def test_black_lights_give_no_light():
    lights = cases.make_lights(cases.cloud(50).position, np.zeros((50, 3)), cases.cloud(50).normal)
    got, _ = light(hierarchy_of(lights, levels=3), *cases.points(30))
    assert not got["irradiance"].any() and not got["lights_used"].any()


@pytest.mark.parametrize("levels", [6, 9, 12])
def test_no_light_is_lost_where_cells_are_finer_than_float32(levels):
    """Centres far from the origin are rounded off their vertex by many cells; the lists must still find them."""
    rng = np.random.default_rng(7)
    lights = cases.make_lights(rng.uniform(-1, 1, (200, 3)) + 1e5, np.ones((200, 3)), cases.unit_vectors(rng, 200))
    hierarchy = hierarchy_of(lights, levels=levels)
    position = lights.position[:64] + rng.normal(0, 0.02, (64, 3)).astype(np.float32)
    got, params = light(hierarchy, position, cases.unit_vectors(rng, 64), alpha=1)
    want = oracle.light(hierarchy, position, cases.unit_vectors(rng, 64), params, RADIUS)
    counted = got["overdraw"][:, 0]
    assert np.all((want.overdraw_least <= counted) & (counted <= want.overdraw_most))
