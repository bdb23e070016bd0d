"""The robots that toddle knows by name: one frozen record each, and the only place to edit to add one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from toddle.failures import BadInput, unknown_name

if TYPE_CHECKING:
    from toddle.robots.body import Body

MODELS = Path(__file__).parent / "models"


@dataclass(frozen=True)
class Robot:
    """What the catalogue says of one robot.

    Attributes:
        name: how it is called on the command line.
        about: one line for the listing.
        build: makes the body; it takes the tip, base and joints that were asked for.
        source: the document or package its numbers come from.
        test_points: how many points the document's fixed test set has (0: none is documented).
        test_spacing: the least distance between two of them [m].
        hidden: hidden layers that suit its learner.
        published: the document's mean errors [mm], by the name of the figure.
    """

    name: str
    about: str
    build: Callable[[str | None, str | None, Sequence[str] | None], Body]
    source: str
    test_points: int = 0
    test_spacing: float = 0.0
    hidden: tuple[int, ...] = (20,)
    published: Mapping[str, float] = field(default_factory=dict)


def _urdf(file: Path) -> Callable[[str | None, str | None, Sequence[str] | None], Body]:
    def build(tip: str | None, base: str | None, joints: Sequence[str] | None) -> Body:
        from toddle.robots.urdf import read_urdf

        return read_urdf(file, tip=tip, base=base, joints=joints)

    return build


CATALOGUE = {
    robot.name: robot
    for robot in (
        Robot(
            "nicu",
            "right arm of the humanoid NICU, four joints",
            _urdf(MODELS / "nicu.urdf"),
            "Mahboob 2015, chapters 3 and 4",
            test_points=110,
            test_spacing=0.10,
            hidden=(10,),
            published={"fixed_error_mean_mm": 24.7, "seen_error_mean_mm": 18.0},
        ),
    )
}


def load(
    spec: str, *, tip: str | None = None, base: str | None = None, joints: Sequence[str] | None = None
) -> Body:
    """The body that a name or a path stands for.

    Args:
        spec: a name of the catalogue, ``planar:N``, or the path of a URDF file.
        tip: the link whose position is reported.
        base: the link in whose frame it is reported.
        joints: names of the actuated joints.

    Raises:
        BadInput: there is no such robot or file, or it can't be used.
    """
    if spec.startswith("planar:"):
        from toddle.robots.planar import planar

        count = spec.removeprefix("planar:")
        if not count.isdecimal():
            raise BadInput(f"N is {count!r}", where=spec, remedy="give a number of joints, such as planar:5")
        return planar(int(count))
    if spec in CATALOGUE:
        return CATALOGUE[spec].build(tip, base, joints)
    if Path(spec).suffix or "/" in spec:
        return _urdf(Path(spec))(tip, base, joints)
    raise unknown_name("robot", spec, names())


def names() -> list[str]:
    """Every name of the catalogue."""
    return list(CATALOGUE)


def describe() -> list[Robot]:
    """Every record of the catalogue, for a listing."""
    return list(CATALOGUE.values())
