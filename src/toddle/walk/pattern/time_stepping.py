"""Linear time-stepping of the centre of mass on the preview horizon (Huber 2019, equations 2.29 to 2.42).

A state is position, velocity and acceleration of one axis; the jerk is constant over a sample. The printed equations
are read with the exponents running from 1 to N for the state and from 0 to N - 1 for the jerks, and with T^3 / 6 in
2.36 and (1 + 2 n) T^2 / 2 in 2.37.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import GRAVITY


class TimeStepping(NamedTuple):
    """What follows from a state (first of each pair) and from N jerks (second), at the N samples ahead.

    Attributes:
        position_state: P_ps of 2.36.
        position_jerk: P_pu of 2.36 [s^3].
        velocity_state: P_vs of 2.37.
        velocity_jerk: P_vu of 2.37 [s^2].
        zmp_state: P_zs of 2.41.
        zmp_jerk: P_zu of 2.42 [s^3].
    """

    position_state: Float[np.ndarray, "samples 3"]
    position_jerk: Float[np.ndarray, "samples samples"]
    velocity_state: Float[np.ndarray, "samples 3"]
    velocity_jerk: Float[np.ndarray, "samples samples"]
    zmp_state: Float[np.ndarray, "samples 3"]
    zmp_jerk: Float[np.ndarray, "samples samples"]


def time_stepping(samples: int, sample: float, height: float) -> TimeStepping:
    """The matrices of the preview horizon.

    Args:
        samples: N.
        sample: T [s].
        height: of the centre of mass [m], c_z of 2.39.
    """
    ahead = np.arange(1, samples + 1) * sample
    one, zero = np.ones(samples), np.zeros(samples)
    age = np.subtract.outer(np.arange(samples), np.arange(samples))
    past = age >= 0
    position = np.where(past, (1 + 3 * age + 3 * age**2) * sample**3 / 6, 0.0)
    velocity = np.where(past, (1 + 2 * age) * sample**2 / 2, 0.0)
    lever = height / GRAVITY
    position_state = np.stack([one, ahead, ahead**2 / 2], axis=1)
    return TimeStepping(
        position_state,
        position,
        np.stack([zero, one, ahead], axis=1),
        velocity,
        position_state - lever * np.array([0.0, 0.0, 1.0]),
        position - lever * np.where(past, sample, 0.0),
    )


def advance(state: Float[np.ndarray, "*axes 3"], jerk: Float[np.ndarray, "*axes"], t: float) -> np.ndarray:
    """The state a time later, under a constant jerk (2.29): exact for any time.

    Args:
        state: position, velocity, acceleration of each axis.
        jerk: of each axis, per second cubed.
        t: the time [s].

    Returns:
        The same shape as the state.
    """
    motion = np.array([[1.0, 0.0, 0.0], [t, 1.0, 0.0], [t * t / 2, t, 1.0]])
    return state @ motion + jerk[..., None] * np.array([t**3 / 6, t * t / 2, t])


def zero_moment_point(state: Float[np.ndarray, "*axes axis 3"], height: float) -> Float[np.ndarray, "*axes axis"]:
    """Where the linear inverted pendulum presses on the floor [m] (2.6, 2.7).

    Args:
        state: position, velocity, acceleration of each axis.
        height: of the centre of mass [m].
    """
    return state[..., 0] - height / GRAVITY * state[..., 2]
