"""``toddle reach --skill FOLDER --target X Y Z``: joint values, the error to expect, and a verdict."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toddle.cli.reach import Reach
from toddle.cli.reach_babbling import how_it_moves, mover
from toddle.failures import BadInput

if TYPE_CHECKING:
    from collections.abc import Sequence

    from toddle.reach.body_skill import BodySkill
    from toddle.reach.skill import Skill
    from toddle.robots.body import Body
    from toddle.signals import Solution

_LOOKS = 3


def answer(asked: Reach) -> int:
    """Answer a target from a saved skill, or bring the skill into another form; returns the exit code."""
    from toddle.outside.skills import load_skill
    from toddle.reach.api import check_same_robot, solve
    from toddle.reach.body_skill import BodySkill
    from toddle.robots.catalogue import load_choice
    from toddle.signals import Verdict

    skill = load_skill(asked.skill or Path())
    if isinstance(skill, BodySkill):
        from toddle.cli.reach_body import after

        after(asked, skill)
        if asked.propose is not None:
            from toddle.cli.reach_export import propose

            propose(skill, asked.propose)
        if asked.target is None:
            return 0
        if asked.solutions is not None:
            return _several(asked, skill)
    else:
        _refuse_for_inverse(asked)
    looks = _looks(asked, skill)
    body = robot = None
    if looks > 0:
        body = load_choice(skill.source)
        check_same_robot(skill, body)
        robot = mover(body, how_it_moves(asked), skill.config.seed)
    found = solve(
        skill, asked.target or (), robot=robot, looks=max(looks, 1), tolerance=asked.tolerance,
        orientation=asked.orientation, near=asked.near, choice=asked.choice,
    )  # fmt: skip
    if asked.json:
        print(json.dumps(_record(asked, skill, found)))
    elif found.verdict is not Verdict.OUT_OF_REACH:
        _print_joints(skill.joints, found.q, _turning(body, skill))
        print(f"{found.verdict}: {found.reason}")
    if found.verdict is Verdict.OUT_OF_REACH:
        raise BadInput(f"out of reach, {found.reason}", where="--target", remedy="aim at that, or closer")
    return 0 if found.verdict is Verdict.REACHED else 1


def _looks(asked: Reach, skill: Skill | BodySkill) -> int:
    if asked.looks is not None:
        return asked.looks
    # a pose is answered open loop: looks correct where the tip is, not how it is turned
    return 0 if asked.orientation is not None or not skill.source.spec else _LOOKS


def _several(asked: Reach, skill: BodySkill) -> int:
    """Several postures for one target."""
    from toddle.reach.body_skill import solutions

    found = solutions(skill, asked.target or (), asked.solutions or 1, orientation=asked.orientation, near=asked.near)
    if asked.json:
        print(json.dumps({"target": list(asked.target or ()), "solutions": [_record(asked, skill, s) for s in found]}))
    else:
        for number, solution in enumerate(found, 1):
            print(f"posture {number}: {solution.reason}")
            _print_joints(skill.joints, solution.q, _turning(None, skill))
    if not found:
        raise BadInput("out of reach", where="--target", remedy="leave --solutions out to hear how far it is")
    return 0


def _refuse_for_inverse(asked: Reach) -> None:
    """Refuse what a skill that learned the inverse itself can't do."""
    for name in ("orientation", "near", "choice", "solutions", "to", "to_urdf", "propose"):
        if getattr(asked, name) is not None:
            raise BadInput(
                "this skill learned by babbling knows no body",
                where="--" + name.replace("_", "-"),
                remedy="leave it out, or learn with --method screws",
            )


def _record(asked: Reach, skill: Skill | BodySkill, found: Solution) -> dict[str, Any]:
    from toddle.outside.files import finite

    facts = {
        "robot": skill.source.spec,
        "target": list(asked.target or ()),
        "joints": dict(zip(skill.joints, map(float, found.q), strict=True)),
        "expected_error_mm": 1000 * found.expected_error,
        "expected_error_90_mm": 1000 * found.error_90,
        "looks": found.steps,
        "verdict": str(found.verdict),
        "reason": found.reason,
    }
    if found.nearest is not None:
        facts["nearest_m"] = found.nearest.tolist()
    return finite(facts)


def _print_joints(names: Sequence[str], q: Any, turning: list[bool]) -> None:
    width = max(map(len, names))
    for name, value, turns in zip(names, q, turning, strict=True):
        print(f"{name:<{width}}  {value:9.5f}" + (f"  ({math.degrees(value):7.2f} deg)" if turns else ""))


def _turning(body: Body | None, skill: Skill | BodySkill) -> list[bool]:
    """Which joints are known to turn, so that their values are angles."""
    from toddle.reach.body_skill import BodySkill
    from toddle.reach.model.rigid import Rigid
    from toddle.robots.chain import Chain

    if isinstance(skill, BodySkill) and isinstance(skill.fit.model, Rigid):
        arm = skill.fit.model.linkage
    elif isinstance(body, Chain):
        arm = body
    else:
        return [False] * len(skill.joints)
    return [not any(arm.slides[arm.gain[:, joint] != 0]) for joint in range(len(skill.joints))]
