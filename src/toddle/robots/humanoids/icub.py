"""The iCub of the package icub-models, whole and as Heicub: without arms and head."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from toddle.failures import MissingExtra
from toddle.robots.humanoid import Humanoid
from toddle.robots.humanoids.description import read
from toddle.robots.humanoids.infer import humanoid
from toddle.robots.humanoids.settings import Settings

MODEL = "iCubGazeboV2_5"
_TORSO = ("torso_pitch", "torso_roll", "torso_yaw")
_SAID = Settings(
    left_foot="l_foot",
    right_foot="r_foot",
    moves=_TORSO,
    sole_length=0.18,
    sole_width=0.095,
    sole_ahead=0.0315,
    foot_distance=0.14,
    com_height=0.465,
    step_time=0.6,
    double_support=0.12,
    step_height=0.02,
    margin=(0.02, 0.02),
    hull=((-0.24, 0.12), (-0.24, 0.30), (0.24, 0.30), (0.24, 0.12)),
    fastest=(0.3, 0.1, 0.3),
    stiffness=3000.0,
    damping=60.0,
    reflected=0.05,
    effort=37.0,
)


def path() -> Path:
    """The URDF file of the whole robot.

    Raises:
        MissingExtra: the package icub-models is not installed.
    """
    try:
        import icub_models
    except ImportError:
        raise MissingExtra("icub-models", "icub", what_for="the iCub") from None
    return Path(icub_models.get_model_file(MODEL))


def heicub() -> Humanoid:
    """iCub without arms and head: 15 joints, 26 kg."""
    file = path()
    parts = read(file, without=("neck_1", "l_shoulder_1", "r_shoulder_1"))
    return humanoid(parts, replace(_SAID, name="heicub"), str(file))


def icub() -> Humanoid:
    """The whole iCub; walking moves its legs and torso."""
    file = path()
    return humanoid(read(file), replace(_SAID, name="icub"), str(file))
