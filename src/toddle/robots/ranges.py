"""The same arm with other joint ranges."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import jax.numpy as jnp

from toddle.robots.body import Body
from toddle.robots.chain import Chain


def in_degrees(body: Body, name: str, ranges: Mapping[str, tuple[float, float]]) -> Body:
    """A chain with the ranges of its joints replaced, and home in their middle.

    Args:
        body: the chain.
        name: what it is called from now on.
        ranges: lower and upper limit of each revolute joint by name [deg]; joints that the chain hasn't are ignored.
    """
    if not isinstance(body, Chain):
        raise TypeError(f"{body.name} is no chain")
    low, high = zip(*(map(math.radians, ranges[joint]) for joint in body.joints), strict=True)
    lower, upper = jnp.array(low, jnp.float32), jnp.array(high, jnp.float32)
    return replace(body, name=name, lower=lower, upper=upper, home=(lower + upper) / 2)
