"""``toddle navigate evaluate`` in rooms: what it prints and leaves, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from toddle.cli import main

FIGURES = {
    "episodes", "success_rate", "wilson_low", "wilson_high", "spl", "collisions", "falls", "zmp_error_mean_cm",
    "command_entropy", "inference_ms_median",
}  # fmt: skip


def test_the_expert_drives_through_rooms(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "e"
    words = ["--driver", "expert", "--scenario", "straight", "--episodes", "1", "--jobs", "1", "--out", str(folder)]
    assert main(["navigate", "evaluate", *words, "--split", "validation", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert set(figures) >= FIGURES | {"policy", "straight"}
    assert set(figures["straight"]) >= FIGURES
    assert (figures["driver"], figures["success_rate"], figures["falls"]) == ("expert", 1.0, 0)
    assert "search" not in figures
    assert {path.name for path in folder.iterdir()} == {"figures.json", "drives.json", "paths.png", "straight.png"}
    assert main(["navigate", "evaluate", *words]) == 2  # nothing is written over
    assert "written over" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        ("--driver", "expert", "--pattern"),
        ("--driver", "expert", "--circles", "2"),
        ("--driver", "expert", "--scenario", "strait"),
        ("--driver", "expert", "--scenario", "curve", "curve"),
        ("--driver", "expert", "--style", "unseen", "--split", "validation"),
        ("--driver", "expert", "--episodes", "0"),
        ("--driver", "expert", "--robot", "nobody"),
        ("--driver", "baseline", "--style", "unseen"),
        ("--driver", "baseline", "--eyes", "cast"),
        ("--rooms",),
        ("--rooms", "--policy", "nowhere"),
        ("--rooms", "--people", "2", "--driver", "guide"),
    ],
    ids=" ".join,
)
def test_what_is_wrong_is_told_in_one_line(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["navigate", "evaluate", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.strip().splitlines()) == 1, err
    assert err.startswith("toddle: ")
    assert not list(tmp_path.iterdir())


def test_a_policy_that_says_it_was_cloned_goes_to_rooms_and_is_refused_where_it_is_broken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p").mkdir()
    (tmp_path / "p" / "policy.json").write_text('{"format": "toddle cloned", "version": 1}')
    assert main(["navigate", "evaluate", "--policy", "p", "--style", "unseen"]) == 2
    err = capsys.readouterr().err
    assert len(err.strip().splitlines()) == 1
    assert "policy" in err
    assert not (tmp_path / "runs").exists()
