"""Datasets of drives: written and read bit for bit, cut off at any moment, damaged in any place, appended to."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from drives import drive, same
from hypothesis import given, settings
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.navigate.scenarios.rooms import SCENARIOS
from toddle.navigate.sight import PERIOD
from toddle.outside.dataset import layout
from toddle.outside.dataset.reader import episodes, facts_of, read_dataset, read_episode
from toddle.outside.dataset.rows import Damaged
from toddle.outside.dataset.writer import Writer


def made(folder: Path, count: int = 3, looks: int = 4) -> Path:
    with Writer(folder) as writer:
        for seed in range(count):
            assert writer.add(drive(seed, looks + seed)) == seed
    return folder


def faults_of(folder: Path) -> list[str]:
    found: list[Damaged] = []
    for number, recording in read_dataset(folder, found.append):
        assert same(recording, drive(number, 4 + number)), number
    return [fault.line for fault in found]


@settings(max_examples=5)
@given(seed=st.integers(0, 1000), looks=st.integers(1, 12), things=st.integers(1, layout.MOST_THINGS))
def test_what_is_written_is_read_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, seed: int, looks: int, things: int
) -> None:
    folder, kept = tmp_path_factory.mktemp("kept"), drive(seed, looks, things)
    with Writer(folder) as writer:
        writer.add(kept)
    assert same(read_episode(folder, 0), kept)
    facts = facts_of(folder, 0)
    assert facts[:6] == (kept.room, kept.driver, kept.seed, kept.outcome, looks, things)


def test_depth_is_kept_to_the_millimetre(tmp_path: Path) -> None:
    depth = np.random.default_rng(1).uniform(0, 20, (7, 60, 80)).astype(np.float32)
    depth[0, 0, :3] = 0.0, 100.0, -1.0
    with Writer(tmp_path) as writer:
        writer.add(drive()._replace(depth=depth))
    read = read_episode(tmp_path, 0).depth
    assert read[0, 0, :3].tolist() == [0.0, np.float32(65.535), 0.0]
    assert np.abs(read.astype(float) - depth)[1:].max() < 0.000501


def test_the_folder_is_what_lerobot_expects(tmp_path: Path) -> None:
    made(tmp_path)
    info = json.loads((tmp_path / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["total_episodes"]) == ("v3.0", round(1 / PERIOD), 3)
    assert info["total_frames"] == 4 + 5 + 6
    rows = pq.read_table(tmp_path / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [(row["dataset_from_index"], row["dataset_to_index"]) for row in rows] == [(0, 4), (4, 9), (9, 15)]
    for number, row in enumerate(rows):
        place = {"chunk_index": row["data/chunk_index"], "file_index": row["data/file_index"]}
        table = pq.read_table(tmp_path / info["data_path"].format(**place))
        assert table["index"].to_pylist() == list(range(row["dataset_from_index"], row["dataset_to_index"]))
        assert set(table["episode_index"].to_pylist()) == {number}
        assert np.allclose(table["timestamp"].to_numpy(), np.arange(row["length"]) / 5)
        assert set(table["task_index"].to_pylist()) == {number}
        assert (tmp_path / info["video_path"].format(video_key=layout.PICTURE, **place)).is_file()
        columns = [name for name, what in info["features"].items() if what["dtype"] != "video"]
        assert table.column_names == columns
    tasks = pq.read_table(tmp_path / "meta/tasks.parquet").to_pylist()
    assert [row["task"] for row in tasks] == [layout.ORDERS[scenario] for scenario in SCENARIOS]


def test_statistics_are_those_of_all_episodes(tmp_path: Path) -> None:
    made(tmp_path)
    kept = [drive(seed, 4 + seed) for seed in range(3)]
    stats = json.loads((tmp_path / "meta/stats.json").read_text())
    asked = np.concatenate([one.asked for one in kept])
    assert np.allclose(stats["action"]["mean"], asked.mean(axis=0))
    assert np.allclose(stats["action"]["std"], asked.std(axis=0))
    pictures = np.concatenate([one.picture for one in kept]) / 255
    assert np.allclose(np.ravel(stats[layout.PICTURE]["std"]), pictures.std(axis=(0, 1, 2)))
    assert np.shape(stats[layout.PICTURE]["mean"]) == (3, 1, 1)
    depth = 1000 * np.concatenate([one.depth for one in kept])
    assert np.isclose(np.ravel(stats[layout.DEPTH]["mean"])[0], depth.mean(dtype=float))
    assert stats["taught"]["count"] == [15]


def test_a_dataset_is_appended_to(tmp_path: Path) -> None:
    whole = made(tmp_path / "whole", 3)
    parts = made(tmp_path / "parts", 1)
    for seed in (1, 2):
        with Writer(parts) as writer:
            assert len(writer) == seed
            writer.add(drive(seed, 4 + seed))
    assert faults_of(parts) == []
    for path in sorted(path for path in whole.rglob("*") if path.is_file()):
        assert path.read_bytes() == (parts / path.relative_to(whole)).read_bytes(), path


def test_two_do_not_write_at_once(tmp_path: Path) -> None:
    with Writer(tmp_path), pytest.raises(BadInput, match="another process is writing"):
        Writer(tmp_path)
    Writer(tmp_path).close()


class Cut(BaseException):
    """The process ends here."""


def test_cut_between_any_two_files_nothing_whole_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each rename in turn is the last thing that a process does, or the first that it doesn't."""
    replace, seen = os.replace, []
    for cut in range(8):
        folder = made(tmp_path / str(cut), 2)
        calls = []

        def counting(source: Path, target: Path, cut: int = cut, calls: list[Path] = calls) -> None:
            if len(calls) == cut:
                raise Cut
            calls.append(target)
            replace(source, target)

        with Writer(folder) as writer, monkeypatch.context() as patch:
            patch.setattr(os, "replace", counting)
            try:
                writer.add(drive(2, 6))
            except Cut:
                seen.append(len(calls))
        committed = any("data" in path.parts for path in calls)
        info = json.loads((folder / "meta/info.json").read_text())
        assert info["total_episodes"] in (2, len(episodes(folder)))
        assert faults_of(folder) == []
        assert len(episodes(folder)) == 2 + committed
        with Writer(folder) as writer:
            assert writer.add(drive(2 + committed, 6 + committed)) == 2 + committed
        assert faults_of(folder) == []
    assert seen == [0, 1, 2, 3, 4]  # video, data, episodes, stats, info: an episode is five renames


