"""ssik: analytical inverse kinematics for six or seven revolute joints, by the solver that it builds for an arm."""

# pyright: reportMissingImports=false

from __future__ import annotations

import hashlib
import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np

from benchmarks.reach.peers.worker import Job, Peer, Refused, serve

BUILD_SECONDS = 100


def peer(job: Job) -> Peer:
    if not job.posed:
        raise Refused("it solves full poses only")
    if job.slides.any() or len(job.joints) not in (6, 7):
        raise Refused("it solves six or seven revolute joints only")
    solver = built(job)
    q_seed = job.middle

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray | None:
        found = solver.solve(aim, max_solutions=1, q_seed=q_seed if start is None else start)
        return np.asarray(found[0].q) if found else None

    return Peer(attempt, "solver made by `ssik build`; max_solutions 1, q_seed; native where it is")


def built(job: Job) -> ModuleType:
    """The module that `ssik build` writes for an arm, kept for the next run."""
    urdf = Path(job.urdf)
    path = Path(job.folder) / f"{urdf.stem}_{hashlib.sha256(urdf.read_bytes()).hexdigest()[:12]}_ik.py"
    if not path.exists():
        command = [sys.executable, "-m", "ssik.cli", "build", job.urdf, "--base", job.base, "--ee", job.tip]
        command += ["--validate-poses", "20", "--out", str(path)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=BUILD_SECONDS)
        except subprocess.TimeoutExpired:
            path.unlink(missing_ok=True)
            raise Refused(f"`ssik build` took more than {BUILD_SECONDS} s") from None
        if not path.exists():
            said = (done.stderr or done.stdout).strip().splitlines() or [""]
            raise Refused(f"`ssik build` failed: {said[-1][:200]}")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


if __name__ == "__main__":
    serve(peer, ("ssik", "numpy"))
