"""Noticing that the body changed: is a seen tip where the learned model, and how sure it is, allow it to be?

With the miss r of a movement, the sensor's noise s and the model's covariance C(q), the surprise

    d^2 = r' (s^2 I + C(q))^-1 r

is chi-squared while all is well. Beyond 30 a movement is a jump: damage, or one wild look. Which of the two is decided
by the jumps that follow, as a sequential test does it (Wald 1945; Page 1954): each jump adds its log odds, each calm
movement takes some away. What is too small for jumps adds up in a cumulative sum of d^2 over what chance explains.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.reach.model.model import Model

JUMP = 30.0  # d^2 of a jump; by chance 1.4e-6 with three coordinates
_SLACK = 1.5  # of d^2 for each coordinate: what chance explains, and half as much again
_SUM = 40.0  # the cumulative sum at which a slow change is noticed
_SURE = math.log(1e4)  # log odds at which damage is beyond doubt
_CALM = 0.05  # how often a broken body moves as if it weren't


class Level(StrEnum):
    """How a body's movements look."""

    CALM = "calm"
    SUSPECTED = "suspected"
    CONFIRMED = "confirmed"


class Watch(NamedTuple):
    """What was seen so far.

    Attributes:
        wild: share of looks that are wild while all is well.
        odds: log odds of damage from jumps, from 0.
        drift: cumulative sum of d^2 over what chance explains.
        jumps: movements since the first jump that still counts; 0: none does.
        drifting: movements since the cumulative sum was last 0.
    """

    wild: float
    odds: float = 0.0
    drift: float = 0.0
    jumps: int = 0
    drifting: int = 0

    @classmethod
    def start(cls, wild: float = 0.0) -> Watch:
        """Nothing seen yet; the share of wild looks is what the fit found (`toddle.reach.model.model.Fit`)."""
        return cls(wild=min(max(wild, 1e-3), 0.3))


class Alarm(NamedTuple):
    """What the last movement says.

    Attributes:
        level: calm; suspected: a jump that may be one wild look; confirmed: the body changed.
        surprise: d^2 of the movement.
        since: how many movements, the last one included, were made since the change began; 0: none was.
    """

    level: Level
    surprise: float
    since: int


def look(
    watch: Watch, q: Float[np.ndarray, " joints"], x: Float[np.ndarray, " space"], model: Model, sensor: float
) -> tuple[Watch, Alarm]:
    """Take one more movement into account.

    Args:
        watch: what was seen so far.
        q: joint values commanded [rad or m].
        x: where the tip was seen [m].
        model: the learned body.
        sensor: standard deviation of a seen tip about the model on each axis [m].
    """
    surprise = float(surprises(model, q[None], x[None], sensor)[0])
    jump = surprise > JUMP
    gain = math.log((1 - _CALM) / watch.wild) if jump else math.log(_CALM / (1 - watch.wild))
    odds = max(0.0, watch.odds + gain)
    drift = watch.drift if jump else max(0.0, watch.drift + surprise - _SLACK * len(x))
    watch = watch._replace(
        odds=odds,
        drift=drift,
        jumps=watch.jumps + 1 if odds > 0 else 0,
        drifting=watch.drifting + 1 if drift > 0 else 0,
    )
    level = Level.SUSPECTED if odds > 0 else Level.CALM
    if odds > _SURE or drift > _SUM:
        level = Level.CONFIRMED
    since = 0 if level is Level.CALM else max(watch.jumps, watch.drifting if drift > _SUM else 0)
    return watch, Alarm(level, surprise, since)


def surprises(
    model: Model, q: Float[np.ndarray, "batch joints"], x: Float[np.ndarray, "batch space"], sensor: float
) -> Float[np.ndarray, " batch"]:
    """d^2 of each movement: the squared miss in units of what noise and the model's own doubt explain."""
    miss = x - model.forward(q)
    covariance = model.spread(q) + sensor**2 * np.eye(x.shape[1])
    return np.einsum("bi,bi->b", miss, np.linalg.solve(covariance, miss[..., None])[..., 0])
