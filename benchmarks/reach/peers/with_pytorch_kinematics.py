"""pytorch_kinematics: damped least squares from many starts at once, in PyTorch on the processor."""

# pyright: reportMissingImports=false

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytorch_kinematics
import torch

from benchmarks.reach.peers.worker import Job, Peer, Refused, right, serve

RETRIES = 10


def peer(job: Job) -> Peer:
    torch.set_num_threads(1)
    torch.manual_seed(0)
    chain = pytorch_kinematics.build_serial_chain_from_urdf(Path(job.urdf).read_bytes(), job.tip, job.base)
    if tuple(chain.get_joint_parameter_names()) != tuple(job.joints):
        raise Refused("it read other joints than the file has")
    chain = chain.to(dtype=torch.float64)
    middle = torch.as_tensor(job.middle)
    if not right(job, chain.forward_kinematics(middle).get_matrix()[0].numpy(), job.middle):
        raise Refused("its forward kinematics of the file is another one")
    limits = torch.as_tensor(np.stack([job.lower, job.upper], axis=1))

    def solver(starts: torch.Tensor) -> pytorch_kinematics.PseudoInverseIK:
        return pytorch_kinematics.PseudoInverseIK(
            chain,
            pos_tolerance=5e-4,
            rot_tolerance=5e-3,
            retry_configs=starts,
            joint_limits=limits,
            orientation_weight=float(job.posed),
            early_stopping_any_converged=True,
            early_stopping_no_improvement=None,
            clamp_to_limits=True,
        )

    def solve(aims: np.ndarray, starts: torch.Tensor) -> np.ndarray:
        found = solver(starts).solve(pytorch_kinematics.Transform3d(matrix=torch.as_tensor(aims)))
        best = torch.argmax(found.converged.int(), dim=1)
        return found.solutions[torch.arange(len(aims)), best].numpy()

    spread = limits[:, 0] + (limits[:, 1] - limits[:, 0]) * torch.rand(RETRIES, len(job.joints), dtype=torch.float64)
    first = torch.cat([middle[None], spread[1:]])

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        if start is None:
            return solve(aim[None], first)[0]
        drawn = limits[:, 0] + (limits[:, 1] - limits[:, 0]) * torch.rand(first.shape, dtype=torch.float64)
        return solve(aim[None], drawn)[0]

    return Peer(
        attempt,
        f"PseudoInverseIK, {RETRIES} starts at once, stops when one converged, clamped to the limits, float64",
        lambda aims: solve(aims, first),
    )


if __name__ == "__main__":
    serve(peer, ("pytorch_kinematics", "torch", "numpy"))
