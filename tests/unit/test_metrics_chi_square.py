"""Pearson's chi-square test: pooled bins, against scipy's own, and its distribution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from lab.errors import LabError
from lab.metrics import chi_square, pooled


def test_large_bins_are_scipys() -> None:
    counts, probability = np.array([48, 35, 15, 102]), np.array([0.25, 0.2, 0.05, 0.5])
    found = chi_square(counts, probability)
    wanted = stats.chisquare(counts, probability * counts.sum())
    assert found.statistic == pytest.approx(wanted.statistic) and found.p_value == pytest.approx(wanted.pvalue)
    assert found.freedom == 3
    assert chi_square(counts, 7 * probability) == pytest.approx(found), "only proportions count"


def test_rare_outcomes_are_pooled() -> None:
    counts, expected = np.array([3, 1, 0, 2, 94]), np.array([2.0, 2.0, 2.0, 1.0, 93.0])
    found = chi_square(counts, expected)
    assert found.freedom == 1  # 1 + 2 + 2 = 5 in a bin; the last 2 join the 93
    wanted = stats.chisquare([2 + 3 + 1, 94], [5, 95])
    assert found.statistic == pytest.approx(wanted.statistic) and found.p_value == pytest.approx(wanted.pvalue)


def test_p_values_are_uniform_where_the_probabilities_are_right() -> None:
    rng = np.random.default_rng(2)
    probability = rng.dirichlet(np.full(40, 0.3))
    p = [chi_square(rng.multinomial(800, probability), probability).p_value for _ in range(400)]
    assert stats.kstest(p, "uniform").pvalue > 0.01
    wrong = probability * np.where(np.arange(40) % 2, 1.5, 1.0)
    assert (
        np.median([chi_square(rng.multinomial(800, wrong / wrong.sum()), probability).p_value for _ in range(50)])
        < 0.01
    )


def test_what_cannot_be() -> None:
    assert chi_square([5, 1], [1.0, 0.0]) == (float("inf"), 0, 0.0)
    assert chi_square([9], [0.3]) == (0.0, 0, 1.0)
    assert chi_square([], []) == (0.0, 0, 1.0)
    assert chi_square([0, 0], [1, 1]) == (0.0, 0, 1.0)
    assert chi_square([2, 1], [1, 1]) == (0.0, 0, 1.0), "three draws tell nothing"
    for counts, probability in (([1, 2], [1.0]), ([-1, 2], [1, 1]), ([1, 2], [1, np.nan]), ([[1]], [[1]])):
        with pytest.raises(LabError, match="chi_square"):
            chi_square(counts, probability)


def test_many_tests_as_one() -> None:
    """None of them fails, all together do."""
    probability = np.array([0.2, 0.3, 0.5])
    rng = np.random.default_rng(4)
    right = [chi_square(rng.multinomial(200, probability), probability) for _ in range(100)]
    off = [chi_square(rng.multinomial(200, [0.22, 0.32, 0.46]), probability) for _ in range(100)]
    assert pooled(right).p_value > 0.01 and pooled(off).p_value < 1e-4 < min(test.p_value for test in off)
    assert pooled(right).freedom == 200
    assert pooled(right).statistic == pytest.approx(sum(test.statistic for test in right))
    assert pooled(right).p_value == pytest.approx(stats.chi2.sf(pooled(right).statistic, 200))
    assert pooled([]) == (0.0, 0, 1.0)
    assert pooled([right[0], chi_square([5, 1], [1.0, 0.0])]).p_value == 0
