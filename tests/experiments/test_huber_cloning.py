"""The network that learned to drive by watching: a tiny one learns, is compared, drives, and is judged again."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drives import drive
from small_networks import LIGHT

from toddle.experiments import huber_cloning as experiment
from toddle.experiments import huber_cloning_tables as tables
from toddle.experiments.experiment import Outcome, Task
from toddle.failures import BadInput
from toddle.navigate.cloning.dagger import Course
from toddle.navigate.cloning.episodes import episode
from toddle.navigate.cloning.policy import Cloned
from toddle.navigate.cloning.recording import RoomKey
from toddle.navigate.cloning.training import begin
from toddle.navigate.scenarios.rooms import SCENARIOS
from toddle.navigate.task import Outcome as End
from toddle.outside.files import finite
from toddle.outside.navigation.room_eyes import EyeOptions
from toddle.outside.navigation.room_judging import figures_of
from toddle.outside.navigation.room_policies import is_cloned
from toddle.outside.navigation.room_run import RoomFinish

TINY = experiment.Parameters(
    seeds=1, scenarios=("straight",), course=Course(1, 0, 1, LIGHT.passes), judged=0, drives=1, validation=1,
    eyes=EyeOptions("cast"), seconds=1.0, kinds=(), jobs=1,
)  # fmt: skip


def task(folder: Path, data: Path | None = None, told: list[float] | None = None) -> Task:
    heard = [] if told is None else told
    return Task(False, 0, None, folder, lambda done, _: heard.append(done), lambda: False, data)


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Outcome, list[float]]:
    folder, told = tmp_path_factory.mktemp("cloning"), list[float]()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiment, "QUICK", TINY)
        patch.setattr(experiment, "CloningConfig", lambda: LIGHT)
        return folder, experiment.run(task(folder, told=told)), told


def test_it_runs_and_says_that_so_little_proves_nothing(learned: tuple[Path, Outcome, list[float]]) -> None:
    folder, outcome, told = learned
    assert told == sorted(told)
    assert max(told) <= 1
    assert not outcome.holds
    assert "prove nothing" in outcome.verdict
    assert is_cloned(folder / "light-0")
    for name in ("4-16", "4-17", "4-18", "4-24", "4-25"):
        assert (folder / f"figure-{name}.png").stat().st_size > 5_000
    json.dumps(finite(outcome.figures))
    assert outcome.figures["network"]["late"] == outcome.figures["expert"]["late"] == 1  # a second is too little
    assert outcome.figures["looks"]["networks"][0]["kullback_leibler_ahead"] > 0


def test_what_was_learned_is_judged_again_with_the_same_figures(
    learned: tuple[Path, Outcome, list[float]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, first, _ = learned
    monkeypatch.setattr(experiment, "QUICK", TINY)
    monkeypatch.setattr(experiment, "FULL", TINY)
    again = experiment.run(task(tmp_path, folder))
    assert again.figures["looks"] == first.figures["looks"]
    assert again.figures["balance"] == first.figures["balance"]
    assert again.figures["networks"] == ["light-0"]
    assert not (tmp_path / "light-0").exists()


def test_a_folder_without_networks_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(experiment, "QUICK", TINY)
    with pytest.raises(BadInput, match="no network"):
        experiment.run(task(tmp_path, tmp_path))


def test_each_drive_is_begun_with_an_empty_memory() -> None:
    some = [episode(drive(seed, looks=4)) for seed in range(2)]
    training = begin(LIGHT, some, 0)
    policy = Cloned(training.learner.network, training.scale, LIGHT)
    together = experiment.predicted(policy, some)
    apart = [experiment.predicted(policy, [one]) for one in some]
    np.testing.assert_array_equal(together, np.concatenate(apart))
    assert together.shape == (8, 2)


def finish(number: int, scenario: str, outcome: End, error: float) -> RoomFinish:
    """A drive that nobody drove; half of its ticks err by twice as much as the others."""
    errors = np.array([error, 2 * error])
    asked = np.array([[0.1, 0.0, 0.0], [0.2, 0.0, 0.0]])
    key = RoomKey(scenario, "test", "seen", number)  # pyright: ignore[reportArgumentType]
    path = np.zeros((2, 4))
    return RoomFinish(key, outcome, "", 1.0, path, 1.0, 1.0, 0.5, error, 0.0, asked, np.ones(2), errors)


def said(outcomes: dict[str, End], error: float) -> tuple[str, bool]:
    ours = [finish(0, name, outcomes.get(name, End.WON), error) for name in SCENARIOS]
    theirs = [finish(0, name, End.WON, 0.02) for name in SCENARIOS]
    figures = {"network": figures_of(ours), "expert": figures_of(theirs)}
    return tables.verdict(figures, {"network": tables.balance(ours), "expert": tables.balance(theirs)})


def test_the_verdict() -> None:
    assert said({}, 0.02)[1]
    assert said({"obstacle": End.COLLIDED}, 0.02)[1]  # which the document's network did not solve either
    assert not said({"search": End.LATE}, 0.02)[1]
    assert said({}, 0.02 * 1.3)[1]  # the expert's: 3 cm, and 1 cm of deviation
    verdict, holds = said({}, 0.02 * 1.4)
    assert not holds
    assert "not shown" in verdict
    assert verdict.startswith("6 of 6 drives")


def test_balance_is_that_of_all_ticks() -> None:
    some = [finish(0, "straight", End.WON, 0.01), finish(0, "search", End.WON, 0.03)]
    found = tables.balance(some)
    assert set(found) == {"all", "straight", "search"}
    assert found["straight"]["mean"] == pytest.approx(1.5)
    assert found["straight"]["spread"] == pytest.approx(0.5)
    assert found["all"]["mean"] == pytest.approx(3.0)
    assert found["all"]["entropy"] == pytest.approx(np.log(2))
    assert tables.balance([]) == {}


def test_every_part_that_is_left_out_is_a_part() -> None:
    for parts in experiment.KINDS.values():
        course = {name: value for name, value in parts.items() if name == "dagger"}
        network = {name: value for name, value in parts.items() if name != "dagger"}
        replace(experiment.CloningConfig(), **network)
        replace(experiment.FULL.compared, **course)
    passes = {replace(experiment.FULL.compared, dagger=on).passes for on in (True, False)}
    drives = {
        sum(stage.drives for stage in replace(experiment.FULL.compared, dagger=on).stages) for on in (True, False)
    }
    assert len(passes) == len(drives) == 1
