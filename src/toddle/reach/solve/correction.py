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

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.failures import BadInput

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

    Raises:
        BadInput: looks is negative.
    """
    if looks < 0:
        raise BadInput(f"{looks} looks", remedy="give 0 (open loop) or more")
    answer = lambda x: jnp.clip(predict(x), 0.0, 1.0)  # noqa: E731
    slope = jax.jacfwd(predict) if method == "newton" else lambda x: jnp.zeros((0, len(x)))
    q = jax.vmap(answer)(targets)
    x = observe(q)
    attempt = _Attempt(q, x, targets, jax.vmap(slope)(targets))
    edges = jnp.broadcast_to(scale, targets.shape)
    distance = jnp.linalg.norm((x - targets) * edges, axis=-1)
    best_q, errors = q, [distance]
    for _ in range(looks):
        if method == "newton":
            attempt = _newton(attempt, observe, targets, largest)
        else:
            attempt = _shift(attempt, observe, targets, answer)
        distance = jnp.linalg.norm((attempt.x - targets) * edges, axis=-1)
        best_q = jnp.where((distance < errors[-1])[:, None], attempt.q, best_q)
        errors.append(jnp.minimum(distance, errors[-1]))
    return Corrected(best_q, jnp.stack(errors))


def _shift(attempt: _Attempt, observe: Observe, targets: Array, answer: Predict) -> _Attempt:
    """One movement with the commanded target shifted by what was missed."""
    command = attempt.command + targets - attempt.x
    q = jax.vmap(answer)(command)
    return attempt._replace(q=q, x=observe(q), command=command)


def _newton(attempt: _Attempt, observe: Observe, targets: Array, largest: float) -> _Attempt:
    """One movement with the joints moved by the slope times what was missed; the slope learns from the outcome."""
    step = jnp.einsum("pjs,ps->pj", attempt.slope, targets - attempt.x)
    step = step * jnp.minimum(1.0, largest / jnp.maximum(jnp.max(jnp.abs(step), axis=1, keepdims=True), 1e-12))
    q = jnp.clip(attempt.q + step, 0.0, 1.0)
    x = observe(q)
    slope = jax.vmap(_broyden)(attempt.slope, q - attempt.q, x - attempt.x)
    return attempt._replace(q=q, x=x, slope=slope)


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
