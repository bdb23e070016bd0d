"""``toddle reach``: an arm learns to reach, goes on learning, or is asked to reach."""

from __future__ import annotations

import json
import math
import re
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from toddle.cli.arguments import parse
from toddle.cli.options import POSITIONAL
from toddle.cli.run_folder import leave, new_folder, refuse_used, tell_figures
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.reach.session import Cycle, Session
    from toddle.reach.skill import Skill
    from toddle.robots.body import Body, Plant
    from toddle.robots.catalogue import Choice

_SAVE_SECONDS = 20.0
_LIVE_SAMPLES = 5_000
_LENGTH = re.compile(r"(\d+(?:\.\d+)?)(mm|cm|m)")
_MOST_NOISE = 1.0  # [m]
_METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}


@dataclass(frozen=True)
class Reach:
    """An arm learns its own inverse kinematics from nothing but its movements.

    toddle reach ROBOT learns, and leaves a folder with the skill, its figures and pictures. toddle reach --skill
    FOLDER --target X Y Z answers with joint angles. toddle reach --resume FOLDER goes on learning.

    Attributes:
        robot: a name (nicu, suralp, icub_arm, planar:7, planar3, scara, bha), or the path of a URDF or MJCF file.
        method: how it explores: goal-and-motor-babbling, goal-babbling, random-goal-babbling, active-goal,
            active-motor, motor-babbling or continuous-motor-babbling; what suits the arm unless given.
        learner: what learns from it: perceptron, local-linear or recall (a memory of movements); the method's own
            unless given.
        samples: movements to learn from; 300000 unless given, 20000 for a memory of movements, 5000 in physics.
        seed: of all randomness.
        hidden: units of each hidden layer of the perceptron; 0 for none.
        learning_rate: step of the learner.
        perturbation: size of exploration.
        network: the perceptron with our refinements, or plain, as the thesis's tables have it.
        reading: of the thesis's algorithm: the one that reproduces its tables, or its literal words.
        test_points: size of the fixed test set.
        test_spacing: least distance between its points [m].
        per_cycle: movements between two tests.
        tip: the link whose position is learned.
        base: the link in whose frame it is told.
        joints: the joints that move; the others are held.
        plant: what moves: the kinematics, or the arm in physics with servos, gravity and sensor noise; kinematics
            unless given.
        noise: standard deviation of the seen tip on each axis, in physics, such as 1mm.
        out: the folder to leave; runs/ROBOT unless given.
        json: print one JSON object with the figures, and nothing else.
        resume: a folder to go on in.
        skill: a folder to answer from.
        target: where the tip should go [m].
        looks: how often the answer may be corrected by looking, 3 times unless given; 0 for open loop.
        tolerance: error up to which a target counts as reached [m].
    """

    robot: Annotated[str | None, POSITIONAL] = None
    method: str | None = None
    learner: str | None = None
    samples: int | None = None
    seed: int | None = None
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
    noise: str | None = None
    out: Path | None = None
    json: bool = False
    resume: Path | None = None
    skill: Path | None = None
    target: tuple[float, ...] | None = None
    looks: int | None = None
    tolerance: float | None = None


_OF_A_RUN = (
    "method", "learner", "samples", "seed", "hidden", "learning_rate", "perturbation", "network",
    "reading", "test_points", "test_spacing", "per_cycle",
)  # fmt: skip
_TAKES = {  # the options that each way of calling has, beside --json
    "robot": {*_OF_A_RUN, "tip", "base", "joints", "plant", "noise", "out"},
    "resume": {"samples"},
    "skill": {"target", "looks", "tolerance", "plant", "noise"},
}


def main(argv: Sequence[str]) -> int:
    """Learn, resume, or answer, and return the exit code."""
    asked = parse(Reach, argv, prog="toddle reach")
    _check_mode(asked)
    if asked.skill is not None:
        return _answer(asked, asked.skill)
    if asked.resume is not None:
        return _resume(asked, asked.resume)
    return _learn(asked)


