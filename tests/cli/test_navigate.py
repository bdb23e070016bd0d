"""``toddle navigate``: what it learns, leaves and prints, how it is stopped and goes on, and what it refuses."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from toddle.cli import main
from toddle.outside.navigation.policy_files import load_policy

CALL = "import sys; from toddle.cli import main; sys.exit(main(sys.argv[1:]))"
TINY = ("--actors", "4", "--horizon", "16", "--minibatch", "32", "--epochs", "1", "--hidden", "8", "--episodes", "3")
RUN = {
    "checkpoint.json", "checkpoints", "config.json", "figures.json", "learning.png", "policy.json",
    "policy.safetensors", "tensorboard",
}  # fmt: skip
KEYS = {"env", "seed", "steps", "train_seconds", "compile_seconds", "steps_per_second"}
JUDGED = {"success_rate", "wins", "losses", "return_mean"}
WALKED = JUDGED | {"collisions", "falls", "late", "lost"}

Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def navigate(capfd: pytest.CaptureFixture[str]) -> Call:
    """Calls ``toddle navigate``; returns exit code, standard output and standard error."""

    def call(*words: object) -> tuple[int, str, str]:
        code = main(["navigate", *map(str, words)])
        said = capfd.readouterr()
        return code, said.out, said.err

    return call


@pytest.fixture(scope="module")
def point(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run on the document's point."""
    path = tmp_path_factory.mktemp("point") / "run"
    assert main(["navigate", "ppo", "point", *TINY, "--steps", "512", "--out", str(path), "--json"]) == 0
    return path


