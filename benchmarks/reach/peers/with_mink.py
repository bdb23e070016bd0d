"""mink: differential inverse kinematics on MuJoCo, stepped until it stands at the target."""

from __future__ import annotations

from pathlib import Path

import mink
import mujoco
import numpy as np

from benchmarks.reach.peers.worker import STOP, Job, Peer, serve

STEPS, DAMPING = 20, 1e-3


def peer(job: Job) -> Peer:
    options = '<mujoco><compiler fusestatic="false" discardvisual="true"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(Path(job.urdf).read_text().replace("</robot>", options))
    configuration = mink.Configuration(model)
    order = [int(model.joint(name).qposadr[0]) for name in job.joints]
    task = mink.FrameTask(job.tip, "body", position_cost=1.0, orientation_cost=float(job.posed), lm_damping=1e-2)
    limits = [mink.ConfigurationLimit(model)]

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        q = np.zeros(model.nq)
        q[order] = job.middle if start is None else start
        configuration.update(q)
        task.set_target(mink.SE3.from_matrix(aim))
        for _ in range(STEPS):
            error = task.compute_error(configuration)
            if np.linalg.norm(error[:3]) < STOP[0] and (not job.posed or np.linalg.norm(error[3:]) < STOP[1]):
                break
            velocity = mink.solve_ik(configuration, [task], 1.0, "daqp", damping=DAMPING**2, limits=limits)
            configuration.integrate_inplace(velocity, 1.0)
        return configuration.q[order]

    return Peer(attempt, f"FrameTask (lm_damping 0.01), ConfigurationLimit, DAQP, {STEPS} whole steps at most")


if __name__ == "__main__":
    serve(peer, ("mink", "mujoco", "daqp", "numpy"))
