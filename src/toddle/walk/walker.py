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
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT, Humanoid
from toddle.signals import Circle, Footstep, Reference, Senses, Velocity
from toddle.walk.balance import pendulum, support
from toddle.walk.balance.estimate import Estimate, Observer, estimate, observer
from toddle.walk.balance.feet import Feet, rest, swing
from toddle.walk.balance.pendulum import Pair
from toddle.walk.balance.step_adjustment import adjust
from toddle.walk.clearance import held_back
from toddle.walk.config import TICK, WalkConfig
from toddle.walk.pattern.displacement import rotate
from toddle.walk.pattern.feasible import cap
from toddle.walk.pattern.nmpc import NEVER, Nmpc, PlanState, nmpc
from toddle.walk.pattern.nmpc import plan as next_plan
from toddle.walk.pattern.obstacles import NONE
from toddle.walk.pattern.plan import Status
from toddle.walk.posture.model import PostureModel, posture_model
from toddle.walk.posture.solve import WEIGHTS, PostureTarget, solve_posture
from toddle.walk.posture.survey import static_torques, survey
from toddle.walk.state import Action, Landing, Mode, Pose, Step, WalkerState
from toddle.walk.stepping import (
    STILL,
    Chain,
    aim,
    begin,
    bounds,
    by_command,
    catching,
    chain,
    clear_of,
    corrected,
    first_stance,
    moving,
    shift_zmp,
    side_by_side,
    within_reach,
)

