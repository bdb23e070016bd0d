"""IKPy: SciPy's bounded least squares on a chain read from the file."""

# pyright: reportMissingImports=false

from __future__ import annotations

import warnings

import numpy as np
from ikpy.chain import Chain

from benchmarks.reach.peers.worker import Job, Peer, Refused, right, serve


def peer(job: Job) -> Peer:
    warnings.simplefilter("ignore")
    names = [link.name for link in Chain.from_urdf_file(job.urdf, base_elements=[job.base]).links]
    active = [name in job.joints for name in names]
    if sum(active) != len(job.joints):
        raise Refused("it read other joints than the file has")
    chain = Chain.from_urdf_file(job.urdf, base_elements=[job.base], active_links_mask=active)
    places = [names.index(name) for name in job.joints]

    def spread(q: np.ndarray) -> np.ndarray:
        whole = np.zeros(len(names))
        whole[places] = q
        return whole

    if not right(job, chain.forward_kinematics(spread(job.middle)), job.middle):
        raise Refused("its forward kinematics of the file is another one")

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        q0 = spread(job.middle if start is None else start)
        whole = chain.inverse_kinematics_frame(aim, initial_position=q0, orientation_mode="all" if job.posed else None)
        return np.asarray(whole)[places]

    return Peer(attempt, "inverse_kinematics_frame, defaults, orientation_mode 'all'" if job.posed else "defaults")


if __name__ == "__main__":
    serve(peer, ("ikpy", "scipy", "numpy"))