def _check_mode(asked: Reach) -> None:
    """Refuse options that contradict each other before anything heavy is imported."""
    modes = [name for name in _TAKES if getattr(asked, name) is not None]
    if not modes and asked.target is not None:
        raise BadInput("--skill is missing", where="--target", remedy="give --skill FOLDER --target X Y Z")
    if not modes:
        raise BadInput(
            "no robot is named",
            where="toddle reach",
            remedy="name one, such as nicu, or the path of a URDF or MJCF file",
        )
    if len(modes) > 1:
        raise BadInput(f"{' and '.join(modes)} exclude each other", where="toddle reach", remedy="give one")
    (mode,) = modes
    for field in fields(asked):
        if field.name not in {mode, "json", *_TAKES[mode]} and getattr(asked, field.name) is not None:
            settled = mode != "robot" and field.name in _TAKES["robot"]
            raise BadInput(
                "it was settled when learning began" if settled else f"it doesn't go with a {mode}",
                where="--" + field.name.replace("_", "-"),
                remedy="leave it out" if settled else "leave it out, or give --skill FOLDER --target X Y Z",
            )
    if mode == "skill" and asked.target is None:
        raise BadInput("--target is missing", where="--skill", remedy="give --skill FOLDER --target X Y Z")
    if asked.noise is not None and asked.plant != "physics":
        raise BadInput("only physics has sensor noise", where="--noise", remedy="add --plant physics")
    if asked.looks is not None and not 0 <= asked.looks <= 1000:
        raise BadInput(f"{asked.looks} is out of range", where="--looks", remedy="give 0 to 1000")
    if asked.tolerance is not None and not asked.tolerance > 0:
        raise BadInput(f"{asked.tolerance} is out of range", where="--tolerance", remedy="give a distance above 0 [m]")


def _learn(asked: Reach) -> int:
    from toddle.reach.api import suited
    from toddle.reach.config import ReachConfig
    from toddle.reach.methods import learner_named, with_method
    from toddle.robots.catalogue import Choice, settled

    given = {name: getattr(asked, name) for name in _OF_A_RUN if getattr(asked, name) is not None}
    if asked.plant == "physics":
        given.setdefault("samples", _LIVE_SAMPLES)
        given.setdefault("per_cycle", 500)
    if given.get("hidden") == (0,):
        given["hidden"] = ()
    config = ReachConfig(**given)
    learner_named(with_method(config, 0, 0))
    source = settled(Choice(asked.robot or "", asked.tip, asked.base, asked.joints))
    how = _how(asked)
    refuse_used(asked.out)
    session = _open(source, suited(config, source.spec), how)
    folder = new_folder(asked.out, source.spec)
    if config.method is None:
        size = f"{len(session.body.joints)} joints for {session.targets.shape[1]} coordinates"
        took = f"{session.config.method}, learner {session.config.learner}"
        print(f"{session.body.name}: {size}, so {took}", file=sys.stderr)
    from toddle.reach.session import start

    return _run(asked, session, start(session), source, how, folder)


def _resume(asked: Reach, folder: Path) -> int:
    from toddle.outside.files import make_folder
    from toddle.outside.skills import read_run, resume

    config, facts, tensors = read_run(folder)
    if asked.samples is not None:
        config = replace(config, samples=asked.samples)
    source, how = _recorded(facts, folder)
    make_folder(folder)
    session = _open(source, config, how)
    cycle = resume(session, tensors, str(folder))
    if cycle.samples >= session.samples:
        raise BadInput(
            f"it has learned from all its {cycle.samples} movements",
            where=str(folder),
            remedy=f"ask for more with --samples, such as {2 * cycle.samples}",
        )
    return _run(asked, session, cycle, source, how, folder)


def _how(asked: Reach) -> dict[str, Any]:
    """What moves, in the form that a run remembers."""
    return {"plant": asked.plant or "kinematics", "noise": _metres(asked.noise)}


def _recorded(facts: dict[str, Any], folder: Path) -> tuple[Choice, dict[str, Any]]:
    """Which robot a saved run has, and what moves."""
    from toddle.outside.skills import choice_from

    try:
        how = {"plant": facts["how"]["plant"], "noise": facts["how"]["noise"]}
        if how["plant"] not in ("kinematics", "physics") or not isinstance(how["noise"], float | None):
            raise ValueError(f"nothing moves by {how}")
        return choice_from(facts["choice"]), how
    except (LookupError, TypeError, ValueError) as fault:
        raise BadInput(
            f"it is not a run of this version ({fault})", where=str(folder), remedy="learn it again"
        ) from fault


def _open(source: Choice, config: Any, how: dict[str, Any]) -> Session:
    """The session of a robot, in kinematics or in physics."""
    from toddle.reach.api import hidden_of
    from toddle.reach.session import open_session
    from toddle.robots.catalogue import load_choice

    body = load_choice(source)
    return open_session(_mover(body, how, config.seed), config, hidden=hidden_of(source.spec), survey=body)


