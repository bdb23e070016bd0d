"""What the arms are to reach, and how answers are scored: by this project's own kinematics in float64, for everybody.

A target is the pose of a uniformly random posture inside the limits, so that each is reachable.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.reach.bodies import Body
from toddle.robots.linkage import poses

DISTANCE, ANGLE, SLACK = 1e-3, 0.01, 1e-6  # within which a target counts as reached [m], [rad]; at a limit [rad or m]


def seed_of(name: str, seed: int) -> list[int]:
    """The seed of an arm's targets; the arm's name is part of it."""
    return [seed, zlib.crc32(name.encode())]


def targets(body: Body, count: int, seed: int) -> Float[np.ndarray, "count 4 4"]:
    """Poses of random postures, from the base to the tip [m]."""
    drawn = np.random.default_rng(seed_of(body.name, seed)).random((count, len(body.lower)))
    return poses(body.linkage, body.lower + (body.upper - body.lower) * drawn)


def reached(
    body: Body, aims: Float[np.ndarray, "count 4 4"], answers: Sequence[Sequence[float] | None]
) -> Bool[np.ndarray, " count"]:
    """Which answers put the tip within 1 mm and 0.01 rad of the target, inside the limits; None is no answer."""
    given = np.array([answer is not None and len(answer) == len(body.lower) for answer in answers], bool)
    q = np.array([answer if had else body.lower for answer, had in zip(answers, given, strict=True)], float)
    given &= np.isfinite(q.sum(axis=1))
    q = np.where(np.isfinite(q), q, body.lower)
    pose = poses(body.linkage, q)
    near = np.less(np.linalg.norm(pose[:, :3, 3] - aims[:, :3, 3], axis=1), DISTANCE)
    if body.posed:
        near = near & (angles(pose, aims) < ANGLE)
    inside = ((q >= body.lower - SLACK) & (q <= body.upper + SLACK)).all(axis=1)
    return given & near & inside


def angles(one: Float[np.ndarray, "count 4 4"], other: Float[np.ndarray, "count 4 4"]) -> Float[np.ndarray, " count"]:
    """Angles between the rotations of two rows of poses [rad]; exact where small."""
    apart = np.linalg.norm(one[:, :3, :3] - other[:, :3, :3], axis=(1, 2))  # 2 sqrt 2 sin(angle / 2)
    return 2 * np.arcsin(np.minimum(apart / np.sqrt(8), 1.0))
