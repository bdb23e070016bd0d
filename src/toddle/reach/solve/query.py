"""One target at a time, in microseconds: a learned inverse as a plain numpy function.

Dispatching a compiled JAX function costs more than evaluating a small network; numpy has the answer before that. Both
engines compute with the same arrays, and a test holds them equal.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

from toddle.reach.learn.perceptron import Perceptron
from toddle.reach.skill import Skill

Query = Callable[[Float[np.ndarray, " space"]], Float[np.ndarray, " joints"]]


def query_of(skill: Skill) -> Query:
    """The skill's one-shot answer to a single target [m], as joint values within their limits [rad or m]."""
    if isinstance(skill.learner, Perceptron):
        return _perceptron_query(skill, skill.learner)
    return lambda target: skill.predict(target[None])[0]


def _perceptron_query(skill: Skill, learner: Perceptron) -> Query:
    box, margin = skill.box, learner.margin
    low, span = np.asarray(box.joint_lower, float), np.asarray(box.joint_span, float)
    high, gain = low + span, span / (1 - 2 * margin)
    offset = low - margin * gain
    state: Any = skill.state
    layers = state.now if state.mean is None else state.mean
    *hidden, (last, last_bias) = [(np.asarray(weights, float), np.asarray(bias, float)) for weights, bias in layers]
    scale, shift = 1 / np.asarray(box.space_span, float), np.asarray(box.space_lower, float)
    if learner.symmetric:
        scale, shift = 2 * scale, shift + 0.5 / scale

    def answer(target: Float[np.ndarray, " space"]) -> Float[np.ndarray, " joints"]:
        x = (target - shift) * scale
        for weights, bias in hidden:
            x = _sigmoid(weights @ x + bias)
        q = offset + gain * _sigmoid(last @ x + last_bias)
        return np.minimum(np.maximum(q, low), high)

    return answer


def _sigmoid(z: np.ndarray) -> np.ndarray:
    """1 / (1 + exp(-z)), in the form that can't overflow."""
    return 0.5 + 0.5 * np.tanh(0.5 * z)
