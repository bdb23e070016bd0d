"""A rigid chain as plain NumPy arrays in float64: the same numbers as `toddle.robots.chain.Chain`, for native solvers.

The tip's transform is ``T(q) = before[0] Z(m_0) before[1] Z(m_1) ... tip`` with ``m = gain @ q + offset`` and ``Z`` a
turn about z, or a slide along it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.robots.chain import Chain


class Linkage(NamedTuple):
    """The constants of a chain.

    Attributes:
        before: transform from each axis' predecessor (or the base) to its own frame at zero motion [m].
        slides: 1.0 where the axis is prismatic, 0.0 where it is revolute.
        gain: motion of each axis for a unit of each actuated joint.
        offset: motion of each axis when all joints are zero [rad or m].
        tip: transform from the last axis' frame to the tip [m].
    """

    before: Float[np.ndarray, "axes 4 4"]
    slides: Float[np.ndarray, " axes"]
    gain: Float[np.ndarray, "axes joints"]
    offset: Float[np.ndarray, " axes"]
    tip: Float[np.ndarray, "4 4"]


def linkage_of(chain: Chain) -> Linkage:
    """The constants of a chain, in float64."""
    return Linkage(
        *(np.asarray(values, float) for values in (chain.before, chain.slides, chain.gain, chain.offset, chain.tip))
    )


def poses(linkage: Linkage, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch 4 4"]:
    """Transforms from the base to the tip [m] for joint values [rad or m]."""
    return axis_frames(linkage, q)[-1] @ linkage.tip


def pose_slopes(
    linkage: Linkage, q: Float[np.ndarray, "batch joints"]
) -> tuple[Float[np.ndarray, "batch 4 4"], Float[np.ndarray, "batch 6 joints"]]:
    """The transforms, and the geometric Jacobian in the base frame: three rows of shift [m], three of turn [rad]."""
    frames = axis_frames(linkage, q)
    tip = frames[-1] @ linkage.tip
    axis, foot = frames[..., :3, 2], frames[..., :3, 3]  # axes first, then the batch
    slides = linkage.slides[:, None, None]
    shift = np.where(slides > 0, axis, np.cross(axis, tip[None, :, :3, 3] - foot))
    twist = np.concatenate([shift, axis * (1 - slides)], axis=2)
    return tip, np.einsum("abk,aj->bkj", twist, linkage.gain)


def axis_frames(linkage: Linkage, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "axes batch 4 4"]:
    """Every axis' frame after its own motion."""
    motion = q @ linkage.gain.T + linkage.offset
    slide = motion * linkage.slides
    cos, sin = np.cos(motion - slide), np.sin(motion - slide)
    frames = np.empty((len(linkage.slides), len(q), 4, 4))
    frame = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for axis, before in enumerate(linkage.before):
        frame = frame @ before
        x, y = frame[..., 0].copy(), frame[..., 1].copy()
        c, s = cos[:, axis, None], sin[:, axis, None]
        frame[..., 0], frame[..., 1] = c * x + s * y, c * y - s * x
        frame[..., 3] += frame[..., 2] * slide[:, axis, None]
        frames[axis] = frame
    return frames
