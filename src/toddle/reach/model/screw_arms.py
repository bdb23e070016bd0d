"""Several candidate arms side by side: where their tips are, and how that changes with their axes.

A start of the fit is one candidate; many are moved at once, because for a few hundred movements NumPy's calls cost more
than its arithmetic. An arm is a `toddle.robots.linkage.Linkage` whose axes each follow one motor; the numbers that a
step changes are those of `toddle.reach.model.rigid`: shift and turn of an axis across itself, its stretch, the tip.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from toddle.reach.model.rigid import PER_AXIS, twist_motion
from toddle.robots.linkage import Linkage


class Arms(NamedTuple):
    """Candidates of one shape.

    Attributes:
        before: transform to each axis' frame at zero motion [m].
        slides: 1.0 where the axis slides, 0.0 where it turns.
        gain: motion of the axis for a unit of its motor.
        tip: transform from the last axis to the tip [m].
        motor: which joint drives each axis.
    """

    before: Float[np.ndarray, "arms axes 4 4"]
    slides: Float[np.ndarray, "arms axes"]
    gain: Float[np.ndarray, "arms axes"]
    tip: Float[np.ndarray, "arms 4 4"]
    motor: Int[np.ndarray, "arms axes"]

    def pick(self, which: int | Int[np.ndarray, " some"]) -> Arms:
        """Some of the candidates."""
        rows = np.array([which]) if isinstance(which, int) else which
        return Arms(self.before[rows], self.slides[rows], self.gain[rows], self.tip[rows], self.motor[rows])


class Motion(NamedTuple):
    """Where candidates put their tips, for every movement.

    Attributes:
        place: of the tip [m].
        turn: of the tip: the three axes of its frame, then x, y, z.
        slope: how shift [m] and turn [rad] of the tip change with the numbers; turn only where it was asked for.
    """

    place: Float[np.ndarray, "arms 3 movements"]
    turn: Float[np.ndarray, "arms 3 3 movements"]
    slope: Float[np.ndarray, "arms numbers rows movements"]


def numbers_of(axes: int) -> int:
    """How many numbers change an arm: seven an axis and six for its tip."""
    return PER_AXIS * axes + 6


def move(arms: Arms, q: Float[np.ndarray, "movements joints"], free: np.ndarray, *, turns: bool = False) -> Motion:
    """Where the candidates put their tips, and the slopes of the numbers that are free in any of them.

    Args:
        arms: the candidates.
        q: joint values [rad or m].
        free: indices of the wanted numbers.
        turns: whether the slope has rows for the tip's turn, too.
    """
    count, axes = arms.slides.shape
    motion = arms.gain[:, :, None] * q.T[arms.motor]
    slide = motion * arms.slides[:, :, None]
    cos, sin = np.cos(motion - slide), np.sin(motion - slide)
    still = np.empty((count, axes, 4, 3, len(q)))  # columns of a frame, then x, y, z: the movements lie together
    frame = np.zeros((count, 4, 3, len(q)))
    frame[:, 0, 0] = frame[:, 1, 1] = frame[:, 2, 2] = 1.0
    for axis in range(axes):
        frame = _onwards(arms.before[:, axis], frame)
        still[:, axis] = frame
        c, s = cos[:, axis, None], sin[:, axis, None]
        x, y = still[:, axis, 0], still[:, axis, 1]
        frame[:, 0], frame[:, 1] = c * x + s * y, c * y - s * x
        frame[:, 3] += frame[:, 2] * slide[:, axis, None]
    tip = _onwards(arms.tip, frame)
    return Motion(tip[:, 3], tip[:, :3], _slopes(arms, motion, still, tip, free, turns))


def _onwards(step: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Frames after a constant transform."""
    flat = frame.reshape(len(frame), 4, -1)
    return (step.transpose(0, 2, 1) @ flat).reshape(frame.shape)


def _slopes(
    arms: Arms, motion: np.ndarray, still: np.ndarray, tip: np.ndarray, free: np.ndarray, turns: bool
) -> np.ndarray:
    """The columns of the free numbers, as in `toddle.reach.model.rigid.number_slopes`."""
    count, axes, _, _, movements = still.shape
    slope = np.zeros((count, len(free), 6 if turns else 3, movements))
    lever = tip[:, None, 3] - still[:, :, 3]
    for kind in range(6):
        rows, axis = _columns(free, kind, axes)
        if kind < 3:
            slope[:, rows, :3] = still[:, axis, kind]
        elif len(rows):
            slope[:, rows, :3] = _cross(still[:, axis, kind - 3], lever[:, axis])
            if turns:
                slope[:, rows, 3:] = still[:, axis, kind - 3]
    rows, axis = _columns(free, 6, axes)
    if len(rows):
        slides = arms.slides[:, axis, None, None]
        along = still[:, axis, 2]
        swing = slides * along + (1 - slides) * _cross(along, lever[:, axis])
        slope[:, rows, :3] = motion[:, axis, None] * swing
        if turns:
            slope[:, rows, 3:] = motion[:, axis, None] * (1 - slides) * along
    for row, number in enumerate(free):
        kind = number - PER_AXIS * axes
        if 0 <= kind < 3:
            slope[:, row, :3] = tip[:, kind]
        elif kind >= 3 and turns:
            slope[:, row, 3:] = tip[:, kind - 3]
    return slope


