"""Making movements and watching the tip: what a body is learned from, and what its answers are judged by.

A body is asked in batches, a plant one movement at a time. Draws are made row by row from streams of their own, so the
first movements of a longer run are those of a shorter one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.model.rigid import twist_motion
from toddle.reach.observe import observer
from toddle.robots.body import Body, Plant
from toddle.robots.chain import Chain
from toddle.robots.linkage import linkage_of, poses
from toddle.signals import Experience

_STILL = 1e-9  # [m]
_POSTURES, _NOISE = 1, 2  # streams of randomness


@runtime_checkable
class PosePlant(Plant, Protocol):
    """A plant whose tip is seen with its orientation."""

    def move_pose(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Go to the joint values q [rad or m]; the tip's position [m] and its rotation to the base frame."""
        ...


@dataclass(frozen=True)
class Sight:
    """How the tip is seen.

    Attributes:
        noise: standard deviation on each axis [m].
        angle_noise: standard deviation about each axis [rad].
        turned: whether its orientation is seen.
    """

    noise: float = 0.0
    angle_noise: float = 0.0
    turned: bool = False


def postures(
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    count: int,
    seed: int,
) -> Float[np.ndarray, "count joints"]:
    """Joint values to try, uniformly random [rad or m]."""
    return np.random.default_rng([seed, _POSTURES]).uniform(lower, upper, (count, len(lower)))


def gather(
    body: Body | Plant,
    q: Float[np.ndarray, "movements joints"],
    sight: Sight,
    seed: int,
) -> Experience:
    """Make movements and see where the tip goes.

    Args:
        body: what moves; noise is added to what a body says, a plant's sight is its own.
        q: where its joints go [rad or m].
        sight: how well the tip is seen.
        seed: of the noise.

    Raises:
        BadInput: the orientation is asked for and can't be seen, or the tip isn't a position in the plane or in space.
    """
    if not isinstance(body, Body):
        return _checked(body, _moved(body, q, sight.turned))
    x, turn = truth(body, q, turned=sight.turned)
    noise = np.random.default_rng([seed, _NOISE]).normal(size=(len(q), 6))
    x = x + sight.noise * noise[:, : x.shape[1]]
    if turn is not None:
        turn = turn @ twist_motion(sight.angle_noise * noise * [0, 0, 0, 1, 1, 1])[:, :3, :3]
    return _checked(body, Experience(q, x, turn))


def together(first: Experience, more: Experience) -> Experience:
    """All movements, those of the first before those of the other."""
    turn = None if first.turn is None or more.turn is None else np.concatenate([first.turn, more.turn])
    return Experience(np.concatenate([first.q, more.q]), np.concatenate([first.x, more.x]), turn)


def truth(
    body: Body, q: Float[np.ndarray, "movements joints"], *, turned: bool = False
) -> tuple[Float[np.ndarray, "movements space"], Float[np.ndarray, "movements 3 3"] | None]:
    """Where joint values [rad or m] bring the tip [m], and its orientation where that is asked for."""
    if isinstance(body, Chain):
        pose = poses(linkage_of(body), q)
        return pose[:, list(body.coordinates), 3], pose[:, :3, :3] if turned else None
    if not turned:
        return observer(body)(q), None
    pose_of = getattr(body, "pose", None)
    if pose_of is None:
        raise BadInput("its orientation isn't known", where=body.name, remedy="leave --pose out")
    seen = _poses(pose_of, q)
    return seen[:, :3, 3], seen[:, :3, :3]


def _checked(body: Body | Plant, seen: Experience) -> Experience:
    """What was seen, where it can be learned from."""
    if seen.x.shape[1] not in (2, 3):
        raise BadInput(f"its tip has {seen.x.shape[1]} coordinates", where=body.name, remedy="it takes 2 or 3")
    if not np.all(np.isfinite(seen.x)):
        raise BadInput("its tip is not at a finite position", where=body.name, remedy="check its description")
    if len(seen.x) > 1 and np.ptp(seen.x, axis=0).max() < _STILL:
        raise BadInput("no joint moves the tip", where=body.name, remedy="name another tip")
    return seen


def _poses(pose: Callable, q: Float[np.ndarray, "movements joints"]) -> Float[np.ndarray, "movements 4 4"]:
    import jax
    import jax.numpy as jnp

    return np.asarray(jax.jit(jax.vmap(pose))(jnp.asarray(q, jnp.float32)), float)


def _moved(plant: Plant, q: Float[np.ndarray, "movements joints"], turned: bool) -> Experience:
    if turned and not isinstance(plant, PosePlant):
        raise BadInput("its orientation isn't seen", where=plant.name, remedy="leave --pose out")
    seen = [plant.move_pose(row) if turned and isinstance(plant, PosePlant) else (plant.move(row), None) for row in q]
    x = np.stack([np.asarray(position, float) for position, _ in seen])
    return Experience(q, x, np.stack([np.asarray(turn, float) for _, turn in seen]) if turned else None)
