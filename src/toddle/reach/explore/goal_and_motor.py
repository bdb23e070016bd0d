"""Goal and motor babbling (Mahboob 2015, section 4.2, equations 4.7-4.9 and algorithm 1).

The arm follows lines: a perturbation E is drawn once a line and added both to the last reached position, which gives
the goal, and to the motors that the learner answers for that goal. A line ends when motors saturate.

The text leaves open how E is drawn, from where a line goes on, and says that it ends when "all the motors" saturate.
Read literally, lines almost never end and the tables cannot be had. The default is the reading that reproduces them:
E = +-e with a random sign for each component, a line ends at the first saturated motor, or where the tip stops moving:
a learner that has learned "from here, for there, stay" would otherwise stay for good.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from toddle.reach.explore.explorer import Explorer, Home, Predict, Proposal


class LineState(NamedTuple):
    """Where the line stands: last reached position, its perturbation, and whether a new line begins."""

    position: Float[Array, " space"]
    goal_step: Float[Array, " space"]
    motor_step: Float[Array, " joints"]
    ended: Bool[Array, ""]


class LineNoise(NamedTuple):
    """The perturbation of a line, should one begin: signs (or fractions) for goal and motors."""

    goal: Float[Array, "*count space"]
    motor: Float[Array, "*count joints"]


class GoalAndMotorBabbling(Explorer):
    """Lines in goal space with motor perturbation.

    Attributes:
        perturbation: e, the size of each component of E in the unit box (the thesis's best: 0.233).
        ends: a line ends when "any" motor saturates (reproduces the tables), or "all" of them (the text's words).
        draws: components of E are "signs" (+-e), or "uniform" in [-e, e].
        stall: a line ends too when the tip moves less than this share of what was meant; 0: never.
        restart: a new line starts at the "last" reached position, or at "home".
    """

    perturbation: Float[Array, ""]
    ends: Literal["any", "all"] = eqx.field(static=True, default="any")
    draws: Literal["signs", "uniform"] = eqx.field(static=True, default="signs")
    restart: Literal["last", "home"] = eqx.field(static=True, default="last")
    stall: float = eqx.field(static=True, default=0.1)

    def init(self, home: Home) -> LineState:
        """The first line begins at home."""
        return LineState(home.x, jnp.zeros_like(home.x), jnp.zeros_like(home.q), jnp.array(True))

    def draw(self, key: jax.Array, count: int, home: Home) -> LineNoise:
        """A perturbation for each movement; only those at which a line begins are used."""
        sizes = (len(home.x), len(home.q))
        if self.draws == "signs":
            drawn = jax.random.rademacher(key, (count, sum(sizes)), jnp.float32)
        else:
            drawn = jax.random.uniform(key, (count, sum(sizes)), minval=-1.0, maxval=1.0)
        return LineNoise(drawn[:, : sizes[0]], drawn[:, sizes[0] :])

    def propose(self, state: LineState, noise: LineNoise, predict: Predict, home: Home) -> tuple[LineState, Proposal]:
        """P* = P + E, M** = I(P*) + E (equations 4.7, 4.8), motors kept within their limits."""
        goal_step = jnp.where(state.ended, self.perturbation * noise.goal, state.goal_step)
        motor_step = jnp.where(state.ended, self.perturbation * noise.motor, state.motor_step)
        start = jnp.where(state.ended, home.x, state.position) if self.restart == "home" else state.position
        goal = start + goal_step
        motors = predict(goal) + motor_step
        saturated = (motors <= 0.0) | (motors >= 1.0)
        ended = jnp.any(saturated) if self.ends == "any" else jnp.all(saturated)
        state = LineState(start, goal_step, motor_step, ended)
        return state, Proposal(jnp.clip(motors, 0.0, 1.0), goal)

    def observe(
        self, state: LineState, proposal: Proposal, x: Float[Array, " space"], home: Home
    ) -> tuple[LineState, Float[Array, ""]]:
        """The line goes on from where the tip came to be."""
        stalled = jnp.sum((x - state.position) ** 2) < self.stall**2 * jnp.sum(state.goal_step**2)
        return state._replace(position=x, ended=state.ended | stalled), jnp.float32(1.0)
