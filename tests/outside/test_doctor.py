"""`toddle doctor`: each lack is found, and told with the command that mends it."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from toddle.cli import doctor as command
from toddle.outside import doctor
from toddle.outside.doctor import Finding

PRESENT = Finding("a part", True, "1.0", core=True)
LACK = Finding("ffmpeg", False, "not on PATH", remedy="get ffmpeg")
CORE_LACK = Finding("jax", False, "not installed", core=True, remedy="get jax")


def test_this_machine_is_whole() -> None:
    findings = {finding.part: finding for finding in doctor.examine()}
    parts = {"Python", "jax", "mujoco", "numba", "JAX devices", "GL backend", "ffmpeg", "heicub", "loopback port"}
    assert parts <= findings.keys()
    assert all(finding.present for finding in findings.values() if finding.core)
    assert all(finding.found for finding in findings.values())
    assert all(finding.remedy for finding in findings.values() if not finding.present)
    assert findings["JAX devices"].found.startswith("cpu:0")
    assert findings["heicub"].found == "15 joints, 25.96 kg"


@pytest.mark.parametrize(
    ("findings", "code", "lines"),
    [
        ((PRESENT,), 0, ["ok      a part              1.0"]),
        ((LACK,), 0, ["lacks   ffmpeg              not on PATH; mend it: get ffmpeg"]),
        ((PRESENT, CORE_LACK), 1, [..., "MISSING jax                 not installed; mend it: get jax"]),
    ],
)
def test_lines_and_exit_code(
    findings: tuple[Finding, ...],
    code: int,
    lines: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(command, "examine", lambda: findings)
    assert command.main([]) == code
    assert capsys.readouterr().out.splitlines()[-1] == lines[-1]


def test_json_is_one_object_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "examine", lambda: (PRESENT, CORE_LACK))
    assert command.main(["--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["whole"] is False
    assert told["parts"][1] == {
        "part": "jax", "present": False, "found": "not installed", "core": True, "remedy": "get jax",
    }  # fmt: skip


def test_a_missing_package_is_a_lack() -> None:
    finding = doctor._package("no-such-package", core=True)
    assert not finding.present
    assert finding.remedy == "pip install no-such-package"


def test_a_backend_that_draws_nothing_is_told_with_one_that_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_ask", lambda code, MUJOCO_GL: (MUJOCO_GL == "osmesa", ""))
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    assert doctor._gl_backend().remedy == "export MUJOCO_GL=osmesa"
    monkeypatch.setattr(doctor, "_ask", lambda code, MUJOCO_GL: (False, "no display"))
    assert doctor._gl_backend().remedy == "sudo apt-get install libegl1 libosmesa6"


def test_a_question_that_hangs_or_crashes_is_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_TIME_LIMIT", 0.2)
    assert doctor._ask("import time; time.sleep(60)") == (False, "no answer within 0.2 s")
    monkeypatch.setattr(doctor, "_TIME_LIMIT", 30)
    assert doctor._ask("import os; os.abort()") == (False, "exit code -6")
    assert doctor._ask("1 / 0") == (False, "ZeroDivisionError: division by zero")


def test_a_cache_that_cannot_be_written_is_a_lack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    finding = doctor._cache()
    assert not finding.present
    assert finding.remedy.startswith("export XDG_CACHE_HOME=")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert doctor._cache().present
    assert os.listdir(tmp_path / "toddle") == []
