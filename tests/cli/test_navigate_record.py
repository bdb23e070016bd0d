"""``toddle navigate record``: the expert drives, a person drives at a real terminal, datasets are shown and copied."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from drives import drive, same

from toddle.cli import main
from toddle.failures import BadInput
from toddle.navigate.cloning.expert import Expert
from toddle.navigate.cloning.recording import Recording, RoomKey
from toddle.navigate.task import Outcome
from toddle.outside.dataset import layout
from toddle.outside.dataset.drives import Errand, How, errands, expert, missing, record
from toddle.outside.dataset.reader import read_episode
from toddle.outside.dataset.writer import Writer
from toddle.outside.navigation.physics_batch import Recipe
from toddle.outside.navigation.room_eyes import EyeOptions
from toddle.outside.navigation.room_run import RoomRules

RECORD = ("navigate", "record")


def kept(folder: Path, count: int = 4) -> Path:
    with Writer(folder) as writer:
        for seed in range(count):
            writer.add(drive(seed, 4 + seed))
    return folder


def test_drives_go_through_the_scenarios_in_turn_and_are_not_driven_twice(tmp_path: Path) -> None:
    wanted = errands(("straight", "search"), "train", "seen", 5, first=7, seed=2)
    assert [(errand.room.scenario, errand.room.number) for errand in wanted] == [
        ("straight", 7), ("search", 7), ("straight", 8), ("search", 8), ("straight", 9),
    ]  # fmt: skip
    assert len(set(wanted)) == 5
    assert not set(wanted) & set(errands(("straight", "search"), "train", "seen", 5, first=7, seed=3))
    assert wanted == errands(("straight", "search"), "train", "seen", 9, first=7, seed=2)[:5]
    assert missing(tmp_path / "none", wanted, "expert") == wanted
    (tmp_path / "killed/meta").mkdir(parents=True)  # before anything was in it
    assert missing(tmp_path / "killed", wanted, "expert") == wanted
    with Writer(tmp_path / "killed") as writer:
        assert len(writer) == 0
    with Writer(tmp_path / "d") as writer:
        for errand in (wanted[1], wanted[3]):
            writer.add(drive()._replace(room=errand.room, seed=errand.seed))
    assert missing(tmp_path / "d", wanted, "expert") == (wanted[0], wanted[2], wanted[4])
    assert missing(tmp_path / "d", wanted, "person") == wanted
    layout.data_file(tmp_path / "d", 0).unlink()
    assert missing(tmp_path / "d", wanted, "expert") == (*wanted[:3], wanted[4])


def test_two_processes_drive_as_one_does_and_a_room_that_there_is_not_ends_neither() -> None:
    how = How(Recipe(expert), "expert", True, 1.0, 0.0, EyeOptions("cast"), RoomRules(seconds=2.0))
    none, jolted = Errand(RoomKey("curve", "train", "unseen", 0), 0), Errand(RoomKey("search", "train", "seen", 3), 3)
    alone, shared = dict(record(how, (none, jolted), 1)), dict(record(how, (none, jolted), 2))
    fault, same_fault, drive_alone, same_drive = (
        found[errand] for errand in (none, jolted) for found in (alone, shared)
    )
    assert isinstance(fault, BadInput)
    assert isinstance(same_fault, BadInput)
    assert fault.line == same_fault.line
    assert isinstance(drive_alone, Recording)
    assert isinstance(same_drive, Recording)
    assert same(drive_alone, same_drive)
    assert drive_alone[:4] == (jolted.room, "expert", 3, Outcome.LATE)
    off = (drive_alone.asked != drive_alone.taught).any(axis=1)
    assert 0 < off.mean() < 0.8
    assert (np.abs(drive_alone.taught) <= [Expert().fastest, 0.0, Expert().turning + 1e-9]).all()


def test_who_asks_to_stop_gets_what_is_under_way() -> None:
    how = How(Recipe(expert), "expert", eyes=EyeOptions("cast"), rules=RoomRules(seconds=0.2))
    done: list[Errand] = []
    for errand, _ in record(how, errands(("straight",), "train", "seen", 4), 1, lambda: len(done) == 2):
        done.append(errand)
    assert [errand.room.number for errand in done] == [0, 1]


def test_the_expert_drives_and_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = (
        *RECORD,
        "--scenario",
        "straight",
        "--first",
        "16",
        "--eyes",
        "cast",
        "--jobs",
        "1",
        "--out",
        str(tmp_path / "d"),
    )
    assert main([*words, "--episodes", "1", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert (figures["episodes"], figures["recorded"], figures["wins"]) == (1, 1, 1)
    assert figures["real_time_factor"] > 0
    first = read_episode(tmp_path / "d", 0)
    assert first.driver == "expert"
    assert np.array_equal(first.asked, first.taught)
    assert main([*words, "--episodes", "1"]) == 0
    out, err = capsys.readouterr()
    assert "1 of 1 are there already" in err
    assert out.splitlines()[-1].startswith("driven by expert; ")


def test_a_dataset_is_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, picture = kept(tmp_path / "d"), tmp_path / "strips" / "one.png"
    assert main([*RECORD, "--show", str(folder), "--episode", "2", "--out", str(picture)]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines()[-2].split() == ["all", "4", "1", "1", "1", "1", "22", "0.1"]
    assert str(picture) in err
    drawn = cv2.imread(str(picture))
    assert drawn is not None
    assert drawn.shape[1] > 1000


def test_a_damaged_episode_is_told_and_left_out_of_a_copy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = kept(tmp_path / "d")
    path = layout.video_file(folder, 1)
    path.write_bytes(path.read_bytes()[:-1])
    assert main([*RECORD, "--show", str(folder), "--out", str(tmp_path / "one.png")]) == 1
    _, err = capsys.readouterr()
    assert err.splitlines()[-1] == f"toddle: {folder}, episode 1: its video was altered or cut short"
    assert main([*RECORD, "--copy", str(folder), "--out", str(tmp_path / "whole")]) == 1
    for new, old in enumerate((0, 2, 3)):
        assert same(read_episode(tmp_path / "whole", new), drive(old, 4 + old))
    _ = capsys.readouterr()
    assert main([*RECORD, "--show", str(tmp_path / "whole"), "--out", str(tmp_path / "two.png")]) == 0


WRONG = {
    "--episodes 0": "--episodes: 0 is out of range",
    "--noise -1": "--noise: -1 is out of range",
    "--scenario straight straight": "--scenario: one is named twice",
    "--scenario maze": "no choice named 'maze'",
    "--style unseen": "--style: the unseen style is kept out of training",
    "--driver person": "--driver person: this is no terminal",
    "--show nothing": "nothing: there is no dataset here",
    "--copy a": "--copy needs a place",
    "--driver policy": "--driver policy and --policy belong together",
    "--copy a --show b": "--show and --copy exclude each other",
    "--copy a --out a": "it is the dataset itself",
    "--driver policy --policy nothing --out new": "nothing/policy.json: there is no",
    "--robot nobody --out new": "no humanoid named 'nobody'",
    "--episode 3": "--episode: an episode is shown by its number",
    "--out there": "there: it holds letter.txt, and no dataset",
    "--show kept --episode 4": "kept: there is no episode 4; it has 4, from 0",
}


@pytest.mark.parametrize("words", WRONG)
def test_a_wrong_call_is_one_line(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    (tmp_path / "there/letter.txt").touch()
    if "kept" in words:
        _ = kept(tmp_path / "kept")
    assert main([*RECORD, *words.split()]) == 2
    assert WRONG[words] in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


CALL = (
    "import fcntl, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0)\n"
    "from toddle.cli import main; sys.exit(main(sys.argv[1:]))"
)


def test_a_person_drives_at_a_terminal(tmp_path: Path) -> None:
    """Walks into what stands in the way, which ends the drive; quits in the next room, whose drive is not kept."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 100, 0, 0))
    before = termios.tcgetattr(slave)
    words = (*RECORD, "--driver", "person", "--scenario", "straight", "--first", "16", "--eyes", "cast")
    child = subprocess.Popen(
        [sys.executable, "-c", CALL, *words, "--episodes", "2", "--out", str(tmp_path / "d")],
        stdin=slave, stdout=slave, stderr=slave,
        start_new_session=True, env={**os.environ, "TERM": "xterm-256color", "COLUMNS": "100"},
    )  # fmt: skip
    seen = b""

    def watch(seconds: float, until: bytes) -> None:
        nonlocal seen
        end = time.monotonic() + seconds
        while until not in seen and child.poll() is None and time.monotonic() < end:
            if select.select([master], [], [], 0.05)[0]:
                seen += os.read(master, 65536)
        assert until in seen, seen[-2000:]

    watch(100, b"1 of 2: Walk to the fire extinguisher straight ahead.")
    os.write(master, b"wwwwww")
    watch(10, b"asked +0.30")
    watch(10, b"walks +0.2")
    watch(40, b"2 of 2")
    assert b"You have run into something." in seen
    os.write(master, b"q")
    watch(30, b"driven by person")
    assert child.wait(20) == 0
    assert termios.tcgetattr(slave) == before
    for end in (master, slave):
        os.close(end)
    recording = read_episode(tmp_path / "d", 0)
    assert (recording.driver, recording.outcome) == ("person", Outcome.COLLIDED)
    assert recording.asked[:, 0].max() == pytest.approx(0.3)
    assert layout.numbers(tmp_path / "d") == (0,)
