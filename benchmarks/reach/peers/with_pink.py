"""Pink: differential inverse kinematics on Pinocchio, stepped until it stands at the target."""

# pyright: reportMissingImports=false

from __future__ import annotations

import numpy as np
import pink
import pinocchio
from pink.limits import ConfigurationLimit

from benchmarks.reach.peers.worker import STOP, Job, Peer, Refused, serve

STEPS = 20


def peer(job: Job) -> Peer:
    model = pinocchio.buildModelFromUrdf(job.urdf)
    if model.nq != len(job.joints):
        raise Refused("it read other joints than the file has")
    order = [model.joints[model.getJointId(name)].idx_q for name in job.joints]
    task = pink.tasks.FrameTask(job.tip, position_cost=1.0, orientation_cost=float(job.posed), lm_damping=1e-2)
    limits = [ConfigurationLimit(model, config_limit_gain=0.5)]
    data = model.createData()

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        q = np.zeros(model.nq)
        q[order] = job.middle if start is None else start
        configuration = pink.Configuration(model, data, q, copy_data=False)
        task.set_target(pinocchio.SE3(aim))
        for _ in range(STEPS):
            error = task.compute_error(configuration)
            if np.linalg.norm(error[:3]) < STOP[0] and (not job.posed or np.linalg.norm(error[3:]) < STOP[1]):
                break
            velocity = pink.solve_ik(
                configuration, [task], 1.0, solver="daqp", damping=1e-6, limits=limits, safety_break=False
            )
            configuration.integrate_inplace(velocity, 1.0)
        return configuration.q[order]

    return Peer(attempt, f"FrameTask (lm_damping 0.01), ConfigurationLimit (gain 0.5), DAQP, {STEPS} steps at most")


if __name__ == "__main__":
    serve(peer, ("pin-pink", "pin", "daqp", "numpy"))
