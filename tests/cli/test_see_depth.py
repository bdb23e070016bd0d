"""``toddle see depth``: what it leaves and prints, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from toddle.cli import main
from toddle.geometry.camera import Pinhole, StereoCameras
from toddle.outside.seeing.camera_files import write_cameras
from toddle.outside.seeing.picture_files import write_picture
from toddle.see.rectify import rectification

REAL = Path(__file__).parents[3] / "shared" / "data" / "huber2019"
DISPARITY = 12
DEPTH = 236.0 * 0.068 / DISPARITY


def wall(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A textured wall that faces the cameras, 12 pixels apart in both pictures."""
    rng = np.random.default_rng(seed)
    light = np.zeros((240, 400))
    for n in (2, 5, 12):
        light += cv2.resize(rng.normal(size=(240 // n, 400 // n)), (400, 240)) * n
    grey = np.clip(120 + 45 * light / np.std(light), 5, 248).astype(np.uint8)
    return grey[:, 20:340], grey[:, 20 + DISPARITY : 340 + DISPARITY]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three pairs, and the cameras' file."""
    camera = Pinhole(320, 240, 236.0, 236.0, 159.5, 119.5)
    cameras = StereoCameras(camera, camera, np.eye(3), np.array([-0.068, 0.0, 0.0]))
    write_cameras(tmp_path, cameras, rectification(cameras))
    for side in ("l", "r"):
        (tmp_path / side).mkdir()
    for number in range(3):
        for side, picture in zip(("l", "r"), wall(number), strict=True):
            write_picture(tmp_path / side / f"{number}.png", np.ascontiguousarray(picture))
    return tmp_path


def called(folder: Path, *words: str, name: str = "0.png") -> list[str]:
    pair = str(folder / "l" / name), str(folder / "r" / name)
    return ["see", "depth", *pair, "--cameras", str(folder / "left.yaml"), "--rectified", *words]


def test_a_pair_leaves_depth_in_millimetres(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "out"
    assert main(called(folder, "--out", str(out), "--json")) == 0
    told = json.loads(capsys.readouterr().out)
    assert {path.name for path in out.iterdir()} == {"depth.png", "depth_coloured.png", "figures.json"}
    depth = cv2.imread(str(out / "depth.png"), cv2.IMREAD_UNCHANGED)
    assert depth is not None
    assert depth.dtype == np.uint16
    assert np.median(depth[depth > 0]) == pytest.approx(1000 * DEPTH, rel=0.03)
    assert (depth > 0).mean() == pytest.approx(told["trusted_share"], abs=1e-6)
    assert told["trusted_share"] > 0.8
    assert told["depth_median_m"] == pytest.approx(DEPTH, rel=0.03)
    assert told["rectified_before"] is True
    assert told["trouble"] == []
    assert json.loads((out / "figures.json").read_text())["setting"] == "live"


def test_folders_and_every_stage(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "out"
    assert main(called(folder, "--setting", "document", "--stages", "--out", str(out), name="")) == 0
    assert "toddle:" not in capsys.readouterr().err
    told = json.loads((out / "figures.json").read_text())
    assert sorted(told["each"]) == ["0", "1", "2"]
    assert all(one["depth_median_m"] == pytest.approx(DEPTH, rel=0.03) for one in told["each"].values())
    names = {path.name for path in out.iterdir()}
    assert {"0_depth.png", "2_depth_coloured.png", "stages.png", "rectified.png", "stage_disparity.png"} <= names
    assert {"effect_of_N_and_D.png", "effect_of_lambda_and_sigma.png"} <= names


def test_trouble_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    left, right = wall(0)
    write_picture(folder / "l" / "0.png", np.ascontiguousarray(right))
    write_picture(folder / "r" / "0.png", np.ascontiguousarray(left))
    assert main(called(folder, "--no-straighten", "--out", str(folder / "swapped"))) == 0
    assert "swapped:" in capsys.readouterr().err
    for side, picture in (("l", left), ("r", right)):
        write_picture(folder / side / "0.png", np.ascontiguousarray(picture // 5))
    assert main(called(folder, "--out", str(folder / "dark"))) == 0
    assert "dark:" in capsys.readouterr().err


def test_what_can_not_be_used_is_refused_in_one_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "out"
    write_picture(folder / "r" / "1.png", np.zeros((120, 160), np.uint8))
    (folder / "l" / "2.png").write_bytes(b"pony")
    cases = [
        (called(folder, name="1.png"), "160 x 120"),
        (called(folder, name="2.png"), "no picture"),
        (called(folder, name="9.png"), "no such picture"),
        (called(folder, "--setting", "livid"), "did you mean live"),
        (called(folder, "--period", "0"), "--period"),
        (["see", "depth", str(folder / "l"), str(folder / "r" / "0.png"), "--cameras", "x.yaml"], "two folders"),
        (["see", "depth", "l.png", "r.png"], "--cameras is missing"),
    ]
    for words, told in cases:
        assert main([*words, "--out", str(out)]) == 2
        said = capsys.readouterr().err
        assert told in said
        assert len(said.splitlines()) == 1
        assert not out.exists()


@pytest.mark.skipif(not REAL.exists(), reason="the document's pictures are not here")
def test_the_documents_pair_has_depth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [str(REAL / "l_rgb.png"), str(REAL / "r_rgb.png"), "--cameras", str(REAL / "cam_stereo.yaml")]
    assert main(["see", "depth", *words, "--out", str(tmp_path / "out"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["rectified_before"] is True
    assert told["unseen_rows_apart_median_px"] < 0.5
    assert any(said.startswith("saturated") for said in told["trouble"])
    depth = cv2.imread(str(tmp_path / "out" / "depth.png"), cv2.IMREAD_UNCHANGED)
    assert depth is not None
    chair = depth[30:90, 240:310]  # the nearest of three, about a metre away
    assert 900 < np.median(chair[chair > 0]) < 1400
    assert ((depth > 0) & (depth < 800)).sum() < 0.001 * (depth > 0).sum()  # nothing is so near