KILLED = """
import os, random, signal, sys, time
sys.path.insert(0, {tests!r})
from pathlib import Path
from drives import drive, same
from toddle.outside.dataset.reader import begun, episodes, read_episode
from toddle.outside.dataset.writer import Writer
folder, draw = Path({folder!r}), random.Random(7)
whole = 0
for attempt in range(12):  # killed in its first, second or third episode, or a later one
    heard, said = os.pipe()
    child = os.fork()
    if not child:
        with Writer(folder) as writer:
            while True:
                number = len(writer)
                writer.add(drive(number, 2))
                os.write(said, b"x")
    os.close(said)
    told = sum(len(os.read(heard, 1)) for _ in range(attempt % 3))
    time.sleep(draw.uniform(0.0, 0.15))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    told += len(os.read(heard, 65536))
    os.close(heard)
    there = len(episodes(folder)) if begun(folder) else 0
    assert whole + told <= there <= whole + told + 1, (whole, told, there)
    for number in range(whole, there):
        assert same(read_episode(folder, number), drive(number, 2)), number
    whole = there
with Writer(folder) as writer:
    assert len(writer) == whole
print(whole)
"""


def test_killed_at_random_moments_it_loses_at_most_one_episode(tmp_path: Path) -> None:
    script = textwrap.dedent(KILLED).format(tests=str(Path(__file__).parents[2]), folder=str(tmp_path / "d"))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) >= 12


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0x10
    path.write_bytes(bytes(content))


