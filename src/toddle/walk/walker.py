"""The walker: one tick from senses and a velocity command to servo targets; a pure state machine.

    senses -> estimate -> where and when to land -> zero moment point -> centre of mass, soles -> posture -> servos

The predictive controller (``pattern``) plans the footsteps every tenth of a second and at each touchdown; between its
plans the step adjustment (``balance``) corrects place and time of the landing from the measured DCM.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT, Humanoid
from toddle.signals import STILL, Circle, Reference, Senses, Velocity
from toddle.walk.balance import support
from toddle.walk.balance.estimate import Estimate, Observer, estimate, observer
from toddle.walk.balance.pendulum import Pair
from toddle.walk.config import TICK, WalkConfig
from toddle.walk.landing import adjusted
from toddle.walk.modes import changed
from toddle.walk.pattern.feasible import cap
from toddle.walk.pattern.nmpc import Nmpc, nmpc
from toddle.walk.pattern.obstacles import NONE
from toddle.walk.placing import placed
from toddle.walk.planning import allowed, planned
from toddle.walk.posture.model import PostureModel, posture_model
from toddle.walk.posture.solve import posture_target, solve_posture
from toddle.walk.reference import followed, moved, reference
from toddle.walk.servo import pressed, sag, weights
from toddle.walk.state import Action, Mode, WalkerState, pose_of
from toddle.walk.stepping import area, begin, by_command, chain, moving, total

_PERSISTS = 5  # so many unusable plans, one after another, end the walk


@dataclass(frozen=True)
class Walker:
    """A humanoid that walks.

    Attributes:
        humanoid: the robot.
        config: gains and switches.
        observer: what estimating and inverse kinematics need of it, prepared.
        problem: what the predictive controller needs of it, prepared.
    """

    humanoid: Humanoid
    config: WalkConfig
    observer: Observer
    problem: Nmpc

    @property
    def gait(self) -> Gait:
        """How it steps."""
        return self.humanoid.gait

    @property
    def model(self) -> PostureModel:
        """What its inverse kinematics needs, prepared."""
        return self.observer.model

    def start(self) -> WalkerState:
        """Standing at home, the plan's origin between the soles."""
        feet = np.zeros((2, 4))
        feet[LEFT, 1], feet[RIGHT, 1] = self.gait.foot_distance / 2, -self.gait.foot_distance / 2
        still = np.zeros((2, 4))
        foot = pose_of(feet, RIGHT)
        ahead = chain(self.gait, by_command(self.gait, STILL, RIGHT, 0.0), final=True)
        step = begin(self.gait, RIGHT, foot, (0.0, 0.0), ahead, 0.0, True)
        return WalkerState(
            0.0, Mode.STAND, step, 0.0, feet.copy(), feet, still, still, (0.0, 0.0, 0.0, 0.0), (0.0, 0.0), (0.0, 0.0),
            (0.5, 0.5), self.humanoid.home, STILL, (), self.config.lowering, None, None, math.inf, (), NONE, False, 0,
        )  # fmt: skip

    def step(
        self, state: WalkerState, velocity: Velocity, senses: Senses, circles: tuple[Circle, ...] = ()
    ) -> tuple[WalkerState, Action]:
        """One tick of 10 ms.

        Args:
            state: as the last tick left it.
            velocity: the command.
            senses: what the robot's sensors tell.
            circles: obstacles, in the world in which ``senses.place`` is told.

        Returns:
            The next state, and what to do.
        """
        velocity = STILL if state.fallbacks >= _PERSISTS else cap(velocity, self.gait)
        sensed = estimate(self.observer, senses, state.anchors, np.array(state.load), state.estimate, TICK)
        if state.estimate is None:
            state = self._settled_on(state, sensed)
        around = placed(self.model, sensed, senses, circles)
        state = state._replace(t=state.t + TICK, estimate=sensed, circles=around, held=False)
        if len(around):
            asked, velocity = velocity, allowed(self.gait, state, sensed, velocity)
            state = state._replace(held=velocity != asked)
        state = changed(self.gait, self.config, state, sensed, velocity)
        wanted = total(velocity, state.correction) if moving(velocity) else STILL
        if len(around):
            wanted = allowed(self.gait, state, sensed, wanted)
        state, ahead = planned(self.problem, self.config, state, sensed, wanted)
        state, zmp, dcm = adjusted(self.gait, self.config, state, sensed, ahead)
        state = followed(self.gait, self.config, state, sensed, self._feedback(state, sensed, zmp, dcm))
        state = moved(self.gait, state)
        return self._act(state, reference(self.gait, state), sensed, wanted)

    def _settled_on(self, state: WalkerState, sensed: Estimate) -> WalkerState:
        """The state at the first tick: where the floor leans, the joints lean against it from the start."""
        roll, pitch = sensed.sole_tilt.mean(axis=0).tolist()
        height, most = float(sensed.com[2]), self.config.offset_most
        x, y = (min(max(lean, -most), most) for lean in (-pitch * height, roll * height))
        return state._replace(offset=(x, y), com=(float(sensed.com[0]), float(sensed.com[1]), 0.0, 0.0))

    def _feedback(self, state: WalkerState, sensed: Estimate, zmp: Pair, dcm: Pair) -> Pair:
        """p = p_ref + K (xi - xi_ref), within the soles that stand."""
        gain = self.config.zmp_gain
        wanted = (
            zmp[0] + gain * (float(sensed.dcm[0]) - dcm[0]),
            zmp[1] + gain * (float(sensed.dcm[1]) - dcm[1]),
        )
        middle = state.anchors[:, :2].mean(axis=0)
        inside = zmp if state.mode == Mode.STEP else (float(middle[0]), float(middle[1]))
        return support.clip(self.area(state, self.config.pressed), inside, wanted)

    def area(self, state: WalkerState, share: float = 1.0) -> support.Corners:
        """The area of the soles that stand, counter-clockwise; ``share`` shrinks each sole about its middle."""
        return area(self.gait, state, share)

    def _act(
        self, state: WalkerState, wanted: Reference, sensed: Estimate, velocity: Velocity
    ) -> tuple[WalkerState, Action]:
        """The servos' targets for a reference, the sag of its centre of mass made up for."""
        started = time.perf_counter()
        com = wanted.com.copy()
        com[0, :2] += state.offset
        target = posture_target(wanted._replace(com=com), weights(self.config, state))
        posture = solve_posture(self.model, state.q, target, 2)
        servo = posture.q[7:]
        if self.config.feed_forward:
            servo = servo + sag(self.humanoid, self.model, posture.q, wanted.load, pressed(state))
        took = 1e3 * (time.perf_counter() - started)
        plan = state.plan if state.plan_age == 0 else None
        action = Action(servo, wanted, sensed, plan, took, float(posture.misses.max()), velocity)
        return state._replace(q=posture.q), action


def walker(humanoid: Humanoid, config: WalkConfig | None = None) -> Walker:
    """A humanoid, ready to walk."""
    return Walker(humanoid, config or WalkConfig(), observer(humanoid, posture_model(humanoid)), nmpc(humanoid.gait))
