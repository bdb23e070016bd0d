"""Random moments of a walk: pushed, between obstacles, at any phase, with any time left."""

from __future__ import annotations

import numpy as np

from toddle.robots.gait import Gait
from toddle.signals import Footstep, Velocity
from toddle.walk.pattern.nmpc import NEVER, PlanState

ICUB = Gait(0.465, 0.14, 0.18, 0.10, 0.0315)


def random_state(gait: Gait, rng: np.random.Generator, kick: float = 0.0) -> PlanState:
    """A step somewhere on the floor, the centre of mass between its feet, moved and sped by ``kick`` [m], [m/s]."""
    side, yaw = int(rng.integers(2)), float(rng.uniform(-3, 3))
    sign = 1.0 if side == 0 else -1.0
    x, y = rng.uniform(-5, 5, 2)
    across = gait.foot_distance * sign
    other = Footstep(1 - side, x + across * np.sin(yaw) - 0.05 * np.cos(yaw), y - across * np.cos(yaw), yaw)
    phase = float(rng.uniform(0, gait.step_time))
    remaining = max(gait.step_time - phase + float(rng.uniform(-0.1, 0.1)), 0.02)
    middle = np.array([(x + other.x) / 2, (y + other.y) / 2])
    position = middle + kick * rng.uniform(-0.2, 0.2, 2)
    speed = kick * rng.uniform(-1, 1, 2) + 0.1 * np.array([np.cos(yaw), np.sin(yaw)])
    com = np.stack([position, speed, kick * rng.uniform(-5, 5, 2)], axis=1)
    halt = int(rng.choice([NEVER, NEVER, NEVER, 0, 1, 2]))
    support = Footstep(side, float(x), float(y), yaw)
    return PlanState(com, support, other, (other.x, other.y), phase, remaining, gait.double_support, halt)


def random_command(rng: np.random.Generator, size: float = 1.0) -> Velocity:
    return Velocity(*(size * rng.uniform(-1, 1, 3) * [0.4, 0.2, 0.8]).tolist())


def random_circles(state: PlanState, rng: np.random.Generator, most: int = 4) -> np.ndarray:
    """Circles around the robot, none on its feet."""
    count = int(rng.integers(most + 1))
    angle, away = rng.uniform(-np.pi, np.pi, count), rng.uniform(0.35, 1.2, count)
    radius = rng.uniform(0.02, 0.2, count)
    x, y = state.support.x + away * np.cos(angle), state.support.y + away * np.sin(angle)
    return np.stack([x, y, radius], axis=1)
