"""Damped least squares as a user writes it in an afternoon: NumPy, the geometric Jacobian, clipped at the limits."""

from __future__ import annotations

import numpy as np

from benchmarks.reach.peers.worker import STOP, Job, Peer, serve

DAMPING, STEPS = 0.05, 30


def jacobian(job: Job, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pose of the tip, (4, 4), and the geometric Jacobian, (6, joints)."""
    pose, feet, axes = np.eye(4), [], []
    for before, slides, motion in zip(job.before, job.slides, job.gain @ q + job.offset, strict=True):
        pose = pose @ before
        feet.append(pose[:3, 3])
        axes.append(pose[:3, 2])
        c, s = (1.0, 0.0) if slides else (np.cos(motion), np.sin(motion))
        up = motion if slides else 0.0
        pose = pose @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, up], [0, 0, 0, 1]])
    pose = pose @ job.last
    columns = [
        np.concatenate([axis, np.zeros(3)] if slides else [np.cross(axis, pose[:3, 3] - foot), axis])
        for axis, foot, slides in zip(axes, feet, job.slides, strict=True)
    ]
    return pose, np.array(columns).T @ job.gain


def turn(rotation: np.ndarray) -> np.ndarray:
    """Rotation vector of a rotation matrix [rad]."""
    half = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine = np.linalg.norm(half) / 2
    angle = np.arctan2(sine, (np.trace(rotation) - 1) / 2)
    return half / 2 * (angle / sine if sine > 1e-9 else 1.0)


def peer(job: Job) -> Peer:
    rows = 6 if job.posed else 3

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        q = job.middle if start is None else start
        for _ in range(STEPS):
            pose, slopes = jacobian(job, q)
            error = np.concatenate([aim[:3, 3] - pose[:3, 3], turn(aim[:3, :3] @ pose[:3, :3].T)])[:rows]
            if np.linalg.norm(error[:3]) < STOP[0] and np.linalg.norm(error[3:]) < STOP[1]:
                break
            j = slopes[:rows]
            q = np.clip(q + j.T @ np.linalg.solve(j @ j.T + DAMPING**2 * np.eye(rows), error), job.lower, job.upper)
        return q

    return Peer(attempt, f"damping {DAMPING}, {STEPS} steps at most, clipped at the limits")


if __name__ == "__main__":
    serve(peer, ("numpy",))
