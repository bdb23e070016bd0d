"""``toddle reach``: an arm learns to reach, goes on learning, or is asked to reach."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Literal

from toddle.cli.arguments import parse
from toddle.cli.options import POSITIONAL
from toddle.failures import BadInput


@dataclass(frozen=True)
class Reach:
    """An arm learns its own inverse kinematics from nothing but its movements.

    toddle reach ROBOT learns, and leaves a folder with the skill, its figures and pictures. toddle reach --from
    movements.csv learns from recorded movements. toddle reach --skill FOLDER --target X Y Z answers with joint angles.
    toddle reach --resume FOLDER goes on learning.

    Attributes:
        robot: a name (nicu, suralp, icub_arm, planar:7, planar3, scara, bha), or the path of a URDF or MJCF file.
        method: what is learned. The body, to be solved then: screws, curvature, multilinear or network. The inverse
            itself, online: goal-and-motor-babbling, goal-babbling, random-goal-babbling, active-goal, active-motor,
            motor-babbling, continuous-motor-babbling. What suits the arm unless given.
        learner: what learns the inverse: perceptron, local-linear or recall (a memory of movements).
        samples: movements to learn from; what suits the method unless given (300 for screws).
        seed: of all randomness.
        pose: the tip's orientation is seen and learned, too.
        noise: standard deviation of the seen tip on each axis, and of its orientation, such as 1mm 5mrad.
        look_noise: the same of the looks by which answers are tested; none unless given.
        from_: recorded movements to learn from: a .csv or .parquet file with the joints by name and x, y, z.
        model: whether recorded movements correct the robot's description; --no-model learns from them alone.
        damage: the body breaks while it works: lock:JOINT@500, slip:JOINT=0.2rad@500, weaken:JOINT=0.5@500,
            bend:LINK=5cm@500 or replace:LINK=+8cm@500, the number being that of the movement.
        propose: print so many movements, the most informative ones: first ones to correct a robot's description by, or
            next ones for a skill.
        to: export the skill: a file that ends with .onnx or .jax.
        to_urdf: write the learned body as a URDF file.
        hidden: units of each hidden layer of the perceptron; 0 for none.
        learning_rate: step of the learner.
        perturbation: size of exploration.
        network: the perceptron with our refinements, or plain, as the thesis's tables have it.
        reading: of the thesis's algorithm: the one that reproduces its tables, or its literal words.
        test_points: unseen targets to test on: 4096, or for the babbling methods 110.
        test_spacing: least distance between them [m], for the babbling methods.
        per_cycle: movements between two tests, for the babbling methods.
        tip: the link whose position is learned.
        base: the link in whose frame it is told.
        joints: the joints that move; the others are held.
        plant: what moves: the kinematics, or the arm in physics with servos, gravity and sensor noise; kinematics
            unless given.
        out: the folder to leave; runs/ROBOT unless given.
        json: print one JSON object with the figures, and nothing else.
        resume: a folder to go on in.
        skill: a folder to answer from.
        target: where the tip should go [m].
        orientation: how the tip should be turned: a unit quaternion W X Y Z.
        near: the present posture, in the order of the joints [rad or m].
        choice: of several postures: the first found, the one nearest to --near, or the most central one.
        solutions: how many different postures to give.
        looks: how often the answer may be corrected by looking, 3 times unless given; 0 for open loop.
        tolerance: error up to which a target counts as reached [m].
    """

    robot: Annotated[str | None, POSITIONAL] = None
    method: str | None = None
    learner: str | None = None
    samples: int | None = None
    seed: int | None = None
    pose: bool = False
    noise: tuple[str, ...] | None = None
    look_noise: str | None = None
    from_: Path | None = None
    model: bool = True
    damage: tuple[str, ...] | None = None
    propose: int | None = None
    to: tuple[Path, ...] | None = None
    to_urdf: Path | None = None
    hidden: tuple[int, ...] | None = None
    learning_rate: float | None = None
    perturbation: float | None = None
    network: Literal["refined", "plain"] | None = None
    reading: Literal["tables", "literal"] | None = None
    test_points: int | None = None
    test_spacing: float | None = None
    per_cycle: int | None = None
    tip: str | None = None
    base: str | None = None
    joints: tuple[str, ...] | None = None
    plant: Literal["kinematics", "physics"] | None = None
    out: Path | None = None
    json: bool = False
    resume: Path | None = None
    skill: Path | None = None
    target: tuple[float, ...] | None = None
    orientation: tuple[float, float, float, float] | None = None
    near: tuple[float, ...] | None = None
    choice: Literal["first", "nearest", "central"] | None = None
    solutions: int | None = None
    looks: int | None = None
    tolerance: float | None = None


OF_BABBLING = ("learner", "hidden", "learning_rate", "perturbation", "network", "reading", "per_cycle", "test_spacing")
"""Options that only the methods have which learn the inverse online; naming one asks for such a method."""
_OF_A_BODY = ("pose", "look_noise", "damage", "propose", "to", "to_urdf")
_OF_A_ROBOT = ("tip", "base", "joints")
_TAKES = {  # the options that each way of calling has, beside --json
    "robot": {"method", "samples", "seed", "noise", "test_points", "plant", "out", *_OF_A_ROBOT, *OF_BABBLING,
              *_OF_A_BODY},
    "from_": {"robot", "method", "seed", "model", "to", "to_urdf", "out", *_OF_A_ROBOT},
    "resume": {"samples"},
    "skill": {"target", "orientation", "near", "choice", "solutions", "looks", "tolerance", "plant", "noise", "to",
              "to_urdf", "propose"},
}  # fmt: skip


def main(argv: Sequence[str]) -> int:
    """Learn, resume, or answer, and return the exit code."""
    asked = parse(Reach, argv, prog="toddle reach")
    mode = _mode(asked)
    _check(asked, mode)
    if mode == "skill":
        from toddle.cli.reach_answer import answer

        return answer(asked)
    if mode == "resume":
        return _resume(asked)
    if mode == "from_":
        from toddle.cli.reach_log import learn_from_log

        return learn_from_log(asked)
    if learns_inverse(asked):
        from toddle.cli.reach_babbling import learn

        return learn(asked)
    from toddle.cli.reach_body import learn

    return learn(asked)


def _resume(asked: Reach) -> int:
    """Go on in a folder, with whichever kind of learning left it."""
    from toddle.cli.reach_body import MOVEMENTS

    if asked.resume is not None and os.path.lexists(asked.resume / f"{MOVEMENTS}.json"):
        from toddle.cli.reach_body import resume

        return resume(asked, asked.resume)
    from toddle.cli.reach_babbling import resume

    return resume(asked, asked.resume or Path())


def learns_inverse(asked: Reach) -> bool:
    """Whether one of the methods is asked for that learn the inverse itself, online.

    Raises:
        BadInput: there is no such method.
    """
    from toddle.reach.structures import STRUCTURES

    if asked.method is None:
        return any(getattr(asked, name) is not None for name in OF_BABBLING)
    return asked.method not in STRUCTURES


def flag(name: str) -> str:
    """A field's name as it is on the command line."""
    return "--" + name.rstrip("_").replace("_", "-")


