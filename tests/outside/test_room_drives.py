"""Drives through rooms in physics: how they end, what is recorded of them, and the figures of many."""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.navigate.cloning.expert import Expert
from toddle.navigate.cloning.recording import RoomKey
from toddle.navigate.driver import Driver, Timed
from toddle.navigate.scenarios import draw_rooms
from toddle.navigate.scenarios.rooms import Room
from toddle.navigate.scenarios.starts import DRAWN, Start, seen_from
from toddle.navigate.task import Outcome
from toddle.outside.navigation.physics_batch import Recipe, same
from toddle.outside.navigation.room_batch import Judged, keys, run_rooms
from toddle.outside.navigation.room_eyes import EyeOptions, Eyes
from toddle.outside.navigation.room_judging import BINS, command_entropy, figures_of
from toddle.outside.navigation.room_pictures import room_paths
from toddle.outside.navigation.room_policies import is_cloned
from toddle.outside.navigation.room_run import RoomFinish, RoomRules, run_room
from toddle.outside.simulation.rooms import room_simulation
from toddle.robots.humanoid import Humanoid
from toddle.robots.humanoids import load_humanoid
from toddle.signals import STILL, Velocity
from toddle.walk.walker import Walker, walker

CAST = EyeOptions("cast")


@functools.cache
def heicub() -> Humanoid:
    return load_humanoid("heicub")


@functools.cache
def legs() -> Walker:
    return walker(heicub())


def near(room: Room, away: float) -> Start:
    """So far from the target, on the straight way to it, facing it."""
    x, y = room.target.x, room.target.y
    share = 1.0 - away / math.hypot(x, y)
    return Start(share * x, share * y, math.atan2(y, x))


def drive(driver: Driver, room: Room, away: float, seconds: float = 90.0, eyes: EyeOptions | None = None) -> RoomFinish:
    rules = RoomRules(seconds=seconds)
    return run_room(heicub(), driver, room, start=near(room, away), rules=rules, eyes=eyes, before=legs())[0]


ROOM = draw_rooms.room("straight", "train", 1)


def always(velocity: Velocity) -> Timed:
    return Timed(lambda t: velocity, 0.2)


def test_the_expert_stops_at_the_target_and_what_it_saw_is_recorded_in_the_drawn_frame() -> None:
    start = near(ROOM, 1.0)
    finish, recording = run_room(
        heicub(), Expert(), ROOM, seed=7, start=start, eyes=CAST, teacher=Expert(), called="expert", before=legs()
    )
    assert finish.outcome == Outcome.WON
    assert finish.touched == ""
    assert recording is not None
    assert recording.room == RoomKey("straight", "train", "seen", 1)
    assert (recording.driver, recording.seed, recording.outcome) == ("expert", 7, Outcome.WON)
    looks = len(recording.t)
    assert recording.t == pytest.approx(0.2 * np.arange(looks))
    assert recording.picture.shape == (looks, 60, 80, 3)
    assert recording.depth.shape == (looks, 60, 80)
    assert recording.taught == pytest.approx(recording.asked)
    assert finish.asked == pytest.approx(recording.asked)
    assert (recording.asked[-5:] == 0).all()
    assert recording.place[0] == pytest.approx(np.array(start), abs=0.03)
    assert recording.circles[:, : len(ROOM.standing)] == pytest.approx(
        np.broadcast_to(ROOM.circles[: len(ROOM.standing)], (looks, len(ROOM.standing), 3))
    )
    assert (recording.pixels[:, 0] > 50).all()
    left = np.hypot(*(finish.path[-1, 1:3] - ROOM.circles[0, :2]))
    assert 0.25 < left <= 0.6
    assert len(finish.inference_ms) == looks
    assert (finish.inference_ms > 0).all()
    assert finish.shortest == pytest.approx(seen_from(ROOM, start).shortest)
    assert 0.3 < finish.spl <= 1.0
    assert 0.0 < finish.clearance < 1.0


def test_who_stands_near_enough_wins_where_it_is_and_elsewhere_is_late() -> None:
    assert drive(always(STILL), ROOM, 0.5).outcome == Outcome.WON
    assert drive(Timed(lambda t: None, 0.2), ROOM, 0.5).outcome == Outcome.WON
    assert drive(Timed(lambda t: None, 0.2), ROOM, 1.2).outcome == Outcome.LATE
    late = drive(always(STILL), ROOM, 1.2, seconds=3.0)
    assert late.outcome == Outcome.LATE
    assert late.seconds == pytest.approx(3.0, abs=0.11)
    assert late.spl == 0.0


