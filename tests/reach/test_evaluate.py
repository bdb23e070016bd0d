"""Test sets, the sample of what was seen, coverage, and the figures that are made of errors."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from jax import Array

from toddle.reach.evaluate.figures import error_figures, errors_of, query_figures
from toddle.reach.evaluate.seen import (
    CAPACITY,
    Seen,
    cell_of,
    cells_per_axis,
    coverage,
    draw_seen,
    kept,
    nothing_seen,
    remember,
)
from toddle.reach.evaluate.targets import fixed_targets, spread_out

POSITIONS = arrays.arrays(
    float, st.tuples(st.integers(1, 60), st.integers(2, 3)), elements=st.floats(-2, 2, allow_subnormal=False)
)


def distances(points: np.ndarray) -> np.ndarray:
    """Between every two points, each pair once."""
    return np.array([np.linalg.norm(a - b) for i, a in enumerate(points) for b in points[:i]])


@given(POSITIONS, st.floats(0.01, 3), st.integers(1, 30))
def test_targets_keep_their_distance_and_none_could_be_added(positions: np.ndarray, spacing: float, most: int) -> None:
    chosen = spread_out(positions, spacing, most)
    assert 1 <= len(chosen) <= most
    assert {tuple(point) for point in chosen} <= {tuple(point) for point in positions}
    assert np.all(distances(chosen) >= spacing * (1 - 1e-9))
    if len(chosen) < most:
        nearest = np.linalg.norm(positions[:, None] - chosen[None], axis=2).min(axis=1)
        assert np.all(nearest < spacing * (1 + 1e-9))


@given(POSITIONS, st.integers(1, 20))
def test_unless_told_targets_stand_as_far_apart_as_so_many_can(positions: np.ndarray, count: int) -> None:
    points, spacing = fixed_targets(positions, count)
    assert len(points) == min(count, len(positions))
    assert np.all(distances(points) >= spacing * (1 - 1e-9))
    asked, same = fixed_targets(positions, count, 0.5)
    assert same == 0.5
    assert np.all(distances(asked) >= 0.5 - 1e-9)


def test_the_widest_spacing_of_a_known_set_is_found() -> None:
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0], [0.1, 0.0], [0.0, 0.1], [2.9, 0.1]])
    points, spacing = fixed_targets(corners, 3)
    assert spacing == pytest.approx(3.0, abs=0.01)
    np.testing.assert_array_equal(points, corners[:3])


_remember = jax.jit(remember)


def remember_all(stream: np.ndarray, chunk: int, key: jax.Array) -> Seen:
    seen = nothing_seen(3, stream.shape[1])
    for i, start in enumerate(range(0, len(stream), chunk)):
        x = jnp.asarray(stream[start : start + chunk])
        seen = _remember(seen, jax.random.fold_in(key, i), posture_of(x), x)
    return seen


def posture_of(x: Array) -> Array:
    """Made-up joint values that tell which position they led to."""
    return jnp.stack([x[:, 0] + 1, x[:, 1] + 2, x[:, 0] - x[:, 1]], axis=1)


def test_postures_stay_with_the_positions_they_led_to() -> None:
    stream = np.random.default_rng(3).random((3 * CAPACITY, 2)).astype(np.float32)
    postures, positions = kept(remember_all(stream, 2048, jax.random.key(1)))
    np.testing.assert_array_equal(postures, np.asarray(posture_of(jnp.asarray(positions))))


def test_everything_is_kept_until_the_sample_is_full() -> None:
    stream = np.random.default_rng(0).random((CAPACITY, 2)).astype(np.float32)
    first = remember_all(stream[:1000], 500, jax.random.key(0))
    np.testing.assert_array_equal(kept(first)[1], stream[:1000])
    assert int(first.total) == 1000
    np.testing.assert_array_equal(kept(remember_all(stream, 512, jax.random.key(0)))[1], stream)


def test_every_position_ever_visited_is_kept_with_equal_chance() -> None:
    """Five times as many as can be kept: from each of 40 stretches of the stream a fair share remains."""
    count, groups, runs = 5 * CAPACITY, 40, 5
    stream = np.stack([np.arange(count) / count, np.zeros(count)], axis=1).astype(np.float32)
    counts = np.zeros(groups)
    for run in range(runs):
        rows = kept(remember_all(stream, 1024, jax.random.key(run)))[1]
        assert len(rows) == CAPACITY
        assert len(np.unique(rows[:, 0])) == CAPACITY, "a position is kept twice"
        counts += np.histogram(rows[:, 0], bins=groups, range=(0, 1))[0]
    expected = runs * CAPACITY / groups
    # each stretch is hypergeometric, so a little tighter than Poisson: chi-square of 39 degrees, and its 0.1 % point
    assert np.sum((counts - expected) ** 2 / expected) < 72.1


def test_seen_targets_are_drawn_from_what_was_seen_only() -> None:
    stream = 0.25 + 0.5 * np.random.default_rng(1).random((50, 3)).astype(np.float32)
    seen = remember_all(stream, 50, jax.random.key(0))
    drawn = np.asarray(draw_seen(seen, jax.random.key(2), 2000))
    rows = {tuple(row) for row in stream}
    assert {tuple(row) for row in drawn} == rows  # all of them, and no empty row


@given(arrays.arrays(np.float32, (8, 2), elements=st.floats(-0.5, 1.5, width=32)))
def test_coverage_counts_the_reachable_cells_that_were_entered(x: np.ndarray) -> None:
    size = cells_per_axis(2)
    entered = {(min(max(int(a * size), 0), size - 1), min(max(int(b * size), 0), size - 1)) for a, b in x}
    reachable = np.zeros(size * size, bool)
    reachable[: size * size // 2] = True  # the lower half, whichever axis comes first
    flat = np.asarray(cell_of(jnp.asarray(x)))
    assert len(set(flat.tolist())) == len(entered)
    points = jnp.asarray(x)
    seen = _remember(nothing_seen(3, 2), jax.random.key(0), posture_of(points), points)
    share = len({cell for cell in flat.tolist() if reachable[cell]}) / reachable.sum()
    assert float(coverage(seen, jnp.asarray(reachable))) == pytest.approx(share, abs=1e-6)


def test_figures_of_known_errors() -> None:
    errors = np.arange(101) / 1000  # 0 to 100 mm
    assert error_figures("fixed_error", errors) == pytest.approx(
        {
            "fixed_error_mean_mm": 50.0,
            "fixed_error_median_mm": 50.0,
            "fixed_error_p99_mm": 99.0,
            "fixed_error_max_mm": 100.0,
        }
    )


def test_an_error_is_the_distance_between_target_and_tip() -> None:
    targets = np.array([[0.0, 0.0], [1.0, 1.0]])
    found = errors_of(lambda x: x + 1.0, lambda q: q + np.array([2.0, 3.0]), targets)
    np.testing.assert_allclose(found, [5.0, 5.0])


def test_query_times_are_of_one_target_and_of_each_of_many() -> None:
    sizes: list[int] = []

    def count(x: np.ndarray) -> np.ndarray:
        sizes.append(x.size)
        return x

    found = query_figures(count, count, np.zeros((7, 3)))
    assert set(sizes) == {3, 3 * 4096}
    assert 0 < found["query_us_batch4096"] < found["query_us_single"] < 1e4