def _mode(asked: Reach) -> str:
    """Which way of calling it is."""
    modes = [name for name in ("resume", "skill", "from_") if getattr(asked, name) is not None]
    if asked.robot is not None and modes != ["from_"]:
        modes.append("robot")
    if not modes and asked.target is not None:
        raise BadInput("--skill is missing", where="--target", remedy="give --skill FOLDER --target X Y Z")
    if not modes:
        raise BadInput(
            "no robot is named",
            where="toddle reach",
            remedy="name one, such as nicu, or the path of a URDF or MJCF file",
        )
    if len(modes) > 1:
        named = " and ".join(name if name == "robot" else flag(name) for name in modes)
        raise BadInput(f"{named} exclude each other", where="toddle reach", remedy="give one")
    return modes[0]


def _check(asked: Reach, mode: str) -> None:
    """Refuse options that contradict each other before anything heavy is imported."""
    for field in fields(asked):
        given = getattr(asked, field.name) != field.default
        if given and field.name not in {mode, "json", *_TAKES[mode]}:
            raise _misplaced(field.name, mode)
    if mode == "skill" and not (asked.target or asked.to or asked.to_urdf or asked.propose):
        raise BadInput("--target is missing", where="--skill", remedy="give --skill FOLDER --target X Y Z")
    if mode == "from_" and asked.model and asked.robot is None:
        raise BadInput("no robot is named", where="--from", remedy="name its URDF file, or give --no-model")
    if mode == "from_" and not asked.model and asked.robot is not None:
        raise BadInput(f"{asked.robot} is a model", where="--no-model", remedy="leave one of them out")
    for name, most in (("looks", 1000), ("solutions", 1000), ("propose", 10_000)):
        value, least = getattr(asked, name), 0 if name == "looks" else 1
        if value is not None and not least <= value <= most:
            raise BadInput(f"{value} is out of range", where=flag(name), remedy=f"give {least} to {most}")
    if asked.tolerance is not None and not asked.tolerance > 0:
        raise BadInput(f"{asked.tolerance} is out of range", where="--tolerance", remedy="give a distance above 0 [m]")


def _misplaced(name: str, mode: str) -> BadInput:
    settled = mode in ("resume", "skill") and name in _TAKES["robot"]
    what = "it was settled when learning began" if settled else f"it doesn't go with {_CALLED[mode]}"
    return BadInput(what, where=flag(name), remedy="leave it out" if settled else _INSTEAD.get(name, "leave it out"))


_CALLED = {"robot": "a robot", "from_": "--from", "resume": "--resume", "skill": "--skill"}
_INSTEAD: dict[str, str] = dict.fromkeys(
    ("target", "orientation", "near", "choice", "solutions", "looks", "tolerance"),
    "leave it out, or give --skill FOLDER --target X Y Z",
)
