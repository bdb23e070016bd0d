"""The document's own walker (Huber 2019, figure 2.1 and sections 2.1.3 to 2.1.5): a plan, followed by the body.

    velocity -> pattern of the document -> centre of mass, soles at 100 Hz -> posture -> position servos

Nothing is corrected on the way: steps land where and when they were planned. The sensors are read for the figures, and,
if wanted, for the centre of mass that an iteration of the pattern begins with. It has the interface of
`toddle.walk.walker.Walker`, so that the same loop drives both.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT, Humanoid
from toddle.signals import Circle, Footstep, Reference, Senses, Velocity
from toddle.walk.balance import support
from toddle.walk.balance.estimate import Estimate, Observer, estimate, observer
from toddle.walk.config import TICK
from toddle.walk.follower_state import FollowerConfig, FollowerState, Stride
from toddle.walk.pattern.displacement import rotate
from toddle.walk.pattern.document import Document
from toddle.walk.pattern.swing import evaluate, quintic
from toddle.walk.pattern.time_stepping import advance, zero_moment_point
from toddle.walk.pattern.trajectory import swing
from toddle.walk.placing import placed
from toddle.walk.posture.model import posture_model
from toddle.walk.posture.solve import posture_target, solve_posture
from toddle.walk.servo import sag
from toddle.walk.state import Action, Landing, Mode, Pose, pose_of
from toddle.walk.stepping import moving

_ROUNDING = 1e-9
_BESIDE = 0.02  # feet so near to where they stand beside each other are left there [m]


@dataclass(frozen=True)
class Follower:
    """A humanoid that follows the document's plan.

    Attributes:
        humanoid: the robot; its gait is the document's.
        config: what was chosen.
        observer: what estimating and inverse kinematics need of it, prepared.
        pattern: the document's, for the gait.
    """

    humanoid: Humanoid
    config: FollowerConfig
    observer: Observer
    pattern: Document = field(repr=False)

    @property
    def gait(self) -> Gait:
        """How it steps."""
        return self.humanoid.gait

    def start(self) -> FollowerState:
        """Standing at home, the plan's origin between the soles."""
        feet = np.zeros((3, 2, 4))
        feet[0, LEFT, 1], feet[0, RIGHT, 1] = self.gait.foot_distance / 2, -self.gait.foot_distance / 2
        step = Stride(LEFT, pose_of(feet[0], LEFT), self.gait.double_support, 0.0)
        return FollowerState(
            0.0, Mode.STAND, step, 0.0, np.zeros((2, 3)), feet, (0.0, 0.0), Mode.STAND, self.pattern.start(), None,
            feet[0].copy(), (0.5, 0.5), self.humanoid.home, (), None,
        )  # fmt: skip

    def step(
        self, state: FollowerState, velocity: Velocity, senses: Senses, circles: tuple[Circle, ...] = ()
    ) -> tuple[FollowerState, Action]:
        """One tick of 10 ms.

        Args:
            state: as the last tick left it.
            velocity: the command.
            senses: what the robot's sensors tell.
            circles: obstacles, in the world in which ``senses.place`` is told.

        Returns:
            The next state, and what to do.
        """
        sensed = estimate(self.observer, senses, state.anchors, np.array(state.load), state.estimate, TICK)
        before = state.interval
        state = state._replace(t=state.t + TICK, since=state.since + TICK, estimate=sensed)
        around = placed(self.observer.model, sensed, senses, circles)
        state = self._go_on(state, sensed, velocity, tuple(Circle(*row) for row in around.tolist()))
        reference = self._reference(state)
        x, y = reference.zmp.tolist()
        load = support.load_share(state.anchors, (x, y), state.step.stance if _single(state) else None)
        state = state._replace(load=load)
        reference = reference._replace(load=np.array(load))
        started = time.perf_counter()
        posture = solve_posture(self.observer.model, state.q, posture_target(reference), 2)
        servo = posture.q[7:]
        if self.config.feed_forward:
            pressed = self._pressed(state, reference.zmp)
            servo = servo + sag(self.humanoid, self.observer.model, posture.q, reference.load, pressed)
        took = 1e3 * (time.perf_counter() - started)
        plan = None if state.interval is before else state.interval
        action = Action(servo, reference, sensed, plan, took, float(posture.misses.max()), velocity)
        return state._replace(q=posture.q), action

    def area(self, state: FollowerState) -> support.Corners:
        """The area of the soles that stand, counter-clockwise."""
        soles = [state.step.foot] if _single(state) else [pose_of(state.anchors, side) for side in (LEFT, RIGHT)]
        return support.area(self.gait, soles)

    def _go_on(
        self, state: FollowerState, sensed: Estimate, velocity: Velocity, circles: tuple[Circle, ...]
    ) -> FollowerState:
        """The mode, and the interval of the plan, at this tick."""
        if state.mode == Mode.STAND:
            if not moving(velocity):
                return state
            return self._shift(state._replace(landings=()), pose_of(state.anchors, LEFT), self._aside(), Mode.STEP)
        if state.mode == Mode.SHIFT:
            if state.since < self._shift_time(state) - _ROUNDING:
                return state
            com = np.zeros((2, 3))
            com[:, 0] = state.goal
            state = state._replace(mode=state.next, since=0.0, com=com)
            return state if state.next == Mode.STAND else self._iterate(self._first(state), sensed, velocity, circles)
        interval = state.interval
        if interval is None or state.since < interval.duration - _ROUNDING:
            return state._replace(step=state.step._replace(phase=state.step.phase + TICK))
        feet = swing(self.gait, interval, state.feet, interval.duration)
        state = state._replace(since=0.0, com=state.pattern.com, feet=feet)
        if state.pattern.left == self.pattern.model.samples:
            state = self._land(state, sensed, velocity)
            if not moving(velocity) and self._side_by_side(state.anchors):
                middle = state.anchors.mean(axis=0)
                return self._shift(state, (middle[0], middle[1], middle[3]), 0.0, Mode.STAND)
        return self._iterate(state, sensed, velocity, circles)

    def _side_by_side(self, anchors: Float[np.ndarray, "2 4"]) -> bool:
        """Whether the feet stand beside each other; the document's yaws need not come to agree."""
        dx, dy = rotate(-float(anchors[:, 3].mean()), tuple((anchors[LEFT] - anchors[RIGHT])[:2].tolist()))
        return math.hypot(dx, dy - self.gait.foot_distance) < _BESIDE

    def _aside(self) -> float:
        """From the left sole to where the document has the centre of mass when the first step begins [m]."""
        first, start = self.gait.first, self.gait.start
        left = self.gait.foot_distance / 2 if first is None else first[1]
        return 0.0 if start is None else start[1] - left

    def _shift(self, state: FollowerState, pose: Pose, aside: float, then: Mode) -> FollowerState:
        """Bring the centre of mass to rest beside a pose."""
        x, y, yaw = pose
        goal = (x - aside * math.sin(yaw), y + aside * math.cos(yaw))
        return state._replace(mode=Mode.SHIFT, since=0.0, goal=goal, next=then, interval=None)

    def _shift_time(self, state: FollowerState) -> float:
        return self.config.stop_time if state.next == Mode.STAND else self.config.shift_time

    def _first(self, state: FollowerState) -> FollowerState:
        """The pattern begins anew from where the robot stands."""
        left, right = (pose_of(state.anchors, side) for side in (LEFT, RIGHT))
        yaw = np.zeros((2, 3))
        yaw[:, 0] = state.anchors[:, 3]
        pattern = self.pattern.start()
        pattern = pattern._replace(
            com=state.com, yaw=yaw, support=Footstep(LEFT, *left), lifted=Footstep(RIGHT, *right),
            turned=np.full(len(pattern.turned), right[2]),
        )  # fmt: skip
        return state._replace(pattern=pattern)

    def _iterate(
        self, state: FollowerState, sensed: Estimate, velocity: Velocity, circles: tuple[Circle, ...]
    ) -> FollowerState:
        """One iteration of the pattern, from the planned centre of mass or one nearer the measured."""
        com = state.com.copy()
        com[:, 0] += self.config.feedback * (sensed.com[:2] - com[:, 0])
        com[:, 1] += self.config.feedback * (sensed.com_velocity[:2] - com[:, 1])
        pattern, interval = self.pattern.step(state.pattern._replace(com=com), velocity, circles)
        side, *foot = interval.support
        step = Stride(side, (foot[0], foot[1], foot[2]), self.gait.double_support, interval.elapsed)
        return state._replace(pattern=pattern, interval=interval, com=com, step=step)

    def _land(self, state: FollowerState, sensed: Estimate, velocity: Velocity) -> FollowerState:
        """The swing foot stands where it was planned; the landings remember where it was felt."""
        landed, stance = 1 - state.step.stance, state.step.stance
        anchors = state.anchors.copy()
        anchors[landed] = state.feet[0, landed]
        anchors[landed, 2] = 0.0
        x, y, yaw = state.landings[-1].pose if state.landings else pose_of(state.anchors, stance)
        one, other = sensed.soles[stance], sensed.soles[landed]
        dx, dy = rotate(yaw - float(one[3]), (float(other[0] - one[0]), float(other[1] - one[1])))
        turned = math.remainder(float(other[3] - one[3]), 2 * math.pi)
        landing = Landing(state.t, landed, (x + dx, y + dy, yaw + turned), velocity)
        return state._replace(anchors=anchors, landings=(*state.landings[-2:], landing))

    def _reference(self, state: FollowerState) -> Reference:
        motion, feet = state.com, state.feet
        if state.mode == Mode.SHIFT:
            path = quintic(np.ascontiguousarray(state.com.T), np.array(state.goal), self._shift_time(state))
            motion = np.ascontiguousarray(evaluate(path, state.since).T)
        elif state.interval is not None:
            motion = advance(state.interval.com, state.interval.jerk, state.since)
            feet = swing(self.gait, state.interval, state.feet, state.since)
        com = np.zeros((3, 3))
        com[:, :2], com[0, 2] = motion.T, self.gait.com_height
        zmp = zero_moment_point(motion, self.gait.com_height)
        yaw = feet[..., 3].mean(axis=1)
        return Reference(state.t, com, zmp, yaw, feet[0], feet[1], feet[2], np.array(state.load))

    def _pressed(self, state: FollowerState, zmp: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2 2"]:
        """Where each sole is pressed, in its frame [m]: as far from its origin as the ZMP is from the load's middle."""
        dx, dy = (zmp - np.array(state.load) @ state.anchors[:, :2]).tolist()
        return np.array([rotate(-float(yaw), (dx, dy)) for yaw in state.anchors[:, 3]])


def follower(humanoid: Humanoid, gait: Gait, config: FollowerConfig | None = None) -> Follower:
    """A humanoid, ready to follow the document's plan.

    Soles and height of the centre of mass are the robot's own: at the document's 0.45 m the iCub's ankles are at their
    limits most of the time.

    Args:
        humanoid: the robot.
        gait: the document's; a sample is a whole number of ticks.
        config: what was chosen.

    Raises:
        BadInput: the gait doesn't fit the document's pattern, or the loop's period.
    """
    config = config or FollowerConfig()
    if abs(gait.sample / TICK - round(gait.sample / TICK)) > _ROUNDING:
        raise BadInput(
            f"{gait.sample:g} s is no whole number of ticks of {TICK:g} s", where="gait, sample", remedy="give one"
        )
    own = humanoid.gait
    gait = replace(
        gait, com_height=own.com_height, foot_distance=own.foot_distance, foot_length=own.foot_length,
        foot_width=own.foot_width, foot_ahead=own.foot_ahead,
    )  # fmt: skip
    humanoid = replace(humanoid, gait=gait)
    deadline = math.inf if config.deadline_ms is None else config.deadline_ms
    return Follower(humanoid, config, observer(humanoid, posture_model(humanoid)), Document(gait, deadline))


def _single(state: FollowerState) -> bool:
    return state.mode == Mode.STEP and state.step.phase >= state.step.double_support - _ROUNDING
