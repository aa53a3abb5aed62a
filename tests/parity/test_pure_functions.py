"""The small functions that every engine writes anew, run on arrays against one float64 oracle."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from lab import _core

from ..oracle import cases, pure

UNLIKELY = 1e-5  # seeds are fixed: a test that passes keeps passing


def uniforms(count, seed):
    return np.random.default_rng(seed).random(count).astype(np.float32)


# --- random numbers ----------------------------------------------------------------------------------


def test_pcg4d_is_the_published_hash():
    rng = np.random.default_rng(0)
    edges = [[0, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1], [2**32 - 1] * 4, [2**31, 1, 2**16, 2**32 - 1]]
    keys = np.concatenate([np.array(edges, np.uint32), rng.integers(0, 2**32, (500, 4), np.uint32)])
    np.testing.assert_array_equal(_core.pcg4d(keys), pure.pcg4d(keys))


@pytest.mark.parametrize("column", range(4))
def test_pcg4d_of_a_counter_is_uniform(column):
    keys = np.zeros((20000, 4), np.uint32)
    keys[:, column] = np.arange(len(keys))
    for bits in _core.pcg4d(keys).T:
        counts = np.bincount(bits >> 24, minlength=256)
        assert stats.chisquare(counts).pvalue > UNLIKELY


# --- blending ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("radius", [1e-4, 0.3, 1.0, 7.5, 1e5])
@pytest.mark.parametrize("first", [False, True])
@pytest.mark.parametrize("top", [False, True])
def test_blend_weight_is_two_ramps(radius, first, top):
    steps = np.array([0, 0.25, 0.49, 0.5, 0.51, 0.75, 0.99, 1, 1.01, 1.5, 1.99, 2, 2.01, 3, 1e3])
    distance = (radius * np.concatenate([steps, np.linspace(0, 3, 301)])).astype(np.float32)
    got = _core.blend_weight(distance, radius, first, top)
    np.testing.assert_allclose(got, pure.blend_weight(distance, np.float32(radius), first, top), atol=1e-6)
    assert got.min() >= 0 and got.max() <= 1


@pytest.mark.parametrize("alpha", [1e-3, 0.5, 1.0, 2.0, 3.7, 1e3])
@pytest.mark.parametrize("levels", [1, 2, 3, 7, 12])
@pytest.mark.parametrize("first_level", [0, 1])
def test_blend_weights_of_all_levels_sum_to_one(alpha, levels, first_level):
    h1 = 0.37
    cell_size = [h1 / 2, *(h1 * 2.0**level for level in range(levels))]  # r_0 = r_1 / 2
    ends = [alpha * size * factor for size in cell_size for factor in (0.5, 1, 2)]
    distance = np.concatenate([[0, *ends], np.geomspace(1e-6, 1e8, 600), np.linspace(0, 3 * max(ends), 600)])
    distance = distance.astype(np.float32)
    weights = [
        _core.blend_weight(distance, alpha * cell_size[level], level == first_level, level == levels)
        for level in range(first_level, levels + 1)
    ]
    np.testing.assert_allclose(np.sum(weights, axis=0), 1, atol=2e-6)
    assert np.all(np.count_nonzero(np.array(weights) > 1e-5, axis=0) <= 2), "never more than two levels at a time"


# --- emission ----------------------------------------------------------------------------------------

DIRECTIONS = pure.sphere_directions(4000).astype(np.float32)


def moments_of(normals, shares):
    """E[n] and E[n n^T] as float32 (3,) and (6,)."""
    n, share = np.asarray(normals, np.float64), np.asarray(shares, np.float64) / np.sum(shares)
    outer = np.einsum("k,ki,kj->ij", share, n, n)
    return (share @ n).astype(np.float32), outer[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].astype(np.float32)


def emission(lobe, normal, moment, oriented=True, directions=DIRECTIONS):
    return _core.emission(directions, lobe, normal, moment, oriented)


def power(lobe, normal, moment, oriented=True):
    """Integral over the sphere / pi: 1 keeps the power."""
    return 4 * emission(lobe, normal, moment, oriented).astype(np.float64).mean()


def assert_emission(got, want):
    """Equal to rounding; where little is emitted, the root of the second moment has but half of float32's digits."""
    np.testing.assert_allclose(got, want, atol=2e-4)
    clear = want > 0.01
    np.testing.assert_allclose(got[clear], want[clear], rtol=0, atol=1e-5)


