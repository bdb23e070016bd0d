"""The six lines: learn, solve, evaluate. What the command line does is written with these.

Two families of skills stand behind them: a body that was learned and is solved (`toddle.reach.body_skill`), and an
inverse that was learned online, by babbling (`toddle.reach.skill`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal, TypedDict, Unpack

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.failures import BadInput, unknown_name
from toddle.reach.body_config import BodyConfig
from toddle.reach.body_run import fresh_figures, learn_body
from toddle.reach.body_skill import BodySkill, solve_body
from toddle.reach.config import ReachConfig
from toddle.reach.evaluate.figures import error_figures, errors_of, query_figures
from toddle.reach.evaluate.seen import Seen, draw_seen, kept
from toddle.reach.loop import Progress
from toddle.reach.methods import learner_named
from toddle.reach.observe import observer
from toddle.reach.session import Cycle, Pace, Session, cycles, open_session, start
from toddle.reach.skill import Skill, solve_inverse
from toddle.reach.solve.query import query_of
from toddle.reach.structures import STRUCTURES
from toddle.reach.unit_box import UnitBox
from toddle.robots.body import Body, Plant
from toddle.robots.catalogue import Choice, load, load_choice, record, settled
from toddle.signals import Solution

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
    noise: float | None
    angle_noise: float
    look_noise: float
    pose: bool


_OF_BABBLING = ("learner", "hidden", "learning_rate", "perturbation", "network", "reading", "per_cycle", "test_spacing")
_OF_A_BODY = ("noise", "angle_noise", "look_noise", "pose")


def learn(
    robot: Body | Plant | str,
    *,
    on_cycle: Callable[[Cycle], None] | None = None,
    **options: Unpack[Options],
) -> Skill | BodySkill:
    """Let an arm learn to reach from its own movements.

    It learns its body, which is then solved for targets, with what structure suits it; or, where a method is named
    that babbles (`toddle.reach.methods.METHODS`) or an option that only those have, the inverse itself.

    Args:
        robot: a body, a plant that moves one movement at a time, or what `toddle.load` takes.
        on_cycle: called after each testing cycle of babbling with the run's state.
        **options: the fields of `BodyConfig` (``samples`` for its ``movements``), or those of `ReachConfig`.

    Raises:
        BadInput: an option that there isn't, is out of range, or doesn't fit the robot or the method.
    """
    for name in options:
        if name not in Options.__annotations__:
            raise unknown_name("option", name, Options.__annotations__, where="learn")
    body = load(robot) if isinstance(robot, str) else robot
    source = settled(Choice(robot if isinstance(robot, str) else body.name))
    method = options.get("method")
    babbles = method not in STRUCTURES if method is not None else any(name in options for name in _OF_BABBLING)
    for name in _OF_A_BODY if babbles else _OF_BABBLING:
        if name in options:
            family = "babbling" if babbles else "learning the body"
            raise BadInput(f"{family} has no {name}", where="learn", remedy="leave it out")
    if not babbles:
        return learn_body(body, _body_config(options), source)
    given: dict[str, Any] = dict(options)
    session = open_session(body, suited(ReachConfig(**given), body.name), hidden=hidden_of(body.name))
    cycle = start(session)
    pace = Pace(0)
    for latest in cycles(session, cycle):
        cycle = latest
        pace.tick(cycle.samples)
        if on_cycle is not None:
            on_cycle(cycle)
    return skill_of(session, cycle, source, pace=pace)


def solve(
    skill: Skill | BodySkill,
    target: Sequence[float] | Float[np.ndarray, " space"],
    *,
    orientation: Sequence[float] | None = None,
    near: Sequence[float] | Float[np.ndarray, " joints"] | None = None,
    choice: Literal["first", "nearest", "central"] | None = None,
    robot: Body | Plant | None = None,
    looks: int = 3,
    tolerance: float | None = None,
) -> Solution:
    """Joint values that bring the tip to a target.

    Args:
        skill: what was learned.
        target: where the tip should go, in the base frame [m].
        orientation: how it should be turned, a unit quaternion (w, x, y, z); None: as it comes.
        near: the present posture [rad or m].
        choice: of several postures: the first found, the one nearest to ``near`` (which is what is taken when that is
            given), or the most central one.
        robot: the body or plant that tries the answer, so that it can be corrected by looking where the tip went;
            None: open loop, one shot.
        looks: how often it may be corrected.
        tolerance: the error up to which a target counts as reached [m]; None: 5 mm where somebody looks, twice the
            skill's typical error where nobody does, but at most 5 cm.

    Returns:
        An answer within the joint limits, with the error to expect and a verdict. For a target out of reach it is
        the answer for the nearest position within reach.

    Raises:
        BadInput: the target, the orientation, the posture, looks or tolerance can't be used, or the skill learned by
            babbling and knows no orientations and no choice of postures.
    """
    if looks < 1:
        raise BadInput(f"{looks} looks", where="looks", remedy="give at least 1, or no robot for open loop")
    if tolerance is not None and not 0 < tolerance < float("inf"):
        raise BadInput(f"{tolerance} is out of range", where="tolerance", remedy="give a distance above 0 [m]")
    if isinstance(skill, BodySkill):
        return solve_body(
            skill, target, orientation=orientation, near=near, choice=choice, robot=robot, looks=looks,
            tolerance=tolerance,
        )  # fmt: skip
    for name, given in (("orientation", orientation), ("near", near), ("choice", choice)):
        if given is not None:
            raise BadInput("a skill that learned by babbling has none", where=name, remedy="leave it out")
    return solve_inverse(skill, target, robot=robot, looks=looks, tolerance=tolerance)


def _body_config(options: Options) -> BodyConfig:
    given: dict[str, Any] = {"movements" if name == "samples" else name: value for name, value in options.items()}
    kept: dict[str, Any] = {name: value for name, value in given.items() if value is not None or name == "noise"}
    return BodyConfig(**kept)


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
    skill: Skill | BodySkill, robot: Body | Plant | str | None = None, *, points: int = 1000, seed: int = 1
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
    if isinstance(skill, BodySkill):
        return fresh_figures(skill, robot, points, seed)
    observe = observer(robot)
    fraction = np.random.default_rng(seed).random((points, len(skill.joints)))
    targets = observe(np.asarray(skill.box.q_from_unit(jnp.asarray(fraction, jnp.float32))))
    return {
        **error_figures("open_loop_error", errors_of(skill.predict, observe, targets)),
        **error_figures("closed_loop_error", skill.reach_for(observe, targets, LOOKS)[1][-1]),
    }


def check_same_robot(skill: Skill | BodySkill, robot: Body | Plant) -> None:
    """Refuse a robot with other joints or limits than the skill's.

    Raises:
        BadInput: it is another robot.
    """
    if isinstance(skill, BodySkill):
        low, high = skill.lower, skill.upper
    else:
        low = np.asarray(skill.box.joint_lower)
        high = low + np.asarray(skill.box.joint_span)
    same = robot.joints == skill.joints and np.allclose(low, np.asarray(robot.lower), atol=1e-5)
    if not (same and np.allclose(high, np.asarray(robot.upper), atol=1e-5)):
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
