"""What a walk leaves: figures with known answers, the trajectory's table, pictures, films."""

from __future__ import annotations

import io
import math
import os
import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from toddle.failures import ToddleError
from toddle.outside import walk_pictures
from toddle.outside.teleoperation.panel import Panel, Status, frame_of, line_of
from toddle.outside.video import Film
from toddle.outside.walk_figures import figures_of, mean_velocity
from toddle.outside.walk_record import MeasuredRecord, Record, TrueRecord, record_of_pattern, standing
from toddle.outside.walk_trajectory import write_trajectory
from toddle.robots.gait import Gait
from toddle.robots.humanoids.gaits import DOCUMENT
from toddle.signals import Circle, Footstep, Velocity
from toddle.walk.pattern.document import Document
from toddle.walk.pattern.trajectory import walk_pattern

GAIT = Gait(com_height=0.45, foot_distance=0.14, foot_length=0.2, foot_width=0.1, foot_ahead=0.03)
STEPS = DOCUMENT["hrp2"]


def made(velocity: Velocity, seconds: float = 60.0, *, off: float = 1.0, zmp_off: float = 0.02) -> Record:
    """A walk whose figures are known: it moves ``off`` times as fast as it is told, and sways."""
    t = np.arange(1, round(seconds * 100) + 1) / 100
    n, yaw = len(t), off * velocity.omega * t
    command = np.tile(velocity, (n, 1))
    sway = 0.03 * np.sin(2 * np.pi * t / 1.2)
    place = np.cumsum(np.stack([np.cos(yaw), np.sin(yaw)]) * off * velocity.vx * 0.01, axis=1)
    waist = np.column_stack([*(place + sway * np.stack([-np.sin(yaw), np.cos(yaw)])), yaw])
    zmp = np.zeros((n, 2))
    measured = MeasuredRecord(
        np.zeros((n, 3)), np.zeros((n, 3)), zmp + np.array([zmp_off, 0.0]), np.zeros((n, 2, 4)), yaw, off * command,
        np.zeros((n, 2)), np.zeros(n),
    )  # fmt: skip
    return Record(
        t, command, command, np.zeros((n, 3, 3)), zmp, np.zeros((n, 3)), np.zeros((n, 2, 4)), np.zeros((n, 2, 4)),
        np.zeros((n, 2, 4)), np.zeros((n, 2)), np.full(n, -1), np.full(n, 0.1), measured,
        np.array([1.0, 2.0, 9.0]), ("solved", "late", "solved"), False, TrueRecord(t[9::10], waist[9::10]),
    )  # fmt: skip


def test_figures_of_a_walk_with_known_ones() -> None:
    figures = figures_of(made(Velocity(0.1, 0.0, 0.1), off=0.98), GAIT, until=60.0, wall=6.0)
    assert figures["velocity_error_percent"] == pytest.approx(2.0)
    assert figures["yaw_rate_error_percent"] == pytest.approx(2.0)
    assert figures["true_velocity_error_percent"] == pytest.approx(2.0, abs=0.1)
    assert figures["true_yaw_rate_error_percent"] == pytest.approx(2.0, abs=0.01)
    assert (figures["zmp_error_mean_cm"], figures["zmp_error_std_cm"]) == (pytest.approx(2.0), pytest.approx(0.0))
    assert figures["distance_m"] == pytest.approx(0.098 * 60, rel=1e-3)
    assert (figures["nmpc_ms_median"], figures["fallbacks"]) == (2.0, 1)
    assert figures["plans"] == {"solved": 2, "late": 1}
    assert figures["real_time_factor"] == pytest.approx(10.0)


def test_only_the_last_forty_seconds_count() -> None:
    record = made(Velocity(0.1, 0.0, 0.0))
    measured = record.measured
    assert measured is not None
    measured.velocity[: 20 * 100 - 1] = 0.0
    assert figures_of(record, GAIT, until=60.0, wall=1.0)["velocity_error_percent"] == pytest.approx(0.0, abs=1e-9)
    measured.velocity[: 30 * 100] = 0.0
    assert figures_of(record, GAIT, until=60.0, wall=1.0)["velocity_error_percent"] == pytest.approx(25.0, abs=0.1)


