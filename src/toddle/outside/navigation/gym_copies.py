"""Copies of a Gymnasium environment side by side, whatever the way in which they begin anew.

Gymnasium's vector environments know three (farama.org/Vector-Autoreset-Mode). What is wanted is one: the observation
after each step, of the episode that may have ended with it, and the one that the next action answers to. A copy that
only began anew in a call, as those do that do so in the step after, has made no step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from jaxtyping import Bool, Float32, Shaped

from toddle.outside.navigation.gym_task import opened


class Stepped(NamedTuple):
    """What one action of each copy led to.

    Attributes:
        after: observation after it, of the same episode.
        following: observation that the next action answers to.
        reward: for it.
        terminated: the episode ended.
        truncated: it was cut off.
        real: a step was made; the copy has not just begun anew.
    """

    after: Float32[np.ndarray, "actors numbers"]
    following: Float32[np.ndarray, "actors numbers"]
    reward: Float32[np.ndarray, " actors"]
    terminated: Bool[np.ndarray, " actors"]
    truncated: Bool[np.ndarray, " actors"]
    real: Bool[np.ndarray, " actors"]


class Copies:
    """The copies, each in an episode of its own. They are the world: what state they have is their own.

    Attributes:
        spaces: of one of them.
        actors: how many.
    """

    def __init__(self, name: str, actors: int) -> None:
        """Makes them.

        Raises:
            BadInput: see `toddle.outside.navigation.gym_task.opened`.
        """
        self._env, self.spaces = opened(name, actors)
        self.actors = actors
        self._mode = self._env.metadata["autoreset_mode"]
        self._waiting = np.zeros(actors, bool)

    def begin(self, seed: int) -> Float32[np.ndarray, "actors numbers"]:
        """All begin anew, each by a seed of its own from here on."""
        self._waiting = np.zeros(self.actors, bool)
        return self.spaces.seen(self._env.reset(seed=seed)[0])

    def step(self, actions: Shaped[np.ndarray, "actors ..."]) -> Stepped:
        """One action of each, as `GymSpaces.asked` has them; one that waits to begin anew gets none of it."""
        observation, reward, terminated, truncated, info = self._env.step(self.spaces.asked(actions))
        following = self.spaces.seen(observation)
        after, real, ended = following, ~self._waiting, terminated | truncated
        if self._mode == AutoresetMode.NEXT_STEP:
            self._waiting = ended
        elif ended.any():
            after = following.copy()
            if self._mode == AutoresetMode.SAME_STEP:
                finals = np.stack([info["final_obs"][copy] for copy in np.flatnonzero(ended)])
                after[ended] = self.spaces.seen(finals)
            else:
                fresh = self._env.reset(options={"reset_mask": ended})[0]
                following[ended] = self.spaces.seen(fresh)[ended]
        return Stepped(after, following, reward.astype(np.float32), terminated, truncated, real)

    def close(self) -> None:
        """Gives back what they hold."""
        self._env.close()
