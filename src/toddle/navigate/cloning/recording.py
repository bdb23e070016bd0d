"""One drive through a room, as it was seen: what a network learns from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float32, Int, UInt8

from toddle.navigate.scenarios.rooms import Scenario, Split, Style
from toddle.navigate.task import Outcome


class RoomKey(NamedTuple):
    """Which room: `draw_rooms` draws it again from these."""

    scenario: Scenario
    split: Split
    style: Style
    number: int


class Recording(NamedTuple):
    """An episode, a row for each decision.

    Velocities are vx, vy [m/s] and omega [rad/s].

    Attributes:
        room: where.
        driver: who steered, such as expert, person, policy.
        seed: of the drive.
        outcome: how it ended.
        t: time of each look [s].
        picture: what was seen.
        depth: likewise [m]; 0 where it was not known.
        velocity: what the safety gate had let through last: known to who decides.
        asked: what the driver then asked for, and the robot walked.
        taught: what the teacher would have asked for at this look: what is learned.
        place: true x, y [m] and yaw [rad] of the waist.
        circles: x, y, radius [m] of the target, the other things and the people; as many in each row.
        pixels: how many pixels of the small picture show each of these.
    """

    room: RoomKey
    driver: str
    seed: int
    outcome: Outcome
    t: Float[np.ndarray, " looks"]
    picture: UInt8[np.ndarray, "looks 60 80 3"]
    depth: Float32[np.ndarray, "looks 60 80"]
    velocity: Float[np.ndarray, "looks 3"]
    asked: Float[np.ndarray, "looks 3"]
    taught: Float[np.ndarray, "looks 3"]
    place: Float[np.ndarray, "looks 3"]
    circles: Float[np.ndarray, "looks things 3"]
    pixels: Int[np.ndarray, "looks things"]
