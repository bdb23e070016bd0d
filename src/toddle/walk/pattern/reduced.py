"""The default walking pattern, closed over itself: each iteration begins where the last one's jerk has led.

stand --command--> weight shift, first step --> step ... --no command--> two more steps --> stand, feet side by side
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import Circle, Footstep, Velocity
from toddle.walk.pattern.feasible import cap
from toddle.walk.pattern.nmpc import NEVER, Nmpc, Plan, PlanState, Weights, nmpc, plan
from toddle.walk.pattern.obstacles import circles
from toddle.walk.pattern.plan import Interval, com_at_start, standing
from toddle.walk.pattern.time_stepping import advance

_MOVING = 1e-6
_FREEZE = 1.5  # samples before its landing, a foot is no longer redirected


class ReducedState(NamedTuple):
    """Between two iterations.

    Attributes:
        at: where the pattern is.
        plan: the last one.
        shift: part of this step's double support that brings the weight over out of standing [s].
    """

    at: PlanState
    plan: Plan | None
    shift: float


@dataclass(frozen=True)
class Reduced:
    """The pattern for one gait.

    Attributes:
        gait: how the robot steps.
        weights: of the objective; None: the defaults.
        deadline_ms: an iteration that takes longer isn't used; None: none is late.
        problem: what doesn't change.
    """

    gait: Gait
    weights: Weights | None = None
    deadline_ms: float | None = None
    problem: Nmpc = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Works out the constant parts.

        Raises:
            BadInput: the gait's hull can't be used.
        """
        object.__setattr__(self, "problem", nmpc(self.gait, self.weights, freeze=_FREEZE * self.gait.sample))

    def start(self) -> ReducedState:
        """Standing."""
        left, right = standing(self.gait)
        gait = self.gait
        over = gait.double_support
        origin = (right.x, right.y)
        at = PlanState(com_at_start(gait), left, right, origin, over, gait.step_time, over, 0)
        return ReducedState(at, None, 0.0)

    def step(
        self, state: ReducedState, velocity: Velocity, obstacles: Sequence[Circle] = ()
    ) -> tuple[ReducedState, Interval]:
        """One iteration; it lasts a sample, or what is left of the step. The command is capped to what fits."""
        velocity = cap(velocity, self.gait)
        at, shift = self._commanded(state, velocity)
        found = plan(self.problem, at, velocity, circles(obstacles), state.plan, self.deadline_ms)
        stands = at.halt == 0
        duration = self.gait.sample if stands else _whole(self.gait.sample, at.remaining)
        landing = Footstep(1 - at.support.side, *(float(number) for number in found.feet[0]))
        interval = Interval(
            duration,
            at.com,
            found.jerk,
            at.support,
            None if stands or at.phase < shift else landing,
            at.phase - shift,
            at.remaining,
            found.status,
            found.milliseconds,
        )
        com = advance(at.com, found.jerk, duration)
        if stands:
            return ReducedState(at._replace(com=com, phase=at.phase + duration), found, 0.0), interval
        if duration < at.remaining:
            moved = at._replace(com=com, phase=at.phase + duration, remaining=at.remaining - duration)
            return ReducedState(moved, found, shift), interval
        landed = PlanState(
            com,
            landing,
            at.support,
            (at.support.x, at.support.y),
            0.0,
            self.gait.step_time,
            self.gait.double_support,
            max(at.halt - 1, NEVER) if at.halt > 0 else NEVER,
        )
        return ReducedState(landed, found, 0.0), interval

    def _commanded(self, state: ReducedState, velocity: Velocity) -> tuple[PlanState, float]:
        """The state with what the command makes of it: begin, go on, or halt; and the weight shift's time."""
        at, gait = state.at, self.gait
        moving = max(map(abs, velocity)) > _MOVING
        if at.halt == 0:
            if not moving:
                return at, 0.0
            support, other = self._first(at, velocity)
            shift = weight_shift(gait)
            begun = PlanState(
                at.com,
                support,
                other,
                _pressed(at, state.plan),
                0.0,
                shift + gait.step_time,
                shift + gait.double_support,
                NEVER,
            )
            return begun, shift
        if moving:
            return at._replace(halt=NEVER), state.shift
        if at.halt == NEVER:
            return at._replace(halt=1 if at.phase < state.shift else 2), state.shift
        return at, state.shift

    def _first(self, at: PlanState, velocity: Velocity) -> tuple[Footstep, Footstep]:
        """Who carries first: the sole that the centre of mass is over, else the one the command leads away from."""
        left, right = (at.support, at.lifted) if at.support.side == LEFT else (at.lifted, at.support)
        away = [np.hypot(at.com[0, 0] - foot.x, at.com[1, 0] - foot.y) for foot in (left, right)]
        if abs(away[LEFT] - away[RIGHT]) > self.gait.foot_distance / 2:
            return (left, right) if away[LEFT] < away[RIGHT] else (right, left)
        return (left, right) if velocity.vy + 0.1 * velocity.omega <= 0 else (right, left)


def weight_shift(gait: Gait) -> float:
    """Half a step's time, in whole samples [s]."""
    return max(round(gait.step_time / 2 / gait.sample), 1) * gait.sample


def _whole(sample: float, remaining: float) -> float:
    """A sample, or what is left, where that is no more than a sample or a rounding error above it [s]."""
    return remaining if remaining < sample + 1e-6 else sample


def _pressed(at: PlanState, last: Plan | None) -> tuple[float, float]:
    """The ZMP of a robot that stands [m]: as planned; before any plan, under the centre of mass."""
    if last is None:
        return float(at.com[0, 0]), float(at.com[1, 0])
    return float(last.zmp[0, 0]), float(last.zmp[0, 1])
