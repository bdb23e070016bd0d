"""A learned body at work while its own body changes: it notices by its errors, says so, and adapts as it goes on.

Each movement reaches for a target. `toddle.reach.model.damage_watch` judges what was seen; from the first suspicion on,
`toddle.reach.model.damage_repair` looks for what explains the movements since, and the solver goes on with the body as
it is now. A suspicion that the next movements don't bear out is dropped, and the body is taken as it was.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.body_skill import BodySkill
from toddle.reach.gather import together, truth
from toddle.reach.model.damage_repair import Repair, repair
from toddle.reach.model.damage_watch import Alarm, Level, Watch, look
from toddle.reach.model.model import Model
from toddle.reach.model.rigid import Rigid
from toddle.reach.solve.solver import Solver, solver_of
from toddle.robots.body import Body
from toddle.robots.chain import Chain
from toddle.robots.damage import Damage, parse_damage
from toddle.robots.damaged import DamagedPlant
from toddle.robots.linkage import poses
from toddle.signals import Experience

_AFTER = 60  # movements made after the last damage
_LOOKED_BACK = 30  # movements that a repair is fitted to at most
_TARGETS = 5  # stream of randomness
_TRIES = 5  # targets drawn for each movement, of which the first is taken that is solved
_LEAST_NOISE = 1e-5  # [m]


@dataclass(frozen=True)
class Work:
    """What happens while a body works.

    Attributes:
        damages: what breaks, and when.
        movements: how many are made, those of learning included.
        links: the joint that carries each link, by the link's name.
    """

    damages: tuple[Damage, ...]
    movements: int
    links: Mapping[str, str]


@dataclass(frozen=True)
class Step:
    """One movement at work.

    Attributes:
        movement: its number, those of learning included.
        target: where the tip was to go [m]; NaN where it wasn't to reach, but to learn what happened.
        error: how far from there it truly came to be [m].
        alarm: what the watch made of it.
        news: what was noticed or understood; empty: nothing new.
    """

    movement: int
    target: Float[np.ndarray, " space"]
    error: float
    alarm: Alarm
    news: str


@runtime_checkable
class Adaptation(Protocol):
    """A body's picture of itself while it works: it is shown every movement, and may change its mind."""

    model: Model
    solver: Solver

    def wants(self) -> Float[np.ndarray, " joints"] | None:
        """A movement that it wants to make to learn what happened [rad or m]; None: reach on."""
        ...

    def show(self, q: np.ndarray, x: np.ndarray) -> tuple[Alarm, str]:
        """One more movement: what it says of the body, and what is new; empty: nothing."""
        ...


def work_plan(texts: Sequence[str], body: Body, learned_from: int, links: Mapping[str, str]) -> Work:
    """What the damages on a command line ask for.

    Args:
        texts: such as ``lock:elbow@500``.
        body: what breaks.
        learned_from: movements of learning.
        links: the joint that carries each link, by the link's name.

    Raises:
        BadInput: one of them can't happen to this body, or happens while it still learns.
    """
    damages = tuple(parse_damage(text) for text in texts)
    for damage in damages:
        if damage.at <= learned_from:
            raise BadInput(
                f"the body is still being learned then (from {learned_from} movements)",
                where=f"damage {damage}",
                remedy=f"break it from movement {learned_from + 1} on, or learn from fewer with --samples",
            )
    DamagedPlant(body, damages, links=links)
    return Work(damages, max(damage.at for damage in damages) + _AFTER, links)


def work(skill: BodySkill, body: Body, plan: Work) -> Iterator[Step]:
    """Reach for one random target after the other, while the body breaks.

    Args:
        skill: what was learned.
        body: what it was learned on.
        plan: what happens to it.
    """
    config, count = skill.config, len(skill.experience.q)
    plant = DamagedPlant(body, plan.damages, noise=config.noise or 0.0, seed=config.seed, links=plan.links)
    plant.restore({**plant.state(), "moves": np.array(count), "stood": skill.experience.q[-1]})
    mind = adaptation_of(skill)
    rng = np.random.default_rng([config.seed, _TARGETS])
    for movement in range(count + 1, plan.movements + 1):
        probe = mind.wants()
        target, q = _reachable(skill, mind, rng) if probe is None else (np.full(skill.fit.model.space, np.nan), probe)
        seen = plant.move(q)
        error = float(np.linalg.norm(_true_tip(plant, body, q) - target))
        alarm, news = mind.show(q, seen)
        yield Step(movement, target, error, alarm, news)


def adaptation_of(skill: BodySkill) -> Adaptation:
    """How a skill's body adapts: by hypotheses for a rigid arm, by probing for a soft one.

    Raises:
        BadInput: nothing is known of how such a model breaks.
    """
    if isinstance(skill.fit.model, Rigid):
        return RigidAdaptation(skill)
    from toddle.reach.working_soft import SoftAdaptation

    return SoftAdaptation(skill)


