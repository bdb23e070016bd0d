"""``toddle reach`` by learning the body: what it leaves, prints, answers and refuses."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import toddle
from toddle.cli import main
from toddle.outside import body_pictures, pictures
from toddle.outside.files import read_record
from toddle.reach.body_skill import BodySkill
from toddle.reach.gather import truth
from toddle.reach.model.rigid import Rigid
from toddle.robots.body import Body

DOCUMENTED = {
    "method", "movements", "noise_mm", "fit_seconds", "total_seconds", "open_loop_error_mean_mm",
    "open_loop_error_p99_mm", "open_loop_error_max_mm", "after_looks_p99_mm", "after_looks_success_percent_1mm",
    "success_percent", "verdicts", "fixed_error_mean_mm", "seen_error_mean_mm", "query_us_single",
}  # fmt: skip
SMALL = ("--test-points=200", "--seed=3")

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def reach(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Calls ``toddle reach`` without its pictures; returns exit code, standard output and standard error."""
    for module, name in ((pictures, "explored_space"), (pictures, "targets_by_error"),
                         (body_pictures, "expected_error"), (body_pictures, "misses")):  # fmt: skip
        monkeypatch.setattr(module, name, lambda *_, **__: None)

    def call(*words: object) -> tuple[int, str, str]:
        code = main(["reach", *map(str, words)])
        said = capfd.readouterr()
        assert code != 1, said.err
        return code, said.out, said.err

    return call


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The arm of NICU, learned with its orientation from 150 movements."""
    path = tmp_path_factory.mktemp("reach") / "run"
    words = ["reach", "nicu", "--samples=150", "--noise", "1mm", "5mrad", *SMALL, "--out", str(path), "--json"]
    assert main(words) == 0
    return path


def learned(folder: Path) -> BodySkill:
    skill = toddle.load_skill(folder)
    assert isinstance(skill, BodySkill)
    return skill


def test_it_leaves_figures_pictures_and_a_skill(folder):
    names = {path.name for path in folder.iterdir()}
    assert names >= {"skill.json", "skill.safetensors", "movements.json", "figures.json", "config.json", "points.json",
                     "explored.png", "fixed.png", "expected.png", "misses.png"}  # fmt: skip
    figures = json.loads((folder / "figures.json").read_text())
    assert set(figures) >= DOCUMENTED | {"orientation_error_p99_mrad"}
    assert figures["method"] == "screws"
    assert figures["movements"] == 150
    assert len(figures["after_looks_p99_mm"]) == 6
    assert figures["open_loop_error_p99_mm"] < 1.5
    assert figures["orientation_error_p99_mrad"] < 10


def test_the_figures_are_those_of_the_true_body(folder):
    skill, body = toddle.load_skill(folder), toddle.load("nicu")
    assert isinstance(body, Body)
    reached, _ = truth(body, skill.predict(skill.targets))
    errors = np.linalg.norm(reached - skill.targets, axis=1)
    figures = json.loads((folder / "figures.json").read_text())
    assert 1000 * errors.mean() == pytest.approx(figures["fixed_error_mean_mm"], rel=1e-6)


def test_json_is_one_object_and_nothing_else(reach, tmp_path):
    code, out, err = reach("planar:2", "--samples=40", *SMALL, "--out", tmp_path / "run", "--json")
    assert code == 0
    assert set(json.loads(out)) >= DOCUMENTED
    assert "so its axes are looked for" in err


def test_the_same_seed_gives_the_same_body(reach, tmp_path):
    for name in ("a", "b"):
        assert reach("planar:2", "--samples=40", "--noise=1mm", *SMALL, "--out", tmp_path / name)[0] == 0
    one, other = (read_record(tmp_path / name, "skill", "skill")[1] for name in ("a", "b"))
    assert one.keys() == other.keys()
    assert all(np.array_equal(one[name], other[name]) for name in one)


def test_a_longer_run_keeps_its_movements(reach, tmp_path):
    assert reach("planar:2", "--samples=40", "--noise=1mm", *SMALL, "--out", tmp_path / "part")[0] == 0
    before = learned(tmp_path / "part").experience
    assert reach("--resume", tmp_path / "part", "--samples=60")[0] == 0
    after = learned(tmp_path / "part").experience
    assert len(after.q) == 60
    np.testing.assert_array_equal(after.q[:40], before.q)
    np.testing.assert_allclose(after.x[:40], before.x, atol=1e-15)
    code, _, err = reach("--resume", tmp_path / "part", "--samples=60")
    assert code == 2
    assert "--samples" in err


def test_it_answers_with_a_verdict(reach, folder):
    target = json.loads((folder / "points.json").read_text())["fixed"][3]["position_m"]
    code, out, _ = reach("--skill", folder, "--target", *target, "--json")
    answer = json.loads(out)
    assert code == 0
    assert answer["verdict"] == "reached"
    assert answer["expected_error_mm"] <= answer["expected_error_90_mm"]
    body = toddle.load("nicu")
    assert isinstance(body, Body)
    reached, _ = truth(body, np.array([list(answer["joints"].values())]))
    assert np.linalg.norm(reached[0] - target) < 2e-3


def test_poses_and_choices(reach, folder):
    skill = learned(folder)
    model = skill.fit.model
    assert isinstance(model, Rigid)
    pose = model.pose(skill.home[None])[0]
    w = np.sqrt(1 + np.trace(pose[:3, :3])) / 2
    turn = pose[:3, :3]
    vector = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (4 * w)
    ask = ("--skill", folder, "--target", *pose[:3, 3], "--json")
    code, out, _ = reach(*ask, "--orientation", w, *vector)
    assert code == 0
    found = np.array(list(json.loads(out)["joints"].values()))
    np.testing.assert_allclose(model.pose(found[None])[0], pose, atol=1e-3)
    code, out, _ = reach(*ask, "--near", *skill.home, "--looks=0")
    assert code == 0
    np.testing.assert_allclose(list(json.loads(out)["joints"].values()), skill.home, atol=1e-3)
    code, out, _ = reach(*ask, "--solutions=3")
    assert code == 0
    assert 1 <= len(json.loads(out)["solutions"]) <= 3


def test_out_of_reach_names_the_nearest_point(reach, folder):
    code, out, err = reach("--skill", folder, "--target", 3, 0, 0.6, "--json")
    assert code == 2
    answer = json.loads(out)
    assert answer["verdict"] == "out of reach"
    assert len(answer["nearest_m"]) == 3
    assert "out of reach" in err


def test_a_lock_is_noticed_named_and_drawn(reach, tmp_path):
    words = ("nicu", "--samples=150", "--noise=1mm", *SMALL, "--out", tmp_path / "run", "--json")
    code, out, err = reach(*words, "--damage", "lock:elbow_y@170")
    assert code == 0
    figures = json.loads(out)
    assert figures["damage_false_alarms"] == 0
    assert figures["damage_noticed_after_movements"] <= 3
    assert figures["damage_said"] == "the body changed: elbow_y is locked"
    assert "elbow_y is locked" in err
    assert (tmp_path / "run" / "damage.png").stat().st_size > 5000


def test_recorded_movements_correct_a_description(reach, tmp_path):
    body, rng = toddle.load("nicu"), np.random.default_rng(0)
    assert isinstance(body, Body)
    q = rng.uniform(np.asarray(body.lower), np.asarray(body.upper), (60, 4))
    x = truth(body, q)[0] + 1e-3 * rng.normal(size=(60, 3))
    log = tmp_path / "movements.csv"
    rows = [",".join([*body.joints, "x", "y", "z"]), *(",".join(map(str, row)) for row in np.hstack([q, x]))]
    log.write_text("\n".join(rows))
    code, out, _ = reach("nicu", "--from", log, "--out", tmp_path / "run", "--json")
    assert code == 0
    figures = json.loads(out)
    assert figures["method"] == "corrected"
    assert figures["held_out_error_mean_mm"] < 3
    assert figures["changes"]
    code, out, err = reach("--from", log, "--no-model", "--method=screws", "--out", tmp_path / "alone", "--json")
    assert code == 0, err
    assert json.loads(out)["method"] == "screws"
    assert toddle.load_skill(tmp_path / "alone").joints == body.joints


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("nicu", "--noise", "1"), "--noise: '1' is no length or angle"),
        (("nicu", "--noise", "1mm", "2mm"), "given twice"),
        (("nicu", "--noise", "-1mm"), "out of range"),
        (("nicu", "--method", "screwz"), "known: "),
        (("nicu", "--samples", "5"), "movements"),
        (("nicu", "--damage", "lock:knee@500"), "knee"),
        (("nicu", "--damage", "lock:elbow_y@20"), "still being learned"),
        (("nicu", "--damage", "lock:elbow_y"), "damage"),
        (("nicu", "--to", "skill.txt"), "skill.txt"),
        (("nicu", "--plant", "physics", "--pose"), "--pose"),
        (("--from", "none.csv"), "--no-model"),
        (("nicu", "--from", "none.csv"), "no such file"),
        (("nicu", "--from", "none.csv", "--no-model"), "leave one of them out"),
        (("bha", "--pose", "--samples", "300", "--to-urdf", "body.urdf"), "no rigid links"),
    ],
)
def test_a_wrong_call_is_one_line_and_leaves_nothing(reach, tmp_path, monkeypatch, words, told):
    monkeypatch.chdir(tmp_path)
    code, out, err = reach(*words)
    assert code == 2
    assert out == ""
    assert told in err.strip().splitlines()[-1]
    assert not list(tmp_path.iterdir())
