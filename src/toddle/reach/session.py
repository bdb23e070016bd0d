"""A run of the learning loop on one body: what is needed beside the loop, and the loop over testing cycles.

A `Session` holds what a configuration and a body determine (unit box, explorer, learner, test targets), so a run can be
taken up again from its configuration and its saved `Progress` alone, bit for bit.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput, ToddleError
from toddle.reach import live, loop
from toddle.reach.config import ReachConfig
from toddle.reach.evaluate.seen import cell_of, cells_per_axis
from toddle.reach.evaluate.targets import fixed_targets
from toddle.reach.explore.explorer import Home
from toddle.reach.methods import learner_named, make_explorer, make_learner, needs_equal_scales, with_method
from toddle.reach.observe import observer
from toddle.reach.unit_box import UnitBox, around, sample_reachable
from toddle.robots.body import Body, Plant

_SURVEY = 50_000  # postures that show a body's workspace; forward kinematics are cheap
_LEARNED, _REMEMBERED = 300_000, 20_000  # movements to learn from: the thesis's run, and what a memory is filled with
_TEST_POINTS = 110  # the size of the thesis's fixed set (section 4.2)
_LIVE_SURVEY = 1_000  # the same on a plant, where each is a movement


@dataclass(frozen=True)
class Session:
    """Everything about a run that doesn't change.

    Attributes:
        config: the run's configuration.
        body: the body or plant that moves.
        setting: the loop's constants.
        targets: the fixed test set [m].
        spacing: the least distance between two of its points [m].
        reachable_cells: which cells of space a survey could enter.
    """

    config: ReachConfig
    body: Body | Plant
    setting: loop.Setting
    targets: Float[np.ndarray, "points space"]
    spacing: float
    reachable_cells: jax.Array

    @property
    def samples(self) -> int:
        """How many movements the run is to learn from."""
        return self.config.samples or (_REMEMBERED if learner_named(self.config) == "recall" else _LEARNED)

    def observe(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space"]:
        """Where joint values [rad or m] bring the tip [m]; on a plant, by moving there."""
        return observer(self.body)(q)

    def predict(
        self, progress: loop.Progress, targets: Float[np.ndarray, "batch space"]
    ) -> Float[np.ndarray, "batch joints"]:
        """One-shot answers for targets [m], within the joint limits [rad or m]."""
        return np.asarray(_answer(self.setting, progress, jnp.asarray(targets, jnp.float32)))


_answer = eqx.filter_jit(loop.answer)
_score = eqx.filter_jit(loop.score)


def open_session(
    body: Body | Plant,
    config: ReachConfig,
    *,
    hidden: tuple[int, ...] = (40, 40),
    survey: Body | None = None,
) -> Session:
    """Prepare a run.

    Args:
        body: the body or plant that will move.
        config: what to run; where it names no method, the one that suits the body is taken.
        hidden: hidden layers that suit the robot, for where the configuration names none.
        survey: the kinematics of a plant, where known: its workspace is then surveyed without a movement.

    Raises:
        BadInput: the configuration doesn't fit the body.
    """
    surveyed = survey if survey is not None else body
    positions = _survey(surveyed, config.seed)
    config = with_method(config, len(body.joints), positions.shape[1])
    lower, upper = np.asarray(body.lower), np.asarray(body.upper)
    box = around(lower, upper, positions, isotropic=needs_equal_scales(config))
    home_x = observer(surveyed)(np.asarray(body.home)[None])[0]
    home, reachable_cells = _placed(box, *(jnp.asarray(a, jnp.float32) for a in (body.home, home_x, positions)))
    setting = loop.Setting(box, home, make_explorer(config, box), make_learner(config, box, hidden))
    targets, spacing = fixed_targets(positions, config.test_points or _TEST_POINTS, config.test_spacing)
    return Session(config, body, setting, targets, spacing, reachable_cells)


@eqx.filter_jit
def _placed(box: UnitBox, q: jax.Array, x: jax.Array, positions: jax.Array) -> tuple[Home, jax.Array]:
    """Home in the unit box, and which cells of space the survey entered."""
    cells = cells_per_axis(len(x)) ** len(x)
    entered = jnp.zeros(cells, bool).at[cell_of(box.x_to_unit(positions))].set(True)
    return Home(box.q_to_unit(q), box.x_to_unit(x)), entered


def _survey(body: Body | Plant, seed: int) -> Float[np.ndarray, "samples space"]:
    """Positions that the tip can take, from a stream of their own that learning never sees."""
    key = jax.random.fold_in(jax.random.key(seed), 0x7E57)
    if isinstance(body, Body):
        positions = np.asarray(sample_reachable(body, key, _SURVEY)[1], float)
    else:
        fraction = np.asarray(jax.random.uniform(key, (_LIVE_SURVEY, len(body.joints))), float)
        lower, upper = np.asarray(body.lower), np.asarray(body.upper)
        positions = np.stack([body.move(q) for q in lower + fraction * (upper - lower)])
    if positions.shape[1] not in (2, 3):
        raise BadInput(f"its tip has {positions.shape[1]} coordinates", where=body.name, remedy="it takes 2 or 3")
    if not np.all(np.isfinite(positions)):
        raise BadInput("its tip is not at a finite position", where=body.name, remedy="check its description")
    return positions


@dataclass(frozen=True)
class Cycle:
    """The state of a run after a testing cycle: progress and all scores so far."""

    progress: loop.Progress
    history: tuple[loop.Scores, ...]

    @property
    def samples(self) -> int:
        """Movements learned from so far."""
        return int(self.progress.seen.total)


def start(session: Session) -> Cycle:
    """A run before its first movement."""
    progress = eqx.filter_jit(loop.begin)(session.setting, jax.random.key(session.config.seed))
    return Cycle(progress, ())


def cycles(session: Session, cycle: Cycle) -> Iterator[Cycle]:
    """Learn on, a testing cycle at a time, until the configured number of movements is made.

    Every yielded cycle can be saved and taken up again; the rest of the run is then the same bit for bit.

    Raises:
        ToddleError: learning diverged (a number is no longer finite).
    """
    while cycle.samples < session.samples:
        count = min(session.config.per_cycle, session.samples - cycle.samples)
        if isinstance(session.body, Body):
            progress, _ = loop.advance_jit(session.setting, session.body, cycle.progress, count)
            targets = jnp.asarray(session.targets, jnp.float32)
            scores = _score(session.setting, session.body, progress, targets, session.reachable_cells)
        else:
            progress = live.advance(session.setting, session.body, cycle.progress, count)
            scores = live.score(session, progress)
        if not np.isfinite(scores.fixed_error):
            raise ToddleError(
                f"learning diverged after {int(progress.seen.total)} movements",
                remedy="lower --learning-rate or --perturbation",
            )
        cycle = Cycle(progress, (*cycle.history, jax.tree.map(np.asarray, scores)))
        yield cycle


class Pace:
    """How many movements a second are learned from, once everything is compiled: from the first cycle on."""

    def __init__(self, samples: int) -> None:
        self._start = self._first = self._last = (samples, time.perf_counter())
        self._cycles = 0

    def tick(self, samples: int) -> None:
        """A cycle has ended after so many movements."""
        self._last = (samples, time.perf_counter())
        self._cycles += 1
        if self._cycles == 1:
            self._first = self._last

    @property
    def per_second(self) -> float:
        """Movements a second; with a single cycle, compiling included."""
        (before, began), (after, ended) = self._first if self._cycles > 1 else self._start, self._last
        return (after - before) / max(ended - began, 1e-9)
