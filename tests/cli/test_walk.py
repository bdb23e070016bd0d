"""``toddle walk``: what it leaves, what it prints, how it is driven and stopped, and its exit codes."""

from __future__ import annotations

import gzip
import json
import math
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from toddle.cli import main

DOCUMENTED = (
    "robot", "scenario", "seconds", "fell", "distance_m", "velocity_error_percent", "yaw_rate_error_percent",
    "zmp_error_mean_cm", "zmp_error_std_cm", "nmpc_ms_median", "nmpc_ms_p99", "posture_ms_median", "real_time_factor",
    "fallbacks",
)  # fmt: skip
FILES = {
    "config.json", "figures.json", "trajectory.parquet", "footprints.png", "feet.png", "zmp_error.png", "velocity.png",
}  # fmt: skip
EXACT = Path(__file__).parents[1] / "walk" / "data"
CALL = "import sys; from toddle.cli import main; sys.exit(main(sys.argv[1:]))"

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def walk(capfd: pytest.CaptureFixture[str]) -> Run:
    """Calls ``toddle walk``; returns exit code, standard output and standard error."""

    def call(*words: object) -> tuple[int, str, str]:
        code = main(["walk", *map(str, words)])
        said = capfd.readouterr()
        return code, said.out, said.err

    return call


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nine seconds of a curve in physics."""
    path = tmp_path_factory.mktemp("walk") / "run"
    words = ("walk", "--command", "0.1", "0", "0.1", "--for", "9", "--no-video", "--out", str(path), "--json")
    assert main(words) == 0
    return path


def columns(path: Path) -> dict[str, np.ndarray]:
    table = pq.read_table(path / "trajectory.parquet")
    return {name: table[name].to_numpy() for name in table.column_names}


def test_a_run_leaves_a_folder_with_all_of_it(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} == FILES
    config = json.loads((folder / "config.json").read_text())
    assert (config["robot"], config["legs"], config["seconds"]) == ("heicub", [[0.0, 0.1, 0.0, 0.1]], 9.0)
    assert {"gait", "walker", "world", "versions", "seed"} <= set(config)
    for name in FILES:
        if name.endswith(".png"):
            assert (folder / name).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_documents_walker_has_a_body(walk: Run, tmp_path: Path) -> None:
    words = ("heicub", "--weights", "document", "--for", 3, "--no-video", "--out", tmp_path / "run", "--json")
    code, out, _ = walk(*words)
    figures, config = json.loads(out), json.loads((tmp_path / "run" / "config.json").read_text())
    assert (code, figures["fell"], figures["fallbacks"]) == (0, False, 0)
    assert figures["zmp_error_mean_cm"] < 1
    assert config["gait"]["step_time"] == 3.2
    assert config["walker"]["feed_forward"]


def test_its_figures_are_those_that_are_documented(folder: Path) -> None:
    figures = json.loads((folder / "figures.json").read_text())
    assert tuple(name for name in figures if name in DOCUMENTED) == DOCUMENTED
    assert (figures["robot"], figures["scenario"], figures["fell"]) == ("heicub", "command", False)
    assert 9.0 < figures["seconds"] < 13.0  # and it came to stand
    assert figures["distance_m"] == pytest.approx(0.1 * 9.0, rel=0.2)
    assert 0 < figures["zmp_error_mean_cm"] < 5
    assert figures["velocity_error_percent"] < 10
    assert figures["true_yaw_rate_error_percent"] < 10


def test_its_trajectory_is_a_motion(folder: Path) -> None:
    """Velocities and accelerations are derivatives, and what was measured is near what was planned."""
    table = columns(folder)
    axes = ("x", "y", "z", "yaw")
    names = [f"com_{axis}{order}" for order in ("", "_velocity", "_acceleration") for axis in axes]
    names = ["t", *names, "zmp_x", "zmp_y", *(f"{side}_{axis}" for side in ("left", "right") for axis in axes)]
    assert list(table)[: len(names)] == names
    measured = [name for name in names[1:] if not name.endswith("_acceleration") and name != "com_yaw_velocity"]
    assert {f"{name}_measured" for name in measured} <= set(table)
    assert np.diff(table["t"]) == pytest.approx(0.01)
    for name in names:
        assert np.isfinite(table[name]).all(), name
    speed = np.gradient(table["com_x_measured"], table["t"])
    assert np.median(np.abs(speed - table["com_x_velocity"])) < 0.03
    for name in ("com_x", "com_y", "left_x", "right_yaw"):
        assert np.abs(table[f"{name}_measured"] - table[name]).max() < 0.05, name
    ahead = np.hypot(table["com_x"][-1], table["com_y"][-1])
    assert ahead == pytest.approx(2 * math.sin(0.9 / 2), rel=0.15)  # the chord of 0.9 m with a radius of 1 m
    assert table["command_vx"].max() == pytest.approx(0.1)
    assert table["asked_vx"][0] == 0.1


def test_json_is_one_object_and_nothing_else(walk: Run, tmp_path: Path) -> None:
    words = ("hrp2", "--pattern-only", "--iterations", "10", "--weights", "document", "--out", tmp_path / "a", "--json")
    code, out, err = walk(*words)
    assert (code, err, out.count("\n")) == (0, "", 1)
    figures = json.loads(out)
    assert figures.pop("folder") == str(tmp_path / "a")
    assert figures == json.loads((tmp_path / "a" / "figures.json").read_text())
    assert (figures["zmp_error_mean_cm"], figures["posture_ms_median"]) == (None, None)


@pytest.mark.parametrize(("name", "omega"), [("straight", 0.0), ("turn", 0.1)])
def test_the_documents_pattern_is_the_exact_one(walk: Run, tmp_path: Path, name: str, omega: float) -> None:
    words = ("hrp2", "--pattern-only", "--weights", "document", "--command", 0.1, 0, omega, "--iterations", 100)
    code, _, err = walk(*words, "--out", tmp_path / "a", "--json")
    assert (code, err) == (0, "")
    with gzip.open(EXACT / f"exact_{name}.csv.gz", "rt") as file:
        exact = np.loadtxt(file, delimiter=",", skiprows=1)
    table = columns(tmp_path / "a")
    assert (len(table["t"]), len(exact)) == (2200, 2000)  # ten samples of standing come first
    assert np.ptp(table["com_x"][:200]) == 0
    assert np.abs(table["com_x"][200:] - exact[:, 0]).max() < 1e-6
    assert np.abs(table["com_y"][200:] - exact[:, 1]).max() < 1e-6


def test_our_pattern_walks_as_told_and_stands(walk: Run, tmp_path: Path) -> None:
    words = ("--pattern-only", "--command", 0.1, 0.05, 0.1, "--for", 10, "--out", tmp_path / "a", "--json")
    code, out, _ = walk(*words)
    figures = json.loads(out)
    assert code == 0
    assert figures["velocity_error_percent"] < 3
    assert figures["yaw_rate_error_percent"] < 3
    table = columns(tmp_path / "a")
    left, right = (np.array([table[f"{side}_{axis}"][-1] for axis in ("x", "y")]) for side in ("left", "right"))
    assert np.hypot(*(left - right)) == pytest.approx(0.14, abs=1e-6)  # side by side
    assert abs(table["com_x_velocity"][-1]) < 0.02


def test_more_than_it_can_is_capped_and_said(walk: Run, tmp_path: Path) -> None:
    words = ("--pattern-only", "--command", 5, 0, 0, "--for", 2, "--out", tmp_path / "a")
    code, out, err = walk(*words)
    assert code == 0
    assert err == "heicub: 5 0 0 is more than it walks safely; 0.3 0 0 is let through\n"
    assert "figures, trajectory and pictures" in out
    assert columns(tmp_path / "a")["command_vx"].max() == pytest.approx(0.3)


def test_a_fall_is_exit_code_1(walk: Run, tmp_path: Path) -> None:
    words = ("--command", 0, 0, 0, "--for", 6, "--push", "80@0.5@90", "--no-video", "--out", tmp_path / "a", "--json")
    code, out, err = walk(*words)
    figures = json.loads(out)
    assert code == 1
    assert figures["fell"]
    assert figures["seconds"] < 5
    assert f"fell after {figures['seconds']:.1f} s" in err
    assert "trajectory.parquet" in os.listdir(tmp_path / "a")


def test_a_script_is_walked(walk: Run, tmp_path: Path) -> None:
    (tmp_path / "walk.txt").write_text("t vx vy omega\n0 0.1 0 0\n1.5 0 0.05 0\n3 0 0 0\n")
    code, out, _ = walk("--pattern-only", "--script", tmp_path / "walk.txt", "--out", tmp_path / "a", "--json")
    assert (code, json.loads(out)["scenario"]) == (0, "script")
    table = columns(tmp_path / "a")
    at = {t: tuple(table[f"command_{axis}"][np.searchsorted(table["t"], t)] for axis in ("vx", "vy")) for t in (1, 2.5)}
    assert at == {1: (0.1, 0.0), 2.5: (0.0, 0.05)}


def test_ctrl_c_stops_it_and_loses_nothing(tmp_path: Path) -> None:
    words = ("walk", "--for", "3000", "--no-video", "--out", str(tmp_path / "a"), "--json")
    with subprocess.Popen(
        [sys.executable, "-c", CALL, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert child.stderr is not None
        while "walks, seconds: " not in child.stderr.readline():
            assert child.poll() is None
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=60)
    assert child.returncode == 130
    assert "Traceback" not in err
    figures = json.loads(out)
    table = columns(tmp_path / "a")
    assert table["t"][-1] == pytest.approx(figures["seconds"])
    assert table["command_vx"][-1] == 0  # it was stopped, not dropped


def test_keys_need_a_terminal(walk: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    with open(os.devnull) as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        code, out, err = walk("--keys")
    assert (code, out) == (2, "")
    assert err.startswith("toddle: --keys: standard input is no terminal")


class Driver:
    """A person at a terminal, in which ``toddle walk --keys`` runs."""

    def __init__(self, path: Path) -> None:
        self.master, self.slave = pty.openpty()
        self.before = termios.tcgetattr(self.slave)
        code = f"import fcntl, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0)\n{CALL}"
        words = ("walk", "--keys", "--out", str(path))
        self.child = subprocess.Popen(
            [sys.executable, "-c", code, *words],
            stdin=self.slave, stdout=self.slave, stderr=self.slave, start_new_session=True,
            env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
        )  # fmt: skip
        self.seen = b""

    def watch(self, seconds: float, until: bytes | None = None) -> None:
        """Read what is shown for so long, or until something is."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and (until is None or until not in self.seen):
            if select.select([self.master], [], [], 0.05)[0]:
                try:
                    self.seen += os.read(self.master, 65536)
                except OSError:
                    return
            elif self.child.poll() is not None:
                return


