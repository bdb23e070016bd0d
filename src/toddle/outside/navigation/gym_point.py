"""``toddle/Point-v0``: the document's point that walks to a goal, as a Gymnasium environment of numpy.

The same as `toddle.navigate.tasks.point.PointTask`, for what doesn't speak JAX (Huber 2019, section 4.3.1). Importing
this registers it. Actions go where they point, even beyond -1 to 1, as the document's noisy ones do.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import register
from jaxtyping import Float32

from toddle.navigate.task import Outcome
from toddle.navigate.tasks.point import PRIZE, PointTask

POINT = "toddle/Point-v0"
"""The id of the environment."""

register(id=POINT, entry_point="toddle.outside.navigation.gym_point:PointEnv")


class PointEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A point that walks to a goal.

    Attributes:
        task: its numbers.
    """

    def __init__(self, longest: int = 0) -> None:
        """Makes one.

        Args:
            longest: an episode is cut off after so many steps; 0: never.
        """
        self.task = PointTask(longest=longest)
        wide = np.full(2, self.task.far + self.task.widest + 10.0)
        goals = np.full(2, float(self.task.widest))
        high = np.concatenate([wide, goals]).astype(np.float32)
        self.observation_space = gymnasium.spaces.Box(-high, high, dtype=np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), dtype=np.float32)
        self._agent, self._goal = np.zeros(2, np.float32), np.zeros(2, np.float32)
        self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32[np.ndarray, "4"], dict[str, Any]]:
        """At the origin, with a new goal."""
        super().reset(seed=seed)
        widest = self.task.widest
        self._agent, self._steps = np.zeros(2, np.float32), 0
        self._goal = self.np_random.integers(-widest, widest + 1, 2).astype(np.float32)
        return self._seen(), {}

    def step(
        self, action: Float32[np.ndarray, "2"]
    ) -> tuple[Float32[np.ndarray, "4"], float, bool, bool, dict[str, Any]]:
        """Go; the reward is the distance gained, and the prize for an end. Info: the ``outcome``."""
        before = self._distance()
        self._agent = self._agent + np.float32(self.task.stride) * action
        self._steps += 1
        after = self._distance()
        won, lost = after < self.task.near, after > self.task.far
        late = not (won or lost) and 0 < self.task.longest <= self._steps
        outcome = Outcome.WON if won else Outcome.LOST if lost else Outcome.LATE if late else Outcome.GOES_ON
        reward = before - after + PRIZE * (won - lost)
        return self._seen(), reward, won or lost, late, {"outcome": int(outcome)}

    def _distance(self) -> float:
        x, y = (self._goal - self._agent).tolist()
        return (x * x + y * y) ** 0.5

    def _seen(self) -> Float32[np.ndarray, "4"]:
        return np.concatenate([self._agent, self._goal])
