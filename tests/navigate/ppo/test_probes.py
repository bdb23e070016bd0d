"""Tasks with known answers: values within 0.05 of them, the right actions, with and without memory.

All probes are learned side by side in one compiled call: which one it is, is a number that is mapped over.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from toddle.navigate.policy import policy_of
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.network import forgotten
from toddle.navigate.ppo.training import Training, init, iterate
from toddle.navigate.task import Actions, Continuous, Discrete, Task
from toddle.navigate.tasks.probes import Answered, Chosen, Constant, Delayed, Lasting, Observed, Remembered

GAMMA, UPDATES = 0.9, 120
PROBES = ["constant", "observed", "delayed", "chosen", "answered", "cut", "ending", "remembered"]
FEED_FORWARD, RECURRENT, NUMBER = (Discrete(2), 0), (Discrete(2), 8), (Continuous(1), 0)
ALL = pytest.mark.parametrize("kind", [FEED_FORWARD, RECURRENT, NUMBER], ids=["choice", "recurrent", "number"])
Kind = tuple[Actions, int]


def probes(actions: Actions) -> list[Any]:
    short, ending = Lasting(10, actions=actions), Lasting(5, terminates=True, actions=actions)
    one_step = [Constant(actions), Observed(actions), Delayed(actions), Chosen(actions), Answered(actions)]
    return [*one_step, short, ending, *([Remembered()] if actions == Discrete(2) else [])]


@dataclass(frozen=True)
class OneOf:
    """One of several tasks by a number, which may be traced."""

    which: Array
    tasks: tuple[Any, ...]
    actions: Actions
    observations: int = 1

    def start(self, key: Array) -> Any:
        return jax.lax.switch(self.which, [task.start for task in self.tasks], key)

    def step(self, state: Any, action: Array, key: Array) -> Any:
        return jax.lax.switch(self.which, [task.step for task in self.tasks], state, action, key)


def settings(memory: int) -> PpoConfig:
    return PpoConfig(
        steps=UPDATES * 320, actors=16, horizon=20, minibatch=80, epochs=4, gamma=GAMMA, learning_rate=2e-2,
        hidden=(16,), memory=memory, sequence=10, deviation=0.3, normalise_observations=False, normalise_rewards=False,
    )  # fmt: skip


@cache
def trained(kind: Kind) -> Training:
    """All probes' trainings."""
    actions, memory = kind
    config, tasks = settings(memory), tuple(probes(actions))

    @partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
    @jax.vmap
    def all_of_it(which: Array) -> Training:
        task = OneOf(which, tasks, actions)
        begun = init(task, config, jax.random.key(1))
        return jax.lax.scan(lambda now, _: (iterate(task, config, now)[0], None), begun, length=UPDATES)[0]

    return jax.block_until_ready(all_of_it(jnp.arange(len(tasks))))


def of(kind: Kind, name: str) -> Training:
    return jax.tree.map(lambda part: part[PROBES.index(name)], trained(kind))


def values(kind: Kind, name: str, seen: list[float]) -> np.ndarray:
    """Of one observation after the other, in one episode."""
    memory, found, network = forgotten(settings(kind[1])), [], of(kind, name).network
    for number in seen:
        _, value, memory = network(jnp.array([number], jnp.float32), memory)
        found.append(float(value))
    return np.array(found)


def action(kind: Kind, name: str, seen: list[float]) -> float:
    """The last one, after these observations."""
    policy = policy_of(of(kind, name), settings(kind[1]), kind[0])
    memory, chosen = policy.start(), jnp.zeros(1, jnp.float32)
    for number in seen:
        chosen, memory = policy(jnp.array([number], jnp.float32), memory)
    return float(chosen.reshape(()))


@ALL
def test_probes_are_tasks(kind: Kind):
    assert all(isinstance(task, Task) for task in probes(kind[0]))


@ALL
def test_value_of_a_constant(kind: Kind):
    assert values(kind, "constant", [0.0]) == pytest.approx(1, abs=0.05)


@ALL
@pytest.mark.parametrize("seen", [-1.0, 1.0])
def test_value_of_what_is_seen(kind: Kind, seen: float):
    assert values(kind, "observed", [seen]) == pytest.approx(seen, abs=0.05)


@ALL
def test_later_rewards_are_discounted(kind: Kind):
    np.testing.assert_allclose(values(kind, "delayed", [0.0, 1.0]), [GAMMA, 1.0], atol=0.05)


@ALL
def test_action_that_pays(kind: Kind):
    assert action(kind, "chosen", [0.0]) == pytest.approx(1 if kind[0] == Discrete(2) else 0.5, abs=0.05)
    assert values(kind, "chosen", [0.0]) == pytest.approx(1, abs=0.05)


@ALL
@pytest.mark.parametrize("seen", [-1.0, 1.0])
def test_action_that_pays_for_what_is_seen(kind: Kind, seen: float):
    best = float(seen > 0) if kind[0] == Discrete(2) else seen / 2
    assert action(kind, "answered", [seen]) == pytest.approx(best, abs=0.05)
    assert values(kind, "answered", [seen]) == pytest.approx(1, abs=0.05)


@ALL
def test_cut_off_is_worth_what_would_follow(kind: Kind):
    np.testing.assert_allclose(values(kind, "cut", [0.0] * 10), 1 / (1 - GAMMA), atol=0.05)


@ALL
def test_end_is_worth_nothing(kind: Kind):
    left = 5 - np.arange(5)
    expected = (1 - GAMMA**left) / (1 - GAMMA)
    np.testing.assert_allclose(values(kind, "ending", [step / 5 for step in range(5)]), expected, atol=0.05)


@pytest.mark.parametrize("cue", [-1.0, 1.0])
def test_memory_recalls_the_cue(cue: float):
    seen = [cue, 0.0, 0.0, 0.0]
    assert action(RECURRENT, "remembered", seen) == float(cue > 0)
    np.testing.assert_allclose(values(RECURRENT, "remembered", seen), GAMMA ** np.arange(3.0, -1, -1), atol=0.05)


def test_without_memory_the_cue_is_lost():
    last = [action(FEED_FORWARD, "remembered", [cue, 0.0, 0.0, 0.0]) for cue in (-1.0, 1.0)]
    assert last[0] == last[1]
    assert values(FEED_FORWARD, "remembered", [0.0]) == pytest.approx(0, abs=0.3)
