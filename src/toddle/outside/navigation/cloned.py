"""A network that learned by watching, from its folder to the stick: as a recipe that can be sent to a process."""

from __future__ import annotations

from pathlib import Path

from toddle.failures import BadInput
from toddle.navigate.cloning.driver import Clone
from toddle.outside.navigation.cloning_files import load_cloned
from toddle.robots.humanoid import Humanoid


def cloned(humanoid: Humanoid, folder: Path) -> Clone:
    """The policy in a folder, steering a robot.

    Raises:
        BadInput: there is none, or it asks for more than the robot can do.
    """
    policy = load_cloned(folder)
    greatest = humanoid.gait.fastest
    if policy.config.ahead[1] > greatest.vx + 1e-9 or policy.config.turning > greatest.omega + 1e-9:
        asks = f"it asks for up to {policy.config.ahead[1]:g} m/s and {policy.config.turning:g} rad/s"
        most = f"{humanoid.name} walks at {greatest.vx:g} and {greatest.omega:g} at most"
        raise BadInput(f"{asks}, and {most}", where=str(folder), remedy="learn on drives of this robot")
    return Clone(policy)