_PERSISTS = 5  # so many unusable plans, one after another, end the walk
_LOWERING = 0.1  # of the time by which a landing is brought forward or put off [s]
_CROSSED = 0.01  # a plan that breaks its own rows by more is no plan [m]
_CALM = 0.02  # a DCM this near to where it should be lets the robot stand after one more step [m]
_SETTLING = 0.5  # no step catches a robot that has just been put down [s]
_SHRUNK = 0.8  # of the soles: a DCM outside of this, while standing, calls for a step


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
        foot = _pose(feet, RIGHT)
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
        state = state._replace(t=state.t + TICK, estimate=sensed, circles=self._placed(sensed, senses, circles))
        if len(state.circles):
            asked, velocity = velocity, self._held_back(state, sensed, velocity)
            state = state._replace(held=velocity != asked)
        state = self._change_mode(state, sensed, velocity)
        wanted = _sum(velocity, state.correction) if moving(velocity) else STILL
        if len(state.circles):
            wanted = self._held_back(state, sensed, wanted)
        state, ahead = self._plan(state, sensed, wanted)
        state, reference_zmp, reference_dcm = self._adjusted(state, sensed, ahead)
        zmp = self._feedback(state, sensed, reference_zmp, reference_dcm)
        state = self._follow(state, sensed, zmp)
        feet = self._feet(state)
        state = state._replace(feet=feet.pose, feet_velocity=feet.velocity, feet_acceleration=feet.acceleration)
        reference = self._reference(state)
        return self._act(state, reference, sensed, wanted)

    def _held_back(self, state: WalkerState, sensed: Estimate, velocity: Velocity) -> Velocity:
        """The command, less what of it would lead into an obstacle."""
        x, y = state.anchors[:, :2].mean(axis=0).tolist()
        return cap(held_back(velocity, state.circles, (x, y, sensed.yaw), self.gait), self.gait)

    def _settled_on(self, state: WalkerState, sensed: Estimate) -> WalkerState:
        """The state at the first tick: where the floor leans, the joints lean against it from the start."""
        roll, pitch = sensed.sole_tilt.mean(axis=0).tolist()
        height, most = float(sensed.com[2]), self.config.offset_most
        x, y = (min(max(lean, -most), most) for lean in (-pitch * height, roll * height))
        return state._replace(offset=(x, y), com=(float(sensed.com[0]), float(sensed.com[1]), 0.0, 0.0))

    def _change_mode(self, state: WalkerState, sensed: Estimate, velocity: Velocity) -> WalkerState:
        if state.mode == Mode.STAND:
            return self._leave_standing(state, sensed, velocity)
        if state.mode == Mode.SHIFT:
            left = state.shift_left - TICK
            if left > 0:
                return state._replace(shift_left=left)
            return self._first_step(state, velocity)
        step = state.step._replace(phase=state.step.phase + TICK)
        state = state._replace(step=step)
        swinging = 1 - step.stance
        late = step.phase >= step.end + self.config.late
        share = (step.phase - step.double_support) / max(step.end - step.double_support, TICK)
        if late or (share >= self.config.touchdown and bool(sensed.contact[swinging])):
            return self._land(state, sensed, velocity)
        return state

    def _leave_standing(self, state: WalkerState, sensed: Estimate, velocity: Velocity) -> WalkerState:
        xi = (float(sensed.dcm[0]), float(sensed.dcm[1]))
        area = self.area(state, _SHRUNK)
        if self.config.adapt_steps and state.t > _SETTLING and support.margin(area, xi) < 0:
            middle = state.anchors[:, :2].mean(axis=0)
            yaw = float(state.anchors[:, 3].mean())
            aside = rotate(-yaw, (xi[0] - middle[0], xi[1] - middle[1]))[1]
            stance = RIGHT if aside > 0 else LEFT
            step, later = catching(self.gait, stance, _pose(state.anchors, stance), state.zmp)
            return state._replace(
                mode=Mode.STEP, step=step, later=later, plan_age=math.inf, landings=(), correction=STILL
            )
        if not moving(velocity):
            return state
        stance = first_stance(velocity)
        step = state.step._replace(stance=stance, foot=_pose(state.anchors, stance))
        return state._replace(
            mode=Mode.SHIFT, shift_left=self.config.shift_time, step=step, landings=(), correction=STILL
        )

    def _first_step(self, state: WalkerState, velocity: Velocity) -> WalkerState:
        return self._begin(state, state.step.stance, state.zmp, velocity)

    def _begin(self, state: WalkerState, stance: int, origin: Pair, velocity: Velocity) -> WalkerState:
        foot = _pose(state.anchors, stance)
        walks = moving(velocity)
        wanted = _sum(velocity, state.correction) if walks else STILL
        final = not walks and self._calm(state, foot, stance, origin)
        ahead = chain(self.gait, by_command(self.gait, wanted, stance, foot[2]), final)
        step = begin(self.gait, stance, foot, origin, ahead, wanted.omega * self.gait.step_time, final)
        step = step._replace(asked=velocity)
        return state._replace(mode=Mode.STEP, step=step, later=ahead.displacements[1:], plan_age=math.inf)

    def _calm(self, state: WalkerState, foot: Pose, stance: int, origin: Pair) -> bool:
        """Whether the robot could stand after the step that begins: its DCM is about where that asks for."""
        ahead = chain(self.gait, by_command(self.gait, STILL, stance, foot[2]), final=True)
        step = begin(self.gait, stance, foot, origin, ahead, 0.0, True)
        x, y = self._dcm_of(step, ahead)
        sensed = state.estimate
        return sensed is None or math.hypot(float(sensed.dcm[0]) - x, float(sensed.dcm[1]) - y) < _CALM

    def _land(self, state: WalkerState, sensed: Estimate, velocity: Velocity) -> WalkerState:
        landed = 1 - state.step.stance
        anchors = state.anchors.copy()
        anchors[landed] = sensed.soles[landed]
        anchors[landed, 2] = 0.0
        carried = state.step.foot[2]
        anchors[landed, 3] = carried + math.remainder(anchors[landed, 3] - carried, 2 * math.pi)
        pose = _pose(anchors, landed)
        landings = (*state.landings[-2:], Landing(state.t, landed, pose, state.step.asked))
        correction = state.correction
        if moving(velocity) and not state.step.moved and not (state.held or (state.plan and state.plan.obstacle)):
            correction = corrected(correction, landings, self.config)
        late = state.step.phase - state.step.end
        lowering = min(max(state.lowering + self.config.punctual * late, -_LOWERING), _LOWERING)
        state = state._replace(anchors=anchors, landings=landings, correction=correction, lowering=lowering)
        if not moving(velocity) and side_by_side(self.gait, state.step.foot, pose):
            return state._replace(mode=Mode.STAND, correction=STILL)
        return self._begin(state, landed, state.step.foot[:2], velocity)

    def _plan(self, state: WalkerState, sensed: Estimate, wanted: Velocity) -> tuple[WalkerState, Chain]:
        """The footsteps to come: planned again where it is time, else as they were."""
        step, gait = state.step, self.gait
        if state.mode == Mode.SHIFT:
            return state, chain(gait, by_command(gait, wanted, step.stance, step.foot[2]), final=False)
        age = state.plan_age + TICK
        if not self.config.plan_steps:
            state = state._replace(later=by_command(gait, wanted, 1 - step.stance, step.foot[2] + step.turn)[:-1])
        elif age >= self.config.lead - TICK / 2 and (state.mode == Mode.STEP or state.fallbacks):
            state = self._planned_again(state, sensed, wanted)
        else:
            state = state._replace(plan_age=age)
        first = rotate(step.foot[2], state.step.planned)
        return state, chain(gait, (first, *state.later), step.final)

    def _planned_again(self, state: WalkerState, sensed: Estimate, wanted: Velocity) -> WalkerState:
        """One iteration of the predictive controller, from the measured state."""
        step = state.step
        other = state.anchors[1 - step.stance]
        omega = self.gait.omega
        com = np.column_stack([sensed.com[:2], sensed.com_velocity[:2], omega**2 * (sensed.com[:2] - state.zmp)])
        stands = state.mode == Mode.STAND
        walks_on = NEVER if moving(wanted) else 2
        problem = PlanState(
            com,
            Footstep(step.stance, *step.foot),
            Footstep(1 - step.stance, float(other[0]), float(other[1]), float(other[3])),
            step.origin,
            step.phase,
            max(step.end - step.phase, 0.0),
            step.double_support,
            0 if stands else 1 if step.final else walks_on,
            None if step.final or stands else (*rotate(step.foot[2], step.nominal), step.turn),
        )
        plan = next_plan(self.problem, problem, wanted, state.circles, state.plan, self.config.deadline_ms)
        if plan.obstacle and max(plan.overlap, plan.violation) > _CROSSED:
            # linearised rows that the answer itself breaks: the command was held back already, walk on by it
            plan = next_plan(self.problem, problem, wanted, NONE, state.plan, self.config.deadline_ms)
        fallbacks = 0 if plan.status == Status.SOLVED else state.fallbacks + 1
        state = state._replace(plan=plan, plan_age=0.0, fallbacks=fallbacks)
        if stands:
            return state
        displaced = [(float(x), float(y)) for x, y in plan.displacement]
        step = step._replace(planned=rotate(-step.foot[2], displaced[0]), turn=float(plan.feet[0, 2]) - step.foot[2])
        return state._replace(step=step, later=tuple(displaced[1:]))

    def _placed(self, sensed: Estimate, senses: Senses, circles: tuple[Circle, ...]) -> Float[np.ndarray, "circles 3"]:
        """Obstacles of the world in the plan's frame, by where the waist is in both."""
        if not circles or not np.isfinite(senses.place).all():
            return NONE
        here = survey(self.model, sensed.q).waist_p
        turn = sensed.yaw - float(senses.place[2])
        placed = np.array(circles, float)
        for row in placed:
            dx, dy = rotate(turn, (row[0] - float(senses.place[0]), row[1] - float(senses.place[1])))
            row[:2] = here[0] + dx, here[1] + dy
        return placed

    def _adjusted(self, state: WalkerState, sensed: Estimate, ahead: Chain) -> tuple[WalkerState, Pair, Pair]:
        """Place and time of the landing, the planned zero moment point, and the DCM that goes with them."""
        xi = (float(sensed.dcm[0]), float(sensed.dcm[1]))
        if state.mode == Mode.STAND:
            x, y = state.anchors[:, :2].mean(axis=0).tolist()
            return state, (x, y), (x, y)
        step = state.step
        if state.mode == Mode.SHIFT:
            zmp = shift_zmp(self.gait, xi, step.foot[:2], ahead, max(state.shift_left, 0.05))
            return state, zmp, xi
        omega = self.gait.omega
        foot, yaw = step.foot[:2], step.foot[2]
        came = (foot[0] - step.origin[0], foot[1] - step.origin[1])
        short = pendulum.ramp(omega, came, step.double_support - step.phase, step.double_support)
        x0 = rotate(-yaw, (xi[0] - foot[0] - short[0], xi[1] - foot[1] - short[1]))
        step = self._choose(state, x0, ahead)
        state = state._replace(step=step)
        share = min(step.phase / step.double_support, 1.0) if step.double_support > 0 else 1.0
        zmp = (step.origin[0] + share * came[0], step.origin[1] + share * came[1])
        return state, zmp, self._dcm_of(step, ahead)

    def _dcm_of(self, step: Step, ahead: Chain) -> Pair:
        """Where the DCM is to be now, so that it ends the step where the next one needs it."""
        omega, foot, yaw = self.gait.omega, step.foot[:2], step.foot[2]
        came = (foot[0] - step.origin[0], foot[1] - step.origin[1])
        short = pendulum.ramp(omega, came, step.double_support - step.phase, step.double_support)
        goal = aim(step, ahead, self.gait)
        decay = math.exp(-omega * max(step.end - step.phase, 0.0))
        at_end = [decay * (goal.kappa * step.landing[i] + goal.rest[i]) / goal.growth for i in (0, 1)]
        beyond = rotate(yaw, (at_end[0], at_end[1]))
        return foot[0] + short[0] + beyond[0], foot[1] + short[1] + beyond[1]

    def _choose(self, state: WalkerState, x0: Pair, ahead: Chain) -> Step:
        """The step with its landing adjusted."""
        step = state.step
        if step.end - step.phase < self.config.freeze:
            return step
        goal, limits = aim(step, ahead, self.gait), bounds(step, self.gait, self.config)
        limits = within_reach(step, limits, state.feet[1 - step.stance], self.config)
        if not self.config.adapt_time:
            limits = limits._replace(earliest=goal.end, latest=goal.end)
        if not self.config.adapt_steps:
            limits = limits._replace(least=goal.displacement, most=goal.displacement)
        rows = clear_of(self.gait, step, state.circles)
        chosen = adjust(self.config.step, self.gait.omega, x0, step.phase, step.end, goal, limits, rows)
        far = math.hypot(chosen.displacement[0] - goal.displacement[0], chosen.displacement[1] - goal.displacement[1])
        return step._replace(landing=chosen.displacement, end=chosen.end, moved=step.moved or far > _FAR)

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
        """The area of the soles that stand, counter-clockwise."""
        if state.mode == Mode.STEP and state.step.phase >= state.step.double_support:
            return support.sole_corners(self.gait, *state.step.foot, share)
        both = [support.sole_corners(self.gait, *_pose(state.anchors, side), share) for side in (LEFT, RIGHT)]
        return support.hull([*both[0], *both[1]])

    def _follow(self, state: WalkerState, sensed: Estimate, zmp: Pair) -> WalkerState:
        """The centre of mass' reference: drawn to the measured one, then a tick of the pendulum over the new ZMP."""
        config, omega = self.config, self.gait.omega
        x, y, vx, vy = state.com
        mx, my = float(sensed.com[0]), float(sensed.com[1])
        ux, uy = float(sensed.com_velocity[0]), float(sensed.com_velocity[1])
        most = config.offset_most
        gain = TICK / config.offset_time
        offset = (
            min(max(state.offset[0] + gain * (x - mx), -most), most),
            min(max(state.offset[1] + gain * (y - my), -most), most),
        )
        share = config.follow if config.follow_measured else 0.0
        x, y, vx, vy = x + share * (mx - x), y + share * (my - y), vx + share * (ux - vx), vy + share * (uy - vy)
        x, vx = pendulum.advance(omega, x, vx, zmp[0], TICK)
        y, vy = pendulum.advance(omega, y, vy, zmp[1], TICK)
        return state._replace(com=(x, y, vx, vy), offset=offset, zmp=zmp, load=self._load(state, zmp))

    def _load(self, state: WalkerState, zmp: Pair) -> Pair:
        """How the weight is shared by feet that both stand: by the ZMP's place on the line between them."""
        if state.mode == Mode.STEP and state.step.phase >= state.step.double_support:
            return (1.0, 0.0) if state.step.stance == LEFT else (0.0, 1.0)
        (lx, ly), (rx, ry) = state.anchors[LEFT, :2].tolist(), state.anchors[RIGHT, :2].tolist()
        dx, dy = lx - rx, ly - ry
        share = ((zmp[0] - rx) * dx + (zmp[1] - ry) * dy) / max(dx * dx + dy * dy, 1e-9)
        share = min(max(share, 0.0), 1.0)
        return share, 1.0 - share

    def _feet(self, state: WalkerState) -> Feet:
        feet = Feet(state.feet, state.feet_velocity, state.feet_acceleration)
        step = state.step
        if state.mode != Mode.STEP or step.phase < step.double_support:
            for side in (LEFT, RIGHT):
                feet = rest(feet, side, state.anchors[side], TICK)
            return feet
        feet = rest(feet, step.stance, state.anchors[step.stance], TICK)
        dx, dy = rotate(step.foot[2], step.landing)
        goal = (step.foot[0] + dx, step.foot[1] + dy, step.foot[2] + step.turn)
        done, left = step.phase - step.double_support, step.end - state.lowering - step.phase
        return swing(feet, 1 - step.stance, goal, self.gait.step_height, done, left, TICK)

    def _reference(self, state: WalkerState) -> Reference:
        x, y, vx, vy = state.com
        squared = self.gait.omega**2
        com = np.array(
            [
                [x, y, self.gait.com_height],
                [vx, vy, 0.0],
                [squared * (x - state.zmp[0]), squared * (y - state.zmp[1]), 0.0],
            ]
        )
        yaw = np.array([a[:, 3].mean() for a in (state.feet, state.feet_velocity, state.feet_acceleration)])
        return Reference(
            state.t,
            com,
            np.array(state.zmp),
            yaw,
            state.feet,
            state.feet_velocity,
            state.feet_acceleration,
            np.array(state.load),
        )

    def _act(
        self, state: WalkerState, reference: Reference, sensed: Estimate, wanted: Velocity
    ) -> tuple[WalkerState, Action]:
        started = time.perf_counter()
        target = self._target(state, reference)
        posture = solve_posture(self.model, state.q, target, 2)
        servo = posture.q[7:]
        if self.config.feed_forward:
            servo = servo + self._sag(posture.q, state)
        took = 1e3 * (time.perf_counter() - started)
        plan = state.plan if state.plan_age == 0 else None
        action = Action(servo, reference, sensed, plan, took, float(posture.misses.max()), wanted)
        return state._replace(q=posture.q), action

    def _target(self, state: WalkerState, reference: Reference) -> PostureTarget:
        com = reference.com[0].copy()
        com[:2] += state.offset
        heading = _turned(float(reference.yaw[0]))
        soles = np.stack([_turned(float(yaw)) for yaw in reference.feet[:, 3]])
        return PostureTarget(com, reference.feet[:, :3], soles, heading, heading, self._weights(state))

    def _weights(self, state: WalkerState) -> Float[np.ndarray, "21"]:
        """Of the rows of the inverse kinematics: the swing foot's pitch is free at first, and held when it lands."""
        weights = WEIGHTS.copy()
        step = state.step
        if not self.config.release_pitch or state.mode != Mode.STEP or step.phase < step.double_support:
            return weights
        share = (step.phase - step.double_support) / max(step.end - step.double_support, TICK)
        held = min(max((share - 0.5) / 0.4, 0.0), 1.0)
        weights[_PITCH_ROW[1 - step.stance]] *= _FREE + (1 - _FREE) * held
        return weights

    def _sag(self, q: Float[np.ndarray, " positions"], state: WalkerState) -> Float[np.ndarray, " joints"]:
        """How far the servos must be commanded ahead so as to hold their load [rad]."""
        cop = np.array([_seen_from(_pose(state.anchors, side), state.zmp) for side in (LEFT, RIGHT)])
        torque = static_torques(self.model, q, np.array(state.load), cop)
        return np.clip(torque, -self.humanoid.effort, self.humanoid.effort) / self.humanoid.stiffness


_FAR = 0.03  # a landing this far from the plan was moved by a push, not by the gait's own error [m]
_FREE = 1e-5
_PITCH_ROW = (7, 13)  # com 3, then each sole: position 3, rotation 3 about its own x, y, z


def walker(humanoid: Humanoid, config: WalkConfig | None = None) -> Walker:
    """A humanoid, ready to walk."""
    return Walker(humanoid, config or WalkConfig(), observer(humanoid, posture_model(humanoid)), nmpc(humanoid.gait))


def _turned(yaw: float) -> Float[np.ndarray, "3 3"]:
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _pose(poses: Float[np.ndarray, "2 4"], side: int) -> Pose:
    x, y, _, yaw = poses[side].tolist()
    return x, y, yaw


def _seen_from(pose: Pose, point: Pair) -> Pair:
    """A point of the floor in a sole's frame [m]."""
    return rotate(-pose[2], (point[0] - pose[0], point[1] - pose[1]))


def _sum(a: Velocity, b: Velocity) -> Velocity:
    return Velocity(a.vx + b.vx, a.vy + b.vy, a.omega + b.omega)
