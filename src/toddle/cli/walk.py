"""``toddle walk``: a humanoid walks in physics, by a scenario, a script or keys; or only its pattern is made."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

from toddle.cli.arguments import parse
from toddle.cli.options import POSITIONAL
from toddle.cli.walk_folder import refuse_used
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.robots.gait import Gait
    from toddle.signals import Circle, Velocity
    from toddle.walk.scenarios import Leg

DEFAULT_ROBOT = "heicub"
_LONGEST = 3600.0  # [s]
_FARTHEST = 1000.0  # [m]
_HARDEST = 1000.0  # [N s]
_THERE = 60.0  # a policy takes no longer [s]
_PROG = "toddle walk"


@dataclass(frozen=True)
class Walk:
    """A humanoid walks under velocity commands, in physics.

    toddle walk shows the iCub walking straight ahead. toddle walk --keys lets you drive it. A run leaves a folder with
    figures, the trajectory, pictures, and a film where there is something to draw with. The exit code is 1 where the
    robot fell.

    Attributes:
        robot: a name (heicub, icub), or the path of a humanoid's URDF or MJCF file; heicub unless given.
        command: walk at this velocity: ahead, to the left [m/s], turning left [rad/s].
        script: walk by a file of lines "t vx vy omega".
        keys: drive it yourself, from this terminal.
        policy: walk by a policy that toddle navigate left in this folder, to --goal.
        goal: where the policy is to walk: x ahead, y to the left of the start [m].
        scenario: walk one that has a name: straight, sideways, curve, turn, diagonal, obstacle, stop-and-go; straight
            unless given.
        for_: how long to walk [s]; 20 unless the scenario or the script says otherwise, with --keys until you quit,
            with --policy until it is there, at most 60.
        iterations: how long, in iterations of the walking pattern.
        push: push the chest: N.s@t, such as 6@5 for 6 N s at 5 s, or 6@5@90 towards the left; may be given again.
        obstacle: a tall cylinder: x, y and radius [m]; may be given again.
        pattern_only: make the walking pattern without a body, in no time.
        weights: of the walking pattern: ours, or the document's, with its timing and its open loop.
        deadline: an iteration of the pattern that takes longer is not used [ms].
        config: a TOML file that says what a humanoid's description leaves out.
        noise: of the sensors; 1 for those of a good robot.
        delay: age of what the sensors tell, a multiple of 10 [ms].
        lag: time constant of the servos [ms].
        friction: of the floor; 0.8 unless given.
        tilt: of the floor [degrees].
        mass_error: how far off the links' masses are, 0.1 for ten percent.
        seed: of all randomness.
        video: film it; done where it can be, and not with --keys, unless told.
        out: the folder to leave; runs/walk-ROBOT unless given.
        json: print one JSON object with the figures, and nothing else.
    """

    robot: Annotated[str | None, POSITIONAL] = None
    command: tuple[float, float, float] | None = None
    script: Path | None = None
    keys: bool = False
    policy: Path | None = None
    goal: tuple[float, float] | None = None
    scenario: str | None = None
    for_: float | None = None
    iterations: int | None = None
    push: tuple[tuple[str], ...] = ()
    obstacle: tuple[tuple[float, float, float], ...] = ()
    pattern_only: bool = False
    weights: Literal["default", "document"] = "default"
    deadline: float | None = None
    config: Path | None = None
    noise: float | None = None
    delay: float | None = None
    lag: float | None = None
    friction: float | None = None
    tilt: float | None = None
    mass_error: float | None = None
    seed: int = 0
    video: bool | None = None
    out: Path | None = None
    json: bool = False


class Push(NamedTuple):
    """A push at the chest: impulse [N s], time [s], direction from straight ahead, turning left [degrees]."""

    impulse: float
    t: float
    direction: float


class Task(NamedTuple):
    """What is to be walked.

    Attributes:
        name: of the scenario, or "command", "script", "keys", "policy".
        legs: the velocities over time; nothing with keys or a policy.
        seconds: how long.
        circles: obstacles, in the frame in which the robot starts.
        pushes: at the chest.
    """

    name: str
    legs: tuple[Leg, ...]
    seconds: float
    circles: tuple[Circle, ...]
    pushes: tuple[Push, ...]


_OF_A_BODY = ("keys", "policy", "push", "noise", "delay", "lag", "friction", "tilt", "mass_error", "video")
_RANGES = {
    "for_": (0.01, _LONGEST, "s"), "deadline": (0.0, 10_000.0, "ms"), "noise": (0.0, 1000.0, ""),
    "delay": (0.0, 1000.0, "ms"), "lag": (0.0, 1000.0, "ms"), "friction": (0.01, 10.0, ""),
    "tilt": (0.0, 45.0, "degrees"), "mass_error": (0.0, 0.9, ""), "iterations": (1, 100_000, ""),
    "seed": (0, 2**32 - 1, ""),
}  # fmt: skip


def main(argv: Sequence[str]) -> int:
    """Walk, and return the exit code."""
    asked = parse(Walk, argv, prog=_PROG)
    _check(asked)
    if asked.pattern_only:
        from toddle.cli.walk_pattern import make_pattern

        return make_pattern(asked)
    from toddle.cli.walk_physics import walk_in_physics

    return walk_in_physics(asked)


def _check(asked: Walk) -> None:
    """Refuse what contradicts itself or is out of range before anything heavy is imported."""
    _one_of(asked, ("command", "script", "keys", "policy", "scenario"))
    if (asked.policy is None) != (asked.goal is None):
        raise BadInput("--policy and --goal belong together", where=_PROG, remedy="give both")
    if asked.goal is not None and not 0 < math.hypot(*asked.goal) <= _FARTHEST:
        raise BadInput("it is here already, or too far", where="--goal", remedy=f"give x and y up to {_FARTHEST:g} m")
    _one_of(asked, ("for_", "iterations"))
    for name, (low, high, unit) in _RANGES.items():
        value = getattr(asked, name)
        if value is not None and not low <= value <= high:
            remedy = f"give {low:g} to {high:.10g} {unit}".strip()
            raise BadInput(f"{value:g} is out of range", where=_flag(name), remedy=remedy)
    if asked.pattern_only:
        for name in _OF_A_BODY:
            if getattr(asked, name):
                raise BadInput("a pattern has no body", where=_flag(name), remedy="leave it or --pattern-only out")
    for x, y, radius in asked.obstacle:
        if not 0.001 <= radius <= _FARTHEST or max(abs(x), abs(y)) > _FARTHEST:
            what = f"{x:g} {y:g} {radius:g} is out of range"
            raise BadInput(what, where="--obstacle", remedy=f"give x, y and a radius above 0, up to {_FARTHEST:g} m")
    if asked.command is not None and max(map(abs, asked.command)) > _FARTHEST:
        raise BadInput("the velocity is out of range", where="--command", remedy="give m/s, m/s and rad/s")
    if asked.keys and not sys.stdin.isatty():
        raise BadInput(
            "standard input is no terminal", where="--keys", remedy="run it in a terminal, or give --command"
        )
    for (word,) in asked.push:
        _ = read_push(word)
    refuse_used(asked.out)


def _one_of(asked: Walk, names: Sequence[str]) -> None:
    given = [_flag(name) for name in names if getattr(asked, name) not in (None, False)]
    if len(given) > 1:
        raise BadInput(f"{' and '.join(given)} exclude each other", where=_PROG, remedy="give one")


def _flag(name: str) -> str:
    return "--" + name.rstrip("_").replace("_", "-")


def read_push(word: str) -> Push:
    """A push from its word, such as 6@5 or 6@5@90.

    Raises:
        BadInput: it is none.
    """
    remedy = "give N.s@t or N.s@t@degrees, such as 6@5@90"
    try:
        numbers = [float(part) for part in word.split("@")]
        push = Push(numbers[0], numbers[1], *numbers[2:] or [0.0])
    except (ValueError, TypeError, IndexError):
        raise BadInput(f"{word[:60]!r} is no push", where="--push", remedy=remedy) from None
    if not all(map(math.isfinite, push)) or not (0 <= push.impulse <= _HARDEST and 0 <= push.t <= _LONGEST):
        raise BadInput(f"{word[:60]!r} is out of range", where="--push", remedy=remedy)
    return push


def task_of(asked: Walk, gait: Gait) -> Task:
    """What is to be walked, by a robot that steps so.

    Raises:
        BadInput: there is no such scenario, or the script can't be used.
    """
    from toddle.outside.teleoperation.commands import script_seconds
    from toddle.outside.teleoperation.script import read_script
    from toddle.signals import Circle, Velocity
    from toddle.walk.scenarios import Leg, scenario_named

    circles = tuple(Circle(*numbers) for numbers in asked.obstacle)
    pushes = tuple(read_push(word) for (word,) in asked.push)
    name, legs, seconds = "command", (Leg(0.0, Velocity(*(asked.command or (0.0, 0.0, 0.0)))),), 20.0
    if asked.keys:
        name, legs, seconds = "keys", (), _LONGEST
    elif asked.policy is not None:
        name, legs, seconds = "policy", (), _THERE
    elif asked.script is not None:
        legs = read_script(asked.script)
        name, seconds = "script", script_seconds(legs)
    elif asked.command is None:
        scenario = scenario_named(asked.scenario or "straight")
        name, legs, seconds = scenario.name, scenario.legs, scenario.seconds
        circles += scenario.circles
    if asked.iterations is not None:
        seconds = asked.iterations * gait.sample
    return Task(name, legs, asked.for_ or seconds, circles, pushes)


def tell_capped(task: Task, through: Callable[[Velocity], Velocity], robot: str) -> None:
    """Say where less is let through than is asked."""
    for leg in task.legs:
        allowed = through(leg.velocity)
        if max(abs(a - b) for a, b in zip(allowed, leg.velocity, strict=True)) > 1e-9:
            asked, most = (" ".join(f"{part:.3g}" for part in velocity) for velocity in (leg.velocity, allowed))
            print(f"{robot}: {asked} is more than it walks safely; {most} is let through", file=sys.stderr)
            return
