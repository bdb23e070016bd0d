"""Levenberg-Marquardt for several candidate arms at once.

Marquardt's scaling of the diagonal, Nielsen's rule for the damping (Madsen, Nielsen, Tingleff: Methods for non-linear
least squares problems, 2004, section 3.2), and no axis turned by more than one radian in a step. Movements are weighted
by Geman and McClure's rho(r) = r^2 / (1 + r^2 / c^2), c in [m], as reweighted least squares; c = inf: least squares.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.reach.model.rigid import PER_AXIS
from toddle.reach.model.screw_arms import Arms, move, stepped

NONE = np.zeros(0, int)
"""No free numbers: the misses alone."""

_LARGEST_TURN = 1.0  # [rad] a step


class Seen(NamedTuple):
    """What the candidates are fitted to.

    Attributes:
        q: joint values, less their centre [rad or m].
        x: where the tip was seen [m]; a planar arm's z is 0 and counts for nothing.
        turn: its orientation, where that was seen.
        rows: which of x, y, z were seen.
        lever: what a radian of the tip's turn counts [m].
    """

    q: Float[np.ndarray, "movements joints"]
    x: Float[np.ndarray, "movements 3"]
    turn: Float[np.ndarray, "movements 3 3"] | None = None
    rows: int = 3
    lever: float = 0.0

    def some(self, which: np.ndarray | slice) -> Seen:
        """Some of the movements."""
        return self._replace(q=self.q[which], x=self.x[which], turn=None if self.turn is None else self.turn[which])


class State(NamedTuple):
    """Candidates, how far they are off, and the slopes of that.

    Attributes:
        arms: the candidates.
        miss: seen less modelled [m], turns times the lever.
        slope: of the modelled with the free numbers.
    """

    arms: Arms
    miss: Float[np.ndarray, "arms rows movements"]
    slope: Float[np.ndarray, "arms numbers rows movements"]

    @property
    def square(self) -> Float[np.ndarray, "arms movements"]:
        """Of each movement's miss [m^2]."""
        return np.einsum("arm,arm->am", self.miss, self.miss)


def look(arms: Arms, seen: Seen, free: np.ndarray) -> State:
    """How far candidates are off."""
    turns = seen.turn is not None and seen.lever > 0
    motion = move(arms, seen.q, free, turns=turns)
    miss = (seen.x.T - motion.place)[:, : seen.rows]
    slope = motion.slope[:, :, : seen.rows] if not turns else motion.slope
    if turns:
        miss = np.concatenate([miss, seen.lever * turned(motion.turn, seen.turn)], axis=1)
        slope = np.concatenate([slope[:, :, : seen.rows], seen.lever * slope[:, :, 3:]], axis=2)
    return State(arms, miss, slope)


def turned(
    model: Float[np.ndarray, "arms 3 3 movements"], seen: Float[np.ndarray, "movements 3 3"] | None
) -> Float[np.ndarray, "arms 3 movements"]:
    """Rotation vectors from modelled to seen orientations, in the base's frame [rad]."""
    # model[a, k, r, m]: coordinate r of axis k; relative = seen @ model^T
    assert seen is not None
    relative = np.einsum("mrk,aksm->amrs", seen, model)
    axis = relative - relative.swapaxes(-1, -2)
    twice = np.stack([axis[..., 2, 1], axis[..., 0, 2], axis[..., 1, 0]], axis=1)  # 2 sin(angle) times the axis
    sine = np.linalg.norm(twice, axis=1) / 2
    angle = np.arctan2(sine, (np.trace(relative, axis1=-2, axis2=-1) - 1) / 2)
    return twice / 2 * (angle / np.maximum(sine, 1e-12) + (sine < 1e-12))[:, None]


def descend(
    arms: Arms,
    seen: Seen,
    free: np.ndarray,
    *,
    steps: int,
    scale: np.ndarray | float = np.inf,
    held: np.ndarray | None = None,
    tolerance: float = 1e-10,
) -> tuple[Arms, Float[np.ndarray, " arms"], Float[np.ndarray, "arms movements"]]:
    """Improve every candidate.

    Args:
        arms: the candidates.
        seen: what they should fit.
        free: the numbers that may change.
        steps: at most.
        scale: Geman and McClure's c of each candidate [m].
        held: free numbers that one candidate yet holds: True there.
        tolerance: stop where no cost falls by more than this share.

    Returns:
        The candidates, their costs [m^2], and the squared miss of each movement [m^2].
    """
    scale = np.broadcast_to(np.asarray(scale, float), len(arms.slides))
    state = look(arms, seen, free)
    cost = robust_cost(state.square, scale)
    damping, growth = np.full(len(cost), 1e-3), np.full(len(cost), 2.0)
    patience = np.zeros(len(cost), int)
    for _ in range(steps):
        step, foreseen = _step(state, free, damping, scale, held)
        trial = look(stepped(state.arms, step, free), seen, free)
        new = robust_cost(trial.square, scale)
        ratio = (cost - new) / np.maximum(foreseen, 1e-300)
        better = (new < cost) & np.isfinite(new)
        small = (cost - new) <= tolerance * cost
        damping = np.where(better, damping * np.maximum(1 / 3, 1 - (2 * ratio.clip(-1, 2) - 1) ** 3), damping * growth)
        damping = damping.clip(1e-12, 1e12)
        growth = np.where(better, 2.0, growth * 2)
        patience = np.where(better & ~small, 0, patience + 1)
        state, cost = _chosen(better, trial, state), np.where(better, new, cost)
        if (patience >= 4).all():
            break
    return state.arms, cost, state.square


def robust_cost(square: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Geman and McClure's, summed over the movements."""
    return (square / (1 + square / scale[:, None] ** 2)).sum(1)


def _step(
    state: State, free: np.ndarray, damping: np.ndarray, scale: np.ndarray, held: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """A damped step of every candidate, and by how much it should lower the cost."""
    count, numbers = state.slope.shape[:2]
    root = 1 / (1 + state.square / scale[:, None] ** 2)  # square root of the weight
    slope = (state.slope * root[:, None, None]).reshape(count, numbers, -1)
    miss = (state.miss * root[:, None]).reshape(count, -1, 1)
    if held is not None:
        slope = slope * ~held[:, :, None]
    normal = slope @ slope.transpose(0, 2, 1)
    downhill = (slope @ miss)[..., 0]
    diagonal = np.einsum("ann->an", normal)
    diagonal = np.maximum(diagonal, 1e-9 * diagonal.max(axis=1, keepdims=True) + 1e-300)
    normal[:, np.arange(numbers), np.arange(numbers)] += damping[:, None] * diagonal + 1e-12 * diagonal
    step = np.linalg.solve(normal, downhill[..., None])[..., 0]
    turning = np.isin(free % PER_AXIS, (3, 4, 5))
    largest = np.abs(step[:, turning]).max(axis=1, initial=0.0)
    step = step * np.minimum(1.0, _LARGEST_TURN / np.maximum(largest, 1e-12))[:, None]
    return step, (step * (downhill + damping[:, None] * diagonal * step)).sum(1)


def _chosen(better: np.ndarray, new: State, old: State) -> State:
    """The new state where it is better."""
    if better.all():
        return new

    def pick(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.where(better.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    arms = Arms(
        pick(new.arms.before, old.arms.before),
        pick(new.arms.slides, old.arms.slides),
        pick(new.arms.gain, old.arms.gain),
        pick(new.arms.tip, old.arms.tip),
        pick(new.arms.motor, old.arms.motor),
    )
    return State(arms, pick(new.miss, old.miss), pick(new.slope, old.slope))