def _mover(body: Body, how: dict[str, Any], seed: int) -> Body | Plant:
    if how["plant"] != "physics":
        return body
    from toddle.outside.simulation import PhysicsOptions, PhysicsPlant
    from toddle.robots.chain import Chain

    if not isinstance(body, Chain):
        raise BadInput("a soft arm has no physics here", where="--plant", remedy="leave --plant out")
    noise = {} if how["noise"] is None else {"noise": how["noise"]}
    return PhysicsPlant(body, PhysicsOptions(seed=seed, **noise))


def _run(asked: Reach, session: Session, cycle: Cycle, source: Choice, how: dict[str, Any], folder: Path) -> int:
    """Learn to the end or to Ctrl-C, save, evaluate, show."""
    from toddle.outside.skills import save, save_run
    from toddle.outside.terminal import Reporter, stoppable
    from toddle.reach.api import skill_of
    from toddle.reach.session import Pace, cycles

    facts = {"choice": asdict(source), "how": how}
    pace, saved = Pace(cycle.samples), time.perf_counter()
    with Reporter(f"{session.body.name} learns", session.samples) as reporter, stoppable() as stop:
        for latest in cycles(session, cycle):
            cycle = latest
            pace.tick(cycle.samples)
            reporter.tell(cycle.samples, f"error {1000 * float(cycle.history[-1].fixed_error):.1f} mm")
            if time.perf_counter() - saved > _SAVE_SECONDS:
                save_run(folder, session, cycle, facts)
                saved = time.perf_counter()
            if stop.asked:
                break
    save_run(folder, session, cycle, facts)
    skill = skill_of(session, cycle, source, pace=pace)
    save(skill, folder)
    leave(folder, session, cycle, skill)
    tell_figures(skill, folder, as_json=asked.json)
    if cycle.samples < session.samples:
        print(f"toddle: stopped; go on with: toddle reach --resume {folder}", file=sys.stderr)
        return 130
    return 0


def _answer(asked: Reach, folder: Path) -> int:
    """Answer a target from a saved skill."""
    from toddle.outside.skills import load_skill
    from toddle.reach.api import check_same_robot
    from toddle.reach.skill import solve
    from toddle.robots.catalogue import load_choice
    from toddle.signals import Verdict

    how, looks = _how(asked), 3 if asked.looks is None else asked.looks
    skill = load_skill(folder)
    body = robot = None
    if looks > 0:
        body = load_choice(skill.source)
        check_same_robot(skill, body)
        robot = _mover(body, how, skill.config.seed)
    answer = solve(skill, asked.target or (), robot=robot, looks=max(looks, 1), tolerance=asked.tolerance)
    if asked.json:
        print(
            json.dumps(
                {
                    "robot": skill.source.spec,
                    "target": list(asked.target or ()),
                    "joints": dict(zip(skill.joints, map(float, answer.q), strict=True)),
                    "expected_error_mm": 1000 * answer.expected_error,
                    "looks": answer.steps,
                    "verdict": str(answer.verdict),
                    "reason": answer.reason,
                }
            )
        )
    elif answer.verdict is not Verdict.OUT_OF_REACH:
        width = max(map(len, skill.joints))
        for name, value, turns in zip(skill.joints, answer.q, _turning(body, skill), strict=True):
            print(f"{name:<{width}}  {value:9.5f}" + (f"  ({math.degrees(value):7.2f} deg)" if turns else ""))
        print(f"{answer.verdict}: {answer.reason}")
    if answer.verdict is Verdict.OUT_OF_REACH:
        raise BadInput(f"out of reach, {answer.reason}", where="--target", remedy="aim at that, or closer")
    return 0 if answer.verdict is Verdict.REACHED else 1


def _turning(body: Body | None, skill: Skill) -> list[bool]:
    """Which joints are known to turn, so that their values are angles."""
    from toddle.robots.chain import Chain

    if not isinstance(body, Chain):
        return [False] * len(skill.joints)
    return [not any(body.slides[body.gain[:, joint] != 0]) for joint in range(len(skill.joints))]


def _metres(length: str | None) -> float | None:
    """A length with its unit, such as 1mm, in metres."""
    if length is None:
        return None
    match = _LENGTH.fullmatch(length)
    if match is None:
        raise BadInput(f"{length!r} is not a length", where="--noise", remedy="give one with its unit, such as 1mm")
    metres = float(match[1]) * _METRES[match[2]]
    if metres > _MOST_NOISE:
        raise BadInput(f"{length!r} is out of range", where="--noise", remedy=f"give at most {_MOST_NOISE:g}m")
    return metres