@pytest.mark.parametrize("lobe", ["moments", "mean_energy", "mean"])
@pytest.mark.parametrize("count", [1, 2, 3, 20])
@pytest.mark.parametrize("oriented", [True, False])
def test_emission_matches_the_oracle(lobe, count, oriented):
    rng = np.random.default_rng(count)
    for _ in range(10):
        normal, moment = moments_of(cases.unit_vectors(rng, count), rng.uniform(0.1, 1, count))
        want = pure.emission(DIRECTIONS, lobe, normal, moment, oriented)
        assert_emission(emission(lobe, normal, moment, oriented), want)


@pytest.mark.parametrize("lobe", ["moments", "mean_energy", "mean"])
def test_emission_of_one_normal_is_a_cosine(lobe):
    for n in cases.unit_vectors(np.random.default_rng(1), 10):
        normal, moment = moments_of([n], [1])
        cosine = np.maximum(0, DIRECTIONS.astype(np.float64) @ n)
        assert_emission(emission(lobe, normal, moment), cosine)
        assert power(lobe, normal, moment) == pytest.approx(1, abs=1e-3)


def test_emission_of_one_normal_is_zero_behind_it():
    """Nothing is left over by rounding: what faces away does not count as a light."""
    for n in cases.unit_vectors(np.random.default_rng(2), 20):
        normal, moment = moments_of([n], [1])
        behind = DIRECTIONS[DIRECTIONS.astype(np.float64) @ n < -1e-3]
        assert not emission("moments", normal, moment, directions=behind).any()


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_moments_of_two_opposite_normals_are_exact(share):
    for n in cases.unit_vectors(np.random.default_rng(3), 10):
        normal, moment = moments_of([n, -n], [share, 1 - share])
        along = DIRECTIONS.astype(np.float64) @ n
        both = share * np.maximum(0, along) + (1 - share) * np.maximum(0, -along)
        assert_emission(emission("moments", normal, moment), both)


def test_moments_keep_the_power_of_isotropic_normals():
    zero, moment = np.zeros(3, np.float32), np.array([1, 1, 1, 0, 0, 0], np.float32) / 3
    assert power("moments", zero, moment) == pytest.approx(1, abs=1e-3)
    assert power("mean_energy", zero, moment) == pytest.approx(1, abs=1e-3)
    assert power("mean", zero, moment) == 0  # the demo's lobe goes dark
    np.testing.assert_allclose(emission("moments", zero, moment), 0.25, atol=2e-4)


def test_power_of_any_normals():
    """Moments within 3 % (4 for three random normals), mean_energy exactly."""
    rng = np.random.default_rng(4)
    off = []
    for count in (2, 3, 5, 50):
        for _ in range(20):
            normals = cases.unit_vectors(rng, count)
            normals[:, 1] = np.abs(normals[:, 1])
            normal, moment = moments_of(normals, rng.uniform(0.1, 1, count))
            off.append(abs(power("moments", normal, moment) - 1))
            assert power("mean_energy", normal, moment) == pytest.approx(1, abs=2e-3)
            assert power("mean", normal, moment) < 1.001
    assert max(off) < 0.04 and np.median(off) < 0.03


@pytest.mark.parametrize("lobe", ["moments", "mean_energy", "mean"])
def test_lights_without_normals_are_isotropic(lobe):
    zero, moment = np.zeros(3, np.float32), np.array([1, 1, 1, 0, 0, 0], np.float32) / 3
    np.testing.assert_array_equal(emission(lobe, zero, moment, oriented=False), np.float32(0.25))


# --- picking -----------------------------------------------------------------------------------------

WEIGHTS = {
    "even": np.ones(8),
    "uneven": np.array([0.01, 5, 0.3, 0, 2, 2, 0, 0.7]),
    "zeros_first": np.array([0, 0, 1, 3, 0, 0]),
    "one": np.array([4.0]),
    "rising": np.arange(30.0),
    "wide": 10.0 ** np.arange(-3, 4),
}


