"""``toddle see calibrate``: what it leaves and prints, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from toddle.cli import main
from toddle.outside.seeing.camera_files import read_cameras
from toddle.outside.seeing.picture_files import write_picture
from toddle.see.chessboard import Chessboard
from toddle.see.painted_boards import misaligned, shown_boards

FILES = {
    "left.yaml", "right.yaml", "figures.json", "views.json", "corners.png", "rectified.png", "errors.png",
}  # fmt: skip


@pytest.fixture(scope="module")
def boards(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """26 pairs as a person takes them; one right picture is blurred by a moving head, one is no picture."""
    folder = tmp_path_factory.mktemp("boards")
    left, right = folder / "left", folder / "right"
    left.mkdir()
    right.mkdir()
    rng = np.random.default_rng(7)
    shown = shown_boards(misaligned(rng), Chessboard(), rng, near=0.28, far=0.5, spread=0.45)
    for number in range(26):
        pair = next(shown)
        blurred = cv2.filter2D(pair.right, -1, np.eye(9) / 9) if number == 5 else pair.right
        write_picture(left / f"left{number:02d}.png", pair.left)
        write_picture(right / f"right{number:02d}.png", blurred.astype(np.uint8))
    (left / "left90.png").write_bytes(b"no picture")
    (right / "right90.png").write_bytes(b"no picture")
    (left / "left91.png").write_bytes(b"alone")
    return left, right


def test_it_leaves_cameras_figures_and_pictures(
    boards: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    code = main(["see", "calibrate", *map(str, boards), "--out", str(out), "--json"])
    said = capsys.readouterr()
    told = json.loads(said.out)
    assert {path.name for path in out.iterdir()} == FILES
    assert told["folder"] == str(out)
    assert code == (0 if told["trusted"] else 1)
    assert told["reprojection_left_px"] < 0.1
    assert told["reprojection_right_px"] < 0.1
    assert abs(told["baseline_mm"] - 68) < 0.5
    assert told["held_out_rows_apart_px"] < 0.15
    assert "no picture" in told["dropped"]["90"]
    assert "no partner" in told["dropped"]["left91.png"]
    assert "05" in told["dropped"]
    assert told["used"] + told["held_out"] + len(told["dropped"]) == told["pairs"] == 28
    figures = json.loads((out / "figures.json").read_text())
    assert {**figures, "folder": str(out)} == told
    cameras = read_cameras(out, (320, 240)).cameras
    assert 1000 * cameras.baseline == pytest.approx(told["baseline_mm"], abs=1e-6)
    views = json.loads((out / "views.json").read_text())
    assert sum("left_px" in view for view in views.values()) == told["used"]


def test_a_board_whose_distance_is_said_wrongly_is_noticed(
    boards: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["see", "calibrate", *map(str, boards), "--known", "00", "--distance", "2", "--out", str(tmp_path / "out")]
    assert main(words) == 1
    said = capsys.readouterr()
    assert "not to be trusted: a board at 2.00 m is seen at 0." in said.err
    assert "held out" in said.out
    views = json.loads((tmp_path / "out" / "views.json").read_text())
    assert "00" not in views  # it judges, and calibrates nothing


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere", "right"], "no such folder"),
        (["left"], "RIGHT is missing"),
        (["left", "right", "--corners", "2", "6"], "--corners"),
        (["left", "right", "--corners", "8"], "--corners"),
        (["left", "right", "--square", "0"], "--square"),
        (["left", "right", "--known", "05"], "--distance belong together"),
        (["left", "right", "--known", "05", "--distance", "0"], "--distance"),
        (["left", "right", "--corners", "9", "7"], "found in 0 pairs"),
        (["left", "right", "--known", "pony", "--distance", "1"], "pony"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_left(
    boards: tuple[Path, Path], words: list[str], said: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    few = tmp_path / "few"
    for side in boards:
        (few / side.name).mkdir(parents=True)
        for path in sorted(side.iterdir())[:2]:
            (few / side.name / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(few)
    assert main(["see", "calibrate", *words]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert said in line
    assert not (few / "runs").exists()


def test_the_work_must_be_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["see"]) == 2
    assert main(["see", "calibrat"]) == 2
    assert "did you mean calibrate" in capsys.readouterr().err
    assert main(["see", "--help"]) == 0
    assert "rectify" in capsys.readouterr().out
