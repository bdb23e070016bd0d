"""The robots that toddle knows by name: one frozen record each, and the only place to edit to add one."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from toddle.failures import BadInput, MissingExtra, unknown_name

if TYPE_CHECKING:
    from toddle.robots.body import Body
    from toddle.robots.gait import Gait
    from toddle.robots.humanoids.settings import Settings

MODELS = Path(__file__).parent / "models"


@dataclass(frozen=True)
class Choice:
    """What was asked for: a name or a path, and which part of the robot."""

    spec: str
    tip: str | None = None
    base: str | None = None
    joints: Sequence[str] | None = None

    @property
    def called(self) -> str:
        """A short name: a file's without its folder."""
        return Path(self.spec).stem if Path(self.spec).suffix else self.spec


@dataclass(frozen=True)
class Robot:
    """What the catalogue says of one robot.

    Attributes:
        name: how it is called on the command line.
        about: one line for the listing.
        build: makes the body.
        source: the document or package its numbers come from.
        file: its description, where toddle ships one (physics needs the masses in it).
        test_points: how many points the document's fixed test set has; 0: none is documented.
        test_spacing: the least distance between two of them [m]; 0: the widest at which they fit.
        hidden: hidden layers that suit its learner.
        published: the document's mean errors [mm], by the name of the figure.
    """

    name: str
    about: str
    build: Callable[[Choice], Body]
    source: str
    file: Path | None = None
    test_points: int = 0
    test_spacing: float = 0.0
    hidden: tuple[int, ...] = (40, 40)
    published: Mapping[str, float] = field(default_factory=dict)


def load(
    spec: str | os.PathLike[str],
    *,
    tip: str | None = None,
    base: str | None = None,
    joints: Sequence[str] | None = None,
) -> Body:
    """The body that a name or a path stands for.

    Args:
        spec: a name of the catalogue, ``planar:N``, the path of a URDF or MJCF file, or a name of the package
            robot_descriptions where that is installed.
        tip: the link (or site) whose position is reported; None: the end of its arm, inferred and told in its notes.
        base: the link in whose frame it is reported; None: the root.
        joints: names of the actuated joints, the others are held; None: every joint that moves the tip.

    Raises:
        BadInput: there is no such robot or file, or it can't be used.
    """
    return load_choice(Choice(os.fspath(spec), tip, base, joints))


def load_choice(choice: Choice) -> Body:
    """The body that was asked for; see `load`."""
    robot = record(choice.spec)
    if robot is not None:
        return robot.build(choice)
    if _looks_like_a_file(choice.spec):
        return _read(Path(choice.spec), choice)
    return _from_descriptions(choice)


def settled(choice: Choice) -> Choice:
    """What was asked for, to be found again from any folder: a file by its whole path."""
    if record(choice.spec) is None and os.path.exists(choice.spec):
        return replace(choice, spec=str(Path(choice.spec).resolve()))
    return choice


def record(spec: str) -> Robot | None:
    """The catalogue's record of a robot; None where the catalogue does not know it."""
    family = spec.split(":")[0]
    return CATALOGUE.get("planar:N" if family == "planar" else spec)


def names() -> tuple[str, ...]:
    """Every name of the catalogue, ``planar:N`` for the family."""
    return tuple(CATALOGUE)


def describe() -> tuple[Robot, ...]:
    """Every record of the catalogue, for a listing."""
    return tuple(CATALOGUE.values())


def _looks_like_a_file(spec: str) -> bool:
    return bool(spec) and (bool(Path(spec).suffix) or os.sep in spec or Path(spec).exists())


def _read(path: Path, choice: Choice) -> Body:
    from toddle.robots import files

    return files.read(path, tip=choice.tip, base=choice.base, joints=choice.joints)


def _from_descriptions(choice: Choice) -> Body:
    from toddle.robots import packages

    full = packages.full_name(choice.spec)
    if full is not None:
        return packages.described(full, choice.tip, choice.base, choice.joints)
    known = packages.descriptions()
    if not known and choice.spec.endswith("_description"):
        raise MissingExtra("robot-descriptions", "descriptions", what_for=choice.spec)
    raise unknown_name("robot", choice.spec, [*names(), *known])


def _whole(choice: Choice) -> None:
    """Refuse to cut a robot that has one base, one tip and no names of parts."""
    for what in ("tip", "base", "joints"):
        if getattr(choice, what) is not None:
            raise BadInput(f"its {what} can't be chosen", where=choice.spec, remedy=f"leave {what} out, or name a file")


def _nicu(choice: Choice) -> Body:
    return _read(MODELS / "nicu.urdf", choice)


def _nicu_wide(choice: Choice) -> Body:
    from toddle.robots import ranges

    return ranges.in_degrees(_nicu(choice), "nicu-wide", _NICU_WIDE)


def _suralp(choice: Choice) -> Body:
    return _read(MODELS / "suralp.urdf", choice)


def _suralp_wide(choice: Choice) -> Body:
    from toddle.robots import ranges

    return ranges.in_degrees(_suralp(choice), "suralp-wide", _SURALP_WIDE)


def _icub_arm(choice: Choice) -> Body:
    from toddle.robots import packages

    return packages.icub_arm(choice.tip, choice.base, choice.joints)


def _planar(choice: Choice) -> Body:
    from toddle.robots import planar

    _whole(choice)
    count = choice.spec.partition(":")[2]
    if not (count.isascii() and count.isdecimal() and len(count) < 10):
        raise BadInput(f"N is {count!r}", where=choice.spec, remedy="give a number of joints, such as planar:5")
    return planar.planar(int(count))


