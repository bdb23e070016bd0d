"""Who steers: a policy, a person, a script, a planner, all asked the same: where are you, where to, what is around you?

A `Driver` is a value; what it remembers is handed back to it. `Steering` makes any of them a command source of a walk.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from toddle.navigate.scenarios.driver import drive
from toddle.navigate.sight import Showing, Sight
from toddle.navigate.tasks.scan import scan
from toddle.navigate.tasks.walker import WalkerTask
from toddle.signals import Circle, Velocity

_ROUNDING = 1e-9  # of times that were added up [s]
_ROOM_FOR = 4  # circles are filled up to a multiple of it, so that each number of them is not compiled anew


class Situation(NamedTuple):
    """What may be known when a velocity is wanted; all in one frame on the floor.

    Attributes:
        t: time [s].
        place: x, y [m] and yaw [rad] of the robot, from whatever localises it.
        goal: x, y [m].
        velocity: what the safety gate let through last.
        circles: obstacles that can be seen, people among them, where they are now.
        sight: what the robot's cameras see; None: nobody looks.
        showing: the truth beside it, for teachers; None where only the robot is asked.
    """

    t: float
    place: Float[np.ndarray, "3"]
    goal: tuple[float, float]
    velocity: Velocity
    circles: tuple[Circle, ...] = ()
    sight: Sight | None = None
    showing: Showing | None = None


@runtime_checkable
class Driver(Protocol):
    """Whoever wants a velocity."""

    @property
    def period(self) -> float:
        """It decides so often [s]; in between its last word holds."""
        ...

    def start(self) -> Any:
        """What it remembers at first."""
        ...

    def decide(self, memory: Any, situation: Situation) -> tuple[Velocity | None, Any]:
        """The velocity to walk at, None: it has ended; and what to remember."""
        ...


@dataclass(frozen=True)
class Timed:
    """A script or a person: whose velocity depends on the time alone.

    Attributes:
        source: the velocity at a time [s]; None: it has ended.
        period: how often it is asked [s].
    """

    source: Callable[[float], Velocity | None]
    period: float = 0.01

    def start(self) -> None:
        """Nothing is remembered."""

    def decide(self, memory: None, situation: Situation) -> tuple[Velocity | None, None]:
        """What the source says now."""
        return self.source(situation.t), None


@runtime_checkable
class Chooses(Protocol):
    """A policy, as `toddle.navigate.policy.Policy`: from an observation and its memory to an action, -1 to 1 each."""

    def start(self) -> Array:
        """The memory at the start of an episode."""
        ...

    def __call__(self, observation: Float[Array, " numbers"], memory: Array) -> tuple[Array, Array]:
        """The action, and the memory after it; runs under ``jit``."""
        ...


class Recall(NamedTuple):
    """What steering by a policy remembers.

    Attributes:
        memory: the policy's own.
        seen: the last range scan.
        first: nothing has been seen yet.
    """

    memory: Array
    seen: Float[Array, " rays"]
    first: Bool[Array, ""]


@dataclass(frozen=True, eq=False)
class Learned:
    """A policy that learned the walker's task: it sees and acts as it did there, without noise.

    Attributes:
        policy: chooses actions.
        task: what it learned; its walker only tells how fast it may be.
    """

    policy: Chooses
    task: WalkerTask

    @property
    def period(self) -> float:
        """As in training [s]."""
        return self.task.dt

    def start(self) -> Recall:
        """The policy's own memory, and nothing seen."""
        return Recall(self.policy.start(), jnp.ones(self.task.scan_rays), jnp.array(True))

    def decide(self, memory: Recall, situation: Situation) -> tuple[Velocity, Recall]:
        """What the policy thinks best; what is not finite asks to stand."""
        numbers = (situation.place, situation.goal, situation.velocity, _filled(situation.circles))
        given = [jnp.asarray(np.asarray(part), jnp.float32) for part in numbers]
        velocity, own, seen = _decision(self.policy, self.task)(memory.memory, memory.seen, memory.first, *given)
        vx, vy, omega = np.asarray(velocity).astype(float).tolist()
        return Velocity(vx, vy, omega), Recall(own, seen, jnp.array(False))


@lru_cache(maxsize=16)
def _decision(policy: Chooses, task: WalkerTask) -> Callable[..., tuple[Array, Array, Array]]:
    """One compiled decision of a policy."""

    def decision(
        memory: Array, last: Array, first: Array, place: Array, goal: Array, velocity: Array, circles: Array
    ) -> tuple[Array, Array, Array]:
        seen = scan(place, circles, task.scan_rays, task.reach)
        change = jnp.where(first, 0.0, (seen - last) / task.dt)
        action, memory = policy(task.observation(place, goal, velocity, seen, change), memory)
        return task.velocity(action), memory, seen

    return jax.jit(decision)


def _filled(circles: tuple[Circle, ...]) -> Float[np.ndarray, "circles 3"]:
    """As rows, filled up with none (a negative radius)."""
    rows = [tuple(circle) for circle in circles]
    none = [(0.0, 0.0, -1.0)] * (-len(rows) % _ROOM_FOR)
    return np.array([*rows, *none], dtype=float).reshape(-1, 3)


@dataclass(frozen=True)
class Baseline:
    """A policy by script for tasks without vy: turns to the goal, walks there (`scenarios.driver.drive`)."""

    def start(self) -> Float[Array, "0"]:
        """Nothing is remembered."""
        return jnp.zeros(0)

    def __call__(self, observation: Float[Array, " numbers"], memory: Array) -> tuple[Float[Array, "2"], Array]:
        """Every observation of the walker's task begins with the goal."""
        return drive(observation[:2]), memory


class Steering:
    """A driver as the command source of a walk. Once made, it steers one walk.

    Attributes:
        ended: the driver has ended, or the goal is reached.
    """

    def __init__(self, driver: Driver, look: Callable[[float], Situation], near: float | None = None) -> None:
        """Ready to start.

        Args:
            driver: decides.
            look: the situation at a time [s].
            near: so near the goal is reached, and the walk ends [m]; None: only the driver ends it.
        """
        self._driver, self._look, self._near = driver, look, near
        self._memory, self._decisions = driver.start(), 0
        self._asked: Velocity | None = None
        self.ended = False

    def __call__(self, t: float) -> Velocity | None:
        """The velocity asked for at a time [s]; None: it has ended."""
        if self.ended:
            return None
        due = t >= self._decisions * self._driver.period - _ROUNDING
        if not (due or self._near is not None):
            return self._asked
        situation = self._look(t)
        if self._near is not None and distance(situation) <= self._near:
            self.ended = True
            return None
        if due:
            self._decisions = math.floor(t / self._driver.period + _ROUNDING) + 1
            self._asked, self._memory = self._driver.decide(self._memory, situation)
            self.ended = self._asked is None
        return self._asked


def distance(situation: Situation) -> float:
    """To the goal [m]; NaN where the robot does not know its place."""
    x, y, _ = situation.place.tolist()
    return math.hypot(situation.goal[0] - x, situation.goal[1] - y)
