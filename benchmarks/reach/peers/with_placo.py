"""PlaCo: whole-body inverse kinematics by quadratic programmes on Pinocchio, stepped until it stands at the target."""

# pyright: reportMissingImports=false

from __future__ import annotations

import numpy as np
import placo

from benchmarks.reach.peers.worker import STOP, Job, Peer, serve

STEPS = 20


def peer(job: Job) -> Peer:
    robot = placo.RobotWrapper(job.urdf, placo.Flags.ignore_collisions)
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(False)
    if job.posed:
        task = solver.add_frame_task(job.tip, np.eye(4))
        task.configure("tip", "soft", 1.0, 1.0)
    else:
        task = solver.add_position_task(job.tip, np.zeros(3))
        task.configure("tip", "soft", 1.0)
    solver.add_regularization_task(1e-6)

    def standing() -> bool:
        if not job.posed:
            return bool(task.error_norm() < STOP[0])
        return bool(task.position().error_norm() < STOP[0] and task.orientation().error_norm() < STOP[1])

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        for name, value in zip(job.joints, job.middle if start is None else start, strict=True):
            robot.set_joint(name, float(value))
        robot.update_kinematics()
        if job.posed:
            task.T_world_frame = aim
        else:
            task.target_world = aim[:3, 3]
        for _ in range(STEPS):
            solver.solve(True)
            robot.update_kinematics()
            if standing():
                break
        return np.array([robot.get_joint(name) for name in job.joints])

    return Peer(attempt, f"frame task, joint limits, regularisation 1e-6, {STEPS} whole steps at most")


if __name__ == "__main__":
    serve(peer, ("placo", "pin", "numpy"))
