"""The walker of `toddle walk` as a value that tasks in JAX steer: the predictive controller itself, every iteration.

On a processor the walkers of a whole ``vmap`` go to the active sets at once (`walk.pattern.batch_native`), through one
callback; on an accelerator the batched interior point runs inside the jitted code (`walk.pattern.batch`). A command
passes the safety gate first, at each sample, as it does before the robot (`walk.gate`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from toddle.failures import BadInput
from toddle.navigate.walks import Walks
from toddle.robots.gait import Gait
from toddle.robots.humanoid import Humanoid
from toddle.signals import Circle, Velocity
from toddle.walk.gate import BACKWARDS, gate
from toddle.walk.pattern.batch import BatchWalk, start_batch
from toddle.walk.pattern.batch_daqp import _many, _one
from toddle.walk.pattern.batch_state import single, stacked
from toddle.walk.pattern.reduced import Reduced, ReducedState

Solver = Literal["native", "batch", "auto"]


class Walker(NamedTuple):
    """One walker.

    Attributes:
        walk: the pattern, a batch of one without its leading axis.
        allowed: what the safety gate let through last: vx, vy [m/s], omega [rad/s].
    """

    walk: BatchWalk
    allowed: Float[Array, "3"]


def nmpc_walks(robot: Humanoid | Gait, *, solver: Solver = "auto", hold: int = 4, threads: int | None = None) -> Walks:
    """The walker as tasks take it.

    Args:
        robot: whose gait it is.
        solver: "native" for processors, "batch" for accelerators, "auto" for what JAX runs on.
        hold: samples that one command lasts.
        threads: that share the walkers natively; None: one for each core.

    Raises:
        BadInput: an unknown solver, or no sample to hold.
    """
    gait = robot if isinstance(robot, Gait) else robot.gait
    if hold < 1:
        raise BadInput(f"{hold} samples are no time", where="nmpc_walks, hold", remedy="give at least 1")
    pattern = Reduced(gait)
    one = jax.tree.map(lambda part: np.asarray(part[0]), start_batch(pattern.problem, 1))
    return Walks(
        name="gait" if isinstance(robot, Gait) else robot.name,
        fastest=(gait.fastest.vx, gait.fastest.vy, gait.fastest.omega),
        slowest=-BACKWARDS * gait.fastest.vx,
        seconds=hold * gait.sample,
        start=lambda: Walker(jax.tree.map(jnp.asarray, one), jnp.zeros(3)),
        advance=_called(partial(_each, pattern, hold)),
        place=_place,
        velocity=lambda walker: walker.allowed,
        fallen=partial(_fallen, gait.com_height),
    )


def _called(step: Callable[..., Walker]) -> Callable[..., Walker]:
    def advance(state: Walker, velocity: Float[Array, "3"], circles: Float[Array, "circles 3"]) -> Walker:
        shapes = jax.tree.map(lambda part: jax.ShapeDtypeStruct(part.shape, part.dtype), state)
        return jax.pure_callback(step, shapes, state, velocity, circles, vmap_method="broadcast_all")

    return advance


def _each(pattern: Reduced, hold: int, state: Walker, velocity: Any, circles: Any) -> Walker:
    """All walkers of the leading axes, one after the other."""
    state, velocity, circles = jax.tree.map(np.asarray, (state, velocity, circles))
    lead = velocity.shape[:-1]
    flat = jax.tree.map(lambda part: part.reshape(-1, *part.shape[len(lead) :]), (state, velocity, circles))
    (walks, allowed), asked, around = flat
    ends, passed = [], []
    for i in range(len(asked)):
        at, last = single(walks.at, i), _one(walks.plan, i) if walks.plan.known[i] else None
        at = at._replace(phase=_whole(at.phase), remaining=_whole(at.remaining))
        if last is not None:
            then = last.state
            then = then._replace(phase=_whole(then.phase), remaining=_whole(then.remaining))
            last = last._replace(state=then)
        one = ReducedState(at, last, _whole(float(walks.shift[i])))
        some = [Circle(*row) for row in around[i].astype(float).tolist() if row[2] >= 0]
        command = Velocity(*allowed[i].astype(float).tolist())
        for _ in range(hold):
            wanted = Velocity(*asked[i].astype(float).tolist())
            command = gate(command, wanted, pattern.gait.fastest, pattern.gait.sample)
            one, _ = pattern.step(one, command, some)
        ends.append(one)
        passed.append(command)
    plans = [end.plan for end in ends if end.plan is not None]
    found = _many(plans, stacked([plan.state for plan in plans]))
    new = Walker(
        BatchWalk(stacked([end.at for end in ends]), found, np.array([e.shift for e in ends])), np.array(passed)
    )
    return jax.tree.map(lambda part, old: np.asarray(part, old.dtype).reshape(old.shape), new, state)


def _whole(seconds: float) -> float:
    return round(1e6 * seconds) / 1e6


def _place(walker: Walker) -> Float[Array, "3"]:
    """Where the centre of mass is, and the mean of the soles' yaws."""
    at = walker.walk.at
    yaw = (at.support[..., 2] + at.lifted[..., 2]) / 2
    return jnp.concatenate([at.com[..., 0], yaw[..., None]], axis=-1)


def _fallen(leg: float, walker: Walker) -> Bool[Array, ""]:
    """Not finite, or the centre of mass farther from the sole that carries than a leg is long."""
    at = walker.walk.at
    away = jnp.linalg.norm(at.com[..., 0] - at.support[..., :2], axis=-1)
    finite = jnp.stack([jnp.isfinite(part).all() for part in (at.com, at.support, at.lifted)]).all()
    return ~finite | ~(away < leg)
