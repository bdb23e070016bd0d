"""What is wrong with two cameras is noticed, and nothing is said of cameras that are fine."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from toddle.see.depth import depth_of
from toddle.see.trouble import COVERED, DARK, MISALIGNED, PLAIN, SATURATED, SWAPPED, Watch, watch

from .planes import CAMERAS, box_before_wall, pair

Pair = tuple[np.ndarray, np.ndarray]


def kinds(said: tuple[str, ...]) -> set[str]:
    return {one.partition(":")[0] for one in said}


def flat(value: float, seed: int = 0) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0, 2, (240, 320))
    return np.clip(np.rint(value + noise), 0, 255).astype(np.uint8)


def brighter(given: Pair, times: float) -> Pair:
    left, right = (np.clip(one * times, 0, 255).astype(np.uint8) for one in given)
    return left, right


def lower(given: Pair, rows: int) -> Pair:
    return given[0], np.roll(given[1], rows, axis=0)


def rolled(given: Pair, degrees: float) -> Pair:
    turn = cv2.getRotationMatrix2D((160, 120), degrees, 1)
    return given[0], cv2.warpAffine(given[1], turn, (320, 240), borderMode=cv2.BORDER_REFLECT).astype(np.uint8)


def after(given: Pair, frames: int = 5) -> Watch:
    seen = Watch()
    for number in range(frames):
        seen = watch(seen, *given, depth_of(*given, CAMERAS), 0.5 * number)
    return seen


@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_said_of_good_cameras(seed: int) -> None:
    assert after(pair(6.0 + 3 * seed, seed)).trouble == ()


def test_nothing_is_said_of_a_good_scene_with_depth() -> None:
    left, right, _ = box_before_wall(20, 8)
    assert after((left, right)).trouble == ()


@pytest.mark.parametrize("seed", range(3))
def test_each_trouble_is_called_by_its_name(seed: int) -> None:
    good = pair(9.0 + 4 * seed, seed)
    cases: dict[str, list[Pair]] = {
        COVERED: [(good[0], flat(12)), (flat(12), good[1]), (good[0], flat(150))],
        DARK: [brighter(good, 0.2)],
        SATURATED: [brighter(good, 3.0)],
        PLAIN: [(flat(120, 1), flat(120, 2))],
        SWAPPED: [(good[1], good[0])],
        MISALIGNED: [lower(good, 1), lower(good, -3), rolled(good, 1.0)],
    }
    for kind, pairs in cases.items():
        for spoiled in pairs:
            seen = after(spoiled)
            assert kinds(seen.trouble) == {kind}, (kind, seen.trouble)
            if kind not in (SWAPPED, MISALIGNED):
                assert kinds(depth_of(*spoiled, CAMERAS).trouble) == {kind}


def test_which_camera_is_covered_is_told() -> None:
    good = pair(12.0)
    assert "left camera" in after((flat(12), good[1])).trouble[0]
    assert "right camera" in after((good[0], flat(12))).trouble[0]


def test_one_bad_frame_is_no_trouble_and_a_trouble_passes() -> None:
    good, bad = pair(12.0), brighter(pair(12.0), 0.2)
    seen, said = Watch(), []
    for number, given in enumerate([good, bad, good, good, bad, bad, bad, good, good, good, good]):
        seen = watch(seen, *given, depth_of(*given, CAMERAS), 0.01 * number)
        said.append(kinds(seen.trouble))
    assert said == [set()] * 5 + [{DARK}] * 4 + [set()] * 2


def test_features_are_looked_for_once_a_second() -> None:
    good = pair(12.0)
    image, seen, times = depth_of(*good, CAMERAS), Watch(), []
    for number in range(25):
        seen = watch(seen, *good, image, 0.2 * number)
        times.append(seen.features.time)
    assert len(set(times)) == 5
    assert len(after(good, 30).features.looks) == 5
