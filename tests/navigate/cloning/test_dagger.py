"""Who drives when, and through which rooms."""

from __future__ import annotations

import pytest

from toddle.failures import BadInput
from toddle.navigate.cloning.dagger import MIX, Course, rooms_of


def test_no_room_is_driven_through_twice() -> None:
    rooms = [room for stage in Course().stages for room in rooms_of(stage)]
    assert len(rooms) == 192 + 6 * 72 == len(set(rooms))
    assert {room.split for room in rooms} == {"train"}


def test_every_scenario_has_its_share() -> None:
    rooms = [room.scenario for stage in Course(episodes=100).stages[:1] for room in rooms_of(stage)]
    assert {name: rooms.count(name) / 10 for name in set(rooms)} == {name: MIX.count(name) for name in set(MIX)}


def test_without_dagger_there_is_as_much_to_learn_from() -> None:
    with_, without = Course().stages, Course(dagger=False).stages
    assert [stage.driver for stage in with_] == ["expert"] + ["policy"] * 6
    assert [stage.driver for stage in without] == ["expert"]
    assert sum(stage.drives for stage in with_) == without[0].drives
    assert sum(stage.passes for stage in with_) == pytest.approx(without[0].passes, abs=6)
    one, other = ([room for stage in stages for room in rooms_of(stage)] for stages in (with_, without))
    assert one == other


def test_nothing_is_no_course() -> None:
    with pytest.raises(BadInput, match="too small"):
        Course(episodes=0)