def test_who_never_asks_to_stand_is_late_and_who_walks_on_collides() -> None:
    spins = drive(always(Velocity(0.0, 0.0, 0.2)), ROOM, 0.5, seconds=4.0)
    assert spins.outcome == Outcome.LATE
    through = drive(always(Velocity(0.2, 0.0, 0.0)), ROOM, 0.6, seconds=30.0)
    assert (through.outcome, through.touched) == (Outcome.COLLIDED, "extinguisher")
    away = Start(*near(ROOM, 0.8)[:2], near(ROOM, 0.8).yaw + math.pi)
    empty = draw_rooms.room("straight", "train", 1)
    hit = run_room(heicub(), always(Velocity(0.3, 0.0, 0.0)), empty, start=away, before=legs())[0]
    assert hit.outcome == Outcome.COLLIDED
    assert hit.touched in {"wall", *(thing.kind for thing in empty.things)}


def test_the_teacher_speaks_while_another_drives() -> None:
    asked = Velocity(0.05, 0.0, -0.1)
    finish, recording = run_room(
        heicub(), always(asked), ROOM, eyes=CAST, teacher=Expert(), rules=RoomRules(seconds=2.0), before=legs()
    )
    assert finish.outcome == Outcome.LATE
    assert recording is not None
    assert recording.asked == pytest.approx(np.broadcast_to(np.array(asked), recording.asked.shape))
    assert recording.taught[0, 0] > 0.1
    assert recording.velocity[0] == pytest.approx(np.zeros(3))
    assert recording.velocity[-1] == pytest.approx(np.array(asked))


def test_the_same_drive_is_the_same_again() -> None:
    rules = RoomRules(seconds=1.5)
    one, two = (run_room(heicub(), Expert(), ROOM, seed=3, eyes=CAST, rules=rules, before=legs())[1] for _ in range(2))
    assert one is not None
    assert two is not None
    assert (one.picture == two.picture).all()
    assert (one.depth == two.depth).all()
    assert (one.asked == two.asked).all()
    assert (one.place == two.place).all()


def test_eyes_see_stereo_depth_that_is_about_true() -> None:
    room = draw_rooms.room("obstacle", "train", 2)
    simulation = room_simulation(heicub(), room)
    eyes, clean = Eyes(simulation, room, EyeOptions(), 0), Eyes(simulation, room, EyeOptions("cast", 0.0, 0.0, 0.0), 0)
    try:
        seen, true = eyes.see(), clean.see()
    finally:
        eyes.close()
    close = (seen.depth > 0) & (true.depth > 0) & (true.depth < 2.5)
    assert close.mean() > 0.3
    assert np.abs(seen.depth - true.depth)[close].mean() < 0.15
    holes = EyeOptions("cast", holes=0.3)
    assert 0.2 < (Eyes(simulation, room, holes, 0).see().depth == 0).mean() < 0.5


@pytest.mark.parametrize("bad", [{"noise": -1.0}, {"light": 2.0}, {"holes": math.nan}])
def test_eyes_that_nobody_has_are_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(BadInput, match=next(iter(bad))):
        EyeOptions(**bad)


def test_many_drives_one_by_one_until_somebody_stops_them(tmp_path: Path) -> None:
    rooms = keys(2, ("straight", "curve"), "validation")
    assert [(key.scenario, key.number) for key in rooms] == [
        ("straight", 0), ("curve", 0), ("straight", 1), ("curve", 1)
    ]  # fmt: skip
    how = Judged(Recipe(same, (always(STILL),)), rules=RoomRules(seconds=0.5))
    told: list[int] = []
    found = run_rooms(
        how, rooms, processes=1, progress=lambda number, _: told.append(number), stopped=lambda: len(told) > 1
    )
    assert told == [0, 1]
    assert found[2:] == (None, None)
    finishes = [drive.finish for drive in found if drive is not None]
    figures = figures_of(finishes)
    assert (figures["episodes"], figures["success_rate"], figures["late"]) == (2, 0.0, 2)
    assert figures["straight"]["episodes"] == figures["curve"]["episodes"] == 1
    assert "search" not in figures
    room_paths(tmp_path / "paths.png", finishes, [(1.0, 0.0), (2.0, 1.0)], title="two")
    assert (tmp_path / "paths.png").stat().st_size > 1000


@given(st.integers(1, 40), st.integers(1, 5))
def test_entropy_of_evenly_spread_velocities_is_the_logarithm_of_their_number(count: int, each: int) -> None:
    middles = np.repeat((BINS[:-1] + BINS[1:])[:count] / 2, each)
    assert command_entropy(middles) == pytest.approx(math.log(count), abs=1e-9)
    assert command_entropy(np.concatenate([middles, np.full(10_000, middles[0])])) <= math.log(count) + 1e-9


def test_a_folder_tells_whether_its_policy_was_cloned(tmp_path: Path) -> None:
    assert not is_cloned(tmp_path)
    for text, wanted in (("{", False), ('{"format": "toddle policy"}', False), ('{"format": "toddle cloned"}', True)):
        (tmp_path / "policy.json").write_text(text)
        assert is_cloned(tmp_path) is wanted


def test_the_drawn_start_is_the_origin() -> None:
    assert tuple(DRAWN) == (0.0, 0.0, 0.0)
