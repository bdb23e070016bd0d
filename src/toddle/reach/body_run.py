"""A run that learns the body: make movements, fit a structure to them, test on targets that nobody has seen."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from toddle.reach.body_config import BodyConfig
from toddle.reach.body_skill import BodySkill
from toddle.reach.evaluate.body_figures import figures_of
from toddle.reach.evaluate.targets import fixed_targets
from toddle.reach.explore.isolating import isolating_movements
from toddle.reach.explore.outward import outward_movements
from toddle.reach.gather import Sight, gather, postures, truth
from toddle.reach.structures import Known, fit_body, structure_named, suited
from toddle.robots.body import Body, Plant
from toddle.robots.catalogue import Choice, record
from toddle.signals import Experience

_SURVEY, _MOVEMENTS = 3, 4  # streams: of the postures that test targets come from, of movements
_TEST_POINTS = 110  # the size of the thesis's fixed set (Mahboob 2015, section 4.2)
_SURVEYED = 4_000


@dataclass(frozen=True)
class Plan:
    """What a run is going to do.

    Attributes:
        config: the run's configuration, its method and number of movements settled where one is known.
        names: the structures to try.
        why: why these.
        known: what is known of the body.
        q: the movements to make [rad or m].
    """

    config: BodyConfig
    names: tuple[str, ...]
    why: str
    known: Known
    q: Float[np.ndarray, "movements joints"]

    @property
    def sight(self) -> Sight:
        """How the tip is seen."""
        return Sight(self.config.noise or 0.0, self.config.angle_noise, self.config.pose)


def plan(body: Body | Plant, config: BodyConfig, *, like: Body | None = None, made: Experience | None = None) -> Plan:
    """Settle what a run will do.

    Args:
        body: what moves.
        config: what was asked for.
        like: what a plant is known to be built like, where that is known.
        made: movements of a run that was at its end and is to be made longer.

    Raises:
        BadInput: there is no such method.
    """
    names, why = suited(like if like is not None else body)
    if config.method is not None:
        names, why = (structure_named(config.method).name,), "as asked for"
    lower, upper, home = (np.asarray(values, float) for values in (body.lower, body.upper, body.home))
    first = structure_named(names[0])
    count = config.movements or (first.movements if len(names) == 1 else structure_named("curvature").movements)
    if not first.designed:
        q = postures(lower, upper, count, config.seed)
    elif made is None:
        designed = isolating_movements(lower, upper, home)[:count]
        q = np.concatenate([designed, _outward(lower, upper, count - len(designed), config.seed, 0)])
    else:
        q = np.concatenate([made.q, _outward(lower, upper, count - len(made.q), config.seed, len(made.q))])
    settled = replace(config, method=names[0] if len(names) == 1 else None, movements=count)
    return Plan(settled, names, why, Known(tuple(body.joints), lower, upper, home), q)


def learn_body(
    robot: Body | Plant,
    config: BodyConfig,
    source: Choice,
    *,
    like: Body | None = None,
    tell: Callable[[str], None] = lambda _: None,
    experience: Experience | None = None,
) -> BodySkill:
    """Let an arm learn its own body from its movements, and test what it learned.

    Args:
        robot: what moves.
        config: what was asked for.
        source: what `toddle.load` makes the body from.
        like: what a plant is known to be built like, where that is known; its answers are then tested on that.
        tell: called with what is found on the way.
        experience: movements that were made already; None: they are made now.

    Raises:
        BadInput: the configuration doesn't fit the body, or its movements can't be learned from.
    """
    begun = time.perf_counter()
    to_do = plan(robot, config, like=like)
    if experience is None:
        experience = gather(robot, to_do.q, to_do.sight, config.seed)
    skill = skill_from(experience, to_do, source, tell)
    return tested(skill, robot, like, time.perf_counter() - begun)


def skill_from(
    experience: Experience, to_do: Plan, source: Choice, tell: Callable[[str], None] = lambda _: None
) -> BodySkill:
    """The skill that movements lead to, not yet tested."""
    known = to_do.known
    fit, sound = fit_body(experience, known, to_do.names, to_do.config.seed, tell)
    space = experience.x.shape[1]
    return BodySkill(
        source, known.joints, known.lower, known.upper, known.home, replace(to_do.config, method=fit.kind),
        to_do.why, fit, sound, experience, np.empty((0, space)), np.empty(0), {},
    )  # fmt: skip


def tested(skill: BodySkill, robot: Body | Plant, like: Body | None, seconds: float) -> BodySkill:
    """The skill with its fixed test set and its figures.

    Args:
        skill: what was learned.
        robot: what moves.
        like: the body whose kinematics a plant has, where known: it gives the targets.
        seconds: how long learning took.
    """
    config, begun = skill.config, time.perf_counter()
    judge = robot if isinstance(robot, Body) else like
    q = np.random.default_rng([config.seed, _SURVEY]).uniform(
        skill.lower, skill.upper, (max(config.test_points, _SURVEYED), len(skill.joints))
    )
    if judge is None:
        positions = gather(robot, q[: min(config.test_points, _TEST_POINTS)], Sight(), config.seed).x
        turns = None
    else:
        positions, turns = truth(judge, q, turned=skill.turned)
    known = record(skill.source.spec)
    count = known.test_points if known is not None and known.test_points else _TEST_POINTS
    fixed, _ = fixed_targets(positions, min(count, len(positions)), known.test_spacing or None if known else None)
    skill = replace(skill, targets=fixed)
    errors, figures = figures_of(skill, robot, judge, positions[: config.test_points], _first(turns, config))
    seconds += time.perf_counter() - begun
    return replace(skill, errors=errors, figures={**figures, "total_seconds": seconds})


def fresh_figures(skill: BodySkill, robot: Body | Plant, points: int, seed: int) -> dict[str, float]:
    """How well a learned body reaches for fresh targets, open loop and after looks; see `toddle.evaluate`."""
    draw = np.random.default_rng([seed, _SURVEY, 1])
    q = draw.uniform(skill.lower, skill.upper, (points, len(skill.joints)))
    seen = gather(robot, q, Sight(turned=skill.turned), seed)
    _, figures = figures_of(replace(skill, targets=seen.x[:_TEST_POINTS]), robot, None, seen.x, seen.turn)
    return {name: value for name, value in figures.items() if isinstance(value, float)}


def _first(turns: np.ndarray | None, config: BodyConfig) -> np.ndarray | None:
    return None if turns is None else turns[: config.test_points]


def _outward(
    lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"], count: int, seed: int, first: int
) -> Float[np.ndarray, "count joints"]:
    return outward_movements(lower, upper, count, np.random.default_rng([seed, _MOVEMENTS, first]))
