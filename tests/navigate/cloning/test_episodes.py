"""What recordings become, and that rooms are never shared between learning and validating."""

from __future__ import annotations

import numpy as np
import pytest
from drives import drive

from toddle.failures import BadInput
from toddle.navigate.cloning.episodes import episode, split_by_room


def test_depth_is_kept_in_millimetres() -> None:
    recording = drive(3)
    recording = recording._replace(depth=np.where(recording.depth < 1, np.nan, recording.depth).astype(np.float32))
    found = episode(recording)
    known = np.isfinite(recording.depth) & (recording.depth < 60)
    np.testing.assert_allclose(found.depth[known] / 1000, recording.depth[known], atol=6e-4)
    assert (found.depth[np.isnan(recording.depth)] == 0).all()


def test_velocities_are_ahead_and_turning() -> None:
    recording = drive(1)
    found = episode(recording)
    np.testing.assert_allclose(found.taught, recording.taught[:, [0, 2]], rtol=1e-6)
    np.testing.assert_allclose(found.felt, recording.velocity[:, [0, 2]], rtol=1e-6)


def test_rooms_are_not_shared() -> None:
    """Each room is driven through twice."""
    episodes = [episode(drive(seed)) for seed in range(20) for _ in range(2)]
    learned, held = split_by_room(episodes, 0.2, 0)
    assert len(held) == 8
    assert len(learned) == 32
    assert not {one.room for one in learned} & {one.room for one in held}
    again = split_by_room(episodes, 0.2, 0)
    assert [one.room for one in again[1]] == [one.room for one in held]


def test_rooms_that_are_there_for_validation_are_used_for_it() -> None:
    episodes = [episode(drive(seed)) for seed in range(6)]
    given = episodes[2]._replace(room=episodes[2].room._replace(split="validation"))
    learned, held = split_by_room([*episodes, given], 0.5, 0)
    assert held == (given,)
    assert len(learned) == 6


def test_test_rooms_are_refused() -> None:
    given = episode(drive(2))
    given = given._replace(room=given.room._replace(split="test"))
    with pytest.raises(BadInput, match="test split"):
        split_by_room([given], 0.1, 0)


def test_what_cannot_be_learned_from_is_refused() -> None:
    recording = drive(2)
    with pytest.raises(BadInput, match="nothing was seen"):
        episode(drive(2, looks=0))
    with pytest.raises(BadInput, match="not finite"):
        episode(recording._replace(taught=np.full_like(recording.taught, np.nan)))
