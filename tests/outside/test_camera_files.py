"""Cameras and pictures on disk: written and read back, foreign files read, hostile ones refused in one line."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.geometry.camera import Pinhole, StereoCameras
from toddle.outside.seeing.board_pictures import find_boards
from toddle.outside.seeing.camera_files import read_cameras, write_cameras
from toddle.outside.seeing.picture_files import Paired, paired, read_picture, write_picture
from toddle.see.chessboard import Chessboard
from toddle.see.painted_boards import misaligned
from toddle.see.rectify import rectification

REAL = Path(__file__).parents[3] / "shared" / "data" / "huber2019"
OPENCV = """\
%YAML:1.0
---
K1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 2.0e+02, 0., 160., 0., 2.1e+02, 120., 0., 0., 1. ]
K2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 2.2e+02, 0., 161., 0., 2.3e+02, 121., 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -4.5e-01, 2.9e-01, -2.7e-03, 2.0e-04, -1.2e-01 ]
D2: !!opencv-matrix
   rows: 1
   cols: 4
   dt: d
   data: [ -4.0e-01, 3.0e-01, 0., 0. ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]
T: [ -6.8e-02, 1.0e-03, -2.0e-03 ]
"""
KALIBR = """\
cam0:
  camera_model: pinhole
  intrinsics: [200.0, 210.0, 160.0, 120.0]
  distortion_model: radtan
  distortion_coeffs: [-0.3, 0.1, 0.001, -0.002]
  resolution: [320, 240]
  rostopic: /left
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.068]
  - [0.0, 1.0, 0.0, 0.001]
  - [0.0, 0.0, 1.0, 0.002]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  intrinsics: [220.0, 230.0, 161.0, 121.0]
  distortion_model: radtan
  distortion_coeffs: [-0.3, 0.1, 0.001, -0.002]
  resolution: [320, 240]
