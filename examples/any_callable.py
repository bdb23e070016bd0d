"""Anything that moves: a Python function from joint values to the tip's position is a body.

The function below computes; yours may command a real arm and ask a camera.

    python examples/any_callable.py
"""

import numpy as np

import toddle
from toddle.robots.black_box import CallablePlant


def finger(q: np.ndarray) -> np.ndarray:
    """Two links of 4 cm and 3 cm, seen with half a millimetre of noise [m]."""
    first, both = q[0], q[0] + q[1]
    tip = np.array([0.04 * np.cos(first) + 0.03 * np.cos(both), 0.04 * np.sin(first) + 0.03 * np.sin(both)])
    return tip + noise.normal(0, 0.0005, 2)


noise = np.random.default_rng(0)
plant = CallablePlant(finger, joints=("base", "knuckle"), lower=[0.0, 0.2], upper=[1.4, 1.5], name="finger")
skill = toddle.learn(plant, samples=2_000, per_cycle=1_000, test_points=30, seed=0)
figures = skill.figures
print(f"open loop {figures['fixed_error_mean_mm']:.1f} mm, closed loop {figures['closed_loop_error_mean_mm']:.1f} mm")