def test_a_person_drives_it(tmp_path: Path) -> None:
    driver = Driver(tmp_path / "a")
    driver.watch(60, until=b"real-time factor")
    os.write(driver.master, b"w\x1b[A")
    driver.watch(4, until=b"+0.100 m/s")
    assert b"+0.100 m/s" in driver.seen
    os.write(driver.master, b"q")
    driver.watch(60)
    assert driver.child.wait(timeout=30) == 0
    assert termios.tcgetattr(driver.slave) == driver.before
    for end in (driver.master, driver.slave):
        os.close(end)
    for part in (b"ZMP margin", b"support foot", b"NMPC", b"sideways", b"heicub, keys"):
        assert part in driver.seen, part
    figures: dict[str, Any] = json.loads((tmp_path / "a" / "figures.json").read_text())
    assert (figures["fell"], figures["scenario"]) == (False, "keys")
    assert columns(tmp_path / "a")["asked_vx"].max() == pytest.approx(0.1)


def test_a_lost_terminal_stops_the_robot(tmp_path: Path) -> None:
    driver = Driver(tmp_path / "a")
    driver.watch(60, until=b"real-time factor")
    os.write(driver.master, b"ww")
    driver.watch(1.5)
    os.close(driver.slave)
    os.close(driver.master)
    assert driver.child.wait(timeout=60) == 0
    table = columns(tmp_path / "a")
    assert table["asked_vx"].max() == pytest.approx(0.1)
    assert table["command_vx"][-1] == 0
    assert not json.loads((tmp_path / "a" / "figures.json").read_text())["fell"]
