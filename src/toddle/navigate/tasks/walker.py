"""The walker that has to go to a goal: Huber's fusion of the walking pattern with PPO (2019, section 4.3.2), and more.

The document's task: the observation is the goal in the robot's frame, the actions are vx and omega, the rewards are
those of `rewards`. Beyond it: goals all around, a time limit, circles on the floor, people who walk, a range scan, and
vy as a third action. The robot starts at the origin and faces x; the world is the frame of its start.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray

from toddle.failures import BadInput
from toddle.navigate.scenarios.layouts import ROOM, Layout, layout
from toddle.navigate.task import Continuous, Outcome, Step
from toddle.navigate.tasks.people import RADIUS, People, Room, enter, walk
from toddle.navigate.tasks.rewards import Rewards
from toddle.navigate.tasks.scan import scan
from toddle.navigate.walks import Walks

_ENDS = (Outcome.WON, Outcome.LOST, Outcome.COLLIDED, Outcome.FELL)
_AROUND = 1.0  # the people's room reaches so far beyond start and goal [m]


class Course(NamedTuple):
    """An episode under way.

    Attributes:
        walker: the state of `Walks`.
        place: x, y [m] and yaw [rad] of the robot.
        goal: x, y [m].
        circles: x, y, radius of each obstacle [m]; a negative radius for none.
        people: who walk around.
        seen: the last range scan, as shares of its reach.
        steps: actions so far.
    """

    walker: Any
    place: Float[Array, "3"]
    goal: Float[Array, "2"]
    circles: Float[Array, "circles 3"]
    people: People
    seen: Float[Array, " rays"]
    steps: Int[Array, ""]


class Bearing(NamedTuple):
    """The goal as the robot has it.

    Attributes:
        goal: in the robot's frame: ahead, to the left [m].
        distance: to it [m].
        frontal: cosine of the angle between the robot's x axis and the way to it.
    """

    goal: Float[Array, "2"]
    distance: Float[Array, ""]
    frontal: Float[Array, ""]


@dataclass(frozen=True)
class WalkerTask:
    """Fulfils `Task`.

    A step checks the goal, circles and people where it ends. An episode is late by time alone: it is cut off, nothing
    is lost. A walker that breaks down, or whose place is no longer a number, has fallen.

    Attributes:
        walks: the walker.
        goal: how far away the goal is drawn, at least and at most [m].
        near: so near it is reached [m].
        far: farther away from the goal, the robot is lost [m].
        seconds: after so long the episode is late [s].
        sideways: whether vy is a third action.
        circles: at most so many; each number up to it is drawn as often.
        people: so many walk around.
        rays: of the range scan, all around; None: 24 where there are circles or people, else 0.
        reach: of the range scan [m].
        body: radius of the robot: it collides nearer than that to a circle's or a person's edge [m].
        observe: "document": the goal in the robot's frame [m]; "full": also the velocity let through last, as shares of
            the fastest, the scan, and where there are people, how each ray changed [1/s].
        told: whether the walking pattern is told of circles and people, and may evade them by itself.
        hold: the pattern advances so often with each action.
        rewards: what counts how much.
    """

    walks: Walks
    goal: tuple[float, float] = (0.5, 3.0)
    near: float = 0.2
    far: float = 4.0
    seconds: float = 60.0
    sideways: bool = False
    circles: int = 0
    people: int = 0
    rays: int | None = None
    reach: float = 2.0
    body: float = 0.2
    observe: Literal["document", "full"] = "document"
    told: bool = False
    hold: int = 1
    rewards: Rewards = field(default_factory=Rewards)

    def __post_init__(self) -> None:
        _check(self)

    @property
    def scan_rays(self) -> int:
        """How many numbers the scan has."""
        if self.observe == "document":
            return 0
        default = 24 if self.circles or self.people else 0
        return default if self.rays is None else self.rays

    @property
    def observations(self) -> int:
        """How many numbers an observation has."""
        return 2 if self.observe == "document" else 5 + self.scan_rays * (2 if self.people else 1)

    @property
    def actions(self) -> Continuous:
        """Ahead, perhaps to the left, turning left: shares of the fastest (backwards: of the slowest)."""
        return Continuous(3 if self.sideways else 2)

    @property
    def dt(self) -> float:
        """One action lasts so long [s]."""
        return self.hold * self.walks.seconds

    def start(self, key: PRNGKeyArray) -> tuple[Course, Float[Array, " numbers"]]:
        """A new episode with a goal, circles and people drawn."""
        where, who = jax.random.split(key)
        return self.begin(layout(where, self.goal, self.circles, self.body), who)

    def begin(self, where: Layout, key: PRNGKeyArray) -> tuple[Course, Float[Array, " numbers"]]:
        """A new episode in a given layout.

        Args:
            where: the goal, and as many circles as there are to be.
            key: for people.
        """
        walker = self.walks.start()
        place, goal = self.walks.place(walker), jnp.asarray(where.goal)
        people = enter(key, room(goal), self.people, self.body + RADIUS + ROOM)
        seen = self._scan(place, jnp.asarray(where.circles), people)
        course = Course(walker, place, goal, jnp.asarray(where.circles), people, seen, jnp.int32(0))
        return course, self._observation(course, jnp.zeros_like(seen))

    def step(self, state: Course, action: Float[Array, " action"], key: PRNGKeyArray) -> tuple[Course, Step]:
        """One action, for `dt`.

        Args:
            state: before.
            action: -1 to 1; what lies beyond counts as the nearest of these.
            key: for people.
        """
        people = walk(state.people, key, room(state.goal), self.dt)
        told = jnp.concatenate([state.circles, people.circles]) if self.told else jnp.zeros((0, 3))
        walker = self._advanced(state.walker, self.velocity(action), told)
        place = self.walks.place(walker)
        whole = jnp.isfinite(place).all()
        place = jnp.where(whole, place, state.place)
        seen = self._scan(place, state.circles, people)
        after = Course(walker, place, state.goal, state.circles, people, seen, state.steps + 1)
        outcome = self._outcome(after, self.walks.fallen(walker) | ~whole)
        last, now = bearing(state.place, state.goal), bearing(place, state.goal)
        time = after.steps.astype(jnp.float32) * self.dt
        reward = self.rewards(last.distance - now.distance, now.frontal - last.frontal, time, outcome)
        observation = self._observation(after, (seen - state.seen) / self.dt)
        ended = jnp.stack([outcome == end for end in _ENDS]).any()
        return after, Step(observation, reward, ended, outcome == Outcome.LATE, outcome)

    def velocity(self, action: Float[Array, " action"]) -> Float[Array, "3"]:
        """What an action asks of the walker: vx, vy [m/s], omega [rad/s]."""
        shares = jnp.clip(action, -1.0, 1.0)
        most = self.walks.fastest
        ahead = shares[0] * jnp.where(shares[0] >= 0, most[0], -self.walks.slowest)
        aside = shares[1] * most[1] if self.sideways else jnp.zeros_like(ahead)
        return jnp.stack([ahead, aside, shares[-1] * most[2]])

    def _advanced(self, walker: Any, velocity: Float[Array, "3"], told: Float[Array, "circles 3"]) -> Any:
        if self.hold == 1:
            return self.walks.advance(walker, velocity, told)
        return jax.lax.fori_loop(0, self.hold, lambda _, now: self.walks.advance(now, velocity, told), walker)

    def _outcome(self, course: Course, fallen: Array) -> Int[Array, ""]:
        distance = bearing(course.place, course.goal).distance
        conditions = [
            (fallen, Outcome.FELL),
            (self._gap(course) < 0, Outcome.COLLIDED),
            (distance <= self.near, Outcome.WON),
            (distance > self.far, Outcome.LOST),
            (course.steps >= math.ceil(self.seconds / self.dt - 1e-6), Outcome.LATE),
        ]
        goes_on = jnp.int32(Outcome.GOES_ON)
        return jnp.select([met for met, _ in conditions], [jnp.int32(end) for _, end in conditions], goes_on)

    def _gap(self, course: Course) -> Float[Array, ""]:
        """Between the robot's edge and the nearest obstacle's [m]; infinite without obstacles."""
        circles = jnp.concatenate([course.circles, course.people.circles])
        away = jnp.hypot(*(circles[:, :2] - course.place[None, :2]).T) - circles[:, 2] - self.body
        return jnp.min(jnp.where(circles[:, 2] >= 0, away, jnp.inf), initial=jnp.inf)

    def _scan(self, place: Float[Array, "3"], circles: Float[Array, "circles 3"], people: People) -> Array:
        return scan(place, jnp.concatenate([circles, people.circles]), self.scan_rays, self.reach)

    def _observation(self, course: Course, change: Float[Array, " rays"]) -> Float[Array, " numbers"]:
        velocity = self.walks.velocity(course.walker)
        return self.observation(course.place, course.goal, velocity, course.seen, change)

    def observation(
        self,
        place: Float[Array, "3"],
        goal: Float[Array, "2"],
        velocity: Float[Array, "3"],
        seen: Float[Array, " rays"],
        change: Float[Array, " rays"],
    ) -> Float[Array, " numbers"]:
        """What a policy is shown, here and on a robot.

        Args:
            place: x, y [m] and yaw [rad] of the robot.
            goal: x, y [m].
            velocity: let through last: vx, vy [m/s], omega [rad/s].
            seen: `scan` of `scan_rays` rays.
            change: of it since the last action [1/s]; 0 at first.
        """
        ahead = bearing(place, goal).goal
        if self.observe == "document":
            return ahead
        shares = velocity / jnp.array(self.walks.fastest)
        row = jnp.concatenate([ahead, shares, seen, *([change] if self.people else [])])
        return jnp.where(jnp.isfinite(row), row, 0.0)


def bearing(place: Float[Array, "3"], goal: Float[Array, "2"]) -> Bearing:
    """The goal from a place: g_a = R_z(yaw)^-1 (g_w - a_w), Huber's section 4.3.2.

    Args:
        place: x, y [m] and yaw [rad] of the robot.
        goal: x, y [m].
    """
    way = goal - place[:2]
    cos, sin = jnp.cos(place[2]), jnp.sin(place[2])
    seen = jnp.stack([cos * way[0] + sin * way[1], cos * way[1] - sin * way[0]])
    distance = jnp.hypot(way[0], way[1])
    return Bearing(seen, distance, seen[0] / jnp.maximum(distance, 1e-6))


def room(goal: Float[Array, "2"]) -> Room:
    """Where people walk: a square around start and goal [m]."""
    return Room(goal / 2, jnp.hypot(goal[0], goal[1]) / 2 + _AROUND)


def _check(task: WalkerTask) -> None:
    """Refuses numbers that make no task."""
    nearest, farthest = task.goal
    if not 0 < task.near < nearest <= farthest < task.far < math.inf:
        raise BadInput(
            f"near {task.near}, goals at {nearest} to {farthest}, far {task.far} are in no order",
            where="walker task, goal",
            remedy="choose 0 < near < nearest <= farthest < far [m]",
        )
    above: Mapping[str, float] = {"seconds": task.seconds, "reach": task.reach, "body": task.body, "hold": task.hold}
    for name, value in above.items():
        if not (math.isfinite(value) and value > 0):
            raise BadInput(f"{value} is no use", where=f"walker task, {name}", remedy="give a number above 0")
    for name, count in {"circles": task.circles, "people": task.people, "rays": task.rays or 0}.items():
        if count < 0:
            raise BadInput(f"{count} is no number of them", where=f"walker task, {name}", remedy="give 0 or more")
    if task.observe not in ("document", "full"):
        raise BadInput(f"{task.observe!r} is unknown", where="walker task, observe", remedy="say document or full")
