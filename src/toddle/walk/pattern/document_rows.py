"""Constraints of the document's walking pattern, each with its derivative by the yaws (Huber 2019, 2.61 to 2.82).

Unknowns, in the order of 2.53: N jerks and N_f footsteps along x, then the same along y. A constraint reads
``lower <= matrix @ unknowns <= upper``. The matrices depend on yaws: entry 0 belongs to the sole that stands,
entry j to the j-th footstep to come. The document differentiates them by the yaws for its Gauss-Newton step (2.86);
the derivatives given here are of ``matrix @ unknowns - upper``. The author's program adds up every edge of a closed
polygon in that block, which gives zero, so its trajectories know no such derivative, nor does `document`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from toddle.signals import Circle

OBSTACLE_MARGIN = 0.2
"""Kept from an obstacle on top of its radius and of the longer side of a sole [m]; from the author's program."""


class Rows(NamedTuple):
    """Some rows of a quadratic programme: ``lower <= matrix @ unknowns <= upper``."""

    matrix: Float[np.ndarray, "rows unknowns"]
    lower: Float[np.ndarray, " rows"]
    upper: Float[np.ndarray, " rows"]


class Preview(NamedTuple):
    """How a step's samples are dealt to the previewed footsteps, at one phase of the step (2.47 to 2.49).

    Attributes:
        step: the sole that stands at each sample: 0 for the present one, j for the j-th to come.
        zmp: ZMP less sole by jerks and footsteps of one axis: (P_zu, -V) of 2.68.
        first: the first sample at which each footstep carries; N where none does.
    """

    step: Int[np.ndarray, " samples"]
    zmp: Float[np.ndarray, "samples unknowns"]
    first: Int[np.ndarray, " steps"]


def zmp_rows(
    preview: Preview,
    drift: Float[np.ndarray, "samples 2"],
    yaw: Float[np.ndarray, " soles"],
    box: Float[np.ndarray, "2 2"],
) -> Rows:
    """The zero moment point stays in the box of the sole that stands, at every sample (2.65 to 2.69).

    Args:
        preview: which sole stands when.
        drift: ZMP less the present sole where it stands, ZMP where it doesn't, without any jerk (x, y) [m].
        yaw: of the soles [rad].
        box: lower and upper corner in the sole's frame [m].

    Returns:
        2 N rows: along the sole for all samples, then across it.
    """
    turn = yaw[preview.step]
    c, s = np.cos(turn), np.sin(turn)
    samples, width = preview.zmp.shape
    matrix = np.empty((2 * samples, 2 * width))
    matrix[:samples, :width] = matrix[samples:, width:] = c[:, None] * preview.zmp
    matrix[:samples, width:] = s[:, None] * preview.zmp
    matrix[samples:, :width] = -matrix[:samples, width:]
    at = np.concatenate([c * drift[:, 0] + s * drift[:, 1], c * drift[:, 1] - s * drift[:, 0]])
    return Rows(matrix, np.repeat(box[0], samples) - at, np.repeat(box[1], samples) - at)


def zmp_by_yaw(
    preview: Preview,
    drift: Float[np.ndarray, "samples 2"],
    yaw: Float[np.ndarray, " soles"],
    unknowns: Float[np.ndarray, " unknowns"],
) -> Float[np.ndarray, "rows soles"]:
    """The derivative of `zmp_rows` by each sole's yaw [m/rad]; first block of the right column of 2.86."""
    turn = yaw[preview.step]
    c, s = np.cos(turn), np.sin(turn)
    x, y = (drift + np.stack([preview.zmp @ part for part in np.split(unknowns, 2)], axis=1)).T
    mine = preview.step[:, None] == np.arange(len(yaw))
    return np.concatenate([(c * y - s * x)[:, None] * mine, (-c * x - s * y)[:, None] * mine])


