"""A peer's process, and the conversation with it: started once, one core, one thread, asked in JSON, line by line."""

from __future__ import annotations

import json
import os
import subprocess
import threading
from pathlib import Path
from typing import Any, Self

from benchmarks.reach.bodies import Body
from toddle.outside.compile_cache import cache_home

ROOT = Path(__file__).parents[2]
THREADS = ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "NUMBA")


class Asked:
    """A peer that waits for questions; closed with its block."""

    def __init__(self, peer: str, python: Path, core: int | None) -> None:
        settings = {**os.environ, **{f"{name}_NUM_THREADS": "1" for name in THREADS}, "PYTHONPATH": ""}
        self.peer = peer
        self.process = subprocess.Popen(
            [str(python), "-m", f"benchmarks.reach.peers.with_{peer}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            cwd=ROOT,
            env=settings,
        )
        if core is not None and hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(self.process.pid, {core})

    def ask(self, question: dict[str, Any], seconds: float) -> dict[str, Any]:
        """The answer; ``refused`` and the reason where there is none in time, or the process ended."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        late = threading.Event()
        timer = threading.Timer(seconds, lambda: (late.set(), self.process.kill()))
        timer.start()
        try:
            self.process.stdin.write(json.dumps(question) + "\n")
            self.process.stdin.flush()
            line = self.process.stdout.readline()
        except OSError:
            line = ""
        finally:
            timer.cancel()
        if line:
            return json.loads(line)
        if late.is_set():
            return {"refused": f"no answer within {seconds:g} s"}
        return {"refused": f"its process ended with code {self.process.wait()}"}

    @property
    def alive(self) -> bool:
        """Whether it can be asked."""
        return self.process.poll() is None

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.communicate()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def job(body: Body, folder: Path, peer: str) -> dict[str, Any]:
    """What a peer is told of an arm, whose file is written into a folder."""
    path = folder / f"{body.name}.urdf"
    path.write_text(body.text)
    own = cache_home(os.environ) / "peers" / peer / "made"
    own.mkdir(parents=True, exist_ok=True)
    linkage = body.linkage
    return {
        "urdf": str(path),
        "base": body.base,
        "tip": body.tip,
        "joints": list(body.joints),
        "posed": body.posed,
        "folder": str(own),
        "lower": body.lower.tolist(),
        "upper": body.upper.tolist(),
        "before": linkage.before.tolist(),
        "slides": linkage.slides.tolist(),
        "gain": linkage.gain.tolist(),
        "offset": linkage.offset.tolist(),
        "last": linkage.tip.tolist(),
    }
