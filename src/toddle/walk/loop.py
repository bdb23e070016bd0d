"""The control loop, closed: command -> walker -> robot -> senses -> walker.

The robot is a value that answers `Robot`: the simulation, or a real one behind a bridge. The command is any function of
time. Nothing here knows who they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.signals import STILL, Circle, Reference, Senses, Velocity
from toddle.walk.balance import support
from toddle.walk.balance.estimate import Estimate
from toddle.walk.config import TICK
from toddle.walk.gate import gate
from toddle.walk.state import Action, Landing, Mode
from toddle.walk.stepping import achieved

if TYPE_CHECKING:
    from toddle.walk.pattern.nmpc import Plan
    from toddle.walk.pattern.plan import Interval

CommandSource = Callable[[float], Velocity | None]
"""The velocity asked for at a time [s]; None: it has ended, and the robot is to stand."""

_FALLEN = 0.8  # tilt of the waist from which nothing brings it back [rad]
_RESTING = 0.5  # standing so long shows that it stands [s]
_STOPPING = 8.0  # the most that a stop may take [s] ...
_STOPPING_STEPS = 5  # ... or so many steps, where they take longer


@runtime_checkable
class Robot(Protocol):
    """A humanoid that is driven by its servos."""

    def reset(self) -> Senses:
        """Stand at home."""
        ...

    def tick(self, servo: Float[np.ndarray, " joints"]) -> Senses:
        """Command the servos and let 10 ms pass."""
        ...


@runtime_checkable
class Stride(Protocol):
    """The step that a walker is in."""

    @property
    def stance(self) -> int:
        """The side that carries."""
        ...

    @property
    def double_support(self) -> float:
        """How long both do [s]."""
        ...

    @property
    def phase(self) -> float:
        """Time since it began [s]."""
        ...


@runtime_checkable
class State(Protocol):
    """What the loop reads of a walker's state."""

    @property
    def t(self) -> float:
        """Time [s]."""
        ...

    @property
    def mode(self) -> Mode:
        """What the feet do."""
        ...

    @property
    def step(self) -> Stride:
        """The step under way, or the last one."""
        ...

    @property
    def landings(self) -> tuple[Landing, ...]:
        """The last three touchdowns."""
        ...

    @property
    def estimate(self) -> Estimate | None:
        """What the senses told."""
        ...


S = TypeVar("S", bound=State)


@runtime_checkable
class Walks(Protocol[S]):
    """Who decides: a `toddle.walk.walker.Walker` or a `toddle.walk.follower.Follower`."""

    @property
    def gait(self) -> Gait:
        """How it steps."""
        ...

    def start(self) -> S:
        """Standing at home."""
        ...

    def step(self, state: S, velocity: Velocity, senses: Senses, circles: tuple[Circle, ...] = ()) -> tuple[S, Action]:
        """One tick of 10 ms."""
        ...

    def area(self, state: S) -> support.Corners:
        """The area of the soles that stand, counter-clockwise."""
        ...


class Measured(NamedTuple):
    """What the senses tell of the walk, in the plan's frame.

    Attributes:
        com: centre of mass [m].
        com_velocity: its velocity [m/s].
        zmp: zero moment point from the ankles' sensors [m]; NaN without contact.
        feet: soles, x, y, z [m], yaw [rad].
        yaw: heading of the waist [rad].
        velocity: achieved over the last two steps; NaN before.
        force: upwards, on each foot [N].
        margin: of the measured zero moment point to the edge of the soles that stand [m]; negative outside.
    """

    com: Float[np.ndarray, "3"]
    com_velocity: Float[np.ndarray, "3"]
    zmp: Float[np.ndarray, "2"]
    feet: Float[np.ndarray, "2 4"]
    yaw: float
    velocity: Velocity
    force: Float[np.ndarray, "2"]
    margin: float


class Moment(NamedTuple):
    """One tick.

    Attributes:
        t: time [s].
        asked: the command as it came.
        allowed: what the safety gate let through.
        reference: what the walking pattern asks for.
        measured: what the senses tell.
        plan: the predictive controller's plan, if one was made in this tick.
        posture_ms: time of the inverse kinematics [ms].
        support: 0 the left foot carries, 1 the right, -1 both.
        fell: the robot lies over.
    """

    t: float
    asked: Velocity
    allowed: Velocity
    reference: Reference
    measured: Measured
    plan: Plan | Interval | None
    posture_ms: float
    support: int
    fell: bool


def walk(
    walker: Walks[S],
    robot: Robot,
    commands: CommandSource,
    seconds: float | None = None,
    circles: tuple[Circle, ...] | Callable[[float], tuple[Circle, ...]] = (),
    *,
    limited: bool = True,
) -> Iterator[Moment]:
    """Walk, one moment a tick, until the commands end, the time is over, or the robot has fallen.

    When the commands end the robot comes to stand, feet side by side; ``seconds`` cuts at once.

    Args:
        walker: decides.
        robot: moves and feels.
        commands: asked at each tick.
        seconds: the most to walk [s]; None: as long as commands come.
        circles: obstacles, in the frame of ``Senses.place``; those that move: a function of time [s].
        limited: whether the gate limits how fast a command changes.
    """
    senses, state, allowed = robot.reset(), walker.start(), STILL
    ended: float | None = None
    stood = 0.0
    stopping = max(_STOPPING, _STOPPING_STEPS * walker.gait.step_time)
    while seconds is None or state.t < seconds - TICK / 2:
        asked = None if ended is not None else commands(state.t)
        if asked is None and ended is None:
            ended = state.t
        stands = state.mode == Mode.STAND and allowed == STILL
        stood = stood + TICK if stands else 0.0
        if ended is not None and (stood > _RESTING + TICK / 2 or state.t - ended > stopping):
            return
        command = STILL if asked is None else asked
        allowed = gate(allowed, command, walker.gait.fastest, TICK, limited=limited)
        around = circles(state.t) if callable(circles) else circles
        state, action = walker.step(state, allowed, senses, around)
        senses = robot.tick(action.servo)
        fell = bool(np.abs(action.estimate.tilt).max() > _FALLEN)
        measured = _measured(walker, state)
        supported = state.step.stance if _single(state) else -1
        yield Moment(
            state.t, command, allowed, action.reference, measured, action.plan, action.posture_ms, supported, fell
        )
        if fell:
            return


def _single(state: State) -> bool:
    return state.mode == Mode.STEP and state.step.phase >= state.step.double_support


def _measured(walker: Walks[S], state: S) -> Measured:
    sensed = state.estimate
    assert sensed is not None
    velocity = achieved(state.landings) if len(state.landings) > 2 else Velocity(np.nan, np.nan, np.nan)
    margin = support.margin(walker.area(state), (float(sensed.zmp[0]), float(sensed.zmp[1])))
    return Measured(
        sensed.com,
        sensed.com_velocity,
        sensed.zmp,
        sensed.soles,
        sensed.yaw,
        velocity,
        sensed.force,
        margin,
    )
