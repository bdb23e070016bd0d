"""Where and when to land: a second solver's answer, never outside of the bounds, and no number makes it raise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from toddle.walk.balance.step_adjustment import Adjustment, Aim, Bounds, StepWeights, adjust

OMEGA, PHASE, END = 4.6, 0.2, 0.6
PLACE = st.floats(-0.3, 0.3)
PAIR = st.tuples(PLACE, PLACE)
AIMS = st.builds(Aim, PAIR, st.floats(0.4, 0.8), st.floats(1.0, 10.0), PAIR, st.floats(8.0, 20.0))
BOUNDS = st.builds(
    lambda low, size, early, late, shift: Bounds(
        low, (low[0] + size[0], low[1] + size[1]), early, early + late, (-shift, -shift), (shift, shift)
    ),
    PAIR,
    st.tuples(st.floats(0, 0.4), st.floats(0, 0.4)),
    st.floats(0.2, 0.6),
    st.floats(0, 0.4),
    st.floats(0, 0.1),
)
WEIGHTS = st.builds(StepWeights, *[st.floats(1e-3, 10)] * 3, st.floats(0.1, 100))
AIM = Aim((0.1, -0.14), 0.6, 9.0, (0.05, 0.3), 15.0)
WIDE = Bounds((-0.24, -0.3), (0.24, -0.12), 0.33, 0.7, (-0.08, -0.04), (0.08, 0.04))


def grown(seconds: float) -> float:
    return math.exp(OMEGA * max(seconds - PHASE, 0.0))


def second_opinion(weights: StepWeights, x0: tuple[float, float], aim: Aim, bounds: Bounds) -> tuple[np.ndarray, ...]:
    """The programme's terms as rows of a bounded least-squares problem: rows, right side, lower and upper bounds."""
    rows, right = np.zeros((7, 5)), np.zeros(7)
    scales = np.sqrt([weights.displacement] * 2 + [weights.time] + [weights.shift] * 2)
    rows[:5] = np.diag(scales)
    right[:3] = scales[:3] * [*aim.displacement, grown(aim.end)]
    for axis in (0, 1):
        # x0 tau + (1 - tau_last) u - (kappa D + b2) / E
        rows[5 + axis, [axis, 2, 3 + axis]] = [-aim.kappa / aim.growth, x0[axis], 1 - grown(END)]
        right[5 + axis] = aim.rest[axis] / aim.growth
    rows[5:] *= math.sqrt(weights.landing)
    right[5:] *= math.sqrt(weights.landing)
    lower = np.array([*bounds.least, grown(bounds.earliest), *bounds.shift_least])
    upper = np.array([*bounds.most, max(grown(bounds.latest), grown(bounds.earliest)), *bounds.shift_most])
    return rows, right, lower, upper


def unknowns(found: Adjustment) -> np.ndarray:
    return np.array([*found.displacement, math.exp(OMEGA * (found.end - PHASE)), *found.shift])


@given(WEIGHTS, PAIR, AIMS, BOUNDS)
def test_a_second_solver_finds_nothing_better(
    weights: StepWeights, x0: tuple[float, float], aim: Aim, bounds: Bounds
) -> None:
    found = adjust(weights, OMEGA, x0, PHASE, END, aim, bounds)
    rows, right, lower, upper = second_opinion(weights, x0, aim, bounds)
    assert found.solved
    chosen = unknowns(found)
    assert (chosen >= lower - 1e-5).all()
    assert (chosen <= upper + 1e-5).all()
    other = lsq_linear(rows, right, (lower - 1e-9, upper + 1e-9), method="bvls", tol=1e-12).x
    cost, best = (float(np.sum((rows @ u - right) ** 2)) for u in (chosen, other))
    assert cost <= best + 1e-5 * (1 + best)


