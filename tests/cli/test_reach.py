"""``toddle reach``: what it leaves, what it prints, how it stops and goes on, and its exit codes."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
import tiny

import toddle
from toddle.cli import main
from toddle.outside import pictures, terminal
from toddle.outside.files import read_record
from toddle.robots import catalogue
from toddle.robots.planar import planar

SIZES = ("--per-cycle=100", "--hidden=4", "--test-points=20")
DOCUMENTED = {
    "robot", "method", "samples", "seed", "fixed_error_mean_mm", "fixed_error_p99_mm", "seen_error_mean_mm",
    "closed_loop_error_mean_mm", "samples_per_second", "query_us_single", "query_us_batch4096",
}  # fmt: skip
TIMINGS = {"samples_per_second", "query_us_single", "query_us_batch4096", "folder"}

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def reach(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Calls ``toddle reach`` (without its pictures, which take most of a short run's time).

    Returns exit code, standard output and standard error.
    """
    for name in ("error_over_samples", "explored_space", "targets_by_error"):
        monkeypatch.setattr(pictures, name, lambda *_, **__: None)

    def call(*words: object) -> tuple[int, str, str]:
        code = main(["reach", *map(str, words)])
        said = capfd.readouterr()
        return code, said.out, said.err

    return call


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two joints in the plane."""
    path = tmp_path_factory.mktemp("reach") / "run"
    assert main(["reach", "planar:2", "--samples=400", *SIZES, "--out", str(path), "--json"]) == 0
    return path


def figures_of(path: Path) -> dict[str, Any]:
    """A run's figures, less what a clock says."""
    return {k: v for k, v in json.loads((path / "figures.json").read_text()).items() if k not in TIMINGS}


def same_arrays(a: Path, b: Path) -> bool:
    """Whether two runs hold the same tensors, in their checkpoint and in their skill, to the last bit."""
    pairs = [(read_record(a, kind, kind)[1], read_record(b, kind, kind)[1]) for kind in ("run", "skill")]
    return all(
        one.keys() == other.keys() and all(one[name].tobytes() == other[name].tobytes() for name in one)
        for one, other in pairs
    )


def test_json_is_one_object_and_nothing_else(reach: Run, tmp_path: Path) -> None:
    code, out, err = reach("planar:2", "--samples=200", *SIZES, "--seed=3", "--out", tmp_path / "run", "--json")
    assert code == 0
    assert out.count("\n") == 1
    figures = json.loads(out)
    assert set(figures) >= DOCUMENTED
    assert figures["robot"] == "planar:2"
    assert (figures["samples"], figures["seed"], figures["method"]) == (200, 3, "goal-and-motor-babbling")
    assert all(figures[name] > 0 for name in DOCUMENTED if name not in ("robot", "method"))
    assert Path(figures["folder"]) == tmp_path / "run"
    assert json.loads((tmp_path / "run" / "figures.json").read_text()) == {
        name: value for name, value in figures.items() if name != "folder"
    }
    took = "planar:2: 2 joints for 2 coordinates, so goal-and-motor-babbling, learner perceptron\n"
    assert re.fullmatch(re.escape(took) + r"(planar:2 learns: \d+ of 200, error [\d.]+ mm\n)+", err)


def test_a_run_leaves_a_folder_with_all_of_it(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} == {
        "config.json", "figures.json", "course.json", "run.json", "run.safetensors", "skill.json", "skill.safetensors",
        "error.png", "explored.png", "coverage.png", "fixed.png", "seen.png", "points.json",
    }  # fmt: skip
    config = json.loads((folder / "config.json").read_text())
    assert (config["source"]["spec"], config["samples"], config["hidden"]) == ("planar:2", 400, [4])
    assert {"python", "jax", "toddle"} <= set(config["versions"])
    course = json.loads((folder / "course.json").read_text())
    assert course["samples"] == [100, 200, 300, 400]
    assert 1000 * course["fixed_error"][-1] == pytest.approx(figures_of(folder)["fixed_error_mean_mm"], rel=1e-5)


def test_the_command_line_and_python_learn_the_same(folder: Path) -> None:
    found = toddle.load_skill(folder)
    targets = tiny.skill().targets
    assert found.predict(targets).tobytes() == tiny.skill().predict(targets).tobytes()
    timings = TIMINGS | {"folder"}
    assert figures_of(folder) == {k: v for k, v in tiny.skill().figures.items() if k not in timings}


