"""How alike two drivers command, beside SciPy and sums by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import entropy

from toddle.failures import BadInput
from toddle.navigate.cloning.measures import AHEAD, TURNING, counts, divergence

HISTOGRAMS = st.lists(st.integers(0, 1000), min_size=6, max_size=6).filter(any).map(np.array)


def test_by_hand() -> None:
    told, said = np.array([3, 1]), np.array([1, 1])
    assert divergence(told, said, added=0.0) == pytest.approx(0.75 * math.log(1.5) + 0.25 * math.log(0.5))
    assert divergence(told, said) == pytest.approx(0.7 * math.log(1.4) + 0.3 * math.log(0.6))


def test_what_the_network_never_says_is_infinite_by_the_letter_alone() -> None:
    told, said = np.array([3, 1]), np.array([4, 0])
    assert divergence(told, said, added=0.0) == math.inf
    assert 0 < divergence(told, said) < 1
    assert divergence(said, told, added=0.0) == pytest.approx(math.log(4 / 3))  # it goes one way


@given(HISTOGRAMS, HISTOGRAMS)
def test_as_scipy_and_never_negative(told: np.ndarray, said: np.ndarray) -> None:
    ours = divergence(told, said)
    assert ours == pytest.approx(float(entropy(told + 0.5, said + 0.5)), abs=1e-12)
    assert ours >= -1e-12
    assert divergence(told, told) == 0.0


@pytest.mark.parametrize("edges", [AHEAD, TURNING])
def test_bins_are_as_wide_and_standing_is_the_middle_of_one(edges: np.ndarray) -> None:
    np.testing.assert_allclose(np.diff(edges), 0.02)
    assert np.abs((edges[:-1] + edges[1:]) / 2).min() < 1e-12
    assert counts(np.array([-0.004, 0.0, 0.004]), edges).max() == 3


@given(st.lists(st.floats(-10, 10), min_size=1, max_size=50))
def test_every_look_counts_once(values: list[float]) -> None:
    assert counts(np.array(values), TURNING).sum() == len(values)
    assert counts(np.array([-9.0, 9.0]), TURNING)[[0, -1]].tolist() == [1, 1]


def test_nothing_is_no_distribution() -> None:
    with pytest.raises(BadInput, match="empty"):
        divergence(np.zeros(3, int), np.ones(3, int))
    with pytest.raises(BadInput, match="empty"):
        divergence(np.ones(3, int), np.zeros(3, int))
