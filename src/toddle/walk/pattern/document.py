"""The document's own walking pattern, as a reference (Huber 2019, section 2.1.3).

One Gauss-Newton step an iteration, from the last iteration's unknowns, which are not shifted. Its trajectories are the
exact optimum of the problem that the author's program states: the velocity turned by the mean of the soles' yaws one
sample ahead, yaws predicted one iteration back, the next footstep frozen in a step's last two samples.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT
from toddle.signals import Circle, Footstep, Velocity
from toddle.walk.pattern.document_problem import Model, model, positions, solve, yaw_jerks, yaws
from toddle.walk.pattern.plan import Interval, Status, com_at_start, standing
from toddle.walk.pattern.time_stepping import advance


class Plan(NamedTuple):
    """The unknowns (2.52): jerks of the centre of mass [m/s^3], footsteps [m], yaw jerks of the soles [rad/s^3]."""

    jerks: Float[np.ndarray, "2 samples"]
    footsteps: Float[np.ndarray, "steps 2"]
    yaw_jerks: Float[np.ndarray, "2 samples"]


class DocumentState(NamedTuple):
    """Between two iterations.

    Attributes:
        com: x, y of the centre of mass: position, velocity, acceleration [m, s].
        yaw: of left and right sole: angle, rate, acceleration [rad, s].
        support: the sole that stands.
        lifted: where the other one stood last.
        left: samples left of this step.
        turned: yaws of the footsteps to come, as the last iteration saw them [rad].
        plan: the last iteration's.
        planned: whether there was one.
    """

    com: Float[np.ndarray, "2 3"]
    yaw: Float[np.ndarray, "2 3"]
    support: Footstep
    lifted: Footstep
    left: int
    turned: Float[np.ndarray, " steps"]
    plan: Plan
    planned: bool


@dataclass(frozen=True)
class Document:
    """The pattern for one gait, by its own ``objective``.

    Attributes:
        gait: its step must be a whole number of samples.
        deadline: an iteration that takes longer is not used [ms].
        clock: in seconds.
    """

    gait: Gait
    deadline: float = np.inf
    clock: Callable[[], float] = time.perf_counter
    model: Model = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Works out the constant parts.

        Raises:
            BadInput: the gait has no hull, or its step is not a whole number of samples.
        """
        object.__setattr__(self, "model", model(self.gait))

    def start(self) -> DocumentState:
        """The left sole is to carry first."""
        samples, steps = self.gait.preview, self.gait.steps
        left, right = standing(self.gait)
        plan = Plan(np.zeros((2, samples)), np.zeros((steps, 2)), np.zeros((2, samples)))
        com = com_at_start(self.gait)
        return DocumentState(com, np.zeros((2, 3)), left, right, self.model.samples, np.zeros(steps), plan, False)

    def step(
        self, state: DocumentState, velocity: Velocity, obstacles: Sequence[Circle] = ()
    ) -> tuple[DocumentState, Interval]:
        """One iteration."""
        began = self.clock()
        plan, status = self._solve(state, velocity, obstacles)
        milliseconds = (self.clock() - began) * 1e3
        if milliseconds > self.deadline:
            plan, status = shifted(self.model, state), Status.LATE
        turned = self._predict(state, plan)
        side, gait = state.support.side, self.gait
        landing = Footstep(1 - side, float(plan.footsteps[0, 0]), float(plan.footsteps[0, 1]), float(turned[0]))
        interval = Interval(
            gait.sample,
            state.com,
            plan.jerks[:, 0],
            state.support,
            landing,
            (self.model.samples - state.left) * gait.sample,
            state.left * gait.sample,
            status,
            milliseconds,
        )
        com = advance(state.com, plan.jerks[:, 0], gait.sample)
        yaw = advance(state.yaw, plan.yaw_jerks[:, 0], gait.sample)
        if state.left == 1:
            return DocumentState(com, yaw, landing, state.support, self.model.samples, turned, plan, True), interval
        return DocumentState(com, yaw, state.support, state.lifted, state.left - 1, turned, plan, True), interval

    def _solve(self, state: DocumentState, velocity: Velocity, obstacles: Sequence[Circle]) -> tuple[Plan, Status]:
        """The new plan, or the shifted last one and why."""
        soles = np.concatenate([[state.support.yaw], state.turned])
        moving = positions(
            self.model,
            state.left,
            state.com,
            self._in_world(state, velocity),
            np.array([state.support.x, state.support.y]),
            state.support.side,
            soles,
            state.plan.footsteps,
            obstacles,
        )
        turning = yaws(self.model, state.left, state.support.side, state.yaw, velocity.omega)
        if not all(np.isfinite(part).all() for part in (moving.gradient, moving.rows, turning.gradient, turning.upper)):
            return shifted(self.model, state), Status.NOT_FINITE
        unknowns, rates = solve(moving), solve(turning)
        if unknowns is None or rates is None:
            return shifted(self.model, state), Status.INFEASIBLE
        if not (np.isfinite(unknowns).all() and np.isfinite(rates).all()):
            return shifted(self.model, state), Status.NOT_FINITE
        axes = unknowns.reshape(2, -1)
        samples = self.gait.preview
        jerks = yaw_jerks(self.model, state.left, state.support.side, state.yaw, rates)
        return Plan(axes[:, :samples], axes[:, samples:].T, jerks), Status.SOLVED

    def _in_world(self, state: DocumentState, velocity: Velocity) -> Float[np.ndarray, "2"]:
        """The commanded velocity, turned by the mean of the soles' yaws one sample ahead."""
        psi = advance(state.yaw, state.plan.yaw_jerks[:, 0], self.gait.sample)[:, 0].mean()
        c, s = np.cos(psi), np.sin(psi)
        return np.array([c * velocity.vx - s * velocity.vy, s * velocity.vx + c * velocity.vy])

    def _predict(self, state: DocumentState, plan: Plan) -> Float[np.ndarray, " steps"]:
        """The yaw of each footstep to come at the first sample at which it carries; 0 beyond the horizon."""
        matrices, first = self.model.matrices, self.model.previews[state.left - 1].first
        angle = state.yaw @ matrices.position_state.T + plan.yaw_jerks @ matrices.position_jerk.T
        carries = (state.support.side + 1 + np.arange(len(first))) % 2
        seen = first < self.gait.preview
        return np.where(seen, angle[carries, np.where(seen, first, 0)], 0.0)


