"""Robotics Toolbox for Python: its Levenberg-Marquardt solver in C++, which restarts by itself."""

# pyright: reportMissingImports=false

from __future__ import annotations

import numpy as np
from roboticstoolbox import Robot
from roboticstoolbox.models.URDF.URDFRobot import URDF_read

from benchmarks.reach.peers.worker import Job, Peer, Refused, right, serve

GAIN = 0.1
TOLERANCE = 1e-7  # half the squared error; the default, 1e-6, lets 1.4 mm pass


def peer(job: Job) -> Peer:
    links, name, _ = URDF_read(job.urdf)
    robot = Robot(links, name=name)
    ets = robot.ets(start=job.base, end=job.tip)
    if ets.n != len(job.joints):
        raise Refused("it read other joints than the file has")
    aim = np.array(ets.eval(job.middle))
    if not right(job, aim, job.middle):
        raise Refused("its forward kinematics of the file is another one")
    mask = np.ones(6) if job.posed else np.array([1.0, 1, 1, 0, 0, 0])

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        q0 = job.middle if start is None else start
        return ets.ik_LM(aim, q0=q0, tol=TOLERANCE, mask=mask, joint_limits=True, k=GAIN).q

    return Peer(attempt, f"ik_LM, defaults (30 iterations, 100 searches, Chan) but k {GAIN}, tol {TOLERANCE:g}")


if __name__ == "__main__":
    serve(peer, ("roboticstoolbox-python", "spatialmath-python", "numpy"))
