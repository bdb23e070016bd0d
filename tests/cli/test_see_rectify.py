"""``toddle see rectify``: what it leaves and prints, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from toddle.cli import main
from toddle.geometry.camera import Pinhole, StereoCameras
from toddle.outside.seeing.camera_files import write_cameras
from toddle.outside.seeing.picture_files import read_picture, write_picture
from toddle.see.rectify import rectification

REAL = Path(__file__).parents[3] / "shared" / "data" / "huber2019"
FILES = {"left.png", "right.png", "rectified.png", "figures.json"}


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    """Two pictures of something far away by straight cameras, the right one tilted by 2 degrees, and their file."""
    rng = np.random.default_rng(0)
    size = (320, 240)
    light = sum(cv2.resize(rng.normal(size=(240 // n, 320 // n)), size) * n for n in (2, 5, 12))
    far = np.clip(128 + 45 * light / np.std(light), 5, 250).astype(np.uint8)
    camera = Pinhole(*size, 236.0, 236.0, 159.5, 119.5)
    tilt, _ = cv2.Rodrigues(np.deg2rad(np.array([2.0, 0.0, 0.5])))
    cameras = StereoCameras(camera, camera, tilt, tilt @ np.array([-0.068, 0.0, 0.0]))
    homography = camera.matrix @ tilt @ np.linalg.inv(camera.matrix)
    write_picture(tmp_path / "l.png", far)
    write_picture(tmp_path / "r.png", cv2.warpPerspective(far, homography, size).astype(np.uint8))
    write_cameras(tmp_path, cameras, rectification(cameras))
    return tmp_path


def called(pair: Path, *words: str) -> list[str]:
    return ["see", "rectify", str(pair / "l.png"), str(pair / "r.png"), "--cameras", str(pair / "left.yaml"), *words]


def test_it_rectifies_and_leaves_pictures(pair: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(called(pair, "--out", str(pair / "out"), "--json")) == 0
    told = json.loads(capsys.readouterr().out)
    assert {path.name for path in (pair / "out").iterdir()} == FILES
    assert told["rectified_before"] is False
    assert told["rows_apart_as_taken_px"] > 5
    assert told["rows_apart_median_px"] < 0.3
    assert told["baseline_m"] == pytest.approx(0.068)
    left, right = (read_picture(pair / "out" / name) for name in ("left.png", "right.png"))
    middle = np.abs(left.astype(float) - right)[60:180, 80:240]  # so far away that the two are the same
    assert np.median(middle) < 12

    for name in ("l", "r"):
        side = {"l": "left", "r": "right"}[name]
        write_picture(pair / f"{name}.png", read_picture(pair / "out" / f"{side}.png"))
    assert main(called(pair, "--out", str(pair / "again"), "--json")) == 0
    assert json.loads(capsys.readouterr().out)["rectified_before"] is True


def test_it_is_told_what_the_pictures_do_not_tell(pair: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("l.png", "r.png"):
        write_picture(pair / name, np.full((240, 320), 128, np.uint8))
    for word, told in (("--rectified", True), ("--no-rectified", False)):
        assert main(called(pair, word, "--out", str(pair / word), "--json")) == 0
        assert json.loads(capsys.readouterr().out)["rectified_before"] is told
    assert main(called(pair, "--no-rectified", "--out", str(pair / "out"))) == 0
    said = capsys.readouterr()
    assert "too little is seen" in said.err
    assert "rectified before" in said.out


def test_pictures_and_cameras_that_do_not_fit_are_refused(pair: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_picture(pair / "r.png", np.zeros((120, 160), np.uint8))
    assert main(called(pair)) == 2
    assert "160 x 120 on the right" in capsys.readouterr().err
    write_picture(pair / "l.png", np.zeros((120, 160), np.uint8))
    assert main(called(pair)) == 2
    assert "320 x 240 pixels, these have 160 x 120" in capsys.readouterr().err
    (pair / "left.yaml").write_text("pony")
    assert main(called(pair)) == 2
    assert "left.yaml" in capsys.readouterr().err
    assert main(["see", "rectify", str(pair / "nothing.png"), str(pair / "r.png"), "--cameras", "x.yaml"]) == 2
    assert "no such picture" in capsys.readouterr().err
    assert main(["see", "rectify", "l.png", "r.png"]) == 2
    assert "--cameras is missing" in capsys.readouterr().err


@pytest.mark.skipif(not REAL.exists(), reason="the document's pictures are not here")
def test_the_documents_pair_is_set_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [str(REAL / "l_rgb.png"), str(REAL / "r_rgb.png"), "--cameras", str(REAL / "cam_stereo.yaml")]
    assert main(["see", "rectify", *words, "--out", str(tmp_path / "out"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["rectified_before"] is True
    assert told["black_edges_overlap"] > 0.99
    assert told["rows_apart_median_px"] > 1.4
    assert told["unseen_rows_apart_median_px"] < 0.5
    assert told["straightened"] is True
    assert told["trouble"] == []