def edges(hull: Float[np.ndarray, "corners 2"]) -> tuple[Float[np.ndarray, "corners 2"], Float[np.ndarray, " corners"]]:
    """Outward unit normals of a convex polygon and their offsets [m]: inside, normal @ x <= offset (2.62 to 2.64)."""
    along = np.roll(hull, -1, axis=0) - hull
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    around = np.sum(hull[:, 0] * np.roll(hull[:, 1], -1) - hull[:, 1] * np.roll(hull[:, 0], -1))
    normal *= np.sign(around) / np.linalg.norm(normal, axis=1, keepdims=True)
    return normal, np.sum(normal * hull, axis=1)


def hull_rows(
    samples: int,
    foot: Float[np.ndarray, "2"],
    yaw: Float[np.ndarray, " soles"],
    normals: Float[np.ndarray, "steps corners 2"],
    offsets: Float[np.ndarray, "steps corners"],
) -> Rows:
    """Each footstep lies in its hull, seen from the footstep before it (2.70 to 2.72).

    Args:
        samples: N.
        foot: x, y of the sole that stands [m].
        yaw: of the soles [rad]; the last is not used.
        normals: of the hull of each footstep to come, in the frame of the sole before it.
        offsets: the same [m].
    """
    turned = np.einsum("jed,jdk->jek", normals, _into_sole(yaw[:-1]))
    steps, corners = offsets.shape
    matrix = np.zeros((steps, corners, 2, samples + steps))
    each = np.arange(steps)
    matrix[each, :, :, samples + each] = turned
    matrix[each[1:], :, :, samples + each[:-1]] = -turned[1:]
    upper = offsets.copy()
    upper[0] += turned[0] @ foot
    return Rows(matrix.reshape(steps * corners, -1), np.full(steps * corners, -np.inf), upper.reshape(steps * corners))


def hull_by_yaw(
    foot: Float[np.ndarray, "2"],
    yaw: Float[np.ndarray, " soles"],
    normals: Float[np.ndarray, "steps corners 2"],
    footsteps: Float[np.ndarray, "steps 2"],
) -> Float[np.ndarray, "rows soles"]:
    """The derivative of `hull_rows` by each sole's yaw [m/rad]; second block of the right column of 2.86."""
    stride = np.diff(footsteps, axis=0, prepend=foot[None])
    quarter = _into_sole(yaw[:-1] + np.pi / 2)
    steps, corners, _ = normals.shape
    slope = np.zeros((steps, corners, len(yaw)))
    each = np.arange(steps)
    slope[each, :, each] = np.einsum("jed,jdk,jk->je", normals, quarter, stride)
    return slope.reshape(steps * corners, -1)


def obstacle_rows(
    samples: int,
    footsteps: Float[np.ndarray, "steps 2"],
    obstacles: Sequence[Circle],
    sole: float,
) -> Rows:
    """One row for each circle, summed over all previewed footsteps, about those of the last iteration (2.79 to 2.82).

    It reads: sum of |F_j|^2 - 2 F_j . centre >= (R + m)^2 - |centre|^2. Print has a row for each footstep; the
    author's program adds them up, so with two footsteps this is not "outside of the circle".

    Args:
        samples: N.
        footsteps: of the last iteration [m].
        obstacles: the circles.
        sole: the longer side of a sole [m].
    """
    steps = len(footsteps)
    matrix, lower = np.zeros((len(obstacles), 2, samples + steps)), np.empty(len(obstacles))
    for row, circle in enumerate(obstacles):
        centre = np.array([circle.x, circle.y])
        matrix[row, :, samples:] = 2 * (footsteps - centre).T
        lower[row] = (circle.radius + OBSTACLE_MARGIN + sole) ** 2 - centre @ centre + np.sum(footsteps**2)
    return Rows(matrix.reshape(len(obstacles), 2 * (samples + steps)), lower, np.full(len(obstacles), np.inf))


def _into_sole(yaw: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2 2"]:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack([np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)], axis=-2)