def test_what_cannot_be_told_is_null() -> None:
    standing_still = figures_of(made(Velocity(0.0, 0.0, 0.0)), GAIT, until=60.0, wall=1.0)
    straight = figures_of(made(Velocity(0.1, 0.0, 0.0)), GAIT, until=60.0, wall=1.0)
    short = figures_of(made(Velocity(0.1, 0.0, 0.0), 6.0), GAIT, until=6.0, wall=1.0)
    changing = made(Velocity(0.1, 0.0, 0.0))
    changing.allowed[4000:] = 0.05
    assert standing_still["velocity_error_percent"] is standing_still["yaw_rate_error_percent"] is None
    assert straight["velocity_error_percent"] is not None
    assert straight["yaw_rate_error_percent"] is None
    assert short["velocity_error_percent"] is None
    assert figures_of(changing, GAIT, until=60.0, wall=1.0)["velocity_error_percent"] is None


@given(
    velocity=st.builds(Velocity, st.floats(-0.3, 0.3), st.floats(-0.1, 0.1), st.floats(-0.3, 0.3)),
    stride=st.floats(1.1, 1.3),
    seconds=st.floats(6.0, 40.0),
)
def test_the_mean_velocity_of_a_swaying_circle_is_its_own(velocity: Velocity, stride: float, seconds: float) -> None:
    """On a circle with known speed; strides are up to 8 % longer or shorter than the gait says."""
    t = np.arange(0.0, seconds, 0.1)
    yaw = velocity.omega * t + 0.03 * np.sin(2 * np.pi * t / stride)
    turned = velocity.omega * t
    rate = velocity.omega if abs(velocity.omega) > 1e-9 else 1e-9
    along, across = np.sin(rate * t) / rate, (1 - np.cos(rate * t)) / rate
    x, y = velocity.vx * along - velocity.vy * across, velocity.vx * across + velocity.vy * along
    sway = 0.03 * np.cos(2 * np.pi * t / stride)
    place = np.column_stack([x - np.sin(turned) * sway, y + np.cos(turned) * sway, yaw])
    assert mean_velocity(t, place, 1.2) == pytest.approx(velocity, abs=4e-3)


@pytest.fixture(scope="module")
def pattern() -> Record:
    velocity = Velocity(0.1, 0.0, 0.05)
    walked = walk_pattern(Document(STEPS), STEPS, lambda _: velocity, 60)
    return record_of_pattern(walked, STEPS, [velocity] * 60)


def test_a_pattern_is_recorded_as_a_walk_is(pattern: Record) -> None:
    assert len(pattern.t) == len(pattern.allowed) == len(pattern.support) == 1400
    down = standing(pattern.feet, pattern.feet_velocity)
    assert down.any(axis=1).all()  # one foot stands at any time
    for side in (0, 1):
        assert down[pattern.support == side, side].all()  # the one that is said to carry, among them
    assert down[pattern.support == -1].all()
    assert set(pattern.allowed[:200, 0]) == {0.0}
    assert set(pattern.allowed[200:, 0]) == {0.1}


def test_the_stands_of_a_walk_are_its_footsteps(pattern: Record) -> None:
    found = walk_pictures.stands(pattern)
    sides = [stand.step.side for stand in found]
    assert sides[2:] == [1 - side for side in sides[3:]] + sides[-1:]
    assert set(pattern.plan_status) == {"solved"}
    for stand in found:
        place = pattern.feet[stand.first : stand.last + 1, stand.step.side]
        assert np.ptp(place, axis=0).max() < 1e-9
        assert place[0, [0, 1, 3]] == pytest.approx(stand.step[1:])


@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=4, max_size=12, unique=True))
def test_a_hull_holds_all_points_and_turns_one_way(points: list[tuple[float, float]]) -> None:
    corners = walk_pictures.hull(np.array(points))
    along = np.roll(corners, -1, axis=0) - corners
    for point in points:
        away = np.array(point) - corners
        assert (along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0] >= -1e-9).all()


def test_a_soles_corners_are_turned_with_it() -> None:
    corners = walk_pictures.sole_corners(Footstep(0, 1.0, 2.0, math.pi / 2), GAIT)
    assert corners.min(axis=0) == pytest.approx([1.0 - 0.05, 2.0 + 0.03 - 0.1])
    assert corners.max(axis=0) == pytest.approx([1.0 + 0.05, 2.0 + 0.03 + 0.1])


