"""One drive through a room in physics, judged by the simulator's truth, and recorded as the robot saw it.

The walker is told of nothing that stands around: whoever steers must see it. People walk as `passing` tells. A drive is
won once the robot, within the target's radius, was asked to stand for a while, and then stands there untouched; who
never asks for it is late.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.navigate.cloning.recording import Recording, RoomKey
from toddle.navigate.driver import Driver, Situation, Steering
from toddle.navigate.scenarios import passing
from toddle.navigate.scenarios.rooms import SUCCESS_RADIUS, Room
from toddle.navigate.scenarios.starts import DRAWN, Start, drawn_places, seen_from
from toddle.navigate.sight import PERIOD, Showing, Sight
from toddle.navigate.task import Outcome
from toddle.outside.navigation.course import path_length
from toddle.outside.navigation.room_eyes import EyeOptions, Eyes
from toddle.outside.simulation.disturbances import TICK, WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation, Truth
from toddle.outside.simulation.rooms import room_simulation, touched_kind
from toddle.outside.simulation.stereo_cameras import CastCamera
from toddle.robots.humanoid import Humanoid
from toddle.signals import STILL, Circle, Senses, Velocity
from toddle.walk.loop import Moment, walk
from toddle.walk.walker import Walker, walker

_LOOK = 10  # ticks between two looks at the truth
_ROUNDING = 1e-9  # of times that were added up [s]
_SLOW, _TURNS = 0.03, 0.06  # a velocity under both asks to stand [m/s, rad/s]


@dataclass(frozen=True)
class RoomRules:
    """How a drive is judged.

    Attributes:
        seconds: after so long it is late [s].
        near: the waist so near to the target's middle is near enough [m].
        stand: how long the robot must be asked to stand there [s].
    """

    seconds: float = 90.0
    near: float = SUCCESS_RADIUS
    stand: float = 1.0


@dataclass(frozen=True, eq=False)
class RoomFinish:
    """How a drive ended; the simulator's truth, in the frame that the room was drawn in.

    Attributes:
        room: where.
        outcome: won, collided, fell or late.
        touched: the kind of thing that was touched, if any: such as wall, person, chair.
        seconds: until the robot was asked to stand at the target, else until the end [s].
        path: time [s], x, y [m], yaw [rad] of the waist, every 0.1 s.
        length: of the path until ``seconds``, without the sway of the steps [m].
        shortest: way to the target's radius [m].
        clearance: the least from any part of the robot to anything [m], at most 1; under 0 they overlap.
        zmp_error: mean distance of planned and measured zero moment point [m].
        zmp_spread: its standard deviation over the drive [m].
        asked: the velocity that was asked for at each look.
        inference_ms: how long the driver took for each decision [ms].
        zmp_errors: the distance of planned and measured zero moment point at each tick [m].
    """

    room: RoomKey
    outcome: Outcome
    touched: str
    seconds: float
    path: Float[np.ndarray, "looks 4"]
    length: float
    shortest: float
    clearance: float
    zmp_error: float
    zmp_spread: float
    asked: Float[np.ndarray, "decisions 3"]
    inference_ms: Float[np.ndarray, " inferences"]
    zmp_errors: Float[np.ndarray, " ticks"] = field(default_factory=lambda: np.zeros(0))

    @property
    def spl(self) -> float:
        """Success weighted by path length (Anderson et al. 2018): shortest / length where it won, else 0."""
        return self.shortest / max(self.length, self.shortest, 1e-9) if self.outcome == Outcome.WON else 0.0


def run_room(
    humanoid: Humanoid,
    driver: Driver,
    room: Room,
    *,
    seed: int = 0,
    start: Start = DRAWN,
    eyes: EyeOptions | None = None,
    teacher: Driver | None = None,
    called: str = "driver",
    rules: RoomRules | None = None,
    world: WorldOptions | None = None,
    before: Walker | None = None,
) -> tuple[RoomFinish, Recording | None]:
    """One drive.

    Args:
        humanoid: the robot.
        driver: steers it.
        room: where, as it was drawn.
        seed: of the eyes' noise.
        start: where the robot begins.
        eyes: how it sees; None: it is blind, which suits who steers by the truth, and nothing is recorded.
        teacher: is asked at each look what it would do; None: the driver itself is the teacher.
        called: the driver's name in the recording.
        rules: how it is judged; None: the defaults.
        world: friction, noise and so on, without circles.
        before: the humanoid's walker, so that it is not built again.

    Returns:
        How it ended, and what was seen.

    Raises:
        BadInput: the robot can't be used, or no way leads from the start to the target.
    """
    there = seen_from(room, start)
    legs = before or walker(humanoid)
    simulation = room_simulation(humanoid, there, world)
    judge = _Judge(there, rules or RoomRules(), simulation)
    sees = None if eyes is None else Eyes(simulation, there, eyes, seed)
    try:
        robot = _InRoom(simulation, there, sees)
        clocked = _Clocked(driver)
        steering, notes = Steering(clocked, robot.situation), _Notes(teacher)

        def command(t: float) -> Velocity | None:
            if judge.over:
                return None
            fresh = robot.look(t)
            asked = steering(t)
            if fresh:
                notes.write(robot.situation(t), STILL if asked is None else asked)
            judge.heard(t, asked)
            return asked

        for moment in walk(legs, robot, command):
            robot.allowed = moment.allowed
            if judge.saw(moment):
                break
    finally:
        if sees is not None:
            sees.close()
    key = RoomKey(room.scenario, room.split, room.style, room.number)
    asked = np.array([tuple(one) for one in notes.asked]).reshape(-1, 3)
    sway = 2 * legs.gait.step_time
    finish = judge.finish(key, start, sway, asked, np.array(clocked.took))
    return finish, None if sees is None else notes.recording(key, called, seed, finish.outcome, start)


class _Clocked:
    """A driver whose decisions are timed."""

    def __init__(self, driver: Driver) -> None:
        self._driver, self.took = driver, []

    @property
    def period(self) -> float:
        return self._driver.period

    def start(self) -> Any:
        return self._driver.start()

    def decide(self, memory: Any, situation: Situation) -> tuple[Velocity | None, Any]:
        begun = time.perf_counter()
        found = self._driver.decide(memory, situation)
        self.took.append(1e3 * (time.perf_counter() - begun))
        return found


class _Row(NamedTuple):
    """A look, and what was said about it."""

    situation: Situation
    sight: Sight
    showing: Showing
    asked: Velocity
    taught: Velocity


class _Notes:
    """What was seen, and what a teacher says to it."""

    def __init__(self, teacher: Driver | None) -> None:
        self._teacher = teacher
        self._memory = None if teacher is None else teacher.start()
        self.asked: list[Velocity] = []
        self._rows: list[_Row] = []

    def write(self, situation: Situation, asked: Velocity) -> None:
        taught: Velocity | None = asked
        if self._teacher is not None:
            taught, self._memory = self._teacher.decide(self._memory, situation)
        self.asked.append(asked)
        if situation.sight is not None and situation.showing is not None:
            said = asked, STILL if taught is None else taught
            self._rows.append(_Row(situation, situation.sight, situation.showing, *said))

    def recording(self, key: RoomKey, called: str, seed: int, outcome: Outcome, start: Start) -> Recording:
        """All looks, in the frame that the room was drawn in."""
        rows = self._rows
        places = np.array([row.showing.place for row in rows])
        circles = np.array([row.showing.circles for row in rows])
        places[:, :2], circles[..., :2] = (
            drawn_places(places[:, :2], start),
            drawn_places(circles[..., :2], start),
        )
        places[:, 2] += start.yaw
        return Recording(
            key,
            called,
            seed,
            outcome,
            np.array([row.situation.t for row in rows]),
            np.array([row.sight.picture for row in rows]),
            np.array([row.sight.depth for row in rows]),
            np.array([tuple(row.situation.velocity) for row in rows]),
            np.array([tuple(row.asked) for row in rows]),
            np.array([tuple(row.taught) for row in rows]),
            places,
            circles,
            np.array([row.showing.pixels for row in rows]),
        )


class _InRoom:
    """The robot in its room, among people; it looks around five times a second."""

    def __init__(self, simulation: HumanoidSimulation, room: Room, eyes: Eyes | None) -> None:
        self._simulation, self._room, self._eyes = simulation, room, eyes
        self._caster = CastCamera(simulation, room)
        self._waist = simulation.data.site("waist")
        self._circles = room.circles
        self._first = len(room.standing)
        self._strides = [passing.enter(person) for person in room.people]
        self._looks = 0
        self._sight: Sight | None = None
        self._showing: Showing | None = None
        self.allowed: Velocity = STILL

    def reset(self) -> Senses:
        """Stand at the start."""
        self._senses = self._simulation.reset()
        return self._senses

    def tick(self, servo: Float[np.ndarray, " joints"]) -> Senses:
        """Command the servos and let 10 ms pass, in which people walk on."""
        x, y = self._waist.xpos[:2].tolist()
        for number, person in enumerate(self._room.people):
            stride = passing.step(person, self._strides[number], (x, y), TICK)
            self._strides[number] = stride
            self._simulation.move(number, stride.x, stride.y)
        self._senses = self._simulation.tick(servo)
        return self._senses

    def look(self, t: float) -> bool:
        """Looks, if it is time to; whether it did."""
        if t < self._looks * PERIOD - _ROUNDING:
            return False
        self._looks += 1
        if self._eyes is not None:
            self._sight = self._eyes.see()
        shown = self._caster.view().thing
        for number, stride in enumerate(self._strides):
            self._circles[self._first + number, :2] = stride.x, stride.y
        pixels = np.bincount(shown.ravel(), minlength=len(self._circles) + 1)[: len(self._circles)]
        turned = self._waist.xmat
        x, y, _ = self._waist.xpos.tolist()
        place = np.array([x, y, math.atan2(turned[3], turned[0])])
        self._showing = Showing(place, self._circles.copy(), pixels, self._room.hall)
        return True

    def situation(self, t: float) -> Situation:
        """What the driver may know at a time [s]."""
        target = self._room.target
        around = tuple(Circle(*row) for row in self._circles[1:].tolist())
        return Situation(t, self._senses.place, (target.x, target.y), self.allowed, around, self._sight, self._showing)


@dataclass
class _Judge:
    """Watches a drive, tick by tick."""

    room: Room
    rules: RoomRules
    simulation: HumanoidSimulation
    outcome: Outcome = Outcome.GOES_ON
    touched: str = ""
    over: bool = False
    still: float = math.nan
    ended: float = 0.0
    clearance: float = 1.0
    path: list[tuple[float, float, float, float]] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    ticks: int = 0
    planned: Float[np.ndarray, "2"] | None = None

    def heard(self, t: float, asked: Velocity | None) -> None:
        """What was asked for: whether the robot has been asked for long enough to stand at the target."""
        if asked is not None and (math.hypot(asked.vx, asked.vy) > _SLOW or abs(asked.omega) > _TURNS):
            self.still = math.nan
            return
        if math.isnan(self.still):
            self.still = t
        if asked is None or t - self.still > self.rules.stand - TICK / 2:
            self.over = asked is None or self._left() <= self.rules.near

    def saw(self, moment: Moment) -> bool:
        """One tick more; whether the drive has ended."""
        if self.planned is not None and np.isfinite(moment.measured.zmp).all():
            self.errors.append(math.dist(moment.measured.zmp, self.planned))  # the plan acts a tick later
        self.planned = moment.reference.zmp
        self.ticks += 1
        touched = bool(self.simulation.touched.any())
        if self.ticks % _LOOK and not moment.fell and not touched:
            return False
        return self._looked(moment, self.simulation.truth(), touched)

    def _looked(self, moment: Moment, truth: Truth, touched: bool) -> bool:
        x, y, yaw = truth.waist.tolist()
        self.path.append((moment.t, x, y, yaw))
        self.clearance = min(self.clearance, float(truth.clearance.min()))
        self.ended = moment.t
        if truth.fallen or moment.fell or not math.isfinite(x + y):
            self.outcome = Outcome.FELL
        elif touched:
            self.outcome, self.touched = Outcome.COLLIDED, touched_kind(self.simulation, self.room)
        elif not self.over and moment.t > self.rules.seconds - TICK / 2:
            self.outcome = Outcome.LATE
        return self.outcome != Outcome.GOES_ON

    def _left(self) -> float:
        place = self.simulation.data.site("waist").xpos
        return math.dist((place[0], place[1]), (self.room.target.x, self.room.target.y))

    def finish(
        self,
        key: RoomKey,
        start: Start,
        sway: float,
        asked: Float[np.ndarray, "decisions 3"],
        took: Float[np.ndarray, " inferences"],
    ) -> RoomFinish:
        """How it ended, once the robot stands, or lies."""
        outcome = self.outcome
        if outcome == Outcome.GOES_ON:
            outcome = Outcome.WON if self._left() <= self.rules.near else Outcome.LATE
        seconds = self.still if outcome == Outcome.WON else self.ended
        path = np.array(self.path).reshape(-1, 4)
        path[:, 1:3] = drawn_places(path[:, 1:3], start)
        path[:, 3] += start.yaw
        return RoomFinish(
            key,
            outcome,
            self.touched,
            seconds,
            path,
            path_length(path[path[:, 0] <= seconds + TICK / 2], sway),
            self.room.shortest,
            self.clearance,
            float(np.mean(self.errors)) if self.errors else math.nan,
            float(np.std(self.errors)) if self.errors else math.nan,
            asked,
            took,
            np.array(self.errors, np.float32),
        )
