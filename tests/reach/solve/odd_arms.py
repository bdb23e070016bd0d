"""Arms that nobody would build: parallel axes, no lengths, axes through the tip, sliding and mimic joints."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from toddle.robots.linkage import Linkage

AXES = np.array([np.eye(3), [[0, 0, 1], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], -np.eye(3)[::-1]])


@st.composite
def odd_arms(draw: DrawFn) -> tuple[Linkage, np.ndarray, np.ndarray]:
    """A linkage, and the limits of its joints."""
    axes = draw(st.integers(1, 8))
    joints = draw(st.integers(1, axes))
    before, tip = np.tile(np.eye(4), (axes, 1, 1)), np.eye(4)
    lengths = st.sampled_from([0.0, 0.0, 0.3, -1.0, 1e-9])
    for frame in before:
        frame[:3, :3] = AXES[draw(st.integers(0, 3))]
        frame[:3, 3] = [draw(lengths) for _ in range(3)]
    tip[:3, 3] = [draw(lengths) for _ in range(3)]
    gain = np.zeros((axes, joints))
    for axis in range(axes):
        gain[axis, min(axis, joints - 1)] = draw(st.sampled_from([1.0, -1.0, 0.5]))
    slides = np.array([float(draw(st.integers(0, 3)) == 0) for _ in range(axes)])
    lower = np.array([draw(st.sampled_from([-3.0, -0.1, 0.0, 1.0])) for _ in range(joints)])
    upper = lower + [draw(st.sampled_from([1e-6, 0.3, 3.0, 12.0])) for _ in range(joints)]
    return Linkage(before, slides, gain, np.zeros(axes), tip), lower, upper
