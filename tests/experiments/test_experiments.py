import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

import toddle.experiments
from toddle.cli import experiment as cli
from toddle.experiments import NAMES, experiment_named
from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.failures import BadInput


@dataclass(frozen=True)
class Nothing:
    why: str = "a stub"


def stub(holds: bool) -> Experiment:
    def run(task: Task) -> Outcome:
        task.tell(0.5, "half")
        row = Row("answer", 41.0 + task.seed, 42.0, "mm")
        return Outcome((row, Row("nothing", float("nan"))), "it was counted", holds, Nothing(), {"full": task.full})

    return Experiment("stub", "a table that there isn't", run)


@pytest.fixture
def stubbed(monkeypatch: pytest.MonkeyPatch):
    def put(holds: bool) -> None:
        monkeypatch.setattr(toddle.experiments, "experiment_named", lambda _: stub(holds))

    return put


@pytest.mark.parametrize("name", NAMES)
def test_each_name_has_its_file(name: str):
    found = experiment_named(name)
    assert found.name == name
    assert "20" in found.reproduces  # document and year


def test_a_wrong_name_is_answered_with_the_nearest():
    with pytest.raises(BadInput, match=r"mahboob-nico.*did you mean mahboob-nicu"):
        experiment_named("mahboob-nico")


def test_naming_the_experiments_imports_nothing_heavy():
    code = (
        "import sys, toddle.experiments, toddle.cli.experiment; print(sorted({'jax', 'matplotlib'} & set(sys.modules)))"
    )
    asked = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert asked.stdout.strip() == "[]"


def test_a_part_of_a_task_tells_its_share_of_the_whole(tmp_path: Path):
    told: list[float] = []
    task = Task(False, 0, None, tmp_path, lambda done, _: told.append(done), lambda: False)
    part = task.part(0.5, 0.75).part(0.0, 0.5)
    part.tell(0.0, "")
    part.tell(1.0, "")
    assert told == [0.5, 0.625]


def test_the_list_names_all(capsys: pytest.CaptureFixture[str]):
    assert cli.main([]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in NAMES)


@pytest.mark.parametrize(("holds", "exit_code"), [(True, 0), (False, 1)])
def test_the_verdict_is_the_exit_code(holds: bool, exit_code: int, stubbed, tmp_path, capsys):
    stubbed(holds)
    assert cli.main(["stub", "--seed", "1", "--out", str(tmp_path / "new")]) == exit_code
    printed = capsys.readouterr().out
    assert f"verdict: {'yes' if holds else 'no'}, it was counted" in printed
    answer = next(line for line in printed.splitlines() if line.startswith("answer"))
    assert answer.split() == ["answer", "42", "mm", "42", "mm"]


def test_the_record_tells_how_to_make_it_again(stubbed, tmp_path, capsys):
    stubbed(True)
    cli.main(["stub", "--full", "--seeds", "3", "--out", str(tmp_path), "--json"])
    record = json.loads((tmp_path / "figures.json").read_text())
    assert record["command"] == "toddle experiment stub --full --seed 0 --seeds 3"
    assert record["figures"] == {"full": True}
    assert record["rows"][0] == {"what": "answer", "ours": 41.0, "document": 42.0, "unit": "mm"}
    assert record["rows"][1]["ours"] is None
    assert {"jax", "toddle", "python"} <= set(record["versions"])
    assert "cores" in record["machine"]
    assert json.loads(capsys.readouterr().out)["command"] == record["command"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["x", "--quick", "--full"], "--quick and --full exclude each other"),
        (["x", "--seeds", "0"], "--seeds: 0 is out of range"),
        (["x", "--seed", "-1"], "--seed: -1 is out of range"),
        (["nothing-like-it"], "no experiment named 'nothing-like-it'"),
    ],
)
def test_bad_calls_are_refused_in_a_line(words: list[str], line: str):
    with pytest.raises(BadInput) as caught:
        cli.main(words)
    assert line in caught.value.line
    assert "\n" not in caught.value.line
