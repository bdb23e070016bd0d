"""The learning loop on what can't sit inside ``jit``: one movement at a time, around the same two halves of a step.

Explorers, learners and scores are those of `toddle.reach.loop`; only the body is called from Python.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from toddle.reach import loop
from toddle.reach.evaluate.seen import coverage, draw_seen, remember
from toddle.robots.body import Plant

if TYPE_CHECKING:
    from toddle.reach.session import Session


@eqx.filter_jit
def _propose(
    setting: loop.Setting, progress: loop.Progress, noise: loop.Noise, index: jax.Array
) -> tuple[loop.Progress, loop.Proposal]:
    return loop.propose(setting, progress, jax.tree.map(lambda leaf: leaf[index], noise))


_absorb = eqx.filter_jit(loop.absorb)
_remember = jax.jit(remember)


def advance(setting: loop.Setting, plant: Plant, progress: loop.Progress, count: int) -> loop.Progress:
    """Learn from `count` movements of a plant."""
    key, for_noise, for_seen = jax.random.split(progress.key, 3)
    noise = setting.explorer.draw(for_noise, count, setting.home)
    movements = []
    for i in range(count):
        progress, proposal = _propose(setting, progress, noise, jnp.int32(i))
        x = plant.move(np.asarray(setting.box.q_from_unit(proposal.q), float))
        unit = setting.box.x_to_unit(jnp.asarray(x, jnp.float32))
        progress, movement = _absorb(setting, progress, proposal, unit)
        movements.append(movement)
    q, x = (jnp.asarray(np.stack([getattr(movement, name) for movement in movements])) for name in ("q", "x"))
    return progress._replace(seen=_remember(progress.seen, for_seen, q, x), key=key)


def score(session: Session, progress: loop.Progress) -> loop.Scores:
    """One testing cycle, by moving to every test target."""
    key = jax.random.fold_in(progress.key, 1)
    box = session.setting.box
    seen = np.asarray(box.x_from_unit(draw_seen(progress.seen, key, len(session.targets))))
    return loop.Scores(
        progress.seen.total,
        jnp.float32(_mean_error(session, progress, session.targets)),
        jnp.float32(_mean_error(session, progress, seen)),
        coverage(progress.seen, session.reachable_cells),
    )


def _mean_error(session: Session, progress: loop.Progress, targets: Float[np.ndarray, "points space"]) -> float:
    reached = session.observe(session.predict(progress, targets))
    return float(np.linalg.norm(reached - targets, axis=1).mean())
