"""What else a recording tells: where the target is, in view or not, and how near things are, as far as they were seen.

Networks learn to tell it beside the command, which makes them see and remember. Nothing that was never seen is asked
for; what was seen is known for `MEMORY` seconds.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float, Float32

from toddle.navigate.cloning.recording import Recording

MEMORY = 20.0
"""Things that were seen are known so long [s]."""

FEWEST = 6, 12
"""Pixels that show the target, and anything else."""

SECTORS, HALF_VIEW = 12, math.radians(75.0)
"""Sectors of nearness, from the right to the left, and how far aside they reach [rad]."""

REACH = 2.5
"""Things farther away than that are not near [m]."""

SEEN, VISIBLE, COS, SIN, DISTANCE, FIRST_SECTOR = range(6)
"""Columns of the labels; distance is in `REACH`."""

LABELS = FIRST_SECTOR + SECTORS


def labels_of(recording: Recording) -> Float32[np.ndarray, "looks labels"]:
    """Of each look, in the robot's frame: the target seen, visible (0 or 1), its bearing, its distance, nearness."""
    yaw = recording.place[:, 2]
    off_x, off_y = (recording.circles[..., axis] - recording.place[:, None, axis] for axis in (0, 1))
    bearing = np.arctan2(off_y, off_x) - yaw[:, None]
    far = np.hypot(off_x, off_y)
    shows = recording.pixels >= np.where(np.arange(recording.pixels.shape[1]) == 0, *FEWEST)
    known = _remembered(recording.t, shows)
    found = np.zeros((len(recording.t), LABELS), np.float32)
    found[:, SEEN], found[:, VISIBLE] = known[:, 0], shows[:, 0]
    found[:, COS], found[:, SIN] = np.cos(bearing[:, 0]), np.sin(bearing[:, 0])
    found[:, DISTANCE] = far[:, 0] / REACH
    found[:, FIRST_SECTOR:] = _nearness(bearing[:, 1:], far[:, 1:], recording.circles[:, 1:, 2], known[:, 1:])
    return found


def _remembered(
    t: Float[np.ndarray, " looks"], shows: Bool[np.ndarray, "looks things"]
) -> Bool[np.ndarray, "looks things"]:
    """Whether each was seen lately."""
    last = np.maximum.accumulate(np.where(shows, t[:, None], -np.inf), axis=0)
    return t[:, None] - last <= MEMORY


def _nearness(
    bearing: Float[np.ndarray, "looks things"],
    far: Float[np.ndarray, "looks things"],
    radius: Float[np.ndarray, "looks things"],
    known: Bool[np.ndarray, "looks things"],
) -> Float[np.ndarray, "looks sectors"]:
    """Of the nearest known thing that reaches into each sector: 1 touches, 0 is `REACH` away."""
    near = np.where(known, np.clip(1.0 - (far - radius) / REACH, 0.0, 1.0), 0.0)
    half = np.arcsin(np.clip(radius / np.maximum(far, 1e-6), 0.0, 1.0)) + HALF_VIEW / SECTORS
    middles = np.linspace(-HALF_VIEW, HALF_VIEW, 2 * SECTORS + 1)[1::2]
    apart = np.abs(np.remainder(middles - bearing[..., None] + math.pi, 2 * math.pi) - math.pi)
    return np.where(apart <= half[..., None], near[..., None], 0.0).max(axis=1, initial=0.0)
