"""The benchmark beside the peers: how answers are scored, and what its page says of them; no peer is installed here."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from toddle.robots.linkage import linkage_of, poses
from toddle.robots.urdf import read_urdf

ROOT = Path(__file__).parents[1]


def module(name: str) -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT)
        return importlib.import_module(f"benchmarks.reach.{name}")


BODIES, TARGETS, WORKER = module("bodies"), module("targets"), module("peers.worker")
MEASURED, REPORT = module("measured"), module("report")


@pytest.fixture(scope="module")
def panda() -> Any:
    return BODIES.body("panda")


def job(body: Any) -> Any:
    before, slides, gain, offset, last = body.linkage
    ends = {"lower": body.lower, "upper": body.upper}
    named = {"before": before, "slides": slides, "gain": gain, "offset": offset, "last": last}
    return WORKER.Job(
        urdf="", base=body.base, tip=body.tip, joints=body.joints, posed=body.posed, folder="", **ends, **named
    )


@pytest.mark.parametrize("name", ["panda", "tiago", "kinova", "icub_arm"])
def test_the_plain_arm_moves_as_the_file_says(name: str, tmp_path: Path) -> None:
    body = BODIES.body(name)
    path = tmp_path / "plain.urdf"
    path.write_text(body.text)
    chain = read_urdf(path)
    q = np.random.default_rng(0).uniform(body.lower, body.upper, (20, len(body.lower)))
    assert chain.joints == body.joints
    assert np.abs(poses(linkage_of(chain), q) - poses(body.linkage, q)).max() < 1e-6  # a chain is in single precision
    for row, pose in zip(q, poses(body.linkage, q), strict=True):
        assert np.abs(WORKER.pose_of(job(body), row) - pose).max() < 1e-12


def test_answers_are_scored_by_where_they_put_the_tip(panda: Any) -> None:
    aims = TARGETS.targets(panda, 4, seed=0)
    drawn = np.random.default_rng(TARGETS.seed_of("panda", 0)).random((4, 7))
    q = panda.lower + (panda.upper - panda.lower) * drawn
    answers = [q[0].tolist(), (q[1] + 0.02).tolist(), None, (q[3] + [0, 0, 0, 0, 0, 0, 2 * np.pi]).tolist()]
    assert TARGETS.reached(panda, aims, answers).tolist() == [True, False, False, False]  # 3: right, but past a limit
    told = [
        WORKER.right(job(panda), aim, None if a is None else np.array(a)) for aim, a in zip(aims, answers, strict=True)
    ]
    assert told == [True, False, False, False]


def test_angles_are_those_of_the_turn() -> None:
    for angle in (0.0, 1e-7, 0.0099, 3.0):
        turned = np.eye(4)[None].copy()
        turned[0, :2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        assert TARGETS.angles(turned, np.eye(4)[None])[0] == pytest.approx(angle, abs=1e-12)


def test_tries_go_on_until_one_is_right(panda: Any) -> None:
    aims = TARGETS.targets(panda, 1, seed=0)
    drawn = np.random.default_rng(TARGETS.seed_of("panda", 0)).random((1, 7))
    right = panda.lower + (panda.upper - panda.lower) * drawn[0]
    starts: list[Any] = []

    def attempt(aim: np.ndarray, start: np.ndarray | None) -> np.ndarray | None:
        starts.append(start)
        return right if len(starts) == 3 else None

    row = WORKER.answered(job(panda), WORKER.Peer(attempt, ""), aims[0], 10.0, np.random.default_rng(0))
    assert (row["tries"], row["first"]) == (3, False)
    assert row["q"] == right.tolist()
    assert starts[0] is None
    assert ((starts[1] >= panda.lower) & (starts[1] <= panda.upper)).all()


def test_a_target_counts_with_its_fastest_round() -> None:
    rounds = [[{"s": 3e-6}, {"s": 5e-6}], [{"s": 4e-6}, {"s": 2e-6}], [{"s": 1e-6}]]
    assert MEASURED.fastest(rounds, "s") == pytest.approx([1.0, 2.0])


def row(success: float, median: float, p99: float, **more: Any) -> dict[str, Any]:
    first = {"first_try_success_percent": success, "settings": "as it comes", "targets": 10}
    return {"success_percent": success, "median_us": median, "p99_us": p99, **first, **more}


def test_the_page_says_where_a_peer_is_ahead() -> None:
    peers = {"toddle": row(100.0, 10.0, 40.0), "ssik": row(100.0, 25.0, 30.0), "ikpy": {"refused": "no such joint"}}
    content = {
        "ours": "toddle", "command": "c", "machine": "m", "python": "3", "seconds": 1.0, "load_average": 0.0,
        "plan": {"targets": 10, "seed": 0}, "versions": {"ssik": {"ssik": "1"}}, "skipped": {"mink": "no wheel"},
        "bodies": {"ur5": {"joints": 6, "posed": True, "peers": peers}},
    }  # fmt: skip
    tables = REPORT.tables_of(content)
    assert tables["behind"] == "- ur5: ssik is ahead of ours in 99th percentile, 30 µs to 40 µs."
    assert "| ssik | 2.5 x |" in tables["median"]
    assert "| **toddle** | 10 µs |" in tables["median"]
    assert "| IKPy | - |" in tables["success"]
    assert "no such joint" in tables["settings"]
    assert "no wheel" in tables["settings"]
    peers["ssik"]["p99_us"] = 50.0
    assert "no peer is ahead" in REPORT.tables_of(content)["behind"]


def test_the_page_is_that_of_the_stored_figures() -> None:
    page = (ROOT / "docs/peers.md").read_text()
    content = json.loads((ROOT / "benchmarks/results/reach_peers.json").read_text())
    assert REPORT.filled(page, REPORT.tables_of(content)) == page
