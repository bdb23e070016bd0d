"""``toddle/Walk-v0``: velocity commands in, senses out, over the walker in physics.

Each episode asks for a goal velocity. The loop of `toddle.walk.loop.walk` runs inside, safety gate included: a step of
the environment is that many of its ticks under one command.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from jaxtyping import Float, Float32, UInt8

from toddle.failures import BadInput, unknown_name
from toddle.outside.environment import WALK
from toddle.outside.environment.asked import Numbers, draws, velocity_of, whole_ticks
from toddle.outside.environment.observation import layout, observe
from toddle.outside.environment.tracking import Place, mean_velocity, reward
from toddle.outside.simulation.disturbances import TICK, WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation, Truth
from toddle.outside.simulation.pictures import Camera
from toddle.robots.humanoids import load_humanoid
from toddle.signals import STILL, Senses, Velocity
from toddle.walk.config import WalkConfig
from toddle.walk.loop import Moment, walk
from toddle.walk.pattern.plan import Status
from toddle.walk.walker import walker

_SEEDS = 2**31


class WalkEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A humanoid that is told how fast to walk.

    Attributes:
        humanoid: the robot.
        layout: where each part of the observation lies in it.
        simulation: the world; what it knows is no observation, but pushes go there. A `reset` may make a new one.
        goal: the velocity to walk at in this episode.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 - as Gymnasium asks

    def __init__(
        self,
        robot: str = "heicub",
        *,
        robot_config: str | None = None,
        world: WorldOptions | None = None,
        config: WalkConfig | None = None,
        goal: Numbers | None = None,
        seconds: float = 20.0,
        step_seconds: float = 0.1,
        render_mode: str | None = None,
        view: str = "side",
        width: int = 640,
        height: int = 360,
    ) -> None:
        """Builds robot and world.

        Args:
            robot: a name of the catalogue, or a file, as `toddle.robots.humanoids.load_humanoid` takes it.
            robot_config: a configuration file of the robot.
            world: friction, noise, obstacles, and so on; its seed is drawn at each `reset`.
            config: gains and switches of the walker.
            goal: velocity to walk at [m/s, m/s, rad/s]; None: drawn at each `reset`.
            seconds: an episode lasts [s].
            step_seconds: one command lasts, a multiple of 0.01 s [s].
            render_mode: ``"rgb_array"``, or None.
            view: of the pictures, see `toddle.outside.simulation.pictures.Camera`.
            width: of the pictures [pixels].
            height: of the pictures [pixels].

        Raises:
            BadInput: any of these can't be used.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise unknown_name("render mode", str(render_mode), self.metadata["render_modes"], where=WALK)
        self._ticks, self._seconds = whole_ticks(step_seconds), seconds
        if not seconds >= step_seconds:
            raise BadInput(
                f"{seconds} s is no time", where=f"{WALK}, seconds", remedy=f"give {step_seconds:g} s or more"
            )
        self.humanoid = load_humanoid(robot, None if robot_config is None else Path(robot_config))
        self.layout = layout(self.humanoid)
        fastest = np.array(self.humanoid.gait.fastest, np.float32)
        self.action_space = gymnasium.spaces.Box(-fastest, fastest, dtype=np.float32)
        low, high = self.layout.low.astype(np.float32), self.layout.high.astype(np.float32)
        self.observation_space = gymnasium.spaces.Box(low, high, dtype=np.float32)
        self.metadata = {**self.metadata, "render_fps": round(1 / (self._ticks * TICK))}
        self.render_mode = render_mode
        self.simulation = HumanoidSimulation(self.humanoid, world)
        self._world, self._walker = self.simulation.options, walker(self.humanoid, config)
        self._always = None if goal is None else self._allowed(goal)
        self.goal = self._always or STILL
        self._view, self._camera = (width, height, view), None
        self._moments: Iterator[Moment] | None = None
        self._command = STILL
        window = max(round(2 * self.humanoid.gait.step_time / (self._ticks * TICK)), 1)
        self._places: deque[Place] = deque(maxlen=window + 1)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32[np.ndarray, " numbers"], dict[str, Any]]:
        """Stand at the start; one tick of 0.01 s has passed.

        Args:
            seed: of everything that is drawn, from here on.
            options: ``goal``: the velocity to walk at in this episode.

        Returns:
            Observation and info, as `step` returns them.

        Raises:
            BadInput: an option that isn't known, or a goal out of range.
        """
        told = dict(options or {})
        goal = told.pop("goal", None)
        if told:
            raise unknown_name("option", str(next(iter(told))), ["goal"], where=f"{WALK}, reset")
        asked = self._always if goal is None else self._allowed(goal)
        super().reset(seed=seed)
        world, drawn = int(self.np_random.integers(_SEEDS)), self.np_random.uniform(-1.0, 1.0, 3)
        self.goal = asked or Velocity(*(drawn * self.humanoid.gait.fastest).tolist())
        if draws(self._world):
            self._forget()
            self.simulation = HumanoidSimulation(self.humanoid, replace(self._world, seed=world))
        self._command, self._support, self._since, self._fallbacks = STILL, -1, 0.0, 0
        self._places.clear()
        self._body = _Felt(self.simulation)
        self._moments = walk(self._walker, self._body, lambda _: self._command, circles=self._world.circles)
        moment = self._walk(1)
        self._ended = False
        return self._seen(moment), self._info(moment, self._look())

    def step(self, action: Numbers) -> tuple[Float32[np.ndarray, " numbers"], float, bool, bool, dict[str, Any]]:
        """Walk for ``step_seconds`` under a command.

        Args:
            action: velocity ahead, to the left [m/s], and turning left [rad/s]; the safety gate caps it, and limits
                how fast it changes.

        Returns:
            Observation (the parts are in ``layout``), reward, whether the robot fell, whether the time is over, and
            info: the truth, for whoever judges or learns.

        Raises:
            BadInput: the action has the wrong shape, or isn't finite; nothing has moved.
            ResetNeeded: the episode is over, or hasn't begun.
        """
        command = velocity_of(action, "action")
        if self._moments is None or self._ended:
            raise ResetNeeded("the episode is over, or hasn't begun: call reset()")
        self._command = command
        moment = self._walk(self._ticks)
        truth = self._look()
        info = self._info(moment, truth)
        fell = bool(info["fell"])
        over = not fell and moment.t > self._seconds - TICK / 2
        self._ended = fell or over
        earned = reward(info["velocity"], self.goal, self.humanoid.gait.fastest, fell)
        return self._seen(moment), earned, fell, over, info

    def render(self) -> UInt8[np.ndarray, "height width 3"] | None:  # type: ignore[override]
        """A picture of the robot as it is; None without a render mode.

        Raises:
            ToddleError: nothing here can draw.
        """
        if self.render_mode is None:
            return None
        if self._camera is None:
            self._camera = Camera(self.simulation, *self._view, shadows=False)
        return self._camera.picture()

    def close(self) -> None:
        """Give back what draws."""
        self._forget()
        self._moments = None

    def _forget(self) -> None:
        if self._camera is not None:
            self._camera.close()
            self._camera = None

    def _allowed(self, goal: Numbers) -> Velocity:
        return velocity_of(goal, "goal", self.humanoid.gait.fastest)

    def _walk(self, ticks: int) -> Moment:
        """So many ticks, fewer if the robot falls."""
        assert self._moments is not None
        moment = next(self._moments)
        self._count(moment)
        while not moment.fell and (ticks := ticks - 1) > 0:
            moment = next(self._moments)
            self._count(moment)
        return moment

    def _count(self, moment: Moment) -> None:
        self._since = self._since + TICK if moment.support == self._support else 0.0
        self._support = moment.support
        self._fallbacks += moment.plan is not None and moment.plan.status != Status.SOLVED

    def _look(self) -> Truth:
        truth = self.simulation.truth()
        self._places.append(Place(truth.t, *truth.waist.tolist()))
        return truth

    def _seen(self, moment: Moment) -> Float32[np.ndarray, " numbers"]:
        omega = self.humanoid.gait.omega
        row = observe(self.layout, omega, self.goal, moment, self._body.senses, self._since)
        return row.astype(np.float32)

    def _info(self, moment: Moment, truth: Truth) -> dict[str, Any]:
        return {
            "t": moment.t,
            "place": truth.waist,
            "velocity": mean_velocity(self._places[0], self._places[-1]),
            "goal": np.array(self.goal),
            "allowed": np.array(moment.allowed),
            "fell": moment.fell or truth.fallen,
            "touched": bool(self.simulation.touched.any()),
            "fallbacks": self._fallbacks,
        }


class _Felt:
    """The simulation, and what it told last."""

    def __init__(self, simulation: HumanoidSimulation) -> None:
        self._simulation = simulation
        self.senses = simulation.reset()

    def reset(self) -> Senses:
        """Stand at home."""
        self.senses = self._simulation.reset()
        return self.senses

    def tick(self, servo: Float[np.ndarray, " joints"]) -> Senses:
        """Command the servos and let 10 ms pass."""
        self.senses = self._simulation.tick(servo)
        return self.senses
