"""A robot that learns to reach and to walk.

    robot = toddle.load("nicu")
    skill = toddle.learn(robot, samples=20_000, seed=0)
    answer = toddle.solve(skill, [0.2, -0.4, 0.6])

    robot = toddle.load_humanoid("heicub")
    controller, body = toddle.walker(robot), toddle.HumanoidSimulation(robot)

Names are resolved when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from toddle.outside.simulation.humanoid import HumanoidSimulation as HumanoidSimulation
    from toddle.outside.skills import load_skill as load_skill
    from toddle.outside.skills import save as save
    from toddle.reach.api import evaluate as evaluate
    from toddle.reach.api import learn as learn
    from toddle.reach.api import solve as solve
    from toddle.reach.body_skill import BodySkill as BodySkill
    from toddle.reach.body_skill import solutions as solutions
    from toddle.reach.skill import Skill as Skill
    from toddle.robots.catalogue import load as load
    from toddle.robots.humanoids import load_humanoid as load_humanoid
    from toddle.signals import Circle as Circle
    from toddle.signals import Solution as Solution
    from toddle.signals import Velocity as Velocity
    from toddle.signals import Verdict as Verdict
    from toddle.walk.walker import walker as walker

_HOMES = {
    "load": "robots.catalogue",
    "learn": "reach.api",
    "evaluate": "reach.api",
    "solve": "reach.api",
    "solutions": "reach.body_skill",
    "BodySkill": "reach.body_skill",
    "Skill": "reach.skill",
    "save": "outside.skills",
    "load_skill": "outside.skills",
    "Solution": "signals",
    "Verdict": "signals",
    "load_humanoid": "robots.humanoids",
    "walker": "walk.walker",
    "HumanoidSimulation": "outside.simulation.humanoid",
    "Velocity": "signals",
    "Circle": "signals",
}

__all__ = [
    "BodySkill",
    "Circle",
    "HumanoidSimulation",
    "Skill",
    "Solution",
    "Velocity",
    "Verdict",
    "evaluate",
    "learn",
    "load",
    "load_humanoid",
    "load_skill",
    "save",
    "solutions",
    "solve",
    "walker",
]


def __getattr__(name: str) -> object:
    """Import a public name's module when the name is first asked for (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
