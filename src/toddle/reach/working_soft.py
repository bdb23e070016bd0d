"""A soft arm's picture of itself while it works: once something seems wrong, it moves every actuator by itself.

Which actuators follow, and how far, tells what happened, to several of them at once (`toddle.reach.model.soft_damage`).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.reach.body_skill import BodySkill
from toddle.reach.gather import together
from toddle.reach.model.crippled import Crippled
from toddle.reach.model.curvature import Curvature
from toddle.reach.model.curvature_update import updated
from toddle.reach.model.damage_watch import Alarm, Level, Watch, look
from toddle.reach.model.model import Model
from toddle.reach.model.soft_damage import diagnose, probe_movements
from toddle.reach.solve.solver import ModelSolver, Solver
from toddle.signals import Experience

_LEAST_NOISE = 1e-5  # [m]
_STARTS = 300  # postures
_IN_WORDS = {"locked": "is locked", "weak": "moves less than it is told", "slip": "has slipped"}


class SoftAdaptation:
    """A soft arm's picture of itself.

    Attributes:
        model: the body as it is taken to be now.
        solver: on that model.
    """

    def __init__(self, skill: BodySkill) -> None:
        self.model: Model = skill.fit.model
        self.solver: Solver = skill.solver
        self._skill = skill
        self._sensor = max(skill.fit.sensor, _LEAST_NOISE)
        self._wild = float(skill.fit.wild.mean())
        self._watch = Watch.start(self._wild)
        self._since: Experience | None = None
        self._probes: list[np.ndarray] = []

    def wants(self) -> Float[np.ndarray, " joints"] | None:
        """The next probing movement [rad or m]; None: reach on."""
        return self._probes[0] if self._probes else None

    def show(self, q: np.ndarray, x: np.ndarray) -> tuple[Alarm, str]:
        """One more movement: what it says of the body, and what is new; empty: nothing."""
        one = Experience(q[None], x[None])
        self._watch, alarm = look(self._watch, q, x, self.model, self._sensor)
        if self._probes:
            self._probes.pop(0)
            self._since = one if self._since is None else together(self._since, one)
            return alarm, "" if self._probes else self._understand(self._since)
        if alarm.level is Level.CALM:
            self._since = None
            if isinstance(self.model, Crippled) and isinstance(self.model.model, Curvature):
                self._take(updated(self.model, one, self._sensor))
            return alarm, ""
        self._since = one if self._since is None else together(self._since, one)
        if alarm.level is Level.SUSPECTED:
            return (
                alarm,
                f"the body seems to have changed: the tip is off by {alarm.surprise**0.5:.0f} times what is usual",
            )
        self._probes = list(probe_movements(q, self._skill.lower, self._skill.upper))
        return alarm, "the body changed: each actuator is moved by itself, to see which ones follow"

    def _take(self, model: Model) -> None:
        """From now on the body is like that; it starts from postures that it knows."""
        known = self._skill.experience.q[:_STARTS]
        memory = Experience(known, model.forward(known))
        self.model, self.solver = model, ModelSolver(model, self._skill.lower, self._skill.upper, memory)

    def _understand(self, since: Experience) -> str:
        """What the probes show."""
        found = diagnose(self._skill.fit.model, since, self._skill.lower, self._skill.upper, self._sensor)
        self._take(found.model)
        self._watch, self._since = Watch.start(self._wild), None
        if not found.causes:
            return "every actuator follows: the body is taken as it was"
        said = (f"{self._skill.joints[joint]} {_IN_WORDS[kind]}" for joint, kind, _ in found.causes)
        return "the body changed: " + ", ".join(said)
