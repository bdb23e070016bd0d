"""Files are written whole or not at all, and what was harmed is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from damage import flip
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput, ToddleError
from toddle.outside import files
from toddle.outside.files import finite, make_folder, read_record, write_bytes, write_json, write_record

TENSORS = {
    "scalar": np.float32(2.5),
    "count": np.int32(7),
    "flags": np.array([True, False, True]),
    "words": np.array([0, 2**64 - 1], np.uint64),
    "matrix": np.arange(6.0).reshape(2, 3).T,  # not in C order
    "empty": np.zeros((0, 3), np.float32),
}
FACTS = {"name": "nicu", "hidden": (10, 20), "nothing": None, "share": 0.1, "text": "Größe\n"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("record")
    write_record(path, "thing", "skill", FACTS, {name: np.asarray(value) for name, value in TENSORS.items()})
    return path


def test_a_record_comes_back_as_it_was(folder: Path) -> None:
    facts, tensors = read_record(folder, "thing", "skill")
    assert facts == {**FACTS, "hidden": [10, 20]}
    assert set(tensors) == set(TENSORS)
    for name, value in TENSORS.items():
        assert tensors[name].dtype == value.dtype
        assert tensors[name].shape == value.shape
        np.testing.assert_array_equal(tensors[name], value)
    assert {path.name for path in folder.iterdir()} == {"thing.json", "thing.safetensors"}


@given(st.sampled_from(["json", "safetensors"]), st.floats(0, 1), st.integers(1, 255))
def test_no_byte_can_be_changed(folder: Path, ending: str, share: float, bits: int) -> None:
    path = folder / f"thing.{ending}"
    before = path.read_bytes()
    try:
        flip(path, share, bits)
        with pytest.raises(BadInput) as refusal:
            read_record(folder, "thing", "skill")
        assert "\n" not in refusal.value.line
        assert str(path) in refusal.value.line or str(folder / "thing.safetensors") in refusal.value.line
    finally:
        path.write_bytes(before)


@pytest.mark.parametrize("bits", [0x01, 0x20, 0x2A])  # the last two make capitals of letters, line ends of spaces
def test_no_byte_at_all_of_the_facts_can_be_changed(folder: Path, bits: int) -> None:
    path = folder / "thing.json"
    before = path.read_bytes()
    try:
        for place in range(len(before)):
            path.write_bytes(before[:place] + bytes([before[place] ^ bits]) + before[place + 1 :])
            with pytest.raises(BadInput):
                read_record(folder, "thing", "skill")
    finally:
        path.write_bytes(before)


@given(st.sampled_from(["json", "safetensors"]), st.floats(0, 1, exclude_max=True))
def test_no_file_can_be_cut_short(folder: Path, ending: str, share: float) -> None:
    path = folder / f"thing.{ending}"
    before = path.read_bytes()
    try:
        path.write_bytes(before[: int(share * len(before))])
        with pytest.raises(BadInput):
            read_record(folder, "thing", "skill")
    finally:
        path.write_bytes(before)


def test_a_record_of_another_kind_is_named(folder: Path) -> None:
    with pytest.raises(BadInput, match=r"it is a toddle skill, not a toddle run"):
        read_record(folder, "thing", "run")


def test_a_file_that_could_not_be_finished_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "figures.json"
    path.write_text("old")

    def full(source: object, target: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "replace", full)
    with pytest.raises(ToddleError, match=r"figures.json: it can't be written \(No space left on device\)"):
        write_bytes(path, b"new")
    assert {entry.name: entry.read_text() for entry in tmp_path.iterdir()} == {"figures.json": "old"}


def test_an_interrupt_in_the_middle_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "figures.json"
    path.write_text("old")

    def interrupt(source: object, target: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(files.os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_bytes(path, b"new")
    assert {entry.name: entry.read_text() for entry in tmp_path.iterdir()} == {"figures.json": "old"}


def test_json_is_plain_and_keeps_the_order_of_its_keys(tmp_path: Path) -> None:
    value = {"b": np.float32(0.5), "a": math.nan, "c": (math.inf, np.int64(3)), "d": {"e": -math.inf}, "f": True}
    write_json(tmp_path / "a.json", value)

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is not JSON")

    found = json.loads((tmp_path / "a.json").read_text(), parse_constant=refuse)
    assert found == {"b": 0.5, "a": None, "c": [None, 3], "d": {"e": None}, "f": True}
    assert list(found) == list(value)
    assert finite(value)["f"] is True


def test_folders_are_made_with_those_above(tmp_path: Path) -> None:
    assert make_folder(tmp_path / "a" / "b") == tmp_path / "a" / "b"
    assert make_folder(tmp_path / "a" / "b").is_dir()
    assert list((tmp_path / "a" / "b").iterdir()) == []


def test_a_folder_that_can_not_be_made_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for place in (tmp_path / "file", tmp_path / "file" / "x", tmp_path / "new" / "newer" / ("n" * 300)):
        with pytest.raises(BadInput, match=r"no folder can be made or written into here \(.+\); name another"):
            make_folder(place)
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


def test_a_relative_folder_is_made_where_we_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    make_folder(Path("runs/a"))
    assert (tmp_path / "runs" / "a").is_dir()
