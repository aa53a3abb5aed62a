"""p-values against scipy's own tests, and families of them against the chance of a false alarm."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from lab.errors import LabError
from lab.metrics import Moments, moments, sidak, welch_test, z_test


def test_z_test_is_two_sided_and_gaussian() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 40, 50))
    variance = rng.uniform(0.1, 3, (40, 50))
    expected = 2 * stats.norm.sf(np.abs(a - b) / np.sqrt(variance))
    np.testing.assert_allclose(z_test(a, b, variance), expected, rtol=1e-10)
    np.testing.assert_allclose(z_test(b, a, variance), expected, rtol=1e-10)
    assert z_test([9.0], [0.0], [1.0])[0] == pytest.approx(2 * stats.norm.sf(9), rel=1e-10)


def test_p_values_of_equal_expectations_are_uniform_and_a_wrong_variance_is_seen() -> None:
    rng = np.random.default_rng(2)
    shape = (100, 100)
    a, b = 5 + 0.3 * rng.normal(size=shape), 5 + 0.4 * rng.normal(size=shape)
    assert stats.kstest(z_test(a, b, 0.25).ravel(), "uniform").pvalue > 1e-3
    for wrong in (0.25 * 1.15, 0.25 / 1.15, 0.3**2, 0.5):
        assert stats.kstest(z_test(a, b, wrong).ravel(), "uniform").pvalue < 1e-3
    p = welch_test(rng.normal(size=(5, *shape)), 3 * rng.normal(size=(9, *shape)))
    assert stats.kstest(p.ravel(), "uniform").pvalue > 1e-3


def test_what_is_exact_must_be_equal() -> None:
    p = z_test([1.0, 1.0, 1.0], [1.0, 1.0 + 1e-12, 2.0], [0.0, 0.0, 0.0])
    assert p.tolist() == [1, 0, 0]
    assert z_test([1.0, 1.0], [1.0 + 1e-12, 2.0], 0.0, tolerance=1e-9).tolist() == [1, 0]
    assert z_test([3.0], [0.0], 1.0, tolerance=1.0)[0] == pytest.approx(2 * stats.norm.sf(2), rel=1e-10)


@pytest.mark.parametrize(("many", "few"), [(12, 3), (2, 2), (40, 7)])
def test_welch_test_is_scipys(many: int, few: int) -> None:
    rng = np.random.default_rng(many)
    a = 2 * rng.normal(size=(many, 8, 9, 3)) + rng.uniform(0, 3, (8, 9, 3))
    b = rng.normal(size=(few, 8, 9, 3))
    expected = stats.ttest_ind(a, b, axis=0, equal_var=False).pvalue
    np.testing.assert_allclose(welch_test(a, b), expected, rtol=1e-9)
    np.testing.assert_allclose(welch_test(moments(a), moments(b)), expected, rtol=1e-9)
    assert not np.allclose(expected, stats.ttest_ind(a, b, axis=0).pvalue, rtol=1e-3) or many == few


def test_welch_test_takes_a_count_for_each_pixel() -> None:
    rng = np.random.default_rng(3)
    counts = np.array([3, 5, 9])
    sets = [rng.normal(size=n) + 1 for n in counts]
    seen = Moments(counts, np.array([s.mean() for s in sets]), np.array([s.var(ddof=1) for s in sets]))
    other = rng.normal(size=(6, 3))
    expected = [stats.ttest_ind(sets[i], other[:, i], equal_var=False).pvalue for i in range(3)]
    np.testing.assert_allclose(welch_test(seen, other), expected, rtol=1e-9)


def test_welch_test_without_noise() -> None:
    same = np.ones((3, 4))
    assert (welch_test(same, same) == 1).all()
    assert (welch_test(same, same + 1e-9) == 0).all()
    assert np.isfinite(welch_test(same * 1e-200, 1e-200 * np.random.default_rng(0).normal(size=(3, 4)))).all()


def test_a_family_of_true_hypotheses_fails_as_often_as_it_may() -> None:
    rng = np.random.default_rng(4)
    families, size, significance = 4000, 64, 0.1
    failed = sum(not sidak(rng.uniform(size=size), significance).accepted for _ in range(families))
    # Mean 400, deviation 19: other corrections lie far off (none: all fail, at 0.1/64 exactly: 380).
    assert abs(failed - families * significance) < 4 * 19
    assert sum(not sidak(rng.uniform(size=size), 0.2).accepted for _ in range(families)) > 4 * 19 + 400


def test_sidak_counts_what_fails() -> None:
    p = np.full((10, 10, 3), 0.5)
    verdict = sidak(p)
    assert verdict.accepted and verdict.failing == 0 and verdict.tests == 300
    assert (1 - verdict.threshold) ** 300 == pytest.approx(0.99, rel=1e-9)
    p[2, 3], p[4, 4, 0] = 1e-9, verdict.threshold * 1.01
    verdict = sidak(p)
    assert not verdict.accepted and verdict.failing == 3
    assert sidak(np.full(10**6, 1e-7), 0.01).failing == 0, "the threshold of a million tests is 1.005e-8"
    assert sidak([0.004], 0.01).failing == 1


def test_what_is_no_p_value_passes_no_test() -> None:
    for wrong in ([0.5, np.nan], [1.5], [-0.1], []):
        with pytest.raises(LabError, match="p-values"):
            sidak(wrong)
    for significance in (0, 1, np.nan):
        with pytest.raises(LabError, match="significance"):
            sidak([0.5], significance)
    for variance in (-1.0, np.nan):
        with pytest.raises(LabError, match="variance"):
            z_test([1.0], [1.0], variance)
    with pytest.raises(LabError, match="two or more"):
        welch_test(Moments(1, np.ones(2), np.ones(2)), np.ones((3, 2)))
    with pytest.raises(LabError, match="same shape"):
        welch_test(np.ones((3, 2)), np.ones((3, 4)))
