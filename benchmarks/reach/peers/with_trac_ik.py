"""TRAC-IK, by the bindings of pytracik: two solvers race each other, with their own restarts, on the robot's file."""

# pyright: reportMissingImports=false

from __future__ import annotations

import numpy as np
from trac_ik import TracIK

from benchmarks.reach.peers.worker import Job, Peer, Refused, serve

SECONDS = 0.005


def peer(job: Job) -> Peer:
    if not job.posed:
        raise Refused("its bindings solve full poses only")
    solver = TracIK(job.base, job.tip, job.urdf, timeout=SECONDS, epsilon=1e-5, solver_type="Speed")
    if solver.dof != len(job.joints):
        raise Refused("it read other joints than the file has")

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray | None:
        return solver.ik(aim[:3, 3], aim[:3, :3], job.middle if start is None else start)

    return Peer(attempt, f"Speed, epsilon 1e-5, timeout {SECONDS} s (its own restarts; two threads on the one core)")


if __name__ == "__main__":
    serve(peer, ("pytracik", "numpy"))
