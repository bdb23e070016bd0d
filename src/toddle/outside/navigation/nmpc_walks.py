"""The walker of `toddle walk` as a value that tasks in JAX steer: the predictive controller itself, every iteration.

On a processor the walkers of a whole ``vmap`` go to compiled active sets in one callback, shared by threads
(`walk.pattern.batch_native`); on an accelerator the batched interior point runs inside the jitted code
(`walk.pattern.batch`). A command passes the safety gate first, at each sample, as it does before the robot
(`walk.gate`). States are the same for both.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from toddle.failures import BadInput, unknown_name
from toddle.navigate.walks import Walks
from toddle.robots.gait import Gait
from toddle.robots.humanoid import Humanoid
from toddle.walk.gate import BACKWARDS
from toddle.walk.pattern.batch import BatchWalk, step_batch
from toddle.walk.pattern.batch_gate import gate
from toddle.walk.pattern.batch_native import Gated, Shares, at_once, start_native, step_gated
from toddle.walk.pattern.nmpc_problem import Nmpc
from toddle.walk.pattern.reduced import Reduced

Solver = Literal["native", "batch", "auto"]
SOLVERS = ("native", "batch", "auto")

_FEW = 16  # walkers in a thread's share, at least
_SHARES = 4  # of each thread: who is done early takes another
_TIPPED = 0.05  # balance is lost where a plan exceeds its soft rows by so much [m]


class Walker(NamedTuple):
    """One walker.

    Attributes:
        walk: the pattern, a batch of one without its leading axis.
        allowed: what the safety gate let through last: vx, vy [m/s], omega [rad/s].
    """

    walk: BatchWalk
    allowed: Float[Any, "*walkers 3"]


def nmpc_walks(robot: Humanoid | Gait, *, solver: Solver = "auto", hold: int = 4, threads: int | None = None) -> Walks:
    """The walker as tasks take it. It starts where its gait says, by default at the origin.

    Args:
        robot: whose gait it is.
        solver: "native" for processors, "batch" for accelerators, "auto" for what JAX runs on.
        hold: samples that one command lasts.
        threads: that share the walkers natively; None: one for each core.

    Raises:
        BadInput: an unknown solver, nothing to hold, no thread, or a gait whose step isn't whole samples.
    """
    gait = robot if isinstance(robot, Gait) else robot.gait
    threads = len(os.sched_getaffinity(0)) if threads is None else threads
    _check(gait, solver, hold, threads)
    problem = Reduced(gait).problem
    one = jax.tree.map(lambda part: part[0], start_native(problem, 1, np.float32))
    batched = solver == "batch" or (solver == "auto" and jax.default_backend() != "cpu")
    return Walks(
        name="gait" if isinstance(robot, Gait) else robot.name,
        fastest=(gait.fastest.vx, gait.fastest.vy, gait.fastest.omega),
        slowest=-BACKWARDS * gait.fastest.vx,
        seconds=hold * gait.sample,
        start=lambda: Walker(jax.tree.map(jnp.asarray, one), jnp.zeros(3, jnp.float32)),
        advance=partial(_in_jax, problem, hold) if batched else _native(problem, hold, threads),
        place=_place,
        velocity=_allowed,
        fallen=partial(_fallen, gait.com_height),
    )


def threaded(threads: int) -> Shares:
    """Threads that wait for walkers; one alone: none is started."""
    if threads == 1:
        return at_once
    pool = ThreadPoolExecutor(threads, "walkers")

    def shared(part: Callable[[int, int], None], walkers: int) -> None:
        size = max(-(-walkers // (_SHARES * threads)), _FEW)
        if walkers <= size:
            return part(0, walkers)
        list(pool.map(part, range(0, walkers, size), [*range(size, walkers, size), walkers]))
        return None

    return shared


def _native(problem: Nmpc, hold: int, threads: int) -> Callable[..., Walker]:
    """The next state by one callback for all walkers of the leading axes."""
    shares = threaded(threads)

    def step(state: Walker, asked: Any, circles: Any) -> Walker:
        given = jax.tree.map(np.asarray, (state, asked, circles))
        lead = given[1].ndim - 1
        count = given[1][..., 0].size
        (walk, allowed), wanted, around = jax.tree.map(lambda part: part.reshape(count, *part.shape[lead:]), given)
        found = step_gated(problem, Gated(walk, allowed), wanted, around, hold=hold, shares=shares)
        return jax.tree.map(lambda part, old: part.reshape(old.shape), Walker(*found), given[0])

    def advance(state: Walker, velocity: Float[Array, "3"], circles: Float[Array, "circles 3"]) -> Walker:
        shapes = jax.tree.map(lambda part: jax.ShapeDtypeStruct(part.shape, part.dtype), state)
        return jax.pure_callback(step, shapes, state, velocity, circles, vmap_method="broadcast_all")

    return advance


def _in_jax(
    problem: Nmpc, hold: int, state: Walker, velocity: Float[Array, "3"], circles: Float[Array, "circles 3"]
) -> Walker:
    """The next state by the interior point, for a batch of one; ``vmap`` makes it many."""
    gait = problem.gait
    around = None if len(circles) == 0 else circles[None]

    def step(_: Any, walker: Walker) -> Walker:
        allowed = gate(gait, walker.allowed, velocity, gait.sample)
        walk = step_batch(problem, jax.tree.map(lambda part: part[None], walker.walk), allowed[None], around)
        return Walker(jax.tree.map(lambda part, old: part[0].astype(old.dtype), walk, walker.walk), allowed)

    return jax.lax.fori_loop(0, hold, step, state)


def _place(walker: Walker) -> Float[Array, "3"]:
    """Where the centre of mass is [m], and the mean of the soles' yaws [rad]."""
    at = walker.walk.at
    return jnp.stack([at.com[0, 0], at.com[1, 0], (at.support[2] + at.lifted[2]) / 2])


def _allowed(walker: Walker) -> Float[Array, "3"]:
    return walker.allowed


def _fallen(leg: float, walker: Walker) -> Bool[Array, ""]:
    """Not finite, out of balance, or the centre of mass farther from the sole that carries than a leg is long [m]."""
    at = walker.walk.at
    away = jnp.hypot(at.com[0, 0] - at.support[0], at.com[1, 0] - at.support[1])
    finite = jnp.isfinite(at.com).all() & jnp.isfinite(at.support).all() & jnp.isfinite(at.lifted).all()
    return ~(finite & (away < leg) & (walker.walk.plan.violation < _TIPPED))


def _check(gait: Gait, solver: str, hold: int, threads: int) -> None:
    if solver not in SOLVERS:
        raise unknown_name("solver", solver, SOLVERS, where="nmpc_walks, solver")
    for name, count in (("hold", hold), ("threads", threads)):
        if count < 1:
            raise BadInput(f"{count} is too few", where=f"nmpc_walks, {name}", remedy="give at least 1")
    samples = gait.step_time / gait.sample
    if abs(samples - round(samples)) > 1e-6:
        raise BadInput(
            f"a step lasts {samples:g} samples",
            where="nmpc_walks, robot",
            remedy="give a gait whose step_time is a whole number of its sample, so that each command lasts alike",
        )
