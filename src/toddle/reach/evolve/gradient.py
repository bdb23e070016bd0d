"""The same controller by Levenberg-Marquardt through a forward model, many starts side by side.

A model that knows its slope dx/dq turns the score of `toddle.reach.evolve.score` into least squares with an exact
Jacobian, dx/dw = dx/dq dq/dw, where evolution sees one number for fifty controllers. Damping after Nielsen (1999):
mu shrinks by 1 - (2 rho - 1)^3 after a step that helped, where rho is the gain beside the predicted one, and doubles
ever faster after one that didn't.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.reach.evolve.controller import Shape, inputs_of, respond_with_slopes
from toddle.reach.model.model import Model

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-1, 1e-10, 1e10


class Refined(NamedTuple):
    """Controllers after so many iterations.

    Attributes:
        weights: one row a start.
        mse: mean squared distance between goals and the modelled tip [m^2].
    """

    weights: Float[np.ndarray, "starts weights"]
    mse: Float[np.ndarray, " starts"]


def refine(
    shape: Shape,
    model: Model,
    goals: Float[np.ndarray, "goals space"],
    weights: Float[np.ndarray, "starts weights"],
    iterations: int,
) -> Refined:
    """Improve each controller on the goals, as the model sees them.

    Args:
        shape: of the controllers.
        model: where the body puts its tip; it may be a learned one.
        goals: positions to reach [m].
        weights: where to start, one row a start.
        iterations: steps tried.
    """
    inputs = inputs_of(shape, goals)
    mse, normal, slope = _linearised(shape, model, goals, inputs, weights)
    # not each weight by its own diagonal: that lets the weights of saturated neurons run away
    scale = np.einsum("sww->s", normal) / shape.weights + 1e-12
    damping, growth = np.full(len(weights), _FIRST_DAMPING), np.full(len(weights), 2.0)
    for _ in range(iterations):
        damped = normal + (damping * scale)[:, None, None] * np.eye(shape.weights)
        step = -np.linalg.solve(damped, slope[:, :, None])[:, :, 0]
        promised = np.einsum("sw,sw->s", step, (damping * scale)[:, None] * step - slope)
        tried = _linearised(shape, model, goals, inputs, weights + step)
        gain = (mse - tried[0]) / np.maximum(promised, 1e-300)
        helped = tried[0] < mse
        weights = np.where(helped[:, None], weights + step, weights)
        mse = np.where(helped, tried[0], mse)
        normal = np.where(helped[:, None, None], tried[1], normal)
        slope = np.where(helped[:, None], tried[2], slope)
        shrink = np.maximum(1 / 3, 1 - (2 * gain.clip(-1, 1) - 1) ** 3)
        damping = (damping * np.where(helped, shrink, growth)).clip(_LEAST_DAMPING, _MOST_DAMPING)
        growth = np.where(helped, 2.0, np.minimum(2 * growth, 1e6))
    return Refined(weights, mse)


def _linearised(
    shape: Shape,
    model: Model,
    goals: Float[np.ndarray, "goals space"],
    inputs: Float[np.ndarray, "inputs goals"],
    weights: Float[np.ndarray, "starts weights"],
) -> tuple[
    Float[np.ndarray, " starts"], Float[np.ndarray, "starts weights weights"], Float[np.ndarray, "starts weights"]
]:
    """Mean squared distance, J^T J and J^T r over the goals, each divided by their number."""
    q, by_weight = respond_with_slopes(shape, weights, inputs)
    postures = q.transpose(0, 2, 1).reshape(-1, q.shape[1])
    x, by_joint = model.slope(postures)
    missed = x.reshape(len(weights), len(goals), -1) - goals
    jacobian = by_joint.reshape(*missed.shape, -1) @ by_weight
    rows = jacobian.reshape(len(weights), -1, jacobian.shape[3])
    flat = missed.reshape(len(weights), -1, 1)
    count = len(goals)
    return (
        (missed**2).sum(axis=(1, 2)) / count,
        rows.transpose(0, 2, 1) @ rows / count,
        (rows.transpose(0, 2, 1) @ flat)[:, :, 0] / count,
    )