def test_a_step_that_goes_as_planned_is_left_alone() -> None:
    # the DCM from the stance foot that the next step needs, brought back to now
    x0 = tuple(
        (AIM.kappa * d + b) / AIM.growth / grown(AIM.end) for d, b in zip(AIM.displacement, AIM.rest, strict=True)
    )
    found = adjust(StepWeights(), OMEGA, (x0[0], x0[1]), PHASE, END, AIM, WIDE)
    assert found.displacement == pytest.approx(AIM.displacement, abs=1e-6)
    assert found.end == pytest.approx(AIM.end, abs=1e-6)
    assert found.shift == pytest.approx((0, 0), abs=1e-6)


def test_a_push_ahead_brings_the_landing_ahead_or_makes_it_earlier() -> None:
    in_time = WIDE._replace(earliest=0.6, latest=0.6, shift_least=(0.0, 0.0), shift_most=(0.0, 0.0))
    calm, pushed = (adjust(StepWeights(), OMEGA, (x, -0.01), PHASE, END, AIM, in_time) for x in (0.01, 0.02))
    assert (calm.end, pushed.end) == pytest.approx((0.6, 0.6))
    assert pushed.displacement[0] > calm.displacement[0] + 0.05
    # the zero moment point takes what it can of a push; what is left ends the step sooner
    calm, pushed = (adjust(StepWeights(), OMEGA, (x, -0.01), PHASE, END, AIM, WIDE) for x in (0.01, 0.1))
    assert pushed.end < calm.end - 0.05


@given(PAIR, st.floats(-math.pi, math.pi), st.floats(0, 0.9))
def test_an_obstacle_that_leaves_room_is_kept_off(x0: tuple[float, float], angle: float, share: float) -> None:
    n = np.array([math.cos(angle), math.sin(angle)])
    corners = np.array([[x, y] for x in (-0.24, 0.24) for y in (-0.3, -0.12)]) @ n
    least = corners.min() + share * np.ptp(corners)
    found = adjust(StepWeights(), OMEGA, x0, PHASE, END, AIM, WIDE, np.array([[*n, least]]))
    assert found.solved
    assert n @ found.displacement >= least - 1e-3


def test_an_obstacle_that_leaves_none_is_neared_and_not_refused() -> None:
    found = adjust(StepWeights(), OMEGA, (0.02, -0.02), PHASE, END, AIM, WIDE, np.array([[-1.0, 0.0, 5.0]]))
    assert found.solved
    assert found.displacement[0] == pytest.approx(-0.24, abs=1e-3)


ANY = st.floats(allow_nan=True, allow_infinity=True)


@given(st.tuples(ANY, ANY), st.tuples(ANY, ANY), ANY, st.floats(-1, 3))
@example((math.nan, 0.0), (0.0, 0.0), 1.0, 0.2)
@example((1e300, -1e300), (0.0, 0.0), 1.0, 0.2)
@example((0.0, 0.0), (math.inf, 0.0), math.inf, 0.2)
def test_no_number_makes_it_raise(
    x0: tuple[float, float], rest: tuple[float, float], kappa: float, phase: float
) -> None:
    aim = AIM._replace(rest=rest, kappa=kappa)
    with np.errstate(all="ignore"):
        found = adjust(StepWeights(), OMEGA, x0, phase, END, aim, WIDE)
    assert all(map(math.isfinite, (*found.displacement, found.end, *found.shift)))
    if found.solved:
        low, high = np.array(WIDE.least) - 1e-5, np.array(WIDE.most) + 1e-5
        assert (low <= found.displacement).all()
        assert (found.displacement <= high).all()
    else:
        assert found == Adjustment(aim.displacement, aim.end, (0.0, 0.0), False)


def test_bounds_that_contradict_each_other_leave_the_plan() -> None:
    crossed = WIDE._replace(least=(0.2, -0.3), most=(0.1, -0.12))
    assert adjust(StepWeights(), OMEGA, (0.02, 0.0), PHASE, END, AIM, crossed) == (AIM.displacement, 0.6, (0, 0), False)
