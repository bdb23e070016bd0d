"""Appends episodes to a dataset, each whole or not at all.

The order makes it so: the video goes to its place, then the rows to ``data``, and from that moment the episode counts;
``meta`` follows. Whoever is killed between two of these leaves a dataset that LeRobot's loader and ours still read, and
the next `Writer` makes ``meta`` follow.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from pathlib import Path
from typing import IO, Any

from toddle.failures import BadInput, ToddleError
from toddle.navigate.cloning.recording import Recording
from toddle.outside.dataset import layout
from toddle.outside.dataset.meta import known_rows, row_of, tell, written
from toddle.outside.dataset.pictures import write_video
from toddle.outside.dataset.reader import facts_of, read_episode
from toddle.outside.dataset.rows import Damaged, Facts, checked, write_rows
from toddle.outside.dataset.statistics import statistics
from toddle.outside.files import make_folder

_LOCK = ".lock"


class Writer:
    """A dataset that is open to be appended to, by one process at a time.

    Attributes:
        folder: of the dataset.
    """

    def __init__(self, folder: Path, robot: str = "heicub") -> None:
        """Opens a dataset, or begins one.

        Args:
            folder: where; it is made if need be.
            robot: whose cameras and velocities these are.

        Raises:
            BadInput: something else is there, another process writes to it, or an episode in it is damaged so that
                none can come after it.
        """
        self.folder = folder
        _refuse_others(folder)
        self._lock = _locked(make_folder(folder))
        try:
            self._robot = robot
            _sweep(folder)
            self._rows = known_rows(folder)
            self._catch_up()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Writer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        """Episodes."""
        return len(self._rows)

    def add(self, recording: Recording) -> int:
        """Keep one episode more.

        Returns:
            Its number.

        Raises:
            BadInput: it can't be kept.
            ToddleError: it can't be written.
        """
        number = len(self._rows)
        checked(recording)
        video, rows = layout.video_file(self.folder, number), layout.data_file(self.folder, number)
        try:
            for path in (video, rows):
                path.parent.mkdir(parents=True, exist_ok=True)
            written(video, lambda part: write_video(part, recording.picture))
            facts = written(rows, lambda part: write_rows(part, recording, number, self._frames(), video))
            self._rows.append(row_of(number, self._frames(), facts, statistics(recording)))
            tell(self.folder, self._rows, number, self._robot)
        except OSError as fault:
            raise ToddleError(
                f"episode {number} can't be written ({fault.strerror})", where=str(self.folder)
            ) from fault
        return number

    def close(self) -> None:
        """Let others write to it."""
        self._lock.close()

    def _frames(self) -> int:
        return self._rows[-1]["dataset_to_index"] if self._rows else 0

    def _catch_up(self) -> None:
        """Make ``meta`` tell of every episode that lies in ``data``."""
        found = layout.numbers(self.folder)
        count = max(len(self._rows), found[-1] + 1 if found else 0)
        told = len(self._rows)
        for number in range(count):
            known = self._rows[number] if number < told else None
            facts = _facts(self.folder, number)
            if known is not None and (facts is None or facts.looks == known["length"]):
                continue  # a damaged one keeps its row
            del self._rows[number:]
            told = number
            self._rows.append(self._found_again(number))
        for number in range(0, max(count, 1), layout.CHUNK):
            tell(self.folder, self._rows, number, self._robot)

    def _found_again(self, number: int) -> dict[str, Any]:
        """The row of an episode that ``meta`` does not tell of."""
        try:
            recording = read_episode(self.folder, number)
        except Damaged as fault:
            remedy = "copy the others into a new dataset: toddle navigate record --copy"
            raise BadInput(f"{fault.what}, and nothing can come after it", where=fault.where, remedy=remedy) from fault
        return row_of(number, self._frames(), facts_of(self.folder, number), statistics(recording))


def _facts(folder: Path, number: int) -> Facts | None:
    try:
        return facts_of(folder, number)
    except Damaged:
        return None


def _refuse_others(folder: Path) -> None:
    """Raise `BadInput` where something lies that is no dataset of ours."""
    if not os.path.lexists(folder):
        return
    if not folder.is_dir():
        raise BadInput("it is no folder", where=str(folder), remedy="name another")
    path = folder / layout.INFO
    if not path.exists():
        others = [name for name in sorted(os.listdir(folder)) if name not in ("data", "meta", "videos", _LOCK)]
        if others:
            raise BadInput(f"it holds {others[0]}, and no dataset", where=str(folder), remedy="name another folder")
        return
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return  # it will be made again
    known = layout.info(0, 0, "")
    if not isinstance(said, dict) or any(
        said.get(name) != known[name] for name in ("codebase_version", "features", "fps")
    ):
        raise BadInput("it is another kind of dataset", where=str(folder), remedy="name another folder")


def _locked(folder: Path) -> IO[bytes]:
    file = (folder / _LOCK).open("wb")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        file.close()
        raise BadInput("another process is writing to it", where=str(folder), remedy="wait, or name another") from None
    return file


def _sweep(folder: Path) -> None:
    """Remove what was half written."""
    for part in folder.glob("*/**/.*.part"):
        with contextlib.suppress(OSError):
            part.unlink()
