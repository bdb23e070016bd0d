"""A course for the walker in physics: where to, around what, among whom; how it is judged; how it ended."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.navigate.scenarios.layouts import Layout
from toddle.navigate.scenarios.planner import plan
from toddle.navigate.task import Outcome
from toddle.navigate.tasks.people import RADIUS, enter, walk
from toddle.navigate.tasks.walker import WalkerTask, room
from toddle.signals import Circle, Footstep

PACE = 0.1
"""People's places are told so often [s]; in between they go straight."""


@dataclass(frozen=True, eq=False)
class Course:
    """From the origin, facing x, to a goal.

    Attributes:
        goal: x, y [m].
        circles: obstacles that stand.
        people: x, y [m] of each person, every `PACE` from the start on; at the end they stand.
        person: a person's radius [m].
    """

    goal: tuple[float, float]
    circles: tuple[Circle, ...] = ()
    people: Float[np.ndarray, "times people 2"] | None = None
    person: float = RADIUS

    def walking(self, t: float) -> tuple[Circle, ...]:
        """The people at a time [s]."""
        if self.people is None or not self.people.size:
            return ()
        whole, share = divmod(max(t, 0.0) / PACE, 1.0)
        last = len(self.people) - 1
        before, after = self.people[min(int(whole), last)], self.people[min(int(whole) + 1, last)]
        return tuple(Circle(x, y, self.person) for x, y in (before + share * (after - before)).tolist())

    def around(self, t: float) -> tuple[Circle, ...]:
        """All obstacles at a time [s], those that stand first."""
        return (*self.circles, *self.walking(t))


@dataclass(frozen=True)
class Rules:
    """How a course is judged.

    Attributes:
        seconds: after so long it is late [s].
        near: the true waist so near to the goal has won [m].
        far: farther away from the goal it is lost [m].
        told: whether the walker's own avoidance of obstacles is told of circles and people.
        settle: whether it must also come to stand at the goal, without falling or touching anything.
        body: radius of the robot, for the shortest way [m].
    """

    seconds: float = 60.0
    near: float = 0.2
    far: float = 4.0
    told: bool = True
    settle: bool = True
    body: float = 0.2

    def __post_init__(self) -> None:
        """Refuses what is no time or distance.

        Raises:
            BadInput: a number that is not above 0.
        """
        for name in ("seconds", "near", "far", "body"):
            if not getattr(self, name) > 0:
                raise BadInput(
                    f"{getattr(self, name)} is no use", where=f"rules, {name}", remedy="give a number above 0"
                )


@dataclass(frozen=True, eq=False)
class Finish:
    """How a course ended; the simulator's truth.

    Attributes:
        outcome: won, collided, fell, late or lost.
        seconds: until the goal was reached, else until the end [s].
        path: time [s], x, y [m], yaw [rad] of the waist, every 0.05 s.
        feet: where each foot stood, in their order.
        length: of the path until ``seconds``, without the sway of the steps [m].
        shortest: way from the start until the goal is near, around the circles that stand [m]; NaN: there is none.
        clearance: the least from any part of the robot to an obstacle [m], at most 1; under 0 they overlap.
        zmp_error: mean distance of planned and measured zero moment point [m].
    """

    outcome: Outcome
    seconds: float
    path: Float[np.ndarray, "looks 4"]
    feet: tuple[Footstep, ...]
    length: float
    shortest: float
    clearance: float
    zmp_error: float

    @property
    def spl(self) -> float:
        """Success weighted by path length (Anderson et al. 2018): shortest / length where it won, else 0."""
        if self.outcome != Outcome.WON or not math.isfinite(self.shortest):
            return 0.0
        return self.shortest / max(self.length, self.shortest, 1e-9)


def courses_of(layouts: Layout) -> tuple[Course, ...]:
    """Courses in drawn layouts."""
    return tuple(
        Course(
            (float(goal[0]), float(goal[1])), tuple(Circle(*row) for row in rows.astype(float).tolist() if row[2] >= 0)
        )
        for goal, rows in zip(np.asarray(layouts.goal), np.asarray(layouts.circles), strict=True)
    )


def strolls(
    seed: int, goal: tuple[float, float], count: int, seconds: float, *, clear: float
) -> Float[np.ndarray, "times people 2"]:
    """Where people walk, drawn as in the walker's task.

    Args:
        seed: of the draw.
        goal: they walk in a square around start and goal [m].
        count: of people.
        seconds: how long [s].
        clear: nobody starts nearer to the robot than this, if a few draws find such a place [m].
    """
    times = math.ceil(seconds / PACE) + 1
    first, *keys = jax.random.split(jax.random.key(seed), times)
    square = room(jax.numpy.asarray(goal, jax.numpy.float32))
    people = jax.jit(enter, static_argnums=(2, 3))(first, square, count, clear)
    _, places = jax.lax.scan(
        lambda now, key: (walk(now, key, square, PACE), now.place), people, jax.numpy.stack([first, *keys])
    )
    return np.asarray(places, float)


def shortest_way(course: Course, near: float, body: float) -> float:
    """Length of the shortest way until the goal is near [m], for a disc of radius ``body``; NaN: there is none."""
    rows = np.array([tuple(circle) for circle in course.circles], float).reshape(-1, 3)
    way = plan(np.array(course.goal, float), rows, body=body)
    return math.nan if way is None else max(way.length - near, 0.0)


def path_length(path: Float[np.ndarray, "looks 4"], sway: float) -> float:
    """Of a path through its places every ``sway`` seconds [m]: at the same phase of the steps, which sway the waist."""
    if len(path) < 2:
        return 0.0
    each = max(round(sway / float(np.median(np.diff(path[:, 0])))), 1)
    places = path[[*range(0, len(path) - 1, each), len(path) - 1], 1:3]
    return float(np.hypot(*np.diff(places, axis=0).T).sum())


def summary(finishes: Sequence[Finish]) -> dict[str, Any]:
    """Of many courses: shares and means; means of times and lengths are those of the won ones."""
    count = len(finishes)
    won = [finish for finish in finishes if finish.outcome == Outcome.WON]
    counts = {outcome.name.lower(): sum(f.outcome == outcome for f in finishes) for outcome in Outcome if outcome}
    return {
        "courses": count,
        "success_rate": len(won) / count if count else math.nan,
        "won": counts["won"],
        "collisions": counts["collided"],
        "falls": counts["fell"],
        "late": counts["late"],
        "lost": counts["lost"],
        "seconds_mean": _mean([finish.seconds for finish in won]),
        "path_length_mean": _mean([finish.length for finish in won]),
        "spl_mean": _mean([finish.spl for finish in finishes]),
        "clearance_least": min((finish.clearance for finish in finishes), default=math.nan),
        "zmp_error_mean": _mean([finish.zmp_error for finish in finishes]),
    }


def _mean(numbers: Sequence[float]) -> float:
    return float(np.nanmean(numbers)) if np.isfinite(numbers).any() else math.nan


def rules_of(task: WalkerTask, *, settle: bool = True) -> Rules:
    """The rules that a task was learned by."""
    return Rules(task.seconds, task.near, task.far, task.told, settle, task.body)
