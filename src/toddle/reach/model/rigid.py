"""A rigid arm as it was learned: a linkage, and how sure its constants are.

Whoever changes a linkage (a fit from nothing, the correction of a wrong description, the repair after damage) does it
with the same seven numbers an axis and six for the tip, all zero where nothing changes:

    before[i] <- before[i] exp(twist_i),  gain[i] <- gain[i] (1 + stretch_i),  tip <- tip exp(twist_tip)

with the twist (shift [m], turn [rad]) in the axis' own frame, so that its turn about z is the joint's zero. Some of
these numbers move nothing (a shift along a turning axis, say). A step of least norm leaves those alone, and so
nothing slides away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.robots.linkage import Linkage, axis_frames, pose_slopes, poses

PER_AXIS = 7  # shift x y z [m], turn x y z [rad], stretch


@dataclass(frozen=True)
class Rigid:
    """A learned rigid arm; a `toddle.reach.model.model.PoseModel`.

    Attributes:
        linkage: its constants.
        covariance: of the numbers above, axis by axis, the tip's six last.
        coordinates: which of x, y, z are its tip's position: (0, 1) for a planar arm.
    """

    linkage: Linkage
    covariance: Float[np.ndarray, "numbers numbers"]
    coordinates: tuple[int, ...] = (0, 1, 2)

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        return len(self.coordinates)

    def forward(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space"]:
        """Tip positions [m] for joint values [rad or m]."""
        return poses(self.linkage, q)[:, self.coordinates, 3]

    def slope(
        self, q: Float[np.ndarray, "batch joints"]
    ) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
        """Tip positions [m], and how they change with the joint values."""
        pose, slope = pose_slopes(self.linkage, q)
        return pose[:, self.coordinates, 3], slope[:, self.coordinates]

    def spread(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space space"]:
        """Covariance of what the model may be wrong by at each posture [m^2]."""
        return self.pose_spread(q)[:, self.coordinates][:, :, self.coordinates]

    def pose(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch 4 4"]:
        """Transforms from the base to the tip [m]."""
        return poses(self.linkage, q)

    def pose_slope(
        self, q: Float[np.ndarray, "batch joints"]
    ) -> tuple[Float[np.ndarray, "batch 4 4"], Float[np.ndarray, "batch 6 joints"]]:
        """The transforms, and the geometric Jacobian in the base frame."""
        return pose_slopes(self.linkage, q)

    def pose_spread(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch 6 6"]:
        """Covariance of shift [m] and turn [rad] that the modelled pose may be wrong by, in the base frame."""
        slope = number_slopes(self.linkage, q)[1]
        return slope @ self.covariance @ slope.transpose(0, 2, 1)


def number_slopes(
    linkage: Linkage, q: Float[np.ndarray, "batch joints"]
) -> tuple[Float[np.ndarray, "batch 4 4"], Float[np.ndarray, "batch 6 numbers"]]:
    """Tip transforms, and how shift [m] and turn [rad] of the tip in the base frame change with the seven numbers."""
    frames = axis_frames(linkage, q)
    tip = frames[-1] @ linkage.tip
    motion = (q @ linkage.gain.T).T  # of each axis, without its offset: that is what a stretch scales
    still = _before_motion(linkage, frames, q)
    slopes = np.zeros((len(q), 6, PER_AXIS * len(linkage.slides) + 6))
    for axis, slides in enumerate(linkage.slides):
        columns = slopes[:, :, PER_AXIS * axis : PER_AXIS * (axis + 1)]
        _twist_columns(columns, still[axis], tip)
        columns[:, :, 6] = columns[:, :, 2 if slides else 5] * motion[axis][:, None]
    _twist_columns(slopes[:, :, -6:], tip, tip)
    return tip, slopes


def changed(linkage: Linkage, numbers: Float[np.ndarray, " numbers"]) -> Linkage:
    """The linkage after a step of the seven numbers an axis and the tip's six."""
    steps = numbers[:-6].reshape(-1, PER_AXIS)
    return linkage._replace(
        before=linkage.before @ twist_motion(steps[:, :6]),
        gain=linkage.gain * (1 + steps[:, 6:]),
        tip=linkage.tip @ twist_motion(numbers[None, -6:])[0],
    )


def twist_motion(twist: Float[np.ndarray, "batch 6"]) -> Float[np.ndarray, "batch 4 4"]:
    """Shift by the first three [m] and then turn by the rotation vector of the last three [rad]: to first order exp."""
    shift, turn = twist[:, :3], twist[:, 3:]
    angle = np.linalg.norm(turn, axis=1)[:, None, None]
    cross = np.zeros((len(twist), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -turn[:, 2], turn[:, 1], -turn[:, 0]
    cross -= cross.transpose(0, 2, 1)
    motion = np.tile(np.eye(4), (len(twist), 1, 1))
    # sin(a)/a and (1 - cos a)/a^2, by sinc so that zero is no special case
    motion[:, :3, :3] += np.sinc(angle / np.pi) * cross + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (cross @ cross)
    motion[:, :3, 3] = shift
    return motion


def _before_motion(
    linkage: Linkage, frames: Float[np.ndarray, "axes batch 4 4"], q: Float[np.ndarray, "batch joints"]
) -> Float[np.ndarray, "axes batch 4 4"]:
    """Every axis' frame before its own motion."""
    first = np.broadcast_to(linkage.before[0], (1, len(q), 4, 4))
    return np.concatenate([first, frames[:-1] @ linkage.before[1:, None]])


def _twist_columns(
    columns: Float[np.ndarray, "batch 6 _"],
    frame: Float[np.ndarray, "batch 4 4"],
    tip: Float[np.ndarray, "batch 4 4"],
) -> None:
    """Fill in how the tip moves when a frame is shifted and turned along its own axes."""
    axes, arm = frame[:, :3, :3], tip[:, :3, 3] - frame[:, :3, 3]
    columns[:, :3, :3] = axes
    columns[:, :3, 3:6] = np.cross(axes.transpose(0, 2, 1), arm[:, None]).transpose(0, 2, 1)
    columns[:, 3:, 3:6] = axes
