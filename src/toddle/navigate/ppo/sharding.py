"""Data-parallel learning: the actors are split over devices, the networks are on all of them.

A run that lies so is trained by the same `train`: the compiler splits the work and sums the gradients.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from toddle.failures import BadInput
from toddle.navigate.ppo.training import Training


def shard(training: Training, devices: Sequence[Any]) -> Training:
    """The same run, on devices of JAX: arrays of its actors split along their first axis, all else copied to each.

    Raises:
        BadInput: no devices, or actors that can't be shared evenly.
    """
    actors = len(training.actors.started)
    if not devices or actors % len(devices):
        raise BadInput(
            f"{actors} actors can't be shared evenly by {len(devices)} devices",
            where="PPO, devices",
            remedy="give a number of actors that the number of devices divides",
        )
    mesh = Mesh(np.array(devices), ("actors",))
    copied, split = NamedSharding(mesh, PartitionSpec()), NamedSharding(mesh, PartitionSpec("actors"))
    return jax.device_put(training, copied)._replace(actors=jax.device_put(training.actors, split))
