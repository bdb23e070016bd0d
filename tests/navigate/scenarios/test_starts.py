"""A room seen from another start is the same room."""

from __future__ import annotations

import math

import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.navigate.scenarios import draw_rooms
from toddle.navigate.scenarios.draw_rooms import BODY
from toddle.navigate.scenarios.raycast import SMALL, chest_eye, ray_caster
from toddle.navigate.scenarios.rooms import SCENARIOS, Scenario
from toddle.navigate.scenarios.starts import DRAWN, Start, drawn_places, seen_from, some_start


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_from_a_free_start_the_robot_sees_what_it_sees_there_in_the_room_as_drawn(scenario: Scenario) -> None:
    room = draw_rooms.room(scenario, "train", 3)
    start = some_start(room, np.random.default_rng(5))
    assert start != DRAWN
    there = seen_from(room, start)
    one = ray_caster(room).view(chest_eye(*start), SMALL)
    two = ray_caster(there).view(chest_eye(0.0, 0.0, 0.0), SMALL)
    assert (one.thing == two.thing).mean() > 0.995
    same = one.thing == two.thing
    assert np.abs(one.depth - two.depth)[same].max() < 0.05
    assert (np.abs(one.picture.astype(int) - two.picture.astype(int)).max(axis=2)[same] <= 12).mean() > 0.98


@pytest.mark.parametrize("number", range(8))
def test_a_start_is_free_and_its_way_leads_to_the_target(number: int) -> None:
    room = draw_rooms.room("obstacle", "train", number)
    start = some_start(room, np.random.default_rng(number))
    there = seen_from(room, start)
    apart = np.hypot(*there.circles[:, :2].T) - there.circles[:, 2]
    assert apart.min() >= BODY
    assert there.hall.inside(np.zeros(2)) >= BODY
    assert there.shortest >= math.hypot(there.target.x, there.target.y) - 0.6 - 1e-9
    assert drawn_places(there.circles[:, :2], start) == pytest.approx(room.circles[:, :2])
    back = drawn_places(np.array([person.points for person in there.people]).reshape(-1, 2), start)
    assert back == pytest.approx(np.array([person.points for person in room.people]).reshape(-1, 2))


def test_the_drawn_start_is_the_room_itself_and_a_blocked_one_is_refused() -> None:
    room = draw_rooms.room("obstacle", "train", 0)
    assert seen_from(room, DRAWN) is room
    with pytest.raises(BadInput, match="no way leads"):
        seen_from(room, Start(room.things[0].x, room.things[0].y, 0.0))