def assert_drawn(picks, weights):
    """Chi-square of picks against weights; what has no weight is never picked."""
    counts = np.bincount(picks, minlength=len(weights))
    assert not counts[weights == 0].any()
    expected = weights / weights.sum() * len(picks)
    common = expected >= 5
    if common.sum() > 1:  # the rare ones are counted together
        rare = expected[~common].sum() > 0
        got = np.append(counts[common], counts[~common].sum() if rare else [])
        want = np.append(expected[common], expected[~common].sum() if rare else [])
        assert stats.chisquare(got, want).pvalue > UNLIKELY


def seeds(count, seed):
    return np.random.default_rng(seed).integers(0, 2**32, count, np.uint32)


@pytest.mark.parametrize("batches", [1, 3, 1000])
@pytest.mark.parametrize("weights", WEIGHTS.values(), ids=WEIGHTS)
@pytest.mark.parametrize("shuffle", [False, True])
def test_last_records_pick_in_proportion_to_the_weights(weights, shuffle, batches):
    """However the sum is reached: where the last record below a batch's end lies before the batch, the pick stays."""
    order = np.random.default_rng(5).permutation(len(weights)) if shuffle else np.arange(len(weights))
    ends = np.cumsum(weights[order].astype(np.float32))
    sample = seeds(20000, 6)
    picks = np.full(len(sample), -1)
    for batch in np.array_split(np.arange(len(ends)), batches):
        if len(batch):
            before = ends[batch[0] - 1] if batch[0] > 0 else 0
            record, _ = _core.last_record(np.full(len(sample), ends[batch[-1]]), sample)
            taken = (record >= before) & (record < ends[batch[-1]])
            picks[taken] = np.searchsorted(ends, record[taken], side="right")
    assert_drawn(order[picks], weights)
    np.testing.assert_array_equal(picks[:300], pure.reservoir_picks(weights[order], sample[:300]))


SUMS = np.concatenate(
    [
        np.geomspace(1e-37, 3e38, 300),
        2.0 ** np.arange(-126, 128, 7),
        np.linspace(1, 2, 50)[:-1],
        [0, 1e-40, 3.4028235e38],
    ]
).astype(np.float32)


def test_last_record_is_its_definition():
    below, sample = np.tile(SUMS, 10), seeds(10 * len(SUMS), 11)
    last, next_one = _core.last_record(below, sample)
    np.testing.assert_allclose(last, pure.last_record(below, sample), rtol=1e-6)
    positive = below > 1e-37
    assert (last[positive] < below[positive]).all() and (next_one >= below).all()
    # Up to the next one it stays the last; there it may be followed by another.
    finite = next_one < np.inf
    same, _ = _core.last_record(next_one[finite], sample[finite])
    np.testing.assert_array_equal(same, last[finite])
    after, _ = _core.last_record(np.nextafter(next_one[finite], np.float32(np.inf)), sample[finite])
    assert ((after == last[finite]) | (after == next_one[finite])).all() and (after == next_one[finite]).any()


@pytest.mark.parametrize("below", [1.0, 1.3, 1.999, 2.0, 1e-20, 7e30])
def test_last_record_is_a_uniform_share_of_the_sum(below):
    last, _ = _core.last_record(np.full(50000, below, np.float32), seeds(50000, 12))
    assert stats.kstest(last / np.float32(below), "uniform").pvalue > UNLIKELY


def test_a_sum_that_is_no_number_ends_the_search():
    last, _ = _core.last_record(np.array([np.inf, np.nan], np.float32), seeds(2, 13))
    assert (last[0] >= 0) and not (last[1] > 0)


@pytest.mark.parametrize("weights", WEIGHTS.values(), ids=WEIGHTS)
def test_race_is_won_in_proportion_to_the_weights(weights):
    rng = np.random.default_rng(8)
    runs, racing = 20000, np.flatnonzero(weights > 0)
    bits = rng.integers(0, 2**32, (runs, len(racing)), np.uint32)
    f = np.broadcast_to(weights[racing].astype(np.float32), bits.shape)
    keys = _core.race_key(bits.ravel(), np.ascontiguousarray(f).ravel()).reshape(bits.shape)
    assert_drawn(racing[keys.argmin(axis=1)], weights)