def test_pictures_of_every_kind_of_walk(pattern: Record, tmp_path: Path) -> None:
    for number, record in enumerate((pattern, made(Velocity(0.1, 0.0, 0.1), 3.0))):
        walk_pictures.footprints(tmp_path / f"a{number}.png", record, STEPS, (Circle(1.0, 0.5, 0.2),), title="a")
        walk_pictures.feet_over_time(tmp_path / f"b{number}.png", record, title="b")
        walk_pictures.zmp_error(tmp_path / f"c{number}.png", record, title="c")
        walk_pictures.velocity_tracking(tmp_path / f"d{number}.png", record, title="d")
    assert len(os.listdir(tmp_path)) == 8


def test_a_walk_of_one_tick_without_a_step_has_figures_and_a_table(tmp_path: Path) -> None:
    record = made(Velocity(0.1, 0.0, 0.0), 0.01)
    figures = figures_of(record, GAIT, until=0.01, wall=0.0)
    assert (figures["distance_m"], figures["real_time_factor"]) == (0.0, None)
    write_trajectory(tmp_path / "t.parquet", record)
    assert pq.read_table(tmp_path / "t.parquet").num_rows == 1


def test_the_table_holds_the_numbers(pattern: Record, tmp_path: Path) -> None:
    write_trajectory(tmp_path / "t.parquet", pattern)
    assert os.listdir(tmp_path) == ["t.parquet"]
    table = pq.read_table(tmp_path / "t.parquet")
    assert not any(name.endswith("_measured") for name in table.column_names)
    assert table["com_y_velocity"].to_numpy().tobytes() == pattern.com[:, 1, 1].tobytes()
    assert table["right_yaw"].to_numpy().tobytes() == pattern.feet[:, 1, 3].tobytes()
    with pytest.raises(ToddleError, match="can't be written"):
        write_trajectory(tmp_path / "nowhere" / "t.parquet", pattern)


def test_a_film_holds_its_pictures(tmp_path: Path) -> None:
    with_colours = [np.full((48, 64, 3), shade, np.uint8) for shade in range(0, 250, 10)]
    film = Film(tmp_path / "a.mp4", 25)
    for picture in with_colours:
        film.add(picture)
    assert not (tmp_path / "a.mp4").exists()  # whole or not at all
    film.close()
    assert os.listdir(tmp_path) == ["a.mp4"]
    words = ("-i", str(tmp_path / "a.mp4"), "-f", "rawvideo", "-pix_fmt", "rgb24", "-")
    seen = subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), *words], capture_output=True, check=True, timeout=60).stdout
    shades = np.frombuffer(seen, np.uint8).reshape(-1, 48 * 64 * 3).mean(axis=1)
    assert shades == pytest.approx([picture.mean() for picture in with_colours], abs=4)


def test_a_film_that_is_dropped_or_empty_leaves_nothing(tmp_path: Path) -> None:
    film = Film(tmp_path / "a.mp4", 25)
    film.add(np.zeros((48, 64, 3), np.uint8))
    with pytest.raises(ValueError, match="a picture of"):
        film.add(np.zeros((50, 64, 3), np.uint8))
    film.drop()
    Film(tmp_path / "b.mp4", 25).close()
    assert os.listdir(tmp_path) == []


STATUS = Status(
    12.3, Velocity(0.3, 0.0, 0.1), Velocity(0.2, 0.0, 0.1), Velocity(0.19, 0.01, 0.11), 0.021, 0, "late", 1.01, 1.5
)


def test_a_status_says_all_of_it(capsys: pytest.CaptureFixture[str]) -> None:
    line = line_of(STATUS)
    for part in ("12 s", "1.50 m", "+0.30", "+0.19", "2.1 cm", "left", "1.0x", "late"):
        assert part in line
    with Panel("robot", "keys") as panel:  # no terminal: one line, and no more than one every two seconds
        panel.tell(STATUS)
        panel.tell(STATUS)
    assert capsys.readouterr().err == line + "\n"


def test_a_status_without_contact_or_steps_is_shown_too() -> None:
    unknown = Velocity(math.nan, math.nan, math.nan)
    status = Status(0.0, unknown, unknown, unknown, math.nan, -1, "-", 0.0, 0.0)
    console = Console(file=io.StringIO(), width=100)
    console.print(frame_of("robot", "keys", status))
    shown = console.file.getvalue()  # type: ignore[attr-defined]
    assert "no contact" in shown
    assert "both" in shown