"""


def alike(one: StereoCameras, other: StereoCameras) -> bool:
    return (
        one.left == other.left
        and one.right == other.right
        and np.allclose(one.rotation, other.rotation, atol=1e-12)
        and np.allclose(one.translation, other.translation, atol=1e-12)
    )


@given(st.integers(0, 10_000))
def test_what_is_written_for_ros_is_read_again(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    folder = tmp_path_factory.mktemp("cameras")
    cameras = misaligned(np.random.default_rng(seed), degrees=3.0)
    made = rectification(cameras)
    left, right = write_cameras(folder, cameras, made)
    for path in (folder, left, right):
        found = read_cameras(path, (320, 240))
        assert alike(found.cameras, cameras)
        assert found.earlier is not None
        assert found.earlier.cameras.camera == made.cameras.camera
        assert np.allclose(found.earlier.right.source, made.right.source, atol=1e-3)


def test_what_ros_expects_is_in_the_file(tmp_path: Path) -> None:
    cameras = misaligned(np.random.default_rng(0))
    made = rectification(cameras)
    _, right = write_cameras(tmp_path, cameras, made)
    facts = yaml.safe_load(right.read_text())
    assert list(facts) == [
        "image_width", "image_height", "camera_name", "camera_matrix", "distortion_model", "distortion_coefficients",
        "rectification_matrix", "projection_matrix",
    ]  # fmt: skip
    projection = np.reshape(facts["projection_matrix"]["data"], (3, 4))
    assert projection[0, 3] == pytest.approx(-made.cameras.camera.fx * cameras.baseline)
    assert facts["distortion_model"] == "plumb_bob"


def test_opencvs_files_are_read(tmp_path: Path) -> None:
    path = tmp_path / "stereo.yaml"
    path.write_text(OPENCV)
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    found = read_cameras(path, (320, 240))
    assert np.array_equal(found.cameras.left.matrix, storage.getNode("K1").mat())
    assert found.cameras.right == Pinhole(320, 240, 220.0, 230.0, 161.0, 121.0, (-0.4, 0.3, 0.0, 0.0, 0.0))
    assert np.allclose(found.cameras.translation, [-0.068, 0.001, -0.002])
    assert found.earlier is None
    with pytest.raises(BadInput, match="how large the pictures are"):
        read_cameras(path)


def test_what_opencv_writes_is_read(tmp_path: Path) -> None:
    path = tmp_path / "stereo.yml"
    cameras = misaligned(np.random.default_rng(1))
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in (
        ("M1", cameras.left.matrix), ("D1", np.array([cameras.left.distortion])), ("M2", cameras.right.matrix),
        ("D2", np.array([cameras.right.distortion])), ("R", cameras.rotation), ("T", cameras.translation[:, None]),
    ):  # fmt: skip
        storage.write(name, value)
    storage.release()
    assert alike(read_cameras(path, (320, 240)).cameras, cameras)


def test_kalibrs_camchain_is_read(tmp_path: Path) -> None:
    path = tmp_path / "camchain.yaml"
    path.write_text(KALIBR)
    found = read_cameras(path).cameras
    assert found.left == Pinhole(320, 240, 200.0, 210.0, 160.0, 120.0, (-0.3, 0.1, 0.001, -0.002, 0.0))
    assert np.allclose(found.translation, [-0.068, 0.001, 0.002])
    with pytest.raises(BadInput, match="320 x 240 pixels, these have 640 x 480"):
        read_cameras(path, (640, 480))


@pytest.mark.skipif(not REAL.exists(), reason="the document's files are not here")
def test_the_documents_own_file_is_read() -> None:
    found = read_cameras(REAL / "cam_stereo.yaml", (320, 240))
    assert found.cameras.baseline == pytest.approx(0.06827, abs=1e-5)
    assert found.earlier is not None
    assert found.earlier.cameras.camera.fx == pytest.approx(234.37748, abs=1e-5)
    made = rectification(found.cameras)
    assert np.allclose(made.rotations[0] @ found.earlier.rotations[0].T, np.eye(3), atol=2e-3)
    with pytest.raises(BadInput, match="no pair of cameras"):
        read_cameras(REAL / "cam_left.yaml", (320, 240))


HOSTILE = {
    "empty": "",
    "no YAML": "a: [1, 2",
    "a list": "- 1\n- 2\n",
    "a number": "3",
    "runs code": "!!python/object/apply:os.system ['true']",
    "not text": "\x00\x01",
    "deep": "[" * 5000,
    "another thing": "name: pony\n",
    "a matrix of words": OPENCV.replace("2.0e+02", "'two'"),
    "too few numbers": OPENCV.replace("[ 2.0e+02, 0., 160.,", "[ 2.0e+02, 0.,"),
    "nan": OPENCV.replace("2.0e+02", ".nan"),
    "a focal length below 0": OPENCV.replace("2.0e+02", "-2.0e+02"),
    "skew": OPENCV.replace("2.0e+02, 0.", "2.0e+02, 5."),
    "huge rows": OPENCV.replace("rows: 3", "rows: 999999999999999999999"),
    "a scalar matrix": OPENCV.replace("K1: !!opencv-matrix\n   rows: 3", "K1: !!opencv-matrix x\nX:\n   rows: 3"),
    "no rotation": OPENCV.replace("[ 1., 0., 0., 0., 1.", "[ 2., 0., 0., 0., 1."),
    "mirrored": OPENCV.replace("[ 1., 0., 0., 0., 1.", "[ -1., 0., 0., 0., 1."),
    "millimetres": OPENCV.replace("-6.8e-02", "-68."),
    "no translation": OPENCV.partition("T:")[0],
    "one camera": KALIBR.partition("cam1:")[0],
    "a camera that is a word": KALIBR.partition("cam1:")[0] + "cam1: yes\n",
    "fisheye": KALIBR.replace("radtan", "equidistant"),
    "no size": KALIBR.replace("[320, 240]", "[320]"),
    "half a pixel": KALIBR.replace("[320, 240]", "[320.5, 240]"),
    "endless numbers": KALIBR.replace("200.0", "1e999"),
    "references without end": "a: &a [1,1,1,1,1,1,1,1,1]\n"
    + "".join(f"{n}: &{n} [{','.join(['*' + m] * 9)}]\n" for m, n in zip("abcdefghi", "bcdefghij", strict=True))
    + KALIBR.replace("[200.0, 210.0, 160.0, 120.0]", "*j").replace("[320, 240]", "*j"),
    "not a number of pixels": KALIBR.replace("[320, 240]", "[-320, 240]"),
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_hostile_camera_files_are_refused_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "cameras.yaml"
    path.write_text(text)
    with pytest.raises(BadInput) as fault:
        read_cameras(path, (320, 240))
    assert str(path) in fault.value.line
    assert "\n" not in fault.value.line
    assert fault.value.remedy


def test_ros_files_that_are_no_pair_are_refused(tmp_path: Path) -> None:
    cameras = misaligned(np.random.default_rng(0))
    left, right = write_cameras(tmp_path, cameras, rectification(cameras))
    kept = right.read_text()
    right.unlink()
    with pytest.raises(BadInput, match=r"right.yaml: there is no such file"):
        read_cameras(tmp_path)
    right.write_text(left.read_text())
    with pytest.raises(BadInput, match="no baseline"):
        read_cameras(left)
    right.write_text(kept.replace("plumb_bob", "equidistant"))
    with pytest.raises(BadInput, match="equidistant"):
        read_cameras(left)
    alone = tmp_path / "camera.yaml"
    alone.write_text(kept)
    with pytest.raises(BadInput, match="one camera of two"):
        read_cameras(alone)
    with pytest.raises(BadInput, match="no such file"):
        read_cameras(tmp_path / "nothing.yaml")


def test_pictures_are_written_and_read(tmp_path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 255, (5, 7, 3)).astype(np.uint8)
    write_picture(tmp_path / "a.png", picture)
    assert np.array_equal(read_picture(tmp_path / "a.png"), picture)


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89PNG\r\n\x1a\n" + bytes(60)])
def test_what_is_no_picture_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(BadInput, match="no picture"):
        read_picture(tmp_path / "a.png")
    with pytest.raises(BadInput, match="no such picture"):
        read_picture(tmp_path)


def named(folder: Path, *names: str) -> Path:
    folder.mkdir()
    for name in names:
        (folder / name).write_bytes(b"")
    return folder


@pytest.mark.parametrize(
    ("left", "right"),
    [
        (("left01.png", "left02.png"), ("right01.png", "right02.png")),
        (("a.png", "b.jpg"), ("a.png", "b.jpg")),
        (("l_1.png", "l_2.png"), ("r_1.png", "r_2.png")),
        (("1-Left.png", "2-Left.png"), ("1-Right.png", "2-Right.png")),
    ],
)
def test_pictures_are_paired_by_name(tmp_path: Path, left: tuple[str, ...], right: tuple[str, ...]) -> None:
    found = paired(named(tmp_path / "x", *left), named(tmp_path / "y", *right, "text.txt"))
    assert [(one.name, other.name) for _, one, other in found.pairs] == list(zip(left, right, strict=True))
    assert found.alone == ()


def test_pictures_without_a_partner_are_named(tmp_path: Path) -> None:
    found = paired(named(tmp_path / "x", "1.png", "2.png"), named(tmp_path / "y", "2.png", "3.png"))
    assert [name for name, *_ in found.pairs] == ["2"]
    assert [path.name for path in found.alone] == ["1.png", "3.png"]


def test_folders_that_hold_no_pairs_are_refused(tmp_path: Path) -> None:
    full = named(tmp_path / "x", "1.png")
    with pytest.raises(BadInput, match="no pictures"):
        paired(full, named(tmp_path / "empty"))
    with pytest.raises(BadInput, match="has a partner"):
        paired(full, named(tmp_path / "other", "2.png"))
    with pytest.raises(BadInput, match="no such folder"):
        paired(full, tmp_path / "nothing")
    with pytest.raises(BadInput, match="same picture"):
        paired(named(tmp_path / "both", "left1.png", "right1.png"), full)


def test_pictures_of_two_sizes_are_refused_and_damaged_ones_dropped(tmp_path: Path) -> None:
    for name, size in (("a", (40, 60)), ("b", (40, 60)), ("c", (30, 60))):
        write_picture(tmp_path / f"{name}.png", np.zeros(size, np.uint8))
    (tmp_path / "d.png").write_bytes(b"nothing")
    a, b, c, d = (tmp_path / f"{name}.png" for name in "abcd")
    found = find_boards(Paired((("1", a, b), ("2", a, d)), (c,)), Chessboard())
    assert found.views == ()
    assert found.size == (60, 40)
    assert [name for name, _ in found.dropped] == ["c.png", "1", "2"]
    with pytest.raises(BadInput, match="60 x 30 pixels, others 60 x 40"):
        find_boards(Paired((("1", a, b), ("2", a, c)), ()), Chessboard())
    with pytest.raises(BadInput, match="no picture can be read"):
        find_boards(Paired((("1", d, d),), ()), Chessboard())
