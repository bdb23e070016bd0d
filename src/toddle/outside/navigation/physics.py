"""Any driver on the walker in MuJoCo, judged by the simulator's truth: contacts, the waist's place, falls.

The driver and the walker know what the robot's senses tell. The judge looks at the truth twenty times a second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.navigate.driver import Driver, Situation, Steering
from toddle.navigate.task import Outcome
from toddle.outside.environment.asked import draws
from toddle.outside.navigation.course import Course, Finish, Rules, path_length, shortest_way
from toddle.outside.simulation.disturbances import TICK, WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation, Truth
from toddle.robots.humanoid import Humanoid
from toddle.signals import STILL, Circle, Footstep, Senses, Velocity
from toddle.walk.loop import Moment, walk
from toddle.walk.walker import Walker, walker

_LOOK = 5  # ticks between two looks at the truth


class Ready(NamedTuple):
    """A robot that need not be built again: its walker, and a simulation that courses in the same world use."""

    walker: Walker
    simulation: HumanoidSimulation


def ready(humanoid: Humanoid, course: Course, *, world: WorldOptions | None = None, seed: int = 0) -> Ready:
    """A robot in the world of a course, built."""
    return _ready(humanoid, _world(course, world, seed), None)


def run_course(
    humanoid: Humanoid,
    driver: Driver,
    course: Course,
    rules: Rules | None = None,
    *,
    world: WorldOptions | None = None,
    seed: int = 0,
    before: Ready | None = None,
) -> tuple[Finish, Ready]:
    """One course.

    Args:
        humanoid: the robot.
        driver: steers it.
        course: where to.
        rules: how it is judged; None: the defaults.
        world: friction, noise and so on; its circles are replaced by the course's, people included.
        seed: of what the world draws.
        before: what the last course returned, so that less is built again; the result is the same.

    Returns:
        How it ended, and the robot for the next course.

    Raises:
        BadInput: the goal is farther than the rules allow, or the robot can't be used.
    """
    rules = rules or Rules()
    if not math.hypot(*course.goal) <= rules.far:
        raise BadInput(
            f"the goal {course.goal} is farther than {rules.far:g} m", where="course", remedy="raise far in the rules"
        )
    there = _ready(humanoid, _world(course, world, seed), before)
    judge = _Judge(course, rules, there)
    robot = _Among(there.simulation, course, judge)
    steering = Steering(driver, robot.look)
    told = (robot.around if course.people is not None else course.circles) if rules.told else ()
    for moment in walk(there.walker, robot, lambda t: None if judge.over else steering(t), circles=told):
        robot.allowed = moment.allowed
        if judge.saw(moment):
            break
    return judge.finish(), there


@dataclass
class _Judge:
    """Watches a walk, tick by tick.

    Attributes:
        course: where to.
        rules: how it is judged.
        there: the robot.
        outcome: so far.
        arrived: when the goal was reached [s]; infinite before.
    """

    course: Course
    rules: Rules
    there: Ready
    outcome: Outcome = Outcome.GOES_ON
    arrived: float = math.inf
    ended: float = 0.0
    clearance: float = 1.0
    path: list[tuple[float, float, float, float]] = field(default_factory=list)
    feet: list[Footstep] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    ticks: int = 0
    support: int = -1
    planned: Float[np.ndarray, "2"] | None = None

    @property
    def over(self) -> bool:
        """The robot need only come to stand."""
        return math.isfinite(self.arrived)

    def saw(self, moment: Moment) -> bool:
        """One tick more; whether the course has ended."""
        if self.planned is not None and np.isfinite(moment.measured.zmp).all():
            self.errors.append(math.dist(moment.measured.zmp, self.planned))  # the plan acts a tick later
        self.planned = moment.reference.zmp
        simulation = self.there.simulation
        if moment.support != self.support:
            self.support = moment.support
            if self.support >= 0:
                x, y, _, yaw = simulation.truth().soles[self.support].tolist()
                self.feet.append(Footstep(self.support, x, y, yaw))
        self.ticks += 1
        if self.ticks % _LOOK and not moment.fell and not simulation.touched.any():
            return False
        return self._looked(moment, simulation.truth(), bool(simulation.touched.any()))

    def _looked(self, moment: Moment, truth: Truth, touched: bool) -> bool:
        x, y, yaw = truth.waist.tolist()
        self.path.append((moment.t, x, y, yaw))
        self.clearance = min(self.clearance, float(truth.clearance.min()))
        self.ended = moment.t
        left = math.dist((x, y), self.course.goal)
        if truth.fallen or moment.fell or not math.isfinite(left):
            self.outcome = Outcome.FELL
        elif touched:
            self.outcome = Outcome.COLLIDED
        elif self.over:
            return False
        elif left <= self.rules.near:
            self.outcome, self.arrived = Outcome.WON, moment.t
            return not self.rules.settle
        elif left > self.rules.far:
            self.outcome = Outcome.LOST
        elif moment.t > self.rules.seconds - TICK / 2:
            self.outcome = Outcome.LATE
        return self.outcome != Outcome.GOES_ON

    def finish(self) -> Finish:
        """How it ended; a driver that gave up before the goal is late."""
        seconds = min(self.arrived, self.ended)
        path = np.array(self.path).reshape(-1, 4)
        sway = 2 * self.there.walker.gait.step_time
        return Finish(
            self.outcome if self.outcome != Outcome.GOES_ON else Outcome.LATE,
            seconds,
            path,
            tuple(self.feet),
            path_length(path[path[:, 0] <= seconds + TICK / 2], sway),
            shortest_way(self.course, self.rules.near, self.rules.body),
            self.clearance,
            float(np.mean(self.errors)) if self.errors else math.nan,
        )


class _Among:
    """The robot among people who walk, until it has arrived; it keeps what it felt last, for the driver."""

    def __init__(self, simulation: HumanoidSimulation, course: Course, judge: _Judge) -> None:
        self._simulation, self._course, self._judge = simulation, course, judge
        self.allowed: Velocity = STILL

    def reset(self) -> Senses:
        """Stand at the start."""
        self._t = 0.0
        self._senses = self._simulation.reset()
        return self._senses

    def tick(self, servo: Float[np.ndarray, " joints"]) -> Senses:
        """Command the servos and let 10 ms pass."""
        self._t += TICK
        if self._course.people is not None:
            for number, circle in enumerate(self.around(self._t)):
                self._simulation.move(number, circle.x, circle.y)
        self._senses = self._simulation.tick(servo)
        return self._senses

    def look(self, t: float) -> Situation:
        """What the driver may know at a time [s]."""
        return Situation(t, self._senses.place, self._course.goal, self.allowed, self.around(t))

    def around(self, t: float) -> tuple[Circle, ...]:
        """All obstacles at a time [s]; once the robot has arrived, nobody walks on."""
        return self._course.around(min(t, self._judge.arrived))


def _world(course: Course, world: WorldOptions | None, seed: int) -> WorldOptions:
    """The same for all seeds where nothing is drawn, so that its simulation is used again."""
    world = replace(world or WorldOptions(), circles=course.around(0.0))
    return replace(world, seed=seed) if draws(world) else world


def _ready(humanoid: Humanoid, world: WorldOptions, before: Ready | None) -> Ready:
    if before is not None and before.walker.humanoid is humanoid:
        if before.simulation.options == world:
            return before
        return Ready(before.walker, HumanoidSimulation(humanoid, world))
    return Ready(walker(humanoid), HumanoidSimulation(humanoid, world))
