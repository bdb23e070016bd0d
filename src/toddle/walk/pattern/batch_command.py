"""What a command asks of one walker of many: `displacement`, `feasible` and the last plan, in array operations.

Each function bears the name of the one that does the same for a single walker.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from toddle.robots.gait import Gait
from toddle.walk.pattern.batch_state import BatchPlan, BatchState
from toddle.walk.pattern.feasible import landing_hull

_HALVINGS = 10
_BISECTIONS = 22  # as fine as single precision tells


def rounding(dtype: jnp.dtype) -> float:
    """Lengths [m], angles [rad] and times [s] that differ by less are the same."""
    return 1e-9 if dtype == jnp.float64 else 1e-5


def sign_of(side: Int[Array, ""], dtype: jnp.dtype) -> Float[Array, ""]:
    """1 where the left foot stands, -1 where the right one does."""
    return (1 - 2 * side).astype(dtype)


def rotate(yaw: Float[Array, ""], x: Float[Array, ""], y: Float[Array, ""]) -> Float[Array, "2"]:
    """The vector, turned left by yaw [rad]."""
    cos, sin = jnp.cos(yaw), jnp.sin(yaw)
    return jnp.stack([cos * x - sin * y, sin * x + cos * y])


def displacement(
    apart: Float[Array, ""], gait: Gait, velocity: Float[Array, "3"], sign: Float[Array, ""], yaw: Float[Array, ""]
) -> Float[Array, "2"]:
    """From the stance foot to the next one [m]."""
    half = -(apart + jnp.abs(velocity[1]) * gait.step_time) / 2 * sign
    turn, none = velocity[2] * gait.step_time, jnp.zeros_like(half)
    ahead = rotate(yaw + turn / 2, velocity[0] * gait.step_time, velocity[1] * gait.step_time)
    return rotate(yaw, none, half) + ahead + rotate(yaw + turn, none, half)


def turned(gait: Gait, yaw: Float[Array, ""], velocity: Float[Array, "3"]) -> Float[Array, " soles"]:
    """Yaws by the command: of the support foot and of the landings to come [rad]."""
    turn = jnp.clip(velocity[2] * gait.step_time, -gait.longest_turn, gait.longest_turn)
    return yaw + turn * jnp.arange(gait.steps + 1).astype(yaw.dtype)


def drawn_to(
    gait: Gait, sign: Float[Array, ""], yaw: Float[Array, ""], velocity: Float[Array, "3"]
) -> Float[Array, "steps 2"]:
    """Displacements by the command, each from the foot before [m]."""
    wide, _ = widening(gait, velocity)
    turn = velocity[2] * gait.step_time
    return jnp.stack(
        [
            displacement(gait.foot_distance + wide, gait, velocity, sign * (-1.0) ** k, yaw + k * turn)
            for k in range(gait.steps)
        ]
    )


def widening(gait: Gait, velocity: Float[Array, "3"]) -> tuple[Float[Array, ""], Bool[Array, ""]]:
    """What the foot distance has to grow by so that both displacements lie in the hull [m]; and whether that helps."""
    dtype = velocity.dtype
    small, rows = rounding(dtype), jnp.asarray(landing_hull(gait).rows, dtype)
    turn = velocity[2] * gait.step_time
    cos, sin = jnp.cos(turn), jnp.sin(turn)
    apart = gait.foot_width / 2 * (1 + cos) + (gait.foot_length / 2 + abs(gait.foot_ahead)) * jnp.abs(sin)
    least, most = jnp.zeros((), dtype), jnp.full((), jnp.inf, dtype)
    for sign in (1.0, -1.0):
        place = displacement(
            jnp.asarray(gait.foot_distance, dtype), gait, velocity, jnp.asarray(sign, dtype), jnp.zeros((), dtype)
        ) * jnp.array([1.0, -sign], dtype)
        way = jnp.stack([sign * sin, 1 + cos]) / 2
        beside = jnp.where(jnp.abs(place[0]) < gait.foot_length, apart, 0.0)
        slope = jnp.concatenate([_dot(rows[:, :2], way), -way[1:]])
        room = jnp.concatenate([rows[:, 2] - _dot(rows[:, :2], place), (place[1] - beside)[None]])
        flat = jnp.abs(slope) < small * 1e-3
        bound = room / jnp.where(flat, 1.0, slope)
        least = jnp.maximum(least, jnp.where(~flat & (slope < 0), bound, -jnp.inf).max())
        most = jnp.minimum(most, jnp.where(~flat & (slope > 0), bound, jnp.inf).min())
        most = jnp.where((flat & (room < -small)).any(), -jnp.inf, most)
    fits = (least <= most + small) & (jnp.abs(turn) <= gait.longest_turn + small)
    return jnp.where(fits, least, 0.0), fits


def _dot(rows: Float[Array, "rows 2"], vector: Float[Array, "2"]) -> Float[Array, " rows"]:
    return rows[:, 0] * vector[0] + rows[:, 1] * vector[1]


def cap(gait: Gait, velocity: Float[Array, "3"]) -> Float[Array, "3"]:
    """The command itself if it fits; else the fastest that fits with the same curve; not finite: none."""
    velocity = jnp.where(jnp.isfinite(velocity).all(), velocity, 0.0)

    def fits(share: Float[Array, ""]) -> Bool[Array, ""]:
        return widening(gait, share * velocity)[1]

    def halve(_: Any, share: Float[Array, ""]) -> Float[Array, ""]:
        return jnp.where(fits(share), share, share / 2)

    def narrow(_: Any, between: tuple[Array, Array]) -> tuple[Array, Array]:
        inside, outside = between
        middle = (inside + outside) / 2
        good = fits(middle)
        return jnp.where(good, middle, inside), jnp.where(good, outside, middle)

    whole = jnp.ones((), velocity.dtype)
    half = jax.lax.fori_loop(0, _HALVINGS, halve, whole)
    inside = jnp.where(fits(half), half, 0.0)
    inside, _ = jax.lax.fori_loop(0, _BISECTIONS, narrow, (inside, jnp.minimum(2 * half, 1.0)))
    return jnp.where(fits(whole), 1.0, inside) * velocity


def nominal(gait: Gait, state: BatchState, velocity: Float[Array, "3"]) -> BatchPlan:
    """The plan that follows from the command alone: no jerk."""
    dtype = state.com.dtype
    drawn = drawn_to(gait, sign_of(state.side, dtype), state.support[2], velocity)
    places = state.support[None, :2] + jnp.cumsum(drawn, axis=0)
    feet = jnp.concatenate([places, turned(gait, state.support[2], velocity)[1:, None]], axis=1)
    zmp = jnp.broadcast_to(state.support[:2], (gait.preview, 2))
    nothing, no = jnp.zeros((), dtype), jnp.zeros((), bool)
    jerks = jnp.zeros((2, gait.preview), dtype)
    return BatchPlan(feet, drawn, jerks, zmp, jnp.zeros((), jnp.int32), no, nothing, nothing, no, state)


def shifted(gait: Gait, last: BatchPlan, state: BatchState, velocity: Float[Array, "3"]) -> BatchPlan:
    """The last plan, seen from now: a landing that has been is dropped, and one more is added by the command."""
    before, dtype = last.state, state.com.dtype
    switched = state.side != before.side
    elapsed = jnp.where(switched, before.remaining + state.phase, state.phase - before.phase)
    late = jnp.clip(jnp.round(elapsed / gait.sample), 0, gait.preview).astype(jnp.int32)
    at = jnp.arange(gait.preview, dtype=jnp.int32) + late
    inside = jnp.minimum(at, gait.preview - 1)
    jerks = jnp.where((at < gait.preview)[None], last.jerks[:, inside], 0.0)
    yaw, side = last.feet[-1, 2], (before.side + gait.steps) % 2
    wide, _ = widening(gait, velocity)
    step = displacement(gait.foot_distance + wide, gait, velocity, sign_of(side, dtype), yaw)
    added = jnp.concatenate([last.feet[-1, :2] + step, turned(gait, yaw, velocity)[1:2]])
    feet = jnp.where(switched, jnp.concatenate([last.feet[1:], added[None]]), last.feet)
    moved = jnp.where(switched, jnp.concatenate([last.displacement[1:], step[None]]), last.displacement)
    return last._replace(feet=feet, displacement=moved, jerks=jerks, zmp=last.zmp[inside], state=state)
