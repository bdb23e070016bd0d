"""What a Gymnasium environment shows and takes, as flat numbers: what of it PPO can learn, and what it can't.

Observations: a `Box` is flattened, a `Discrete` becomes one number for each value, 1 for the one it is. Actions: the
least and the greatest that a `Box` allows become -1 and 1, what is drawn beyond is clipped; a `Discrete` counts from 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import load_env_creator
from gymnasium.error import DependencyNotInstalled
from gymnasium.vector import AutoresetMode, VectorEnv
from jaxtyping import Float32, Shaped

from toddle.failures import BadInput, unknown_name
from toddle.navigate.task import Actions, Continuous, Discrete
from toddle.outside import environment as _walk  # noqa: F401 - registers it
from toddle.outside.navigation import gym_point as _point  # noqa: F401 - registers it


@dataclass(frozen=True, eq=False)
class GymSpaces:
    """Spaces of an environment, one copy of it.

    Attributes:
        name: id of the environment.
        observation: as Gymnasium has it.
        action: likewise.
    """

    name: str
    observation: spaces.Box | spaces.Discrete
    action: spaces.Box | spaces.Discrete

    @property
    def observations(self) -> int:
        """How many numbers an observation has."""
        return int(spaces.flatdim(self.observation))

    @property
    def actions(self) -> Actions:
        """What may be done."""
        if isinstance(self.action, spaces.Discrete):
            return Discrete(int(self.action.n))
        return Continuous(int(np.prod(self.action.shape)))

    def check(self, observations: int, actions: Actions) -> None:
        """Refuses a policy that sees or does something else.

        Raises:
            BadInput: what of it.
        """
        if observations != self.observations:
            what = f"the policy sees {observations} numbers, the environment shows {self.observations}"
        elif actions != self.actions:
            what = f"the policy's actions are {actions}, the environment's {self.actions}"
        else:
            return
        raise _bad(self.name, what, "give the policy that was trained on it")

    def seen(self, batch: Shaped[np.ndarray, "actors ..."]) -> Float32[np.ndarray, "actors numbers"]:
        """Observations of all copies, as the networks get them."""
        if isinstance(self.observation, spaces.Discrete):
            values = np.arange(self.observation.n) + self.observation.start
            return (batch[:, None] == values).astype(np.float32)
        return batch.reshape(len(batch), -1).astype(np.float32)

    def asked(self, actions: Shaped[np.ndarray, "actors ..."]) -> Shaped[np.ndarray, "actors ..."]:
        """Actions for all copies, as the environment takes them."""
        if isinstance(self.action, spaces.Discrete):
            return actions.astype(self.action.dtype) + self.action.start
        low, high = self.action.low, self.action.high
        share = (np.clip(actions, -1.0, 1.0).reshape(len(actions), *self.action.shape) + 1) / 2
        return (low + share * (high - low)).astype(self.action.dtype)


def opened(name: str, actors: int) -> tuple[VectorEnv, GymSpaces]:
    """So many copies of an environment: by its own vector class if it has one, one after the other if not.

    Args:
        name: of the registered environment, with its module before a colon if that has to be imported first.
        actors: how many.

    Raises:
        BadInput: there is no such environment, it can't be made, or its spaces are of no use.
    """
    try:
        env = _made(name, actors)
    except BadInput:
        raise
    except ModuleNotFoundError as error:
        raise _bad(name, f"no module named {error.name}", "install what it needs") from None
    except DependencyNotInstalled as error:
        raise _bad(name, _first(error), "install what it needs") from None
    except Exception as error:  # a stranger's environment: anything may go wrong
        raise _bad(name, f"{type(error).__name__}: {_first(error)}", "see what gymnasium.make makes of it") from None
    try:
        return env, _spaces(name, env)
    except BadInput:
        env.close()
        raise


def _made(name: str, actors: int) -> VectorEnv:
    module, _, bare = name.rpartition(":")
    if module:
        load_env_creator(f"{module}:__name__")  # imports it
    spec = gymnasium.registry.get(bare)
    if spec is None:
        raise unknown_name("environment", bare, gymnasium.registry, where="Gymnasium")
    if spec.vector_entry_point is not None:
        env = gymnasium.make_vec(bare, actors, vectorization_mode="vector_entry_point")
        if spec.entry_point is None or isinstance(env.metadata.get("autoreset_mode"), AutoresetMode):
            return env
        env.close()
    return gymnasium.make_vec(bare, actors, "sync", vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP})


def _spaces(name: str, env: VectorEnv) -> GymSpaces:
    observation, action = env.single_observation_space, env.single_action_space
    if not isinstance(env.metadata.get("autoreset_mode"), AutoresetMode):
        raise _bad(name, "its vector class doesn't say when it begins anew", "give its metadata an autoreset_mode")
    if not isinstance(observation, spaces.Box | spaces.Discrete) or spaces.flatdim(observation) < 1:
        raise _bad(name, f"{_kind(observation)} observations can't be learned from", "flatten them to a Box")
    if not isinstance(action, spaces.Box | spaces.Discrete) or spaces.flatdim(action) < 1:
        raise _bad(name, f"{_kind(action)} actions can't be learned", "make them a Box, or Discrete")
    if isinstance(action, spaces.Box):
        if not np.issubdtype(action.dtype, np.floating):
            raise _bad(name, f"actions of {action.dtype} can't be learned", "make them float32, or Discrete")
        if not action.is_bounded():
            raise _bad(name, "actions without bounds can't be learned", "bound them (wrappers.RescaleAction)")
    return GymSpaces(name, observation, action)


def _kind(space: spaces.Space) -> str:
    return type(space).__name__


def _bad(name: str, what: str, remedy: str) -> BadInput:
    return BadInput(what, where=name, remedy=remedy)


def _first(error: Exception) -> str:
    return (str(error).splitlines() or ["no reason given"])[0]
