"""Second derivatives by hand against differences of the first, and those against differences of the merit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reach.solve.odd_arms import odd_arms
from scipy.spatial.transform import Rotation

from toddle.reach.solve.damped import RADIAN, damped_solver
from toddle.reach.solve.damped_kernels import Work, miss, place
from toddle.reach.solve.settling_kernels import curve


@settings(max_examples=15)
@given(arm=odd_arms(), rows=st.sampled_from([3, 6]), seed=st.integers(0, 100))
def test_gradient_and_hessian_agree_with_differences(arm, rows, seed):
    linkage, lower, upper = arm
    solver = damped_solver(linkage, lower, upper, postures=8)
    axes, n = linkage.gain.shape
    work = Work(np.empty((axes, 6)), np.empty((n, 6)), np.empty((2, 8, 8)), np.empty((3, 12)), np.empty((4, n)))
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.uniform(-1, 1, 3)).as_matrix()
    target = np.concatenate([rng.uniform(-1, 1, 3), turn.ravel()])
    scale = solver.arm.joints[2]

    def derivatives(u):
        place(solver.arm, u * scale, work)
        squared, angle = miss(solver.arm, target, rows, work)
        curve(solver.arm, rows, angle, work)
        lower_half = np.tril(work.matrix[1, :n, :n])
        merit = 0.5 * (squared + (RADIAN * angle) ** 2)
        return angle, merit, -work.joint[1].copy(), lower_half + np.tril(lower_half, -1).T

    u = rng.uniform(lower, upper) / scale
    angle, _, gradient, hessian = derivatives(u)
    if angle > 3.0:
        return  # beyond half a turn the angle has a kink
    size = 1.0 + np.abs(hessian).max()
    for joint, step in enumerate(1e-5 * np.eye(n)):
        after, before = derivatives(u + step), derivatives(u - step)
        assert gradient[joint] == pytest.approx((after[1] - before[1]) / 2e-5, abs=1e-5 * size)
        np.testing.assert_allclose(hessian[joint], (after[2] - before[2]) / 2e-5, atol=1e-5 * size)
