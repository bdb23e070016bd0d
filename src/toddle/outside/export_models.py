"""Learned bodies other than rigid arms in elementary operations: where each puts its tip.

How the joints move the tip is told by differences, a 256th of each joint's range apart: a step needs no better slope,
and the solver comes to the same answer by it. Sources of the equations: the modules of the models.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import combinations_with_replacement

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.outside.export_ops import Ops, Tensor
from toddle.outside.export_solve import Miss, Problem
from toddle.reach.model.crippled import Crippled
from toddle.reach.model.curvature import Curvature
from toddle.reach.model.curvature_chain import places, turn_of
from toddle.reach.model.curvature_rest import Mended
from toddle.reach.model.model import Model
from toddle.reach.model.multilinear import Multilinear
from toddle.reach.model.network import Network
from toddle.signals import Experience

Forward = Callable[[Ops, Tensor], Tensor]
"""From (batch, postures, joints) [rad or m] to (batch, postures, space) [m]."""

_APART = 1 / 256  # of a joint's range: what differences are taken over
_STRIDE = 0.25  # of a joint's range
_STARTS = 1024
_LEAST_SQUARE = 1e-12  # [rad^2]


def model_problem(
    model: Model, lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"], known: Experience
) -> Problem:
    """What is exported of a body that is no rigid arm.

    Args:
        model: the learned body.
        lower: lower limits [rad or m].
        upper: upper limits.
        known: movements, some of whose postures are started from.

    Raises:
        BadInput: the model can't be exported.
    """
    forward = forward_of(model)
    some = np.random.default_rng(0).permutation(len(known.q))[:_STARTS]
    starts = np.clip(known.q[some], lower, upper)
    return Problem(
        lower, upper, upper - lower, _STRIDE, starts, model.forward(starts),
        rows=model.space,
        lever=0.0,
        freest=True,
        goal=lambda ops, target: (target, ops.shape(target, (1, model.space))),
        miss=partial(_miss, forward, upper - lower, model.space),
    )  # fmt: skip


def forward_of(model: Model) -> Forward:
    """Where a model puts its tip, in elementary operations.

    Raises:
        BadInput: the model can't be exported.
    """
    if isinstance(model, Curvature):
        return partial(_curvature, model)
    if isinstance(model, Mended):
        return partial(_mended, model, forward_of(model.structure))
    if isinstance(model, Crippled):
        return partial(_crippled, model, forward_of(model.model))
    if isinstance(model, Multilinear):
        return partial(_multilinear, model)
    if isinstance(model, Network):
        return partial(_network, model)
    raise BadInput(
        f"a body learned as {type(model).__name__} can't be exported",
        where="--to",
        remedy="learn it with --method screws, curvature, multilinear or network",
    )


def _miss(forward: Forward, span: np.ndarray, space: int, ops: Ops, q: Tensor, goal: Tensor) -> Miss:
    joints = len(span)
    changes = np.concatenate([np.zeros((1, joints)), _APART * np.diag(span)])
    tried = ops.shape(q, (-1, 1, joints)) + ops.constant(changes[None, None])
    tips = ops.shape(forward(ops, ops.shape(tried, (-1, joints))), (-1, joints + 1, space))
    tip = ops.take(tips, [0], -2)
    slope = ops.turned((ops.take(tips, range(1, joints + 1), -2) - tip) * (1 / _APART))
    error = goal - ops.shape(tip, (-1, space))
    square = ops.sum(error * error, -1)
    return Miss(ops.shape(error, (-1, space, 1)), slope, square, 0.0 * square)


def _crippled(model: Crippled, whole: Forward, ops: Ops, q: Tensor) -> Tensor:
    still = model.place - model.share * model.about
    return whole(ops, ops.constant(still[None, None]) + ops.constant(model.share[None, None]) * q)


def _mended(model: Mended, structure: Forward, ops: Ops, q: Tensor) -> Tensor:
    if model.rest is None:
        return structure(ops, q)
    u = _scaled(ops, q, model.rest.middle, model.rest.half)
    return structure(ops, q) + _polynomial(ops, u, len(model.rest.half), model.rest.order, model.rest.weights)


def _curvature(model: Curvature, ops: Ops, q: Tensor) -> Tensor:
    shape, numbers, where = model.shape, model.numbers, places(model.shape)
    u, gaps = _scaled(ops, q, shape.middle, shape.half), (0.0, *numbers[where.gaps])
    ends = np.cumsum(shape.sizes)
    x, y, z = (float(part) for part in numbers[where.tip])
    for i in reversed(range(len(shape.sizes))):
        own = ops.take(u, range(ends[i] - shape.sizes[i], ends[i]), -1)
        arc = _polynomial(ops, own, shape.sizes[i], shape.order, numbers[where.segments[i]].reshape(3, -1).T)
        x, y, z = _carried(ops, arc, x, y, z)
        z = z + float(gaps[i])
    turn = turn_of(numbers[None, where.tilt])[0, : shape.space]
    return ops.matmul(ops.join([x, y, z], -1), ops.constant(turn.T[None])) + ops.constant(
        numbers[None, None, : shape.space]
    )


def _carried(ops: Ops, arc: Tensor, x: Tensor, y: Tensor, z: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """A point of the frame at a segment's head, in the frame at its foot; see `toddle.reach.model.curvature_chain`."""
    across, along, length = (ops.take(arc, [part], -1) for part in range(3))
    square = across * across + along * along
    angle = ops.sqrt(ops.maximum(square, ops.constant(_LEAST_SQUARE)))
    s, half = ops.sin(angle) / angle, ops.sin(0.5 * angle) / angle
    v = 2.0 * half * half  # (1 - cos a) / a^2, in the form that doesn't cancel
    rest = length - (across * x + along * y)
    aside = v * rest + s * z
    return across * aside + x, along * aside + y, z * (1.0 - v * square) + s * rest


