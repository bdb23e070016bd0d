"""What the document's walker can be told, and what it remembers between two ticks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.walk.balance.estimate import Estimate
from toddle.walk.config import TICK
from toddle.walk.pattern.document import DocumentState
from toddle.walk.pattern.plan import Interval
from toddle.walk.state import Landing, Mode, Pose


@dataclass(frozen=True)
class FollowerConfig:
    """What can be chosen about it.

    Attributes:
        feed_forward: servos are commanded ahead by the torque that they have to hold.
        feedback: share of the measured centre of mass, place and velocity, in what an iteration begins with.
        shift_time: of the weight shift before the first step [s].
        stop_time: of the one after the last step, which begins in full motion [s].
        deadline_ms: an iteration that takes longer is not used; None: no deadline.
    """

    feed_forward: bool = True
    feedback: float = 0.0
    shift_time: float = 2.0
    stop_time: float = 0.8
    deadline_ms: float | None = None

    def __post_init__(self) -> None:
        """Refuses what can't be followed.

        Raises:
            BadInput: a share beyond 0 to 1, or no time.
        """
        if not 0 <= self.feedback <= 1:
            raise BadInput(f"{self.feedback} is no share", where="follower option feedback", remedy="give 0 to 1")
        if not min(self.shift_time, self.stop_time) > TICK:
            raise BadInput("there is no time", where="follower options shift_time, stop_time", remedy="give seconds")


class Stride(NamedTuple):
    """One step under way: the side that carries, where it stands, its double support, the time since it began [s]."""

    stance: int
    foot: Pose
    double_support: float
    phase: float


class FollowerState(NamedTuple):
    """Everything that the next tick depends on.

    Attributes:
        t: time [s].
        mode: what the feet do.
        step: the step under way, or the last one.
        since: time since the interval or the weight shift began [s].
        com: centre of mass at that beginning: position, velocity, acceleration of x and y [m, s].
        feet: both soles at that beginning: position, velocity, acceleration of x, y, z, yaw [m, rad, s].
        goal: where a weight shift goes [m].
        next: what follows it.
        pattern: the document's, between two iterations.
        interval: of its plan, under way.
        anchors: poses in the plan of the soles: where each stands or last stood; x, y, z, yaw.
        load: planned share of the weight on each foot.
        q: the last posture.
        landings: the last three touchdowns, chained by what the sensors told of each.
        estimate: the last one.
    """

    t: float
    mode: Mode
    step: Stride
    since: float
    com: Float[np.ndarray, "2 3"]
    feet: Float[np.ndarray, "3 2 4"]
    goal: tuple[float, float]
    next: Mode
    pattern: DocumentState
    interval: Interval | None
    anchors: Float[np.ndarray, "2 4"]
    load: tuple[float, float]
    q: Float[np.ndarray, " positions"]
    landings: tuple[Landing, ...]
    estimate: Estimate | None