def test_race_key_is_an_exponential_number_over_the_weight():
    bits = np.concatenate([[0, 1, 511, 512, 2**31, 2**32 - 1], np.random.default_rng(9).integers(0, 2**32, 2000)])
    for f in (1e-20, 0.5, 3.0, 1e20):
        got = _core.race_key(bits.astype(np.uint32), np.full(len(bits), f, np.float32))
        u = (np.floor(bits / 512) + 0.5) / 2**23
        np.testing.assert_allclose(got, -np.log(u) / np.float32(f), rtol=2e-6, atol=2e-7 / f)
        assert np.all(got > 0) and np.isfinite(got).all()


def test_raised_cosine_has_its_density():
    u = np.linspace(0, 1, 20001, endpoint=False, dtype=np.float32)
    x = _core.sample_raised_cosine(u).astype(np.float64)
    assert x.min() >= -1 and x.max() <= 1 and np.all(np.diff(x) >= 0)
    np.testing.assert_allclose(pure.raised_cosine_cdf(x), u, atol=2e-4)
    drawn = _core.sample_raised_cosine(uniforms(20000, 10)).astype(np.float64)
    assert stats.kstest(drawn, pure.raised_cosine_cdf).pvalue > UNLIKELY
    assert drawn.var() == pytest.approx(1 / 3 - 2 / np.pi**2, rel=0.05)


# --- interleaving ------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 4, 8])
@pytest.mark.parametrize("level", [0, 1, 5])
def test_each_run_of_lights_is_dealt_one_to_each_tile(n, level):
    tiles = _core.dealt_tile(200 * n * n, level, n).reshape(200, n * n)
    np.testing.assert_array_equal(np.sort(tiles, axis=1), np.broadcast_to(np.arange(n * n), tiles.shape))


@pytest.mark.parametrize("n", [2, 4, 8])
def test_a_short_run_is_dealt_to_different_tiles(n):
    tiles = _core.dealt_tile(n * n // 2 + 1, 3, n)
    assert len(set(tiles.tolist())) == len(tiles) and tiles.max() < n * n


@pytest.mark.parametrize("n", [2, 4, 8])
@pytest.mark.parametrize("place", [0, 1, 3])
def test_a_place_in_the_run_falls_on_every_tile_alike(n, place):
    runs = 200 * n * n
    tiles = _core.dealt_tile(runs * n * n, 1, n).reshape(runs, n * n)[:, place]
    assert stats.chisquare(np.bincount(tiles, minlength=n * n)).pvalue > UNLIKELY


@pytest.mark.parametrize("n", [2, 4, 8])
def test_dealing_has_no_pattern_from_run_to_run_or_level_to_level(n):
    count = 64 * n * n
    one, other = (_core.dealt_tile(count, level, n).reshape(64, n * n) for level in (1, 2))
    assert not np.array_equal(one, other)
    assert len({tuple(run) for run in one.tolist()}) >= 8
    repeated = np.mean(one[1:, 0] == one[:-1, 0])
    assert repeated < 1 / n**2 + 4 * (1 / n**2 / 63) ** 0.5


def test_packed_slots_tell_the_very_item_or_that_they_cannot():
    rng = np.random.default_rng(5)
    n = 20_000
    slots = rng.integers(0, 2**24 - 1, (n, 3), dtype=np.uint32)
    slots[:, 2] = rng.integers(0, 2**32, n, dtype=np.uint32)
    rest = rng.integers(0, 2**32, n, dtype=np.uint32)
    rest[::4] = slots[::4, 2] ^ rng.integers(0, 4, n // 4, dtype=np.uint32)  # so near that the low bits decide
    slots[1::4, 0] += np.uint32(2**24)  # as of more than 16 million lights
    slots[2::4, 1] += np.uint32(2**24)
    slots[3, :2] = 2**24 - 2, 2**24 - 1  # one too large to tell
    slots[7, :2] = 2**24 - 1, 0  # which marks those
    found = _core.packed_items(slots, rest)
    item = np.where(rest < slots[:, 2], slots[:, 0], slots[:, 1])
    told = found >= 0
    np.testing.assert_array_equal(found[told], item[told])
    large = (slots[:, :2] >= 2**24).any(axis=1)
    assert not told[large].any()
    assert not told[::4].any()
    assert told[11::4].mean() > 0.999