def _multilinear(model: Multilinear, ops: Ops, q: Tensor) -> Tensor:
    at, whole, count = q - ops.constant(model.middle[None, None]), None, 1
    for joint, slides in enumerate(model.slides):
        value = ops.take(at, [joint], -1)
        one = 0.0 * value + 1.0
        factor = [one, value] if slides else [one, ops.cos(value), ops.sin(value)]
        row = ops.join(factor, -1)
        if whole is None:
            whole, count = row, len(factor)
            continue
        products = ops.shape(whole, (-1, count, 1)) * ops.shape(row, (-1, 1, len(factor)))
        count *= len(factor)
        whole = ops.shape(products, (-1, count))
    return ops.matmul(whole, ops.constant(model.weights[None]))


def _network(model: Network, ops: Ops, q: Tensor) -> Tensor:
    turns, others = np.flatnonzero(model.turns).tolist(), np.flatnonzero(~model.turns).tolist()
    parts = []
    if turns:
        angle = ops.take(q, turns, -1)
        parts += [float(np.sqrt(2)) * ops.cos(angle), float(np.sqrt(2)) * ops.sin(angle)]
    if others:
        scaled = _scaled(ops, q, model.middle, model.half / np.sqrt(3))
        parts.append(ops.take(scaled, others, -1))
    z = ops.join(parts, -1)
    for layer in model.layers:
        one = ops.matmul(z, ops.constant(layer.first[None])) + ops.constant(layer.first_bias[None, None])
        z = one * (ops.matmul(z, ops.constant(layer.second[None])) + ops.constant(layer.second_bias[None, None]))
    return ops.constant(model.mean[None, None]) + model.scale * ops.matmul(z, ops.constant(model.out[None]))


def _scaled(ops: Ops, q: Tensor, middle: np.ndarray, half: np.ndarray) -> Tensor:
    return (q - ops.constant(middle[None, None])) * ops.constant((1 / half)[None, None])


def _polynomial(ops: Ops, u: Tensor, size: int, order: int, weights: Float[np.ndarray, "features outputs"]) -> Tensor:
    """Weighted sums of all products of so many actuators up to an order: the constant, the actuators, then more."""
    total, first = ops.constant(weights[None, None, 0]), 1
    for degree in range(1, order + 1):
        powers = list(combinations_with_replacement(range(size), degree))
        product = ops.take(u, [power[0] for power in powers], -1)
        for place in range(1, degree):
            product = product * ops.take(u, [power[place] for power in powers], -1)
        total = total + ops.matmul(product, ops.constant(weights[None, first : first + len(powers)]))
        first += len(powers)
    return total
