"""A humanoid in physics: servo targets in, senses out, a hundred times a second; and, for judges only, the truth.

The controller sees `Senses`, which may be noisy, late and biased. `Truth` is for figures and tests.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from toddle.failures import BadInput
from toddle.outside.simulation.disturbances import TICK, TIMESTEP, WorldOptions
from toddle.outside.simulation.senses import organs, sense, site
from toddle.outside.simulation.touching import clearances, shapes, touching
from toddle.outside.simulation.world import build, disturb_masses
from toddle.robots.humanoid import Humanoid
from toddle.signals import Senses

_STEPS = round(TICK / TIMESTEP)
_LOWEST = 0.6  # of the waist, as a share of its height at the start; under it the robot has fallen
_LEAN = 0.7  # cosine of the waist's tilt; under it the robot has fallen
_AT_LIMIT = 0.999  # of the effort: the servo gives all it has


class Truth(NamedTuple):
    """What is so, in the world (z = 0: the floor).

    Attributes:
        t: time [s].
        q: configuration, in the order of `toddle.robots.humanoid.Tree`.
        v: velocity, likewise.
        com: centre of mass [m].
        com_velocity: its velocity [m/s].
        zmp: zero moment point on the floor, from all contact forces on the feet [m]; NaN in the air.
        load: upward force on each foot [N]; both are means over the last tick.
        soles: left and right: x, y, z [m] and yaw [rad].
        tilt: angle of each sole to the floor [rad].
        waist: x, y [m] and yaw [rad].
        fallen: the waist is low, or lies over.
        touching: whether feet, legs, body touch an obstacle now.
        clearance: of feet, legs, body to the nearest obstacle [m], at most 1; under 0 they overlap.
        saturation: share of the servos that give all they have.
    """

    t: float
    q: Float[np.ndarray, " positions"]
    v: Float[np.ndarray, " speeds"]
    com: Float[np.ndarray, "3"]
    com_velocity: Float[np.ndarray, "3"]
    zmp: Float[np.ndarray, "2"]
    load: Float[np.ndarray, "2"]
    soles: Float[np.ndarray, "2 4"]
    tilt: Float[np.ndarray, "2"]
    waist: Float[np.ndarray, "3"]
    fallen: bool
    touching: Bool[np.ndarray, "3"]
    clearance: Float[np.ndarray, "3"]
    saturation: float


class Push(NamedTuple):
    """A force at the chest, level, from ``start`` [s] on; towards ``direction`` of the waist as it then stands."""

    impulse: float
    direction: float
    start: float
    duration: float


class HumanoidSimulation:
    """A humanoid in MuJoCo, driven by its servos.

    Attributes:
        humanoid: the robot.
        options: the world.
        model: MuJoCo's model; reading it is allowed.
        data: MuJoCo's state; reading it is allowed.
        touched: whether feet, legs, body have touched an obstacle since the last `reset`.
    """

    def __init__(
        self,
        humanoid: Humanoid,
        options: WorldOptions | None = None,
        furnish: Callable[[Any], None] | None = None,
    ) -> None:
        """Builds the world and stands the robot at home.

        Args:
            humanoid: the robot.
            options: the world; None: a level floor.
            furnish: adds to the world's description what else there is: see `rooms`.

        Raises:
            BadInput: the humanoid's description lacks something, or its servos are not its joints.
        """
        self.humanoid, self.options = humanoid, options or WorldOptions()
        self.model = build(humanoid, self.options, furnish)
        joints = len(humanoid.joints)
        if self.model.nu != joints or self.model.nq != 7 + joints:
            raise BadInput(
                f"{self.model.nu} servos and {self.model.nq} coordinates do not fit {joints} joints",
                where=humanoid.name,
                remedy="give it a free joint, and a hinge and a servo for each joint",
            )
        self.data = mujoco.MjData(self.model)
        self._organs = organs(humanoid, self.model, self.options)
        disturb_masses(self.model, self.options)
        self._shapes = shapes(self.model)
        self._chest = int(self.model.site_bodyid[site(humanoid, self.model, "chest")])
        self._soles = [site(humanoid, self.model, name) for name in ("left_sole", "right_sole")]
        self._root = int(self.model.body_rootid[self._chest])
        self._feet = [int(self.model.site_bodyid[number]) for number in self._soles]
        self._vectors, self._contact, self._about = np.zeros(self.model.nsensordata), np.zeros((2, 6)), np.zeros(3)
        self._late = round(self.options.delay_s / TICK)
        self.reset()

    def reset(self, q: ArrayLike | None = None) -> Senses:
        """Stand still at a configuration, at time 0; pushes are forgotten, and the noise starts anew.

        Args:
            q: the configuration (7 + joints); None: at home.

        Raises:
            BadInput: q has the wrong shape, or is not finite.
        """
        start = self._numbers(self.humanoid.home if q is None else q, self.model.nq, "configuration")
        mujoco.mj_resetData(self.model, self.data)
        self._draw = np.random.Generator(np.random.SFC64([self.options.seed, 2]))
        self._pushes: list[tuple[Push, Float[np.ndarray, "3"] | None]] = []
        self.touched = np.zeros(3, bool)
        self.data.qpos[:], self.data.ctrl[:] = start, start[7:]
        if self.model.na:
            self.data.act[:] = start[7:]
        mujoco.mj_forward(self.model, self.data)
        self._contact[:], self._about[:] = self.data.cfrc_ext[self._feet], self.data.subtree_com[self._root]
        self._height = float(self.data.site_xpos[self._organs.waist, 2])
        felt = sense(
            self._organs, self.data.sensordata, self.data, 0.0, self.data.qpos, self.data.qvel, self.options, self._draw
        )
        self._felt = deque([felt] * (self._late + 1), maxlen=self._late + 1)
        return felt

    def tick(self, servo: ArrayLike) -> Senses:
        """Command the servos and let 10 ms pass.

        Args:
            servo: target of each servo, in the humanoid's order [rad].

        Returns:
            What the sensors told at the start of the last physics step, or ``delay_s`` before.

        Raises:
            BadInput: the targets have the wrong shape, or are not finite.
        """
        self.data.ctrl[:] = self._numbers(servo, self.model.nu, "servo targets")
        if self._pushes:
            self._press()
        t, q, v = self._steps()
        self._felt.append(sense(self._organs, self._vectors, self.data, t, q, v, self.options, self._draw))
        if self._shapes.obstacles:
            self.touched |= touching(self._shapes, self.data)
        return self._felt[0]

    def push(self, impulse: float, direction: float, start: float | None = None, duration: float = 0.1) -> None:
        """Push the chest, at its body's centre of mass, with a level force.

        Args:
            impulse: force times duration [N s].
            direction: where to, from the waist's heading when the push starts, turning left [rad].
            start: when [s]; None: now.
            duration: how long the force lasts [s].

        Raises:
            BadInput: a number that is not finite, or no duration.
        """
        push = Push(impulse, direction, self.data.time if start is None else start, duration)
        if not all(math.isfinite(number) for number in push) or duration <= 0:
            raise BadInput(f"{push} is no push", where="push", remedy="give finite numbers, and a duration above 0")
        self._pushes.append((push, None))

    def move(self, obstacle: int, x: float, y: float) -> None:
        """Put an obstacle somewhere else [m], until the next `reset`: so people walk.

        Args:
            obstacle: its place in the world's ``circles``.
            x: of its centre.
            y: likewise.

        Raises:
            BadInput: there is no such obstacle, or a number is not finite.
        """
        if not (0 <= obstacle < len(self.options.circles) and math.isfinite(x) and math.isfinite(y)):
            raise BadInput(
                f"obstacle {obstacle} of {len(self.options.circles)} can't move to ({x:g}, {y:g})",
                where="move",
                remedy="count from 0, and give finite numbers",
            )
        self.data.mocap_pos[obstacle, :2] = x, y

    def truth(self) -> Truth:
        """What is so at this moment; contact forces and servos' torques are those of the last physics step."""
        model, data = self.model, self.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_subtreeVel(model, data)
        waist = data.site_xmat[self._organs.waist]
        height = float(data.site_xpos[self._organs.waist, 2])
        turned = data.site_xmat[self._soles]
        yaws = np.arctan2(turned[:, 3], turned[:, 0])
        force = np.abs(data.qfrc_actuator[6:])
        near = bool(self._shapes.obstacles)
        return Truth(
            float(data.time),
            data.qpos.copy(),
            data.qvel.copy(),
            data.subtree_com[self._root].copy(),
            data.subtree_linvel[self._root].copy(),
            _zmp(self._contact.sum(axis=0), self._about),
            self._contact[:, 5].copy(),
            np.column_stack([data.site_xpos[self._soles], yaws]),
            np.arccos(np.clip(turned[:, 8], -1.0, 1.0)),
            np.array([*data.site_xpos[self._organs.waist, :2], math.atan2(waist[3], waist[0])]),
            not (height > _LOWEST * self._height and waist[8] > _LEAN),
            touching(self._shapes, data) if near else np.zeros(3, bool),
            clearances(self._shapes, model, data) if near else np.ones(3),
            float(np.mean(force >= _AT_LIMIT * self.humanoid.effort)),
        )

    def _steps(self) -> tuple[float, Float[np.ndarray, " positions"], Float[np.ndarray, " speeds"]]:
        """One tick of physics; the start of its last step, to which MuJoCo's sensors then belong."""
        for total in (self._vectors, self._contact, self._about):
            total[:] = 0.0
        for _ in range(_STEPS - 1):
            self._step()
        t, q, v = float(self.data.time), self.data.qpos.copy(), self.data.qvel.copy()
        self._step()
        for total in (self._vectors, self._contact, self._about):
            total /= _STEPS
        return t, q, v

    def _step(self) -> None:
        mujoco.mj_step(self.model, self.data)
        self._vectors += self.data.sensordata
        self._contact += self.data.cfrc_ext[self._feet]
        self._about += self.data.subtree_com[self._root]

    def _press(self) -> None:
        """The mean force of all pushes over this tick, so that each one's impulse is exact."""
        now = self.data.time
        total = np.zeros(3)
        waiting: list[tuple[Push, Float[np.ndarray, "3"] | None]] = []
        for push, towards in self._pushes:
            end = push.start + push.duration
            share = max(min(end, now + TICK) - max(push.start, now), 0.0) / TICK
            if share > 0 and towards is None:
                turned = self.data.site_xmat[self._organs.waist]
                angle = math.atan2(turned[3], turned[0]) + push.direction
                towards = np.array([math.cos(angle), math.sin(angle), 0.0])
            if share > 0 and towards is not None:
                total += share * push.impulse / push.duration * towards
            if end > now:
                waiting.append((push, towards))
        self._pushes = waiting
        self.data.xfrc_applied[self._chest, :3] = total

    def _numbers(self, values: ArrayLike, count: int, what: str) -> Float[np.ndarray, " count"]:
        array = np.asarray(values, dtype=float)
        if array.shape != (count,) or not math.isfinite(array.sum()):
            raise BadInput(
                f"the {what} of shape {array.shape} cannot be used",
                where=self.humanoid.name,
                remedy=f"give {count} finite numbers",
            )
        return array


def _zmp(wrench: Float[np.ndarray, "6"], about: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2"]:
    """Where on the floor a wrench (torque about a point, force) has no level torque."""
    tx, ty, _, fx, fy, fz = wrench.tolist()
    x, y, z = about.tolist()
    return np.array([x - (ty + z * fx) / fz, y + (tx - z * fy) / fz]) if fz > 1.0 else np.full(2, math.nan)