class RigidAdaptation:
    """A rigid arm's picture of itself.

    Attributes:
        model: the body as it is taken to be now.
        solver: on that model.
        cause: the likeliest cause of what changed; None: nothing did.
    """

    def __init__(self, skill: BodySkill) -> None:
        if not isinstance(skill.fit.model, Rigid):
            raise BadInput(f"{skill.fit.kind} is no rigid arm", remedy="learn it with --method screws")
        self._skill = skill
        self._before: Rigid = skill.fit.model
        self.model: Model = skill.fit.model
        self.solver: Solver = skill.solver
        self.cause: Repair | None = None
        self._wild = float(skill.fit.wild.mean())
        self._watch = Watch.start(self._wild)
        self._sensor = max(skill.fit.sensor, _LEAST_NOISE)
        self._since: Experience | None = None
        self._stood = skill.experience.q[-1]
        self._told = ""

    def wants(self) -> None:
        """Nothing: reaching on tells it what happened."""

    def show(self, q: np.ndarray, x: np.ndarray) -> tuple[Alarm, str]:
        """One more movement: what it says of the body, and what is new; empty: nothing."""
        confirmed = self.cause is not None and self._told != ""
        self._watch, alarm = look(self._watch, q, x, self.model if confirmed else self._before, self._sensor)
        news = ""
        if alarm.level is Level.CALM and not confirmed:
            if self._since is not None:
                news = "a wild look, not damage: the body is taken as it was"
                self._forget()
            self._stood = q
            return alarm, news
        if confirmed and alarm.level is Level.CONFIRMED:
            news = "the body changed again"
            if self.cause is not None:
                self._before = self.cause.model
            self._since, self._told, self.cause = None, "", None
            self._watch, alarm = look(Watch.start(self._wild), q, x, self._before, self._sensor)
        if self._since is None and not news:
            news = f"the body seems to have changed: the tip is off by {alarm.surprise**0.5:.0f} times what is usual"
        self._learn(q, x)
        if alarm.level is Level.CONFIRMED and self.cause is not None and self._told != self._named():
            self._told = self._named()
            news = f"the body changed: {self._told}"
            self._watch = Watch.start(self._wild)
        return alarm, news

    def _learn(self, q: np.ndarray, x: np.ndarray) -> None:
        """Fit what may have happened to the movements since, and take the likeliest."""
        one = Experience(q[None], x[None])
        self._since = one if self._since is None else together(self._since, one)
        if len(self._since.q) > _LOOKED_BACK:
            return
        found = repair(self._before, self._since, self._skill.lower, self._skill.upper, self._sensor, stood=self._stood)
        self.cause = found[0]
        self.model = found[0].model
        self.solver = solver_of(self.model, self._skill.lower, self._skill.upper, self._skill.experience)

    def _forget(self) -> None:
        self._since, self.cause, self.model = None, None, self._before
        self.solver = solver_of(self.model, self._skill.lower, self._skill.upper, self._skill.experience)

    def _named(self) -> str:
        """The cause, in words without numbers that still change."""
        if self.cause is None or self.cause.joint < 0:
            return ""
        joint = self._skill.joints[self.cause.joint]
        return {
            "lock": f"{joint} is locked",
            "weaken": f"{joint} moves less than it is told",
            "slip": f"{joint} has slipped",
            "bend": f"the link after {joint} is bent",
            "replace": f"the link after {joint} has another length",
        }[self.cause.kind]


def adapted(skill: BodySkill, mind: Adaptation) -> BodySkill:
    """The skill with the body as it is now."""
    model = getattr(mind, "model", skill.fit.model)
    return replace(skill, fit=replace(skill.fit, model=model))


def _true_tip(plant: DamagedPlant, body: Body, q: Float[np.ndarray, " joints"]) -> Float[np.ndarray, " space"]:
    """Where the broken body's tip is, without noise [m]."""
    actual, linkage = plant.actual(q[None])
    if linkage is None or not isinstance(body, Chain):
        return truth(body, actual)[0][0]
    return poses(linkage, actual)[0, list(body.coordinates), 3]


def _reachable(
    skill: BodySkill, mind: Adaptation, rng: np.random.Generator
) -> tuple[Float[np.ndarray, " space"], Float[np.ndarray, " joints"]]:
    """A target that the body can reach by what it knows of itself now."""
    targets = mind.model.forward(rng.uniform(skill.lower, skill.upper, (_TRIES, len(skill.joints))))
    answers = mind.solver.solve(targets)
    first = int(np.argmax(answers.solved))
    return targets[first], answers.q[first]
