"""Inverse kinematics by iteration from where the arm is: q <- net(target, q) (Thuruthel 2016).

The arm babbles: a walk through its joint space, |q_(i+1) - q_i| < eps. A network learns where the joints went from
where they had been and where the tip came to be, (x_(i+1), q_i) -> q_(i+1) (equation 4): near q_i that is one of the
solutions of J dq = dx, and unlike dq the answer lies in the whole joint space, so a target may be far away. Asked again
from wherever the arm has come to, it settles near the target, from any start. Nothing of the body is assumed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from toddle.failures import BadInput
from toddle.reach.explore.babble import babble, limits_of, suited_eps
from toddle.reach.learn.bayesian_network import BayesianNetwork, Record, train
from toddle.reach.observe import Observe
from toddle.reach.solve.broyden import looked_for
from toddle.robots.body import Body, Plant
from toddle.signals import Experience

Joints = Float[np.ndarray, "points joints"]
Positions = Float[np.ndarray, "points space"]
Act = Callable[[Joints], tuple[Joints, Positions]]
"""Commands joint values; tells the values that the joints took [rad or m], and where the tip was seen [m]."""

_LEAST_PAIRS = 10


class Settled(NamedTuple):
    """Where the iteration ended.

    Attributes:
        q: joint values, within the limits [rad or m].
        steps: movements until the tip stopped (the last of them, below the threshold, included).
        trajectory: joint values at the start and after each step; who has settled stays [rad or m].
    """

    q: Joints
    steps: Int[np.ndarray, " points"]
    trajectory: Float[np.ndarray, "times points joints"]


@dataclass(frozen=True)
class IteratedInverse:
    """What was learned: the network, and the joint space that it lives in.

    Attributes:
        network: (target [m], joint values as shares of their ranges) to joint values.
        record: how its training went.
        lower, upper: joint limits [rad or m].
        home: where iteration begins unless told otherwise [rad or m].
        gain: how far the tip went for each whole range that the joints went, on average [m].
    """

    network: BayesianNetwork
    record: Record
    lower: Float[np.ndarray, " joints"]
    upper: Float[np.ndarray, " joints"]
    home: Float[np.ndarray, " joints"]
    gain: float

    def step(self, targets: Positions, q: Joints) -> Joints:
        """The joint values to go to next from q, towards targets [m]; within the limits [rad or m]."""
        answer = self.network.predict(np.concatenate([targets, self._unit(q)], axis=1))
        return self.lower + np.clip(answer, 0, 1) * (self.upper - self.lower)

    def solve(
        self,
        targets: Positions,
        starts: Joints | None = None,
        *,
        act: Act | None = None,
        settle: float = 1e-3,
        most: int = 50,
    ) -> Settled:
        """Iterate from where the arm is until the tip moves by less than `settle`.

        Args:
            targets: where the tip should go [m].
            starts: joint values to begin at [rad or m]; None: home.
            act: moves the arm at every step, and tells what came of it; None: nobody looks, every joint goes where it
                is sent, and how far the tip moved is judged by how far the joints did.
            settle: the movement of the tip below which it has settled [m].
            most: steps, at most.

        Raises:
            BadInput: a target or a start that doesn't fit the body or is no number.
        """
        self._check(targets, starts)
        q = np.tile(self.home, (len(targets), 1)) if starts is None else np.array(starts, float)
        x = act(q)[1] if act is not None else None
        steps, moving, ways = np.full(len(q), most), np.full(len(q), True), [q]
        for number in range(1, most + 1):
            command = np.where(moving[:, None], self.step(targets, q), q)
            if act is None or x is None:
                q, far = command, self.gain * np.linalg.norm(self._unit(command) - self._unit(q), axis=1)
            else:
                (q, seen), before = act(command), x
                x, far = seen, np.linalg.norm(seen - before, axis=1)
            ways.append(q)
            steps[moving & (far < settle)] = number
            moving &= far >= settle
            if not moving.any():
                break
        return Settled(q, steps, np.stack(ways))

    def follow(
        self, path: Positions, act: Act, start: Float[np.ndarray, " joints"] | None = None, *, feedback: float = 0.0
    ) -> Positions:
        """Where the tip goes when each point of a path is a target for one step [m].

        Args:
            path: the points in their order [m].
            act: moves the arm, one posture at a time.
            start: joint values to begin at [rad or m]; None: home.
            feedback: the share of what was missed at a point by which all later ones are shifted; the paper's method
                doesn't look at what it missed (0).
        """
        self._check(path, None)
        q, shift, way = (self.home if start is None else start)[None], np.zeros(path.shape[1]), []
        for point in path:
            q, x = act(self.step((point + shift)[None], q))
            shift = shift + feedback * (point - x[0])
            way.append(x[0])
        return np.array(way)

    def reach_for(
        self, observe: Observe, targets: Positions, looks: int, starts: Joints | None = None
    ) -> tuple[Joints, Float[np.ndarray, "answers points"]]:
        """Settle, then look where the tip went and move the joints by what was missed, so many times.

        The network's own dq/dx is the inverse Jacobian to begin with, and each look mends it (`looked_for`).

        Args:
            observe: moves to joint values [rad or m] and says where the tip went [m].
            targets: where it should go [m].
            looks: how often an answer is corrected.
            starts: joint values to begin at [rad or m]; None: home.

        Returns:
            The best joint values tried [rad or m], and row by row the best error after 0 (open loop), 1, ... looks [m].
        """
        q, span = self._unit(self.solve(targets, starts).q), self.upper - self.lower
        inverse = self.network.slope(np.concatenate([targets, q], axis=1))[:, :, : targets.shape[1]]
        best, errors = looked_for(lambda unit: observe(self.lower + unit * span), targets, q, inverse, looks)
        return self.lower + best * span, errors

    def _unit(self, q: Joints) -> Joints:
        return (q - self.lower) / (self.upper - self.lower)

    def _check(self, targets: Positions, starts: Joints | None) -> None:
        space = len(self.network.x_scale.middle) - len(self.lower)
        if targets.ndim != 2 or targets.shape[1] != space:
            raise BadInput(f"targets of shape {targets.shape}", where="targets", remedy=f"give rows of {space} numbers")
        if not np.isfinite(targets).all():
            raise BadInput("one holds a value that is no number", where="targets", remedy="leave it out")
        if starts is not None and (starts.shape != (len(targets), len(self.lower)) or not np.isfinite(starts).all()):
            raise BadInput(
                f"starts of shape {starts.shape}", where="starts",
                remedy=f"give {len(targets)} rows of {len(self.lower)} joint values",
            )  # fmt: skip


def learn_iterated(
    body: Body | Plant,
    *,
    samples: int = 2000,
    eps: float | None = None,
    noise: float = 0.0,
    hidden: int = 20,
    seed: int = 0,
    iterations: int = 60,
    tell: Callable[[int, float], None] | None = None,
) -> IteratedInverse:
    """Babble, and learn from it; see `babble` and `fit_iterated`."""
    lower, upper = limits_of(body)
    experience = babble(body, samples, eps=eps, noise=noise, seed=seed)
    home = np.asarray(body.home, float)
    return fit_iterated(
        experience, lower, upper, home, eps=eps, hidden=hidden, seed=seed, iterations=iterations, tell=tell
    )


def fit_iterated(
    experience: Experience,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    home: Float[np.ndarray, " joints"],
    *,
    eps: float | None = None,
    hidden: int = 20,
    seed: int = 0,
    iterations: int = 60,
    tell: Callable[[int, float], None] | None = None,
) -> IteratedInverse:
    """Learn from movements made one after the other.

    Args:
        experience: the movements; only pairs of neighbours less than eps apart are learned from.
        lower, upper, home: of the joints [rad or m].
        eps: see `babble`.
        hidden, seed, iterations, tell: see `train`.

    Raises:
        BadInput: too few such pairs.
    """
    eps = suited_eps(len(lower)) if eps is None else eps
    q, x = (experience.q - lower) / (upper - lower), experience.x
    change = np.linalg.norm(np.diff(q, axis=0), axis=1)
    near = change < eps * (1 + 1e-9)
    if near.sum() < _LEAST_PAIRS:
        raise BadInput(
            f"{near.sum()} movements go less than {eps:g} of the joints' ranges from the one before", where="movements",
            remedy=f"give at least {_LEAST_PAIRS}, made one after the other",
        )  # fmt: skip
    inputs = np.concatenate([x[1:], q[:-1]], axis=1)[near]
    network, record = train(inputs, q[1:][near], hidden=hidden, seed=seed, iterations=iterations, tell=tell)
    went = np.linalg.norm(np.diff(x, axis=0), axis=1)[near]
    return IteratedInverse(network, record, lower, upper, home, float(went.sum() / change[near].sum()))