DAMAGE = {
    "data gone": (layout.data_file, Path.unlink, "its file in data is gone"),
    "data cut short": (layout.data_file, _cut, "its file in data was altered or cut short"),
    "data flipped": (layout.data_file, _flip, "its file in data was altered"),
    "data empty": (layout.data_file, lambda path: path.write_bytes(b""), "its file in data was altered or cut short"),
    "data is text": (layout.data_file, lambda path: path.write_text("hello"), "its file in data was altered or"),
    "video gone": (layout.video_file, Path.unlink, "its video is gone"),
    "video cut short": (layout.video_file, _cut, "its video was altered or cut short"),
    "video flipped": (layout.video_file, _flip, "its video was altered or cut short"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_episode_is_named_and_the_others_are_read(tmp_path: Path, damage: str) -> None:
    folder = made(tmp_path)
    where, how, what = DAMAGE[damage]
    how(where(folder, 1))
    (line,) = faults_of(folder)
    assert line.startswith(f"{folder}, episode 1: {what}")
    with Writer(folder) as writer:  # and the next one comes after it
        assert writer.add(drive(3, 7)) == 3
    assert len(faults_of(folder)) == 1


def test_the_last_episode_gone_is_missed(tmp_path: Path) -> None:
    folder = made(tmp_path)
    layout.data_file(folder, 2).unlink()
    assert faults_of(folder) == [f"{folder}, episode 2: its file in data is gone"]


@pytest.mark.parametrize("name", ["meta/info.json", "meta/stats.json", "meta/tasks.parquet", "meta/episodes/chunk-000"])
def test_what_meta_tells_is_made_again(tmp_path: Path, name: str) -> None:
    folder = made(tmp_path)
    path = folder / name if (folder / name).is_file() else folder / name / "file-000.parquet"
    before = path.read_bytes()
    for damage in (Path.unlink, _cut):
        damage(path)
        assert faults_of(folder) == []
        Writer(folder).close()
        assert path.read_bytes() == before or name == "meta/tasks.parquet"


def test_after_one_that_nobody_can_count_none_comes(tmp_path: Path) -> None:
    folder = made(tmp_path)
    _cut(layout.data_file(folder, 1))
    _cut(layout.episodes_file(folder, 0))
    with pytest.raises(BadInput, match=r"episode 1: .*nothing can come after it"):
        Writer(folder)
    assert len(faults_of(folder)) == 1
    _ = layout.data_file(folder, 1).write_bytes(b"")
    assert len(faults_of(folder)) == 1


@settings(max_examples=60)
@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_any_flipped_bit_is_noticed_or_harmless(
    tmp_path_factory: pytest.TempPathFactory, place: float, bit: int
) -> None:
    folder = tmp_path_factory.mktemp("flipped")
    with Writer(folder) as writer:
        writer.add(drive(4, 1))
    for path in (layout.data_file(folder, 0), layout.video_file(folder, 0)):
        before = path.read_bytes()
        content = bytearray(before)
        content[int(place * len(content))] ^= 1 << bit
        path.write_bytes(bytes(content))
        found: list[Damaged] = []
        read = [recording for _, recording in read_dataset(folder, found.append)]
        assert len(read) + len(found) == 1
        assert all(same(recording, drive(4, 1)) for recording in read)
        assert all(fault.line.startswith(f"{folder}, episode 0: its ") for fault in found)
        path.write_bytes(before)


def test_what_is_no_dataset_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="there is no dataset here"):
        _ = episodes(tmp_path)
    _ = (tmp_path / "letter.txt").write_text("hello")
    with pytest.raises(BadInput, match="it holds letter"):
        Writer(tmp_path)
    with pytest.raises(BadInput, match="it is no folder"):
        Writer(tmp_path / "letter.txt")
    (tmp_path / "other/meta").mkdir(parents=True)
    _ = (tmp_path / "other/meta/info.json").write_text('{"codebase_version": "v2.1", "total_episodes": 3}')
    with pytest.raises(BadInput, match="it is another kind of dataset"):
        Writer(tmp_path / "other")


@pytest.mark.usefixtures("unchecked")
def test_a_recording_that_cannot_be_kept_is_refused_and_leaves_nothing(tmp_path: Path) -> None:
    good = drive()
    nan = good.asked.copy()
    nan[2, 1] = np.nan
    faults = {
        "it holds no look": drive(0, 0),
        "its picture has the shape": good._replace(picture=good.picture[:-1]),
        "its pixels has the shape": good._replace(pixels=good.pixels[:, :-1]),
        "its asked is not finite": good._replace(asked=nan),
        "it has 25 circles, more than 24": drive(0, 3, 25),
    }
    with Writer(tmp_path) as writer:
        for what, recording in faults.items():
            with pytest.raises(BadInput, match=what):
                writer.add(recording)
        assert len(writer) == 0
        assert not list(tmp_path.rglob("*.parquet"))[1:]  # the tasks
        assert writer.add(good) == 0
