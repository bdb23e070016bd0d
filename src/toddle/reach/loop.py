"""The learning loop: explore -> body -> learn, closed here and nowhere else.

What stays is a `Setting` (body, unit box, explorer, learner), what changes is `Progress`; both are pytrees of arrays.
On a body that is a JAX pytree a chunk of movements is one ``scan`` under one ``jit``, and families of runs (seeds,
cells of a study) go side by side by ``vmap``. On a plant (physics, a real robot, any callable) the same two halves of a
step are called around each movement (`toddle.reach.live`).
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from toddle.reach.evaluate.seen import Seen, coverage, draw_seen, nothing_seen, remember
from toddle.reach.explore.explorer import Explorer, Home, Noise, Proposal, State
from toddle.reach.learn.learner import Learner
from toddle.reach.unit_box import UnitBox
from toddle.robots.body import Body
from toddle.signals import Movement


class Setting(eqx.Module):
    """What stays while a skill is learned."""

    box: UnitBox
    home: Home
    explorer: Explorer
    learner: Learner


class Progress(NamedTuple):
    """What changes with each movement; saved and restored, learning goes on bit for bit."""

    explorer: State
    learner: State
    seen: Seen
    key: jax.Array


class Scores(NamedTuple):
    """One testing cycle: open-loop errors on both test sets, and how much of space was visited."""

    samples: Array
    fixed_error: Float[Array, "*batch"]
    seen_error: Float[Array, "*batch"]
    coverage: Float[Array, "*batch"]


def begin(setting: Setting, key: jax.Array) -> Progress:
    """Progress before the first movement: a learner that knows its home, an explorer that stands there."""
    key, first = jax.random.split(key)
    return Progress(
        setting.explorer.init(setting.home),
        setting.learner.init(first, setting.home.x, setting.home.q),
        nothing_seen(len(setting.home.q), len(setting.home.x)),
        key,
    )


def propose(setting: Setting, progress: Progress, noise: Noise) -> tuple[Progress, Proposal]:
    """The first half of a step: what to try, within the joint limits."""
    predict = lambda x: setting.learner.predict(progress.learner, x)  # noqa: E731
    state, proposal = setting.explorer.propose(progress.explorer, noise, predict, setting.home)
    return progress._replace(explorer=state), proposal


def absorb(
    setting: Setting, progress: Progress, proposal: Proposal, x: Float[Array, " space"]
) -> tuple[Progress, Movement]:
    """The second half: the tip was seen at x (unit box), and the learner learns from it."""
    state, weight = setting.explorer.observe(progress.explorer, proposal, x, setting.home)
    learned = setting.learner.update(progress.learner, x, proposal.q, weight)
    return progress._replace(explorer=state, learner=learned), Movement(proposal.q, x, proposal.goal, weight)


def advance(setting: Setting, body: Body, progress: Progress, count: int) -> tuple[Progress, Movement]:
    """Learn from `count` movements of a body; returns them too, with a leading axis."""
    key, for_noise, for_seen = jax.random.split(progress.key, 3)
    noise = setting.explorer.draw(for_noise, count, setting.home)

    def step(inner: tuple[State, State], drawn: Noise) -> tuple[tuple[State, State], Movement]:
        now = progress._replace(explorer=inner[0], learner=inner[1])
        now, proposal = propose(setting, now, drawn)
        x = setting.box.x_to_unit(body.forward(setting.box.q_from_unit(proposal.q)))
        now, movement = absorb(setting, now, proposal, x)
        return (now.explorer, now.learner), movement

    (explorer, learner), movements = jax.lax.scan(step, (progress.explorer, progress.learner), noise)
    return Progress(explorer, learner, remember(progress.seen, for_seen, movements.q, movements.x), key), movements


advance_jit = eqx.filter_jit(advance)


def answer(
    setting: Setting, progress: Progress, targets: Float[Array, "points space"]
) -> Float[Array, "points joints"]:
    """One-shot answers for targets [m]: joint values within their limits [rad or m]."""
    predict = jax.vmap(lambda x: setting.learner.answer(progress.learner, x))
    return setting.box.q_from_unit(jnp.clip(predict(setting.box.x_to_unit(targets)), 0.0, 1.0))


def open_loop_errors(
    setting: Setting, body: Body, progress: Progress, targets: Float[Array, "points space"]
) -> Float[Array, " points"]:
    """Distances between targets and where the one-shot answers bring the tip [m]."""
    reached = jax.vmap(body.forward)(answer(setting, progress, targets))
    return jnp.linalg.norm(reached - targets, axis=-1)


def score(
    setting: Setting,
    body: Body,
    progress: Progress,
    targets: Float[Array, "points space"],
    reachable_cells: Bool[Array, " cells"],
) -> Scores:
    """One testing cycle, as the thesis makes it after each 200 lines or 2,000 movements (sections 4.2, 4.4.1)."""
    # a key that depends on the progress alone: testing must not change what is learned
    key = jax.random.fold_in(progress.key, 1)
    seen = setting.box.x_from_unit(draw_seen(progress.seen, key, len(targets)))
    return Scores(
        progress.seen.total,
        jnp.mean(open_loop_errors(setting, body, progress, targets)),
        jnp.mean(open_loop_errors(setting, body, progress, seen)),
        coverage(progress.seen, reachable_cells),
    )


def learn_in_cycles(
    setting: Setting,
    body: Body,
    key: jax.Array,
    cycles: int,
    per_cycle: int,
    targets: Float[Array, "points space"],
    reachable_cells: Bool[Array, " cells"],
) -> tuple[Progress, Scores]:
    """A whole run in one programme: `cycles` times `per_cycle` movements, tested after each; made for ``vmap``."""

    def cycle(progress: Progress, _: None) -> tuple[Progress, Scores]:
        progress, _movements = advance(setting, body, progress, per_cycle)
        return progress, score(setting, body, progress, targets, reachable_cells)

    return jax.lax.scan(cycle, begin(setting, key), None, length=cycles)
