"""What else is told of looks, against hand computation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drives import drive

from toddle.navigate.cloning.expert import Expert
from toddle.navigate.cloning.labels import COS, DISTANCE, FIRST_SECTOR, REACH, SEEN, SIN, VISIBLE, labels_of
from toddle.navigate.cloning.recording import Recording


def _looks(place: list, circles: list, pixels: list, dt: float = 1.0) -> Recording:
    """Looks of one second each."""
    count = len(pixels)
    return drive(0, looks=count)._replace(
        t=dt * np.arange(count),
        place=np.broadcast_to(np.array(place, float), (count, 3)).copy(),
        circles=np.broadcast_to(np.array(circles, float), (count, len(circles), 3)).copy(),
        pixels=np.array(pixels),
    )


def test_the_target_is_told_in_the_robots_frame() -> None:
    found = labels_of(_looks([1.0, 1.0, math.pi / 2], [[0.0, 2.0, 0.1]], [[50]]))[0]
    assert found[COS] == pytest.approx(math.cos(math.pi / 4))  # one ahead, one to the left
    assert found[SIN] == pytest.approx(math.sin(math.pi / 4))
    assert found[DISTANCE] == pytest.approx(math.sqrt(2) / REACH)


def test_what_was_seen_is_known_for_as_long_as_the_expert_remembers_it() -> None:
    known = round(Expert().memory)
    found = labels_of(_looks([0.0, 0.0, 0.0], [[2.0, 0.0, 0.1]], [[0], [6], *([[5]] * (known + 2))]))
    assert found[:, VISIBLE].tolist() == [0, 1] + [0] * (known + 2)
    assert found[:, SEEN].tolist() == [0] + [1] * (known + 1) + [0, 0]


def test_nearness_lies_in_the_things_sectors() -> None:
    """Half a metre from its rim, 40 degrees to the right, it covers 17 degrees either way."""
    far, radius, aside = 0.7, 0.2, math.radians(-40.0)
    circles = [[3.0, 0.0, 0.1], [far * math.cos(aside), far * math.sin(aside), radius]]
    near = labels_of(_looks([0.0, 0.0, 0.0], circles, [[9, 12]]))[0, FIRST_SECTOR:]
    reached = [1, 2, 3, 4]  # of sectors of 12.5 degrees from -75: -57 to -23 degrees lie in these
    np.testing.assert_allclose(near[reached], 1 - 0.5 / REACH, rtol=1e-6)
    assert (np.delete(near, reached) == 0).all()


def test_a_thing_that_was_never_seen_is_not_asked_for() -> None:
    found = labels_of(_looks([0.0, 0.0, 0.0], [[3.0, 0.0, 0.1], [0.6, 0.0, 0.2]], [[9, 11], [9, 12], [9, 0]]))
    assert found[0, FIRST_SECTOR:].max() == 0
    assert found[1, FIRST_SECTOR:].max() > 0.5
    assert np.array_equal(found[2], found[1])


def test_turning_the_world_changes_nothing() -> None:
    circles = [[2.0, 0.5, 0.1], [0.8, -0.4, 0.2]]
    turned = [[-y, x, r] for x, y, r in circles]
    one = labels_of(_looks([0.1, 0.2, 0.3], circles, [[9, 20]]))
    other = labels_of(_looks([-0.2, 0.1, 0.3 + math.pi / 2], turned, [[9, 20]]))
    np.testing.assert_allclose(one, other, atol=1e-6)
