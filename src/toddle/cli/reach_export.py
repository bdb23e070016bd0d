"""What a learned body becomes beside a skill: a URDF, a file that answers without toddle, movements to make next."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from toddle.failures import BadInput

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from toddle.reach.body_skill import BodySkill
    from toddle.reach.model.rigid import Rigid
    from toddle.robots.body import Body

_LEAST_NOISE = 1e-6  # [m]


def write_urdf(skill: BodySkill, path: Path) -> None:
    """Write the learned body as a URDF file; a corrected one as the user's own file with its joints moved.

    Raises:
        BadInput: it has no rigid links, or the file can't be written.
    """
    from toddle.outside.files import write_bytes
    from toddle.robots.urdf_corrected import corrected_urdf
    from toddle.robots.urdf_text import urdf_text

    model = rigid_of(skill, "--to-urdf")
    about = f"{skill.fit.kind}, from {len(skill.experience.q)} movements; error to expect {1000 * skill.typical:.2f} mm"
    source = skill.source
    name = Path(source.spec).stem or "learned"
    text = urdf_text(name, skill.joints, model.linkage, skill.lower, skill.upper, about=about)
    if skill.fit.kind == "corrected" and Path(source.spec).suffix == ".urdf":
        with contextlib.suppress(BadInput):  # a chain that climbs before it descends is written as a new file
            text = corrected_urdf(
                Path(source.spec).read_bytes(), source.spec, model.linkage, tip=source.tip, base=source.base,
                joints=source.joints, about=about,
            )  # fmt: skip
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


def propose(skill: BodySkill, count: int) -> None:
    """Print the movements that would tell most about a learned body, as a CSV table of joint values.

    Raises:
        BadInput: it has no rigid links.
    """
    from toddle.reach.explore.informative import propose as most_informative

    model = rigid_of(skill, "--propose")
    sensor = max(skill.fit.sensor, _LEAST_NOISE)
    _print_table(skill.joints, most_informative(model, skill.lower, skill.upper, count, sensor=sensor))


def propose_first(body: Body, count: int) -> None:
    """Print the movements that would tell most about how wrong a robot's description is, as a CSV table.

    Raises:
        BadInput: it has no rigid links.
    """
    import numpy as np

    from toddle.reach.explore.informative import propose as most_informative
    from toddle.reach.model.corrected import assumed
    from toddle.robots.chain import Chain
    from toddle.robots.linkage import linkage_of

    if not isinstance(body, Chain):
        raise BadInput(f"{body.name} has no rigid links", where="--propose", remedy="leave it out")
    model = assumed(linkage_of(body), coordinates=body.coordinates)
    _print_table(body.joints, most_informative(model, np.asarray(body.lower), np.asarray(body.upper), count))


def _print_table(names: Sequence[str], q: np.ndarray) -> None:
    print(",".join(names))
    for row in q:
        print(",".join(f"{value:.5f}" for value in row))


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