def test_without_json_a_table_a_folder_and_a_next_step_are_printed(
    reach: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, _ = reach("planar:2", "--samples=200", *SIZES)
    assert code == 0
    assert out.startswith("planar:2 after 200 movements\n")
    assert re.search(r"^fixed error mean mm +[\d.,]+", out, re.MULTILINE)
    assert "figures, pictures and the skill: runs/planar-2\n" in out
    asked = re.search(r"^ask it: toddle (reach --skill runs/planar-2 --target .*)$", out, re.MULTILINE)
    assert asked is not None
    assert main(asked[1].split()) in (0, 1)
    assert reach("planar:2", "--samples=200", *SIZES, "--json")[0] == 0
    assert {path.name for path in (tmp_path / "runs").iterdir()} == {"planar-2", "planar-2-2"}
    assert figures_of(tmp_path / "runs" / "planar-2") == figures_of(tmp_path / "runs" / "planar-2-2")


class CtrlC(terminal.Reporter):
    """A reporter at whose fourth word a person presses Ctrl-C."""

    words = 0

    def tell(self, done: int, news: str) -> None:
        self.words += 1
        if self.words == 4:
            os.kill(os.getpid(), signal.SIGINT)


def test_a_run_that_was_stopped_goes_on_bit_for_bit(
    reach: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten cycles at once, or four, Ctrl-C, and six."""
    straight, stopped = tmp_path / "straight", tmp_path / "stopped"
    assert reach("planar:2", "--samples=1000", *SIZES, "--out", straight, "--json")[0] == 0
    with monkeypatch.context() as patch:
        patch.setattr(terminal, "Reporter", CtrlC)
        code, out, err = reach("planar:2", "--samples=1000", *SIZES, "--out", stopped, "--json")
    assert code == 130
    assert json.loads(out)["samples"] == 400
    assert err.endswith(f"\ntoddle: stopped; go on with: toddle reach --resume {stopped}\n")
    assert toddle.load_skill(stopped).figures["samples"] == 400
    code, out, _ = reach("--resume", stopped, "--json")
    assert code == 0
    assert json.loads(out)["samples"] == 1000
    assert same_arrays(straight, stopped)
    assert figures_of(straight) == figures_of(stopped)
    assert (straight / "course.json").read_bytes() == (stopped / "course.json").read_bytes()


def test_ctrl_c_stops_a_real_process_and_loses_nothing(reach: Run, tmp_path: Path) -> None:
    script = "import sys; from toddle.cli import main; sys.exit(main())"
    words = ["reach", "planar:2", "--samples=100000000", *SIZES, "--out", "run"]
    command = [sys.executable, "-c", script, *words]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("planar:2: 2 joints for 2 coordinates")
        first = process.stderr.readline()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert first.startswith("planar:2 learns: 100 of 100000000, error ")
    assert process.returncode == 130
    assert err.endswith("toddle: stopped; go on with: toddle reach --resume run\n")
    assert "Traceback" not in err
    assert "planar:2 after" in out
    came = int(read_record(tmp_path / "run", "run", "run")[1]["progress.seen.total"])
    assert came >= 100
    samples = ("--samples", came + 200)
    assert reach("--resume", tmp_path / "run", *samples, "--json")[0] == 0
    assert reach("planar:2", *samples, *SIZES, "--out", tmp_path / "straight", "--json")[0] == 0
    assert same_arrays(tmp_path / "run", tmp_path / "straight")


def test_a_run_in_physics_goes_on_bit_for_bit(reach: Run, tmp_path: Path) -> None:
    physics = ("planar:2", *SIZES, "--plant=physics", "--noise=2mm")
    one, two = tmp_path / "one", tmp_path / "two"
    assert reach(*physics, "--samples=200", "--out", one, "--json")[0] == 0
    assert reach(*physics, "--samples=100", "--out", two, "--json")[0] == 0
    code, out, _ = reach("--resume", two, "--samples=200", "--json")
    assert code == 0
    run, again = (read_record(path, "run", "run")[1] for path in (one, two))
    assert all(run[name].tobytes() == again[name].tobytes() for name in run)
    assert any(name.startswith("plant.") for name in run)
    fixed = json.loads(out)["fixed_error_mean_mm"]
    assert fixed == pytest.approx(figures_of(one)["fixed_error_mean_mm"], rel=1e-9)


def test_an_answer_is_joints_within_limits_and_the_error_that_they_lead_to(reach: Run, folder: Path) -> None:
    skill = tiny.inverse(toddle.load_skill(folder))
    for target in skill.seen[:3]:
        code, out, err = reach("--skill", folder, "--target", *target, "--json")
        answer = json.loads(out)
        assert err == ""
        assert list(answer["joints"]) == ["joint_1", "joint_2"]
        q = np.array(list(answer["joints"].values()))
        assert np.all(np.abs(q) <= np.pi / 2 + 1e-6)
        error = 1000 * np.linalg.norm(tiny.forward(q) - target)
        assert answer["expected_error_mm"] == pytest.approx(error, abs=0.01)
        assert answer["looks"] == 3
        assert (
            answer["verdict"] == "reached" if error <= 5 else answer["verdict"] in ("not converged", "at a joint limit")
        )
        assert code == (0 if answer["verdict"] == "reached" else 1)


def test_an_answer_in_words(reach: Run, folder: Path) -> None:
    target = tiny.inverse(toddle.load_skill(folder)).seen[0]
    code, out, err = reach("--skill", folder, "--target", *target, "--tolerance", 2)
    assert (code, err) == (0, "")
    first, second, verdict = out.splitlines()
    for line, name in ((first, "joint_1"), (second, "joint_2")):
        found = re.fullmatch(rf"{name} +(-?[\d.]+)  \( *(-?[\d.]+) deg\)", line)
        assert found is not None
        assert np.degrees(float(found[1])) == pytest.approx(float(found[2]), abs=0.01)
    assert re.fullmatch(r"reached: error seen: [\d.]+ mm, allowed: 2000.0 mm", verdict)


def test_open_loop_answers_need_no_robot(reach: Run, folder: Path) -> None:
    target = tiny.inverse(toddle.load_skill(folder)).seen[0]
    code, out, _ = reach("--skill", folder, "--target", *target, "--looks", 0, "--tolerance", 10, "--json")
    answer = json.loads(out)
    assert (code, answer["looks"]) == (0, 0)
    assert list(answer["joints"].values()) == tiny.skill().predict(target[None])[0].tolist()


def test_an_arm_in_physics_answers_with_what_it_saw(reach: Run, folder: Path) -> None:
    target = tiny.inverse(toddle.load_skill(folder)).seen[0]
    physics = ("--plant=physics", "--noise=0mm", "--tolerance", 2, "--json")
    code, out, _ = reach("--skill", folder, "--target", *target, *physics)
    answer = json.loads(out)
    q = np.array(list(answer["joints"].values()))
    assert code == 0
    assert answer["expected_error_mm"] == pytest.approx(1000 * np.linalg.norm(tiny.forward(q) - target), abs=30)


def test_out_of_reach_is_a_wrong_call_and_says_where_to_aim(reach: Run, folder: Path) -> None:
    code, out, err = reach("--skill", folder, "--target", 3, 4)
    assert (code, out) == (2, "")
    said = re.fullmatch(
        r"toddle: --target: out of reach, (\d+) mm from anything it ever reached; "
        r"the nearest such position is (\S+) (\S+); aim at that, or closer\n",
        err,
    )
    assert said is not None
    nearest = np.array([float(said[2]), float(said[3])])
    assert 1000 * np.linalg.norm(nearest - [3, 4]) == pytest.approx(float(said[1]), abs=2)
    assert np.abs(tiny.inverse(toddle.load_skill(folder)).seen - nearest).max(axis=1).min() < 1e-3


def test_a_sliding_joint_is_not_told_in_degrees(reach: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    slides = replace(planar(2), slides=jnp.array([0.0, 1.0]))
    monkeypatch.setattr(catalogue, "load_choice", lambda choice: slides)
    out = reach("--skill", folder, "--target", *tiny.inverse(toddle.load_skill(folder)).seen[0])[1]
    assert [line.endswith("deg)") for line in out.splitlines()] == [True, False, False]
