"""The iCub of the package icub-models, whole and as Heicub: without arms and head.

Its mesh of a sole is flat over 0.195 x 0.095 m with round corners, its middle 3.15 cm ahead of the ankle; the URDF's
own box is 0.16 x 0.072 m, Huber 2019 writes 0.2 x 0.1 m. The box here is as wide as the flat part and 1.5 cm shorter
for the corners. The torso's torques in the URDF (50,000 N m) stand for none; they are those of the legs.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from toddle.failures import MissingExtra
from toddle.robots.humanoids.gaits import DEFAULT
from toddle.robots.humanoids.settings import Settings

MODEL = "iCubGazeboV2_5"
_SAID = Settings(
    left_foot="l_foot",
    right_foot="r_foot",
    waist="root_link",
    chest="chest",
    moves=("torso_pitch", "torso_roll", "torso_yaw"),
    held=("l_wrist_pitch", "l_wrist_yaw", "r_wrist_pitch", "r_wrist_yaw"),
    stiffness=3000.0,
    damping=60.0,
    reflected=0.05,
    effort=37.0,
    gait=DEFAULT["heicub"],
)


def heicub() -> tuple[Path, Settings]:
    """iCub without arms and head: 15 joints, 26 kg."""
    return _file(), replace(_SAID, name="heicub", held=(), without=("neck_1", "l_shoulder_1", "r_shoulder_1"))


def icub() -> tuple[Path, Settings]:
    """The whole iCub, whose head and arms raise its centre of mass; walking moves its legs and torso."""
    return _file(), replace(_SAID, name="icub", com_height=0.525)


def _file() -> Path:
    try:
        import icub_models
    except ImportError:
        raise MissingExtra("icub-models", "icub", what_for="the iCub") from None
    return Path(icub_models.get_model_file(MODEL))