@pytest.fixture(scope="module")
def rolling(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run of the walker's task, without legs."""
    path = tmp_path_factory.mktemp("goal") / "run"
    words = ("navigate", "ppo", "--robot", "unicycle", *TINY, "--steps", "128", "--out", str(path), "--json")
    assert main(words) == 0
    return path


def tensors(folder: Path) -> bytes:
    return (folder / "policy.safetensors").read_bytes()


def test_a_run_leaves_a_folder_with_all_of_it(point: Path) -> None:
    assert {path.name for path in point.iterdir()} == RUN
    figures = json.loads((point / "figures.json").read_text())
    assert set(figures) >= KEYS | JUDGED
    assert (figures["env"], figures["seed"], figures["steps"]) == ("point", 0, 512)
    assert load_policy(point).source["task"] == "point"


def test_json_is_one_object_and_nothing_else(navigate: Call, rolling: Path, tmp_path: Path) -> None:
    words = ("evaluate", "--policy", rolling, "--pattern", "--episodes", "4", "--out", tmp_path / "e", "--json")
    code, out, _ = navigate(*words)
    assert code == 0
    figures = json.loads(out)
    assert set(figures) >= KEYS | WALKED
    assert figures["wins"] + figures["losses"] == figures["episodes"] == 4


def test_a_run_that_goes_on_is_as_one_that_was_never_cut(navigate: Call, tmp_path: Path) -> None:
    words = ("ppo", "point", *TINY, "--schedule", "constant", "--seed", "3", "--json")
    assert navigate(*words, "--steps", "1024", "--out", tmp_path / "whole")[0] == 0
    assert navigate(*words, "--steps", "512", "--out", tmp_path / "cut")[0] == 0
    assert navigate("ppo", "--resume", tmp_path / "cut", "--steps", "1024", "--json")[0] == 0
    whole, cut = (sorted((tmp_path / name / "checkpoints").iterdir())[-1] for name in ("whole", "cut"))
    assert (whole / "training.safetensors").read_bytes() == (cut / "training.safetensors").read_bytes()


def test_the_first_ctrl_c_leaves_what_there_is(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    words = ["navigate", "ppo", "point", *TINY, "--steps", "100000000", "--out", str(folder)]
    process = subprocess.Popen(
        [sys.executable, "-c", CALL, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    try:
        assert process.stderr is not None
        for line in process.stderr:  # it learns, and tells of it
            if "reward" in line:
                break
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "--resume" in told
    assert json.loads((folder / "figures.json").read_text())["stopped"] == "it was asked to stop"
    assert load_policy(folder).observations == 4


def test_a_diverging_run_says_so_and_leaves_a_policy_of_use(navigate: Call, tmp_path: Path) -> None:
    words = ("ppo", "point", *TINY, "--steps", "20000", "--learning-rate", "1e5", "--out", tmp_path / "r")
    code, _, err = navigate(*words)
    assert code == 1
    assert "--learning-rate" in err
    assert np.isfinite(load_policy(tmp_path / "r").network.actor.weights[0]).all()


def test_a_gymnasium_environment_is_learned_and_judged(navigate: Call, tmp_path: Path) -> None:
    words = ("ppo", "--env", "Pendulum-v1", *TINY, "--steps", "256", "--out", tmp_path / "p", "--json")
    code, out, _ = navigate(*words)
    assert code == 0
    assert set(json.loads(out)) >= KEYS | {"return_mean"}
    code, out, _ = navigate(
        "evaluate", "--policy", tmp_path / "p", "--episodes", "2", "--out", tmp_path / "e", "--json"
    )
    assert code == 0
    assert json.loads(out)["env"] == "Pendulum-v1"


def test_who_steers_in_physics_is_judged_and_drawn(navigate: Call, tmp_path: Path) -> None:
    folder = tmp_path / "e"
    words = ("evaluate", "--driver", "baseline", "--episodes", "1", "--jobs", "1", "--out", folder, "--json")
    code, out, _ = navigate(*words)
    assert code == 0
    figures = json.loads(out)
    assert (figures["wins"], figures["falls"], figures["driver"]) == (1, 0, "baseline")
    assert {path.name for path in folder.iterdir()} == {"figures.json", "courses.json", "paths.png", "cases.png"}


def test_a_policy_becomes_a_file(navigate: Call, point: Path, tmp_path: Path) -> None:
    for name in ("policy.onnx", "policy.jax"):
        assert navigate("export", tmp_path / name, "--policy", point)[0] == 0
        assert (tmp_path / name).stat().st_size > 100


def test_help_tells_what_can_be_done(navigate: Call) -> None:
    code, out, _ = navigate("--help")
    assert code == 0
    assert all(word in out for word in ("ppo", "evaluate", "export"))


HOSTILE = [
    ("",), ("pppo",), ("ppo", "gaol"), ("ppo", "point", "extra"), ("ppo", "--env", "Pendulm-v1"),
    ("ppo", "goal", "--env", "Pendulum-v1"), ("ppo", "--env", "Pendulum-v1", "--circles", "2"),
    ("ppo", "--env", "Pendulum-v1", "--seeds", "2"), ("ppo", "--env", "Blackjack-v1"), ("ppo", "--steps", "0"),
    ("ppo", "--steps", "many"), ("ppo", "--steps", "1.5"), ("ppo", "--actors", "0"), ("ppo", "--gamma", "1.5"),
    ("ppo", "--gamma", "nan"), ("ppo", "--lambda", "-1"), ("ppo", "--epsilon", "0"), ("ppo", "--minibatch", "7"),
    ("ppo", "--learning-rate", "-1"), ("ppo", "--learning-rate", "inf"), ("ppo", "--hidden", "0"),
    ("ppo", "--hidden", "-4", "4"), ("ppo", "--memory", "-1"), ("ppo", "--memory", "4", "--sequence", "5"),
    ("ppo", "--bound", "tahn"), ("ppo", "--activation", "gelu"), ("ppo", "--schedule", "cosine"),
    ("ppo", "--circles", "-1"), ("ppo", "--circles", "999"), ("ppo", "--people", "99"), ("ppo", "--pace", "0"),
    ("ppo", "--pace", "2"), ("ppo", "--robot", "heicubb"), ("ppo", "--solver", "fast"), ("ppo", "--seed", "-1"),
    ("ppo", "--seeds", "0"), ("ppo", "--episodes", "0"), ("ppo", "--devices", "0"), ("ppo", "--devices", "500"),
    ("ppo", "point", "--circles", "2"), ("ppo", "--resume", "nowhere"), ("ppo", "--resume", "{point}", "--actors", "2"),
    ("ppo", "--resume", "{point}", "goal"), ("ppo", "--resume", "{point}", "--steps", "64"),
    ("ppo", "--deviation", "0"),
    ("ppo", "--out", "{point}"), ("ppo", "--out", "{point}/policy.json"), ("evaluate",),
    ("evaluate", "--policy", "nowhere"), ("evaluate", "--policy", "{point}/policy.json"),
    ("evaluate", "--policy", "{point}", "--circles", "2"), ("evaluate", "--driver", "guide", "--policy", "{point}"),
    ("evaluate", "--driver", "guide", "--pattern"), ("evaluate", "--driver", "script"),
    ("evaluate", "--driver", "script", "--script", "nowhere"), ("evaluate", "--script", "nowhere"),
    ("evaluate", "--driver", "wizard"), ("evaluate", "--driver", "guide", "--episodes", "0"),
    ("evaluate", "--driver", "guide", "--jobs", "0"), ("evaluate", "--driver", "guide", "--people", "99"),
    ("evaluate", "--driver", "guide", "--noise", "-1"), ("evaluate", "--driver", "guide", "--robot", "nobody"),
    ("evaluate", "--driver", "guide", "--seed", "-1"), ("export", "p.onnx"), ("export", "p.txt", "--policy", "{point}"),
    ("export", "nowhere/p.onnx", "--policy", "{point}"), ("export", "p.onnx", "--policy", "nowhere"),
]  # fmt: skip


@pytest.mark.parametrize("words", HOSTILE, ids=lambda words: " ".join(words)[:60] or "nothing")
def test_what_is_wrong_is_told_in_one_line(
    words: tuple[str, ...], navigate: Call, point: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = tensors(point)
    code, out, err = navigate(*(word.replace("{point}", str(point)) for word in words if word))
    assert code == 2
    assert out == ""
    assert len(err.strip().splitlines()) == 1, err
    assert err.startswith("toddle: ")
    assert not list(tmp_path.iterdir())
    assert tensors(point) == before


@pytest.mark.parametrize("words", [("--goal", "1", "0"), ("--goal", "0", "0"), ("--command", "0.1", "0", "0")])
def test_a_policy_that_does_not_walk_is_refused(
    words: tuple[str, ...],
    point: Path,
    capfd: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["walk", "--policy", str(point), *words]) == 2
    assert len(capfd.readouterr().err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
