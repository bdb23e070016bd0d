"""The experiments after Huber 2019, cut short."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from toddle.experiments import huber_patterns, huber_zmp
from toddle.experiments.experiment import Task
from toddle.failures import BadInput
from toddle.robots.catalogue import HUMANOIDS
from toddle.signals import Velocity
from toddle.walk.pattern.document import Document
from toddle.walk.pattern.trajectory import Trajectory, walk_pattern


def task(folder: Path, data: Path | None = None) -> Task:
    return Task(False, 0, None, folder, lambda *_: None, lambda: False, data)


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = {name: replace(case, iterations=12) for name, case in huber_patterns.CASES.items()}
    monkeypatch.setattr(huber_patterns, "CASES", cases)
    monkeypatch.setattr(huber_patterns, "QUICK", replace(huber_patterns.QUICK, runs=1))


def files_like_the_author_s(folder: Path, aside: float) -> None:
    """Our own trajectories in the author's columns, the centre of mass set aside [m], a sole lifted in one row."""
    gait = HUMANOIDS["hrp2"].document_gait
    assert gait is not None
    for name, omega in (("straight", 0.0), ("turn", 0.1)):
        walk: Trajectory = walk_pattern(Document(gait), gait, lambda t, w=omega: Velocity(0.1, 0.0, w), 12)
        table = np.zeros((len(walk.t), 21))
        table[:, 0], table[:, 3] = walk.com[:, 0, 0], walk.com[:, 0, 1] + aside
        table[300:, 15] = 0.012
        np.savetxt(folder / f"cpp_nmpc_{name}.csv", table, delimiter=", ")


def test_patterns_are_drawn_and_set_beside_the_author_s(short: None, tmp_path: Path) -> None:
    files_like_the_author_s(tmp_path, 0.01)
    outcome = huber_patterns.run(task(tmp_path, tmp_path))
    figures = {row.what: row for row in outcome.rows}
    for name in ("straight", "turn"):
        assert figures[f"{name}: author's centre of mass off the optimum"].ours == pytest.approx(10.0)
        assert figures[f"{name}: a sole rises in 5 ms, beside the author's file"].document == pytest.approx(12.0)
    assert figures["farthest jump of a sole between two rows"].ours == pytest.approx(0.0, abs=0.1)
    drawn = {path.name for path in tmp_path.glob("*.png")}
    panels = {f"figure-{panel}.png" for panel in ("4-1-a", "4-1-b", "4-2-a", "4-2-b", "4-3")}
    assert drawn == panels | {"author-straight.png", "author-turn.png"}


@pytest.mark.parametrize(
    ("content", "says"),
    [(None, "can't be read"), ("1, 2, left\n", "can't be read"), ("1, 2, 3\n" * 3, "21 columns"), ("", "21 columns")],
)
def test_files_that_are_not_the_author_s_are_refused(
    content: str | None, says: str, short: None, tmp_path: Path
) -> None:
    if content is not None:
        (tmp_path / "cpp_nmpc_straight.csv").write_text(content)
    with pytest.raises(BadInput, match=rf"cpp_nmpc_straight.*{says}"):
        huber_patterns.run(task(tmp_path, tmp_path))


def test_the_document_s_walker_is_measured(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(huber_zmp, "QUICK", replace(huber_zmp.QUICK, seconds=5.0))
    monkeypatch.setattr(huber_zmp, "TASKS", {"straight": huber_zmp.TASKS["straight"]})
    monkeypatch.setattr(huber_zmp, "VARIANTS", {})
    outcome = huber_zmp.run(task(tmp_path))
    assert outcome.holds
    assert outcome.rows[0].ours is not None
    assert 0.1 < outcome.rows[0].ours < 1.0
    assert not outcome.figures["straight"]["fell"]
    assert {path.name for path in tmp_path.glob("*.png")} == {"figure-4-4.png", "figure-4-24-straight.png"}
