"""What a solver's process does: loads an arm, answers targets, and times its own calls; asked in JSON, line by line.

Runs in the peer's environment, so that it needs NumPy alone. Each target gets a first try from the middle of the
ranges, then tries from random postures, until an answer is right or the time a target may take is spent. Whether it is
right is judged here, by the arm's constants, and that isn't part of the time: no peer pays for checking its answers.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np

DISTANCE, ANGLE, SLACK = 1e-3, 0.01, 1e-6  # as benchmarks.reach.targets has them
STOP = (1e-4, 1e-3)  # where peers that iterate stop: a tenth of what is asked for [m], [rad]


@dataclass(frozen=True)
class Job:
    """One arm.

    Attributes:
        urdf: path of its file.
        base, tip: links at its ends.
        joints: those that move, base first.
        lower, upper: limits [rad or m].
        posed: whether a target says how the tip is turned.
        before, slides, gain, offset, last: its constants: transforms before each axis, which slide, how joints move
            axes, motion at zero, and the transform from the last axis to the tip.
        folder: where files may be left for a later run.
    """

    urdf: str
    base: str
    tip: str
    joints: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    posed: bool
    before: np.ndarray
    slides: np.ndarray
    gain: np.ndarray
    offset: np.ndarray
    last: np.ndarray
    folder: str

    @property
    def middle(self) -> np.ndarray:
        """The middle of the ranges."""
        return (self.lower + self.upper) / 2


class Peer(NamedTuple):
    """A solver that knows an arm.

    Attributes:
        attempt: one try: the pose asked for, (4, 4), and the posture to start from, None for the first try; gives
            joint values or None.
        settings: how it is used, in words.
        batch: answers to many poses, (count, 4, 4), in one call; None where it has no such thing.
    """

    attempt: Callable[[np.ndarray, np.ndarray | None], Any]
    settings: str
    batch: Callable[[np.ndarray], Any] | None = None


class Refused(Exception):
    """The solver doesn't take this arm, and why."""


def pose_of(job: Job, q: np.ndarray) -> np.ndarray:
    """(4, 4) from the base to the tip."""
    pose = np.eye(4)
    for before, slides, motion in zip(job.before, job.slides, job.gain @ q + job.offset, strict=True):
        pose = pose @ before
        if slides:
            pose[:3, 3] += pose[:3, 2] * motion
        else:
            c, s = np.cos(motion), np.sin(motion)
            pose[:, :2] = pose[:, :2] @ np.array([[c, -s], [s, c]])
    return pose @ job.last


def right(job: Job, aim: np.ndarray, q: Any) -> bool:
    """Whether an answer counts."""
    if q is None or not np.isfinite(q).all() or (q < job.lower - SLACK).any() or (q > job.upper + SLACK).any():
        return False
    pose = pose_of(job, np.asarray(q, float))
    turned = 2 * np.arcsin(min(1.0, np.linalg.norm(pose[:3, :3] - aim[:3, :3]) / np.sqrt(8))) if job.posed else 0.0
    return bool(np.linalg.norm(pose[:3, 3] - aim[:3, 3]) < DISTANCE and turned < ANGLE)


def answered(job: Job, peer: Peer, aim: np.ndarray, limit: float, rng: np.random.Generator) -> dict[str, Any]:
    """One target: the answer, seconds until then, of the first try alone, whether that was right, and tries."""
    start, spent, tries, first = None, 0.0, 0, (0.0, False)
    while True:
        began = time.perf_counter()
        q = peer.attempt(aim, start)
        spent += time.perf_counter() - began
        tries += 1
        good = right(job, aim, q)
        if tries == 1:
            first = (spent, good)
        if good or spent >= limit:
            answer = None if q is None else [float(value) for value in q]
            return {"q": answer, "s": spent, "first_s": first[0], "first": first[1], "tries": tries}
        start = rng.uniform(job.lower, job.upper)


def solved(job: Job, peer: Peer, asked: dict[str, Any]) -> dict[str, Any]:
    """As many targets as there is time for, in their order."""
    rows, began = [], time.perf_counter()
    for index, aim in enumerate(asked["targets"]):
        rng = np.random.default_rng([asked["seed"], index])
        rows.append(answered(job, peer, np.reshape(aim, (4, 4)), asked["limit"], rng))
        if time.perf_counter() - began > asked["seconds"]:
            break
    return {"rows": rows}


def batched(peer: Peer, asked: dict[str, Any]) -> dict[str, Any]:
    """All targets in one call, and its seconds."""
    assert peer.batch is not None
    aims = np.reshape(asked["targets"], (-1, 4, 4))
    began = time.perf_counter()
    q = peer.batch(aims)
    spent = time.perf_counter() - began
    return {"q": np.asarray(q, float).tolist(), "s": spent}


def loaded(make: Callable[[Job], Peer], asked: dict[str, Any]) -> tuple[Job, Peer, dict[str, Any]]:
    """The solver of an arm, warm: what is made at the first call is made."""
    arrays = ("lower", "upper", "before", "slides", "gain", "offset", "last")
    told: dict[str, Any] = {name: np.array(v) if name in arrays else v for name, v in asked["job"].items()}
    job = Job(**told)
    began = time.perf_counter()
    peer = make(job)
    rng, warm = np.random.default_rng(0), time.perf_counter()
    for _ in range(5):
        aim = pose_of(job, rng.uniform(job.lower, job.upper))
        peer.attempt(aim, None)
        peer.attempt(aim, job.middle)
        if time.perf_counter() - warm > 2.0:
            break
    seconds = time.perf_counter() - began
    return job, peer, {"settings": peer.settings, "batch": peer.batch is not None, "load_s": round(seconds, 3)}


def serve(make: Callable[[Job], Peer], packages: Sequence[str]) -> None:
    """Answer until the input ends; whatever a library prints goes to the standard error."""
    channel = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    job: Job | None = None
    peer: Peer | None = None
    for line in sys.stdin:
        asked = json.loads(line)
        try:
            if asked["do"] == "hello":
                reply = {"versions": {name: version(name) for name in packages}}
            elif asked["do"] == "load":
                job, peer, reply = loaded(make, asked)
            else:
                assert job is not None
                assert peer is not None
                reply = solved(job, peer, asked) if asked["do"] == "solve" else batched(peer, asked)
        except Exception as error:
            reply = {"refused": f"{type(error).__name__}: {error}".splitlines()[0][:300]}
            if isinstance(error, Refused):
                reply = {"refused": str(error)}
        channel.write(json.dumps(reply) + "\n")
        channel.flush()