def shifted(model: Model, state: DocumentState) -> Plan:
    """The last plan, one sample on: what is done when an iteration has no answer.

    Its last sample has no jerk. At the beginning of a step the footsteps move up by one and the last is set beside its
    forerunner; before the first iteration the feet stay where they are.
    """
    plan, steps = state.plan, len(state.plan.footsteps)
    footsteps = plan.footsteps
    if not state.planned:
        places = np.array([[state.lifted.x, state.lifted.y], [state.support.x, state.support.y]])
        footsteps = places[np.arange(steps) % 2]
    elif state.left == model.samples:
        line = np.concatenate([[[state.support.x, state.support.y]], footsteps[1:]])
        carrier = state.support.side if steps % 2 else 1 - state.support.side
        across = model.gait.foot_distance * (-1.0 if carrier == LEFT else 1.0)
        beside = line[-1] + across * np.array([-np.sin(state.support.yaw), np.cos(state.support.yaw)])
        footsteps = np.concatenate([line[1:], beside[None]])
    return Plan(_on(plan.jerks), footsteps, _on(plan.yaw_jerks))


def _on(jerks: Float[np.ndarray, "2 samples"]) -> Float[np.ndarray, "2 samples"]:
    return np.concatenate([jerks[:, 1:], np.zeros((2, 1))], axis=1)
