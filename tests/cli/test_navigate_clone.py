"""``toddle navigate clone`` on the command line: from a dataset to a policy that can be exported; what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from drives import drive

from toddle.cli import main
from toddle.outside.dataset.writer import Writer
from toddle.outside.navigation.cloning_files import load_cloned
from toddle.outside.navigation.room_policies import is_cloned

QUICK = ("--judged", "0", "--json", "--passes", "600")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Drives that nobody drove; of the fifth there is only half."""
    folder = tmp_path_factory.mktemp("drives") / "set"
    with Writer(folder) as writer:
        for seed in range(8):
            writer.add(drive(seed))
    fifth = sorted(folder.glob("data/**/*.parquet"))[4]
    fifth.write_bytes(fifth.read_bytes()[: fifth.stat().st_size // 2])
    return folder


def test_a_policy_is_learned_from_a_dataset_and_exported(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    assert main(["navigate", "clone", str(dataset), *QUICK, "--out", str(folder)]) == 0
    said = capsys.readouterr()
    figures = json.loads(said.out)
    assert figures["passes"] == 512
    assert [line.split(":")[0] for line in said.err.splitlines()] == ["toddle"]
    assert said.err.rstrip().endswith("left out")
    assert is_cloned(folder)
    assert load_cloned(folder).source["dataset"] == str(dataset)
    assert main(["navigate", "export", str(tmp_path / "policy.onnx"), "--policy", str(folder)]) == 0
    assert (tmp_path / "policy.onnx").stat().st_size > 500_000
    assert main(["navigate", "clone", str(dataset), "--out", str(folder)]) == 2
    assert "policy.json would be written over" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--passes", "0"], "--passes: 0 is out of range"),
        (["--rate", "0"], "--rate"),
        (["--anywhere", "2"], "--anywhere: 2 is out of range"),
        (["--resume", "nowhere"], "there is no run here"),
        (["--resume", "nowhere", "--passes", "7"], "can't be changed"),
        (["nowhere"], "no dataset"),
    ],
)
def test_what_is_of_no_use_is_refused(
    words: list[str], expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["navigate", "clone", *words]) == 2
    assert expected in capsys.readouterr().err
    assert not [path for path in tmp_path.rglob("*") if path.name != "runs"]
