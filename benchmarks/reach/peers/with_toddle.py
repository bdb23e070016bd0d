"""This project: its solver of a known robot, as a user of the library calls it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.reach.peers.worker import Job, Peer, serve
from toddle.outside.compile_cache import use_compile_cache

use_compile_cache()  # before Numba is imported


def peer(job: Job) -> Peer:
    from toddle.reach.solve.damped import solver_for
    from toddle.robots.urdf import read_urdf

    solver = solver_for(read_urdf(Path(job.urdf), tip=job.tip, base=job.base))
    solver.solve(np.zeros((2, 3)))  # compiles what a batch calls

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        return solver.solve_one(aim[:3, 3], aim[:3, :3] if job.posed else None, start).q

    def batch(aims: np.ndarray) -> np.ndarray:
        return solver.solve(aims[:, :3, 3], aims[:, :3, :3] if job.posed else None).q

    return Peer(attempt, "solver_for(chain), no posture given; up to 48 stored starts inside one call", batch)


if __name__ == "__main__":
    serve(peer, ("toddle", "numpy", "numba"))
