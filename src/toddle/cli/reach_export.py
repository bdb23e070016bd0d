"""What a learned body becomes beside a skill: a URDF, a file that answers without toddle, movements to make next."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.reach.body_skill import BodySkill
    from toddle.reach.model.rigid import Rigid

_TYPICAL = 0.001  # noise that movements are proposed for where none was found [m]


def write_urdf(skill: BodySkill, path: Path) -> None:
    """Write the learned body as a URDF file.

    Raises:
        BadInput: it has no rigid links, or the file can't be written.
    """
    from toddle.outside.files import write_bytes
    from toddle.robots.urdf_text import urdf_text

    model = rigid_of(skill, "--to-urdf")
    name = Path(skill.source.spec).stem or "learned"
    text = urdf_text(name, skill.joints, model.linkage, skill.lower, skill.upper, model.coordinates)
    write_bytes(path, text.encode())
    print(f"the body as a URDF: {path}", file=sys.stderr)


def export(skill: BodySkill, path: Path) -> None:
    """Write the skill as a file that answers without toddle.

    Raises:
        BadInput: the file's ending names no format, or the skill can't be exported.
    """
    from toddle.outside.export import export as write

    write(skill, path)
    print(f"the skill, to be used without toddle: {path}", file=sys.stderr)


def propose(skill: BodySkill, count: int, *, as_json: bool) -> None:
    """Print the movements that would tell most about the body, as rows of a CSV file (not beside a JSON object).

    Raises:
        BadInput: it has no rigid links.
    """
    from toddle.reach.explore.informative import propose as most_informative

    model = rigid_of(skill, "--propose")
    q = most_informative(
        model, skill.lower, skill.upper, skill.experience.q, count, sensor=skill.fit.sensor or _TYPICAL, seed=0
    )
    print(",".join(skill.joints), file=sys.stderr if as_json else sys.stdout)
    for row in q:
        print(",".join(f"{value:.5f}" for value in row), file=sys.stderr if as_json else sys.stdout)


def rigid_of(skill: BodySkill, where: str) -> Rigid:
    """The skill's model, where it is a rigid arm.

    Raises:
        BadInput: it isn't.
    """
    from toddle.reach.model.rigid import Rigid

    if not isinstance(skill.fit.model, Rigid):
        raise BadInput(
            f"{skill.fit.kind} has no rigid links", where=where, remedy="leave it out, or learn with --method screws"
        )
    return skill.fit.model
