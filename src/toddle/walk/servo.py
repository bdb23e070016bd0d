"""From a reference to the servos: what the inverse kinematics weighs, and how far ahead the servos are commanded."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.robots.humanoid import LEFT, RIGHT, Humanoid
from toddle.walk.balance.pendulum import Pair
from toddle.walk.config import TICK, WalkConfig
from toddle.walk.pattern.displacement import rotate
from toddle.walk.posture.model import PostureModel
from toddle.walk.posture.solve import WEIGHTS
from toddle.walk.posture.survey import static_torques
from toddle.walk.state import Pose, WalkerState, pose_of
from toddle.walk.stepping import single

_FREE = 1e-5  # of the weight of a pitch that is left free
_PITCH_ROW = (7, 13)  # com 3, then each sole: position 3, rotation 3 about its own x, y, z


def weights(config: WalkConfig, state: WalkerState) -> Float[np.ndarray, "21"]:
    """Of the rows of the inverse kinematics: the swing foot's pitch is free at first, and held when it lands."""
    found = WEIGHTS.copy()
    step = state.step
    if not config.release_pitch or not single(state):
        return found
    share = (step.phase - step.double_support) / max(step.end - step.double_support, TICK)
    held = min(max((share - 0.5) / 0.4, 0.0), 1.0)
    found[_PITCH_ROW[1 - step.stance]] *= _FREE + (1 - _FREE) * held
    return found


def pressed(state: WalkerState) -> Float[np.ndarray, "2 2"]:
    """Where the zero moment point presses on each sole, in the sole's frame [m]."""
    return np.array([_seen_from(pose_of(state.anchors, side), state.zmp) for side in (LEFT, RIGHT)])


def sag(
    humanoid: Humanoid,
    model: PostureModel,
    q: Float[np.ndarray, " positions"],
    load: Float[np.ndarray, "2"],
    pressed: Float[np.ndarray, "2 2"],
) -> Float[np.ndarray, " joints"]:
    """How far the servos must be commanded ahead so as to hold their load [rad].

    Args:
        humanoid: its servos' stiffness and effort.
        model: the same robot.
        q: the posture.
        load: share of the weight on each foot.
        pressed: where in each sole's frame [m].
    """
    torque = static_torques(model, q, load, pressed)
    return np.clip(torque, -humanoid.effort, humanoid.effort) / humanoid.stiffness


def _seen_from(pose: Pose, point: Pair) -> Pair:
    return rotate(-pose[2], (point[0] - pose[0], point[1] - pose[1]))
