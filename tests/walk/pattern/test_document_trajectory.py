"""The walking pattern without a body: rows, columns, and soles that move as their derivatives say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from walk.gaits import HEICUB, HRP2

from toddle.failures import BadInput
from toddle.robots.gait import Gait
from toddle.signals import Velocity
from toddle.walk.pattern.document import Document
from toddle.walk.pattern.trajectory import Trajectory, walk_pattern

LATE_LIFT = replace(HRP2, double_support=0.12)


def curve(gait: Gait) -> Trajectory:
    return walk_pattern(Document(gait), gait, lambda t: Velocity(0.03, 0.0, 0.1), 48)


@pytest.mark.parametrize("gait", [HRP2, HEICUB, LATE_LIFT], ids=["hrp2", "heicub", "late"])
def test_the_soles_move_as_their_derivatives_say(gait: Gait) -> None:
    """No sole jumps; at lift-off and landing alone the height's second derivative does, as 2.92 to 2.96 have it."""
    walked, dt = curve(gait), gait.command_period
    feet = walked.feet
    rise = np.diff(feet[:, 0], axis=0)
    mean = (feet[1:, 1] + feet[:-1, 1]) / 2
    bend = np.abs(feet[:, 2]).max()
    assert np.abs(rise / dt - mean).max() < bend * dt
    assert np.abs(feet[:, 0, :, 2]).max() == pytest.approx(gait.step_height, abs=1e-4)
    assert feet[:, 0, :, 2].min() > -1e-12


@pytest.mark.parametrize("gait", [HRP2, HEICUB, LATE_LIFT], ids=["hrp2", "heicub", "late"])
def test_each_sole_lands_where_the_plan_says_and_both_stand_in_double_support(gait: Gait) -> None:
    walked = curve(gait)
    rows_per_tick = round(gait.sample / gait.command_period)
    still = gait.still * rows_per_tick
    for tick, interval in enumerate(walked.intervals):
        landing = interval.landing
        assert landing is not None
        row = still + tick * rows_per_tick
        if interval.elapsed == 0 and tick:
            before = walked.intervals[tick - 1].landing
            assert before is not None
            there = walked.feet[row, 0, before.side]
            assert there == pytest.approx([before.x, before.y, 0.0, before.yaw], abs=1e-9)
            stands = walked.feet[row : row + round(gait.double_support / gait.command_period)]
            assert np.abs(stands[:, 1]).max() == 0.0
        standing = walked.feet[row : row + rows_per_tick, :, interval.support.side]
        assert np.abs(standing[:, 1:]).max() == 0.0


def test_the_table_has_a_row_for_each_command_period() -> None:
    table = curve(HRP2).columns()
    assert list(table)[:5] == ["t", "com_x", "com_y", "com_z", "com_yaw"]
    assert list(table)[-8:] == [f"{side}_{axis}" for side in ("left", "right") for axis in ("x", "y", "z", "yaw")]
    assert {len(column) for column in table.values()} == {200 + 48 * 20}
    np.testing.assert_allclose(np.diff(table["t"]), 0.005, atol=1e-12)
    assert np.all(table["com_z"] == 0.814)
    for axis in ("x", "y"):
        pressed = table[f"com_{axis}"] - 0.814 / 9.81 * table[f"com_{axis}_acceleration"]
        np.testing.assert_allclose(table[f"zmp_{axis}"], pressed, atol=1e-12)
    np.testing.assert_allclose(table["com_yaw"], (table["left_yaw"] + table["right_yaw"]) / 2, atol=1e-12)


def test_a_period_that_does_not_divide_the_sample_is_refused() -> None:
    gait = replace(HRP2, command_period=0.03)
    with pytest.raises(BadInput, match="command_period"):
        walk_pattern(Document(gait), gait, lambda t: Velocity(0.0, 0.0, 0.0), 1)
