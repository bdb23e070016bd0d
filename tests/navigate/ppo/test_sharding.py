"""Actors split over two devices learn what they learn on one."""

from __future__ import annotations

import os
import subprocess
import sys

import jax
import pytest

from toddle.failures import BadInput
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.sharding import shard
from toddle.navigate.ppo.training import init
from toddle.navigate.tasks.probes import Answered

SCRIPT = """
import jax, numpy as np
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.sharding import shard
from toddle.navigate.ppo.training import init, train
from toddle.navigate.tasks.probes import Answered
task, devices = Answered(), jax.devices()
assert len(devices) == 2
config = PpoConfig(actors=8, horizon=8, minibatch=32, epochs=2, hidden=(8,), learning_rate=1e-2)
begun = jax.jit(init, static_argnums=(0, 1))(task, config, jax.random.key(0))
alone, _ = train(task, config, begun, 3)
split = shard(begun, devices)
assert len(split.actors.observation.sharding.device_set) == 2
assert split.actors.observation.addressable_shards[0].data.shape == (4, 1)
assert split.network.log_deviation.sharding.is_fully_replicated
together, _ = train(task, config, split, 3)
for one, other in zip(jax.tree.leaves(together.network), jax.tree.leaves(alone.network), strict=True):
    np.testing.assert_allclose(one, other, rtol=1e-3, atol=1e-4)
print("same")
"""


def test_two_devices_learn_what_one_does():
    flags = "--xla_force_host_platform_device_count=2"
    ran = subprocess.run(
        [sys.executable, "-c", SCRIPT], env={**os.environ, "XLA_FLAGS": flags}, capture_output=True, text=True,
        timeout=300, check=False,
    )  # fmt: skip
    assert ran.stdout.strip() == "same", ran.stderr[-2000:]


def test_actors_that_cannot_be_shared_are_refused():
    begun = jax.eval_shape(lambda key: init(Answered(), PpoConfig(actors=3, minibatch=3), key), jax.random.key(0))
    with pytest.raises(BadInput, match="3 actors"):
        shard(begun, [*jax.devices(), *jax.devices()])
