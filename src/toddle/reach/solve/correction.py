"""Observed correction: look where the tip went, correct by what was missed, ask again.

Two ways to correct the answer for a target x* after the tip was seen at x, with the same learner g and movements:

- "shift": the commanded target moves by what was missed, c <- c + (x* - x), and q = g(c). Nothing is asked of g but its
  answers.
- "newton": the joints move by what was missed, q <- q + H (x* - x), where H starts as the slope dg/dx of the estimate
  itself at the target and is mended by each look (Broyden's good update of an inverse Jacobian). It does not stop at
  what g can answer: where joints are at their limits, or g is coarse, it goes on when shifting stalls.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.failures import BadInput
from toddle.reach.solve.memory import Memory, recall

Predict = Callable[[Float[Array, " space"]], Float[Array, " joints"]]
Observe = Callable[[Float[Array, "points joints"]], Float[Array, "points space"]]


class Corrected(NamedTuple):
    """Answers after looking.

    Attributes:
        q: for each target the best joint values that were tried (unit box).
        errors: row k: distance to the target of the best answer after k looks; row 0 is open loop.
    """

    q: Float[Array, "points joints"]
    errors: Float[Array, "answers points"]


class _Best(NamedTuple):
    """For each target the best movement so far, and its distance."""

    q: Float[Array, "points joints"]
    error: Float[Array, " points"]


class _Attempt(NamedTuple):
    """One target's state between looks: the last movement and what it led to."""

    q: Float[Array, " joints"]
    x: Float[Array, " space"]
    command: Float[Array, " space"]
    slope: Float[Array, "joints space"]


def correct(
    predict: Predict,
    observe: Observe,
    targets: Float[Array, "points space"],
    looks: int,
    *,
    scale: Float[Array, " space"] | float = 1.0,
    method: Literal["newton", "shift"] = "newton",
    largest: float = 0.15,
    memory: Memory | None = None,
) -> Corrected:
    """Answers for targets, each corrected by what is seen after every movement (all in the unit box).

    After k looks each target has been moved for k + 1 times; the last movement is watched as well, so that the best
    one can be kept.

    Args:
        predict: the learner's answer for one position.
        observe: moves once for each target, and tells where the tip came to be.
        targets: where the tip should be.
        looks: how often the answer is corrected.
        scale: lengths of the box's edges [m], if errors are wanted in metres.
        method: "newton" or "shift", as above.
        largest: the most that a joint moves in one correction of "newton", as a fraction of its range.
        memory: remembered movements that "newton" may start from, where they came closer than the first answer.

    Raises:
        BadInput: looks is negative.
    """
    if looks < 0:
        raise BadInput(f"{looks} looks", remedy="give 0 (open loop) or more")
    edges = jnp.broadcast_to(scale, targets.shape)
    q, slope = _begin(predict, targets, method == "newton")
    attempt = _Attempt(q, observe(q), targets, slope)
    best = _Best(q, _distance(attempt.x, targets, edges))
    errors = [best.error]
    if memory is not None and method == "newton":
        start = recall(memory, q, attempt.x, targets, edges)
        attempt = attempt._replace(q=start.q, x=start.x, slope=start.slope)
        best = _better(best, attempt, targets, edges) if looks else best
    for _ in range(looks):
        if method == "newton":
            attempt = _newton(attempt, observe, targets, largest)
        else:
            attempt = _shift(attempt, observe, targets, predict)
        best = _better(best, attempt, targets, edges)
        errors.append(best.error)
    return Corrected(best.q, jnp.stack(errors))


@eqx.filter_jit
def _begin(predict: Predict, targets: Array, newton: bool) -> tuple[Array, Array]:
    """The open-loop answers, and the slope of the estimate there."""
    slope = jax.jacfwd(predict) if newton else lambda x: jnp.zeros((0, len(x)))
    return _answers(predict, targets), jax.vmap(slope)(targets)


@eqx.filter_jit
def _answers(predict: Predict, targets: Array) -> Array:
    return jnp.clip(jax.vmap(predict)(targets), 0.0, 1.0)


@jax.jit
def _distance(x: Array, targets: Array, edges: Array) -> Array:
    return jnp.linalg.norm((x - targets) * edges, axis=-1)


@jax.jit
def _better(best: _Best, attempt: _Attempt, targets: Array, edges: Array) -> _Best:
    distance = _distance(attempt.x, targets, edges)
    q = jnp.where((distance < best.error)[:, None], attempt.q, best.q)
    return _Best(q, jnp.minimum(distance, best.error))


def _shift(attempt: _Attempt, observe: Observe, targets: Array, predict: Predict) -> _Attempt:
    """One movement with the commanded target shifted by what was missed."""
    command = attempt.command + targets - attempt.x
    q = _answers(predict, command)
    return attempt._replace(q=q, x=observe(q), command=command)


def _newton(attempt: _Attempt, observe: Observe, targets: Array, largest: float) -> _Attempt:
    """One movement with the joints moved by the slope times what was missed; the slope learns from the outcome."""
    q = _stepped(attempt, targets, largest)
    x = observe(q)
    return attempt._replace(q=q, x=x, slope=_mended(attempt, q, x))


@eqx.filter_jit
def _stepped(attempt: _Attempt, targets: Array, largest: float) -> Array:
    step = jnp.einsum("pjs,ps->pj", attempt.slope, targets - attempt.x)
    step = step * jnp.minimum(1.0, largest / jnp.maximum(jnp.max(jnp.abs(step), axis=1, keepdims=True), 1e-12))
    return jnp.clip(attempt.q + step, 0.0, 1.0)


@jax.jit
def _mended(attempt: _Attempt, q: Array, x: Array) -> Array:
    return jax.vmap(_broyden)(attempt.slope, q - attempt.q, x - attempt.x)


def _broyden(
    slope: Float[Array, "joints space"], dq: Float[Array, " joints"], dx: Float[Array, " space"]
) -> Float[Array, "joints space"]:
    """Broyden's good update of an inverse Jacobian H: afterwards H dx = dq."""
    along = dq @ slope
    size = along @ dx
    # nothing is learned from a movement that led nowhere or against what the slope says
    safe = size > 1e-3 * jnp.linalg.norm(along) * jnp.linalg.norm(dx) + 1e-12
    update = jnp.outer(dq - slope @ dx, along) / jnp.where(safe, size, 1.0)
    return slope + jnp.where(safe, update, 0.0)