def _planar3(choice: Choice) -> Body:
    from toddle.robots import dh

    _whole(choice)
    return dh.planar3()


def _scara(choice: Choice) -> Body:
    from toddle.robots import dh

    _whole(choice)
    return dh.scara()


def _bha(choice: Choice) -> Body:
    from toddle.robots import continuum

    _whole(choice)
    return continuum.bha()


_NICU_WIDE = {
    "shoulder_z": (-70.0, 50.0),
    "shoulder_y": (-20.0, 20.0),
    "arm_x": (-90.0, 90.0),
    "elbow_y": (-90.0, 90.0),
}
_SURALP_WIDE = {
    "shoulder_y": (-90.0, 90.0),
    "shoulder_x": (-90.0, 90.0),
    "shoulder_z": (-45.0, 45.0),
    "elbow_y": (-90.0, 90.0),
}

_ROBOTS = (
    Robot(
        "nicu",
        "right arm of the humanoid NICU, four joints",
        _nicu,
        "Mahboob 2015, chapters 3 and 4",
        file=MODELS / "nicu.urdf",
        test_points=110,
        hidden=(10,),
        published={"fixed_error_mean_mm": 24.7, "seen_error_mean_mm": 18.0},
    ),
    Robot(
        "nicu-wide",
        "the same arm, its ranges read as plus or minus",
        _nicu_wide,
        "Mahboob 2015, section 4.3",
        file=MODELS / "nicu.urdf",
        test_points=110,
        test_spacing=0.10,
        hidden=(10,),
        published={"fixed_error_mean_mm": 24.7, "seen_error_mean_mm": 18.0},
    ),
    Robot(
        "suralp",
        "right arm of the humanoid SURALP, four joints",
        _suralp,
        "Mahboob 2015, chapter 5",
        file=MODELS / "suralp.urdf",
        test_points=60,
        hidden=(40, 40),
        published={"fixed_error_mean_mm": 28.0, "seen_error_mean_mm": 19.0},
    ),
    Robot(
        "suralp-wide",
        "the same arm, its ranges read as plus or minus",
        _suralp_wide,
        "Mahboob 2015, section 5.3",
        file=MODELS / "suralp.urdf",
        test_points=60,
        test_spacing=0.16,
        hidden=(40, 40),
        published={"fixed_error_mean_mm": 28.0, "seen_error_mean_mm": 19.0},
    ),
    Robot(
        "icub_arm",
        "right arm of the humanoid iCub, chest to hand, seven joints (extra: icub)",
        _icub_arm,
        "the package icub-models",
    ),
    Robot(
        "planar:N",
        "N equal links in the plane, one metre long (planar:5, planar:20, planar:50, ...)",
        _planar,
        "Rolf 2013; Mahboob 2015, appendix A",
        hidden=(100, 100),
    ),
    Robot("planar3", "three links in the plane", _planar3, "Martin 2009, table 1"),
    Robot("scara", "SCARA arm: three turning joints and one that slides", _scara, "Martin 2009, table 2"),
    Robot(
        "bha",
        "bionic handling assistant: a soft arm, nine actuators in three segments",
        _bha,
        "Thuruthel 2016",
    ),
)

CATALOGUE: Mapping[str, Robot] = {robot.name: robot for robot in _ROBOTS}


@dataclass(frozen=True)
class HumanoidRecord:
    """What the catalogue says of one humanoid.

    Attributes:
        name: how it is called on the command line.
        about: one line for the listing.
        source: the document or package its numbers come from.
        build: where its description lies and what is said of it; None: it has a gait and no body.
    """

    name: str
    about: str
    source: str
    build: Callable[[], tuple[Path, Settings]] | None = None

    @property
    def gait(self) -> Gait | None:
        """How it walks by default; None: that is inferred when its body is loaded."""
        from toddle.robots.humanoids import gaits

        return gaits.DEFAULT.get(self.name)

    @property
    def document_gait(self) -> Gait | None:
        """How it walks in Huber 2019; None: it does not occur there."""
        from toddle.robots.humanoids import gaits

        return gaits.DOCUMENT.get(self.name)


def _heicub() -> tuple[Path, Settings]:
    from toddle.robots.humanoids import icub

    return icub.heicub()


def _icub() -> tuple[Path, Settings]:
    from toddle.robots.humanoids import icub

    return icub.icub()


def _talos() -> tuple[Path, Settings]:
    from toddle.robots.humanoids import others

    return others.talos()


def _g1() -> tuple[Path, Settings]:
    from toddle.robots.humanoids import others

    return others.g1()


_HUMANOIDS = (
    HumanoidRecord("heicub", "iCub without arms and head: 15 joints, 26 kg", "icub-models; Huber 2019", _heicub),
    HumanoidRecord("icub", "the whole iCub: 32 joints, 33 kg", "icub-models", _icub),
    HumanoidRecord("talos", "TALOS: 90 kg (extra: humanoids)", "example-robot-data", _talos),
    HumanoidRecord("g1", "Unitree G1: 33 kg (extra: humanoids)", "example-robot-data", _g1),
    HumanoidRecord("hrp2", "HRP-2: the pattern's numbers alone, no body", "Huber 2019"),
)

HUMANOIDS: Mapping[str, HumanoidRecord] = {humanoid.name: humanoid for humanoid in _HUMANOIDS}
"""The humanoids that toddle knows by name."""