def _columns(free: np.ndarray, kind: int, axes: int) -> tuple[np.ndarray, np.ndarray]:
    """Which free numbers are of this kind, and the axes that they belong to."""
    rows = np.flatnonzero((free % PER_AXIS == kind) & (free < PER_AXIS * axes))
    return rows, free[rows] // PER_AXIS


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of vectors whose coordinates lie in the last axis but one."""
    product = np.empty(a.shape)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[..., i, :] = a[..., j, :] * b[..., k, :] - a[..., k, :] * b[..., j, :]
    return product


def stepped(arms: Arms, step: Float[np.ndarray, "arms free"], free: np.ndarray) -> Arms:
    """The candidates after a step of the free numbers."""
    count, axes = arms.slides.shape
    whole = np.zeros((count, numbers_of(axes)))
    whole[:, free] = step
    per_axis = whole[:, :-6].reshape(count, axes, PER_AXIS)
    twist = twist_motion(per_axis[..., :6].reshape(-1, 6)).reshape(count, axes, 4, 4)
    return arms._replace(
        before=arms.before @ twist,
        gain=arms.gain * (1 + per_axis[..., 6]),
        tip=arms.tip @ twist_motion(whole[:, -6:]),
    )


def from_lines(
    along: Float[np.ndarray, "arms axes 3"],
    through: Float[np.ndarray, "arms axes 3"],
    slides: Float[np.ndarray, "arms axes"],
    tip: Float[np.ndarray, "arms 3"],
    motor: Int[np.ndarray, "arms axes"],
) -> Arms:
    """Arms from the directions of their axes, a point on each [m], and their tips [m], all in the base's frame."""
    frames = np.zeros((*along.shape[:2], 4, 4))
    z = along / np.linalg.norm(along, axis=-1, keepdims=True)
    across = np.take_along_axis(np.broadcast_to(np.eye(3), (*z.shape, 3)), np.abs(z).argmin(-1)[..., None, None], -2)
    x = np.cross(across[..., 0, :], z)
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    frames[..., :3, 0], frames[..., :3, 1], frames[..., :3, 2] = x, np.cross(z, x), z
    frames[..., :3, 3], frames[..., 3, 3] = through, 1.0
    end = np.tile(np.eye(4), (len(along), 1, 1))
    end[:, :3, 3] = tip
    back = np.linalg.inv(frames)
    before = frames.copy()
    before[:, 1:] = back[:, :-1] @ frames[:, 1:]
    return Arms(before, slides, np.ones(slides.shape), back[:, -1] @ end, motor)


def side_by_side(groups: list[Arms]) -> Arms:
    """All candidates of several groups."""
    return Arms(*(np.concatenate(values) for values in zip(*groups, strict=True)))


def without(arms: Arms, axis: int) -> Arms:
    """The same arms with one axis less, all others where they are at zero motion."""
    along, through, tip = lines_of(arms)
    end = resting(arms)[:, -1] @ arms.tip
    kept = [np.delete(values, axis, axis=1) for values in (along, through, arms.slides, arms.motor, arms.gain)]
    less = from_lines(kept[0], kept[1], kept[2], tip, kept[3])._replace(gain=kept[4])
    return less._replace(tip=np.linalg.inv(resting(less)[:, -1]) @ end)


def recentred(arms: Arms, shift: Float[np.ndarray, " joints"]) -> Arms:
    """The same arms for joint values that count from further on: q less the shift."""
    motion = arms.gain * shift[arms.motor]
    twist = np.zeros((*motion.shape, 6))
    twist[..., 2], twist[..., 5] = motion * arms.slides, motion * (1 - arms.slides)
    return arms._replace(before=arms.before @ twist_motion(twist.reshape(-1, 6)).reshape(arms.before.shape))


def linkage_from(arms: Arms, centre: Float[np.ndarray, " joints"]) -> Linkage:
    """The first candidate as a linkage of the joint values themselves, where it was one of values less the centre."""
    arms = recentred(arms, -centre)
    slides = arms.slides[0]
    gain = np.zeros((len(slides), len(centre)))
    gain[np.arange(len(slides)), arms.motor[0]] = arms.gain[0]
    return Linkage(arms.before[0], slides, gain, np.zeros(len(slides)), arms.tip[0])


def resting(arms: Arms) -> Float[np.ndarray, "arms axes 4 4"]:
    """Every axis' frame at zero motion, in the base's frame."""
    frames = arms.before.copy()
    for axis in range(1, frames.shape[1]):
        frames[:, axis] = frames[:, axis - 1] @ frames[:, axis]
    return frames


def lines_of(arms: Arms) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions of the axes, a point on each, and the tips, at zero motion in the base's frame."""
    frames = resting(arms)
    return frames[..., :3, 2], frames[..., :3, 3], (frames[:, -1] @ arms.tip)[:, :3, 3]


def tidied(arms: Arms) -> Arms:
    """The same arms, every axis' frame where its axis is nearest to the tip, pointing so that its gain is positive."""
    along, through, tip = lines_of(arms)
    ahead = ((tip[:, None] - through) * along).sum(axis=-1, keepdims=True)
    way = np.where(arms.gain < 0, -1.0, 1.0)
    tidy = from_lines(way[..., None] * along, through + ahead * along, arms.slides, tip, arms.motor)
    tidy = tidy._replace(gain=way * arms.gain)
    end = resting(arms)[:, -1] @ arms.tip
    return tidy._replace(tip=np.linalg.inv(resting(tidy)[:, -1]) @ end)
