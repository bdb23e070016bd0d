"""The arm in physics: it answers "where did the tip go?" by going there, with weight and a noisy sensor.

A movement is a minimum-jerk ramp of the servo commands (Flash and Hogan 1985), then a wait until the joints
rest. Its length is a share of ``sweep_s``: the largest share of its range that any joint travels. What the
tip reaches differs from the chain's own kinematics, by the sag of the servos under the arm's weight and by
the sensor's noise; that is the point.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import mujoco
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from toddle.failures import BadInput, ToddleError
from toddle.outside.simulation.model import build
from toddle.outside.simulation.options import TIMESTEP, PhysicsOptions
from toddle.robots.chain import Chain

_STEPS = 5  # simulation steps to one servo command: commands come at 100 Hz
_SHORTEST = 0.05  # even the smallest movement is a ramp this long [s]
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION  # full physics, commands, and where the constraint solver starts


class PhysicsPlant:
    """A rigid chain in MuJoCo, as a `toddle.robots.body.Plant`: one movement at a time.

    Attributes:
        name: the arm's name.
        joints: names of the actuated joints.
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        home: where the arm stands at first [rad or m].
        options: what was chosen about the simulation.
        moves: movements made.
    """

    def __init__(self, chain: Chain, options: PhysicsOptions | None = None) -> None:
        """Builds the arm and lets it come to rest at home.

        Raises:
            BadInput: the chain cannot be simulated (see `build`).
        """
        self.options = options or PhysicsOptions()
        self.name, self.joints = chain.name, chain.joints
        self.lower, self.upper, self.home = (
            np.asarray(array, float) for array in (chain.lower, chain.upper, chain.home)
        )
        self.moves = 0
        self._arm = build(chain, self.options)
        self._coordinates = list(chain.coordinates)
        self._encoder = np.linalg.pinv(self._arm.gain)
        self._random = np.random.Generator(np.random.PCG64(self.options.seed))
        self.model, self.data = self._arm.model, mujoco.MjData(self._arm.model)
        self._start()

    def move(self, q: ArrayLike) -> Float[np.ndarray, " space"]:
        """Go to the joint values q, clipped to the limits, and look where the tip is.

        Args:
            q: one value for each joint [rad, or m for a sliding joint].

        Returns:
            The observed tip position, noise included [m].

        Raises:
            BadInput: q has the wrong shape, or is not finite.
            ToddleError: the simulation became unstable.
        """
        command = self._command(q)
        for row in self._ramp(command):
            self.data.ctrl[:] = row
            mujoco.mj_step(self.model, self.data, nstep=_STEPS)
        self._settle()
        self.moves += 1
        tip = self.tip
        if not np.isfinite(tip).all():
            raise ToddleError(
                f"the simulation became unstable in movement {self.moves}",
                where=self.name,
                remedy="lower natural_frequency_hz, or make the movements slower with sweep_s",
            )
        return tip + self.options.noise * self._random.standard_normal(len(tip))

    @property
    def tip(self) -> Float[np.ndarray, " space"]:
        """Where the tip is now, without noise [m]."""
        mujoco.mj_kinematics(self.model, self.data)
        return self.data.site_xpos[0, self._coordinates]

    @property
    def observed_joints(self) -> Float[np.ndarray, " joints"]:
        """Where the joints are now, by encoders [rad or m]; over all axes of a joint, by least squares."""
        return self._encoder @ (self.data.qpos - self._arm.offset)

    @property
    def seconds(self) -> float:
        """Simulated time since the arm first stood at home [s]."""
        return float(self.data.time)

    def state(self) -> dict[str, np.ndarray]:
        """All that the next movements depend on: a plant restored from it goes on bit for bit."""
        physics = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, self.data, physics, _STATE)
        return {"physics": physics, "random": _words(self._random), "moves": np.array([self.moves])}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Become what `state` was taken from: the same chain and options are this plant's business to have.

        Raises:
            BadInput: the state is incomplete, or another arm's.
        """
        own = self.state()
        for name, now in own.items():
            then = state.get(name)
            if then is None or then.shape != now.shape or then.dtype != now.dtype:
                raise BadInput(
                    f"the state's {name!r} is missing, or another arm's",
                    where=self.name,
                    remedy="restore it into the arm and options it was taken from",
                )
        mujoco.mj_setState(self.model, self.data, np.array(state["physics"]), _STATE)
        _set_words(self._random, state["random"])
        self.moves = int(state["moves"][0])

    def _start(self) -> None:
        home = self._command(self.home)
        self.data.qpos[:], self.data.ctrl[:] = home, home
        mujoco.mj_step(self.model, self.data, nstep=_STEPS)
        self._settle()
        self.data.time = 0.0

    def _command(self, q: ArrayLike) -> Float[np.ndarray, " servos"]:
        remedy = f"give {len(self.joints)} finite numbers: {', '.join(self.joints)}"
        try:
            values = np.asarray(q, dtype=float)
        except (TypeError, ValueError) as error:
            raise BadInput("joint values must be numbers", where=self.name, remedy=remedy) from error
        if values.shape != self.home.shape or not np.isfinite(values).all():
            shown = np.array2string(values, threshold=8)
            raise BadInput(f"joint values {shown} cannot be moved to", where=self.name, remedy=remedy)
        return self._arm.gain @ np.clip(values, self.lower, self.upper) + self._arm.offset

    def _ramp(self, command: Float[np.ndarray, " servos"]) -> Float[np.ndarray, "commands servos"]:
        """Minimum-jerk commands from the last one to this one, one for every `_STEPS` simulation steps."""
        last = self.data.ctrl.copy()
        low, high = self.model.jnt_range.T
        share = float(np.max(np.abs(command - last) / (high - low)))
        count = math.ceil(max(share * self.options.sweep_s, _SHORTEST) / (_STEPS * TIMESTEP))
        t = np.arange(1, count + 1)[:, None] / count
        return last + (command - last) * (t**3 * (10 - 15 * t + 6 * t**2))

    def _settle(self) -> None:
        """Step until every joint rests, or the patience of `settle_s` is at its end."""
        for _ in range(math.ceil(self.options.settle_s / (_STEPS * TIMESTEP))):
            mujoco.mj_step(self.model, self.data, nstep=_STEPS)
            if np.abs(self.data.qvel).max() < self.options.still:
                return


def _words(random: np.random.Generator) -> np.ndarray:
    """The generator's state in 64-bit words: two of 128 bits, then the half-used draw."""
    state = random.bit_generator.state
    large = (state["state"]["state"], state["state"]["inc"])
    halves = [half for word in large for half in (word >> 64, word & (2**64 - 1))]
    return np.array([*halves, state["has_uint32"], state["uinteger"]], dtype=np.uint64)


def _set_words(random: np.random.Generator, words: np.ndarray) -> None:
    a, b, c, d, held, draw = (int(word) for word in words)
    large = {"state": a << 64 | b, "inc": c << 64 | d}
    random.bit_generator.state = {
        "bit_generator": "PCG64",
        "state": large,
        "has_uint32": held,
        "uinteger": draw,
    }
