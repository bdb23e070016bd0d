"""Environments of the peers: one each, made from the package registry with uv, kept in the cache, skipped if they fail.

PyTorch is installed by pip, which honours where a machine keeps its wheels for the processor alone.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

from toddle.outside.compile_cache import cache_home

ROOT = Path(__file__).parents[2]
SECONDS = 600  # for one peer to install
PACKAGES = {
    "damped_numpy": ("numpy==2.4.6",),
    "mink": ("mink==1.3.0", "daqp==0.11.0"),
    "pink": ("pin-pink==4.4.0", "pin==4.1.0", "daqp==0.11.0"),
    "roboticstoolbox": ("roboticstoolbox-python==1.5.0",),
    "ikpy": ("ikpy==4.2.1",),
    "pytorch_kinematics": ("torch==2.13.0", "pytorch_kinematics==0.10.0"),
    "ssik": ("ssik[urdf]==8.2.0",),
    "placo": ("placo==0.10.2",),
    "trac_ik": ("pytracik==0.0.3",),
}
BY_PIP = ("pytorch_kinematics",)
OURS = "toddle"
PEERS = (OURS, *PACKAGES)


class Skipped(Exception):
    """A peer that couldn't be installed, and why."""


def python_of(peer: str) -> Path:
    """The interpreter of a peer's environment, which is made where it isn't there yet.

    Raises:
        Skipped: it doesn't install.
    """
    if peer == OURS:
        return Path(sys.executable)
    folder = cache_home(os.environ) / "peers" / peer
    python, stamp = folder / "bin" / "python", folder / "installed.json"
    wanted = {"packages": list(PACKAGES[peer]), "python": ".".join(map(str, sys.version_info[:2]))}
    if stamp.exists() and json.loads(stamp.read_text()) == wanted:
        return python
    for command in _commands(peer, folder, python):
        _run(command)
    stamp.write_text(json.dumps(wanted))
    return python


def _commands(peer: str, folder: Path, python: Path) -> list[list[str]]:
    uv = shutil.which("uv") or shutil.which("uv", path=str(ROOT / ".tools" / "bin"))
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    if uv is None or peer in BY_PIP:
        return [
            [sys.executable, "-m", "venv", str(folder)],
            [str(python), "-m", "pip", "install", "--quiet", *PACKAGES[peer]],
        ]
    return [
        [uv, "venv", "--quiet", "--python", sys.executable, str(folder)],
        [uv, "pip", "install", "--quiet", "--python", str(python), *PACKAGES[peer]],
    ]


def _run(command: list[str]) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise Skipped(f"it didn't install within {SECONDS} s") from None
    except OSError as error:
        raise Skipped(f"it didn't install: {error.strerror}") from None
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if line.strip()] or ["no reason given"]
        raise Skipped(f"it didn't install: {said[-1].strip()[:200]}")
