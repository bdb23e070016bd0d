"""Worker processes end with who started them, even if that was killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

STARTS = """
import os
import sys
import time
from multiprocessing import get_context
from toddle.outside.orphans import end_with_parent


def works(told):
    end_with_parent()
    told.send(os.getpid())
    time.sleep(60)


if __name__ == "__main__":
    here, there = get_context("spawn").Pipe()
    get_context("spawn").Process(target=works, args=(there,), daemon=False).start()
    print(here.recv(), flush=True)
    os.kill(os.getpid(), 9)
"""


def test_who_works_ends_when_who_started_it_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "starts.py"
    script.write_text(STARTS)
    done = subprocess.run([sys.executable, str(script)], stdout=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == -9
    worker, latest = int(done.stdout), time.monotonic() + 20
    while time.monotonic() < latest:
        try:
            os.kill(worker, 0)
        except ProcessLookupError:
            return
        time.sleep(0.02)
    pytest.fail(f"process {worker} lives on")
