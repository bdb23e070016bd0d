"""The six lines: learn, solve, evaluate. What the command line does is written with these."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal, TypedDict, Unpack

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.failures import BadInput, unknown_name
from toddle.reach.config import ReachConfig
from toddle.reach.evaluate.figures import error_figures, errors_of, query_figures
from toddle.reach.evaluate.seen import Seen, draw_seen, kept
from toddle.reach.loop import Progress
from toddle.reach.methods import learner_named
from toddle.reach.observe import observer
from toddle.reach.session import Cycle, Pace, Session, cycles, open_session, start
from toddle.reach.skill import Skill
from toddle.reach.solve.query import query_of
from toddle.reach.unit_box import UnitBox
from toddle.robots.body import Body, Plant
from toddle.robots.catalogue import Choice, load, load_choice, record, settled

LOOKS = 3


class Options(TypedDict, total=False):
    """The keyword arguments of `learn`: the fields of `ReachConfig`."""

    method: str | None
    learner: str | None
    samples: int | None
    seed: int
    hidden: tuple[int, ...] | None
    learning_rate: float | None
    perturbation: float | None
    network: Literal["refined", "plain"]
    reading: Literal["tables", "literal"]
    per_cycle: int
    test_points: int | None
    test_spacing: float | None


def learn(
    robot: Body | Plant | str,
    *,
    on_cycle: Callable[[Cycle], None] | None = None,
    **options: Unpack[Options],
) -> Skill:
    """Let an arm learn its inverse kinematics from its own movements.

    Args:
        robot: a body, a plant that moves one movement at a time, or what `toddle.load` takes.
        on_cycle: called after each testing cycle with the run's state.
        **options: the fields of `ReachConfig`: method, samples, seed, hidden, ...

    Raises:
        BadInput: an option that there isn't, is out of range, or doesn't fit the robot.
    """
    known = ReachConfig.__dataclass_fields__
    for name in options:
        if name not in known:
            raise unknown_name("option", name, known, where="learn")
    body = load(robot) if isinstance(robot, str) else robot
    session = open_session(body, suited(ReachConfig(**options), body.name), hidden=hidden_of(body.name))
    cycle = start(session)
    pace = Pace(0)
    for latest in cycles(session, cycle):
        cycle = latest
        pace.tick(cycle.samples)
        if on_cycle is not None:
            on_cycle(cycle)
    source = settled(Choice(robot if isinstance(robot, str) else body.name))
    return skill_of(session, cycle, source, pace=pace)


def skill_of(session: Session, cycle: Cycle, source: Choice, *, pace: Pace) -> Skill:
    """The skill that a run has come to, evaluated.

    Args:
        session: the run.
        cycle: how far it came.
        source: what `toddle.load` makes the body from.
        pace: how quickly, for the figures.
    """
    progress, setting = cycle.progress, session.setting
    postures, seen = (values.astype(float) for values in kept(_seen(setting.box, progress, len(session.targets))[0]))
    errors = errors_of(lambda x: session.predict(progress, x), session.observe, session.targets)
    hidden = getattr(setting.learner, "hidden", ())
    skill = Skill(
        source, session.body.joints, np.asarray(session.body.home, float), session.config, hidden,
        setting.box, setting.learner, progress.learner, seen, postures, session.targets, errors, {},
    )  # fmt: skip
    figures = {
        "robot": session.body.name,
        "method": session.config.method,
        "learner": learner_named(session.config),
        "samples": cycle.samples,
        "seed": session.config.seed,
        **error_figures("fixed_error", errors),
        **error_figures("seen_error", seen_test(session, cycle)[1]),
        **error_figures("closed_loop_error", skill.reach_for(session.observe, session.targets, LOOKS)[1][-1]),
        "coverage_percent": 100 * float(cycle.history[-1].coverage) if cycle.history else 0.0,
        "test_points": len(session.targets),
        "test_spacing_mm": 1000 * session.spacing,
        "samples_per_second": pace.per_second,
        **query_figures(query_of(skill), skill.predict, skill.targets),
    }
    return replace(skill, figures=figures)


@eqx.filter_jit
def _seen(box: UnitBox, progress: Progress, count: int) -> tuple[Seen, Float[Array, "count space"]]:
    """The sample of what was seen in radians and metres, and the latest test targets drawn from it [m]."""
    q, x = box.q_from_unit(progress.seen.postures), box.x_from_unit(progress.seen.positions)
    physical = progress.seen._replace(postures=q, positions=x)
    return physical, draw_seen(physical, jax.random.fold_in(progress.key, 1), count)


def seen_test(session: Session, cycle: Cycle) -> tuple[Float[np.ndarray, "points space"], Float[np.ndarray, " points"]]:
    """The seen test set of a run's last cycle [m], and the open-loop error on each of its points [m]."""
    _, drawn = _seen(session.setting.box, cycle.progress, len(session.targets))
    targets = np.asarray(drawn, float)
    return targets, errors_of(lambda x: session.predict(cycle.progress, x), session.observe, targets)


def evaluate(
    skill: Skill, robot: Body | Plant | str | None = None, *, points: int = 1000, seed: int = 1
) -> dict[str, float]:
    """How well a skill reaches, on fresh targets that it has never seen.

    Args:
        skill: what was learned.
        robot: the body or plant that moves; None: the one that the skill was learned on, loaded again.
        points: how many targets, the tip's positions in postures drawn uniformly.
        seed: of the targets.

    Returns:
        Open-loop and closed-loop errors [mm]: mean, median, 99th percentile and maximum of each.

    Raises:
        BadInput: the robot isn't the one of the skill: other joints, or other limits; or no points are asked for.
    """
    if points < 1:
        raise BadInput(f"{points} points", where="evaluate", remedy="give at least 1")
    if robot is None or isinstance(robot, str):
        robot = load_choice(replace(skill.source, spec=robot or skill.source.spec))
    check_same_robot(skill, robot)
    observe = observer(robot)
    fraction = np.random.default_rng(seed).random((points, len(skill.joints)))
    targets = observe(np.asarray(skill.box.q_from_unit(jnp.asarray(fraction, jnp.float32))))
    return {
        **error_figures("open_loop_error", errors_of(skill.predict, observe, targets)),
        **error_figures("closed_loop_error", skill.reach_for(observe, targets, LOOKS)[1][-1]),
    }


def check_same_robot(skill: Skill, robot: Body | Plant) -> None:
    """Refuse a robot with other joints or limits than the skill's.

    Raises:
        BadInput: it is another robot.
    """
    low = np.asarray(skill.box.joint_lower)
    same = robot.joints == skill.joints and np.allclose(low, np.asarray(robot.lower), atol=1e-5)
    if not (same and np.allclose(low + np.asarray(skill.box.joint_span), np.asarray(robot.upper), atol=1e-5)):
        raise BadInput(
            f"its joints or their limits aren't those of the skill ({', '.join(skill.joints)})",
            where=robot.name,
            remedy="take the robot that the skill was learned on, or learn again",
        )


def hidden_of(spec: str) -> tuple[int, ...]:
    """The hidden layers that suit a robot of the catalogue; a middling size for any other."""
    known = record(spec)
    return known.hidden if known is not None else (40, 40)


def suited(config: ReachConfig, spec: str) -> ReachConfig:
    """The configuration with the test set of the robot's document, where there is one and none was asked for."""
    known = record(spec)
    if known is None or not known.test_points or config.test_points is not None:
        return config
    return replace(
        config, test_points=known.test_points, test_spacing=config.test_spacing or known.test_spacing or None
    )
