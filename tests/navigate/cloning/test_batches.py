"""The order of the data: every look once an epoch, in its order, and told apart from the one before."""

from __future__ import annotations

import numpy as np
from drives import drive

from toddle.navigate.cloning.batches import Batch, Order, streams, streams_order, windows, windows_order
from toddle.navigate.cloning.episodes import Episode, episode

LENGTHS = (3, 7, 1, 12, 5)


def _episodes() -> tuple[Episode, ...]:
    """Each look's felt velocity tells which it is: episode, look."""
    found = []
    for number, count in enumerate(LENGTHS):
        names = np.stack([np.full(count, number), np.arange(count)], axis=1).astype(np.float32)
        found.append(episode(drive(number, looks=count))._replace(felt=names))
    return tuple(found)


def _read(order: Order, episodes: tuple[Episode, ...], times: int) -> tuple[list[Batch], Order]:
    found = []
    for _ in range(times):
        batch, order = streams(order, episodes, 4)
        found.append(batch)
    return found, order


def test_streams_go_through_whole_episodes_in_order() -> None:
    episodes = _episodes()
    found, _ = _read(streams_order(episodes, 2, 0), episodes, 40)
    for stream in range(2):
        names = np.concatenate([batch.felt[stream] for batch in found])
        fresh = np.concatenate([batch.fresh[stream] for batch in found])
        for before, after, begins in zip(names[:-1], names[1:], fresh[1:], strict=True):
            follows = after[0] == before[0] and after[1] == before[1] + 1
            ended = before[1] == LENGTHS[int(before[0])] - 1
            assert begins == (after[1] == 0)
            assert follows != (ended and begins)


def test_each_episode_comes_as_often() -> None:
    episodes = _episodes()
    found, _ = _read(streams_order(episodes, 2, 0), episodes, 200)
    starts = np.concatenate([batch.felt[batch.fresh][:, 0] for batch in found]).astype(int)
    counts = np.bincount(starts, minlength=len(LENGTHS))
    assert counts.max() - counts.min() <= 2


def test_what_belongs_to_a_look_stays_with_it() -> None:
    episodes = _episodes()
    (batch, *_), _ = _read(streams_order(episodes, 3, 5), episodes, 1)
    for stream in range(3):
        for step in range(4):
            number, look = batch.felt[stream, step].astype(int).tolist()
            assert np.array_equal(batch.picture[stream, step], episodes[number].picture[look])
            assert np.array_equal(batch.depth[stream, step], episodes[number].depth[look])
            assert np.array_equal(batch.labels[stream, step], episodes[number].labels[look])
            assert np.array_equal(batch.taught[stream, step], episodes[number].taught[look])


def test_reading_goes_on_where_it_was() -> None:
    episodes = _episodes()
    whole, _ = _read(streams_order(episodes, 2, 3), episodes, 9)
    _, order = _read(streams_order(episodes, 2, 3), episodes, 4)
    rest, _ = _read(Order(*(part.copy() for part in order)), episodes, 5)
    for one, other in zip(whole[4:], rest, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_windows_show_every_look_once_an_epoch_and_never_mix_episodes() -> None:
    episodes, order, ends = _episodes(), windows_order(1), []
    for _ in range(sum(LENGTHS) // 4):
        batch, order = windows(order, episodes, 4, 5)
        ends += [tuple(row) for row in batch.felt[:, -1].astype(int).tolist()]
        assert np.array_equal(batch.weight, np.eye(5, dtype=np.float32)[-1] * np.ones((4, 1), np.float32))
        for felt, fresh in zip(batch.felt, batch.fresh, strict=True):
            first = int(np.flatnonzero(fresh)[-1])  # what is remembered begins here
            assert felt[:, 0].min() == felt[:, 0].max()
            assert np.array_equal(np.diff(felt[first:, 1]), np.ones(4 - first))
            assert first == 0 or felt[first, 1] == 0
    assert sorted(ends) == [(number, look) for number, count in enumerate(LENGTHS) for look in range(count)]
