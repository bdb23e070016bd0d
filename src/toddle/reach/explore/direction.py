"""Goal babbling with direction sampling (Rolf 2013; Mahboob 2015, section 4.1, equations 4.1-4.5).

Goals follow a line, x*_t = x*_(t-1) + step in a random direction, and the learner is asked for each with a perturbation
that changes slowly: q = g(x*) + E(x*), E(x) = A x + b. Each sample is weighted by how well the tip went where it was
meant to go, w_dir = (1 + cos angle(dx, dx*)) / 2, and by how much it moved for the effort, w_eff = min(1, |dx| / |dq|).

A line ends at the boundary of what can be reached: where the tip moves against the line, or less than a tenth of what
was asked for (an arm that is clipped at its limits stands still, and never moves against anything). The next line
starts where the tip came to be; sometimes the arm first moves home, along a straight line in joint space. A home that
is bent to one side, and many ways home, keep the arm to one way of reaching where it has several.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from toddle.failures import BadInput
from toddle.reach.explore.explorer import Explorer, Home, Predict, Proposal
from toddle.reach.unit_box import UnitBox


class Walk(NamedTuple):
    """Where the exploration stands (unit box).

    Attributes:
        q, x: the last movement: its joint values, and where the tip came to be.
        goal: where the line stands, x*_(t-1).
        step: the line's step, dx*.
        linear, constant: A [rad/m] and b [rad] of the perturbation.
        ended: the next movement begins a new line.
        homing: the arm is on its way home.
        goes_home: the arm moves home, should the line end now.
        fresh: nothing was perturbed so far: A and b are still to be drawn.
    """

    q: Float[Array, " joints"]
    x: Float[Array, " space"]
    goal: Float[Array, " space"]
    step: Float[Array, " space"]
    linear: Float[Array, "joints space"]
    constant: Float[Array, " joints"]
    ended: Bool[Array, ""]
    homing: Bool[Array, ""]
    goes_home: Bool[Array, ""]
    fresh: Bool[Array, ""]


class WalkNoise(NamedTuple):
    """Standard normal steps of A and b, a direction of length 1, a number from 0 to 1 that decides on going home."""

    linear: Float[Array, "*count joints space"]
    constant: Float[Array, "*count joints"]
    direction: Float[Array, "*count space"]
    chance: Float[Array, "*count"]


class DirectionSampling(Explorer):
    """Goals along lines in random directions; everything below is in physical units, translated by the box.

    Attributes:
        box: the body's unit box.
        step: distance of one goal from the next [m].
        sigma: standard deviation of the entries of A [rad/m] and b [rad]: the size of the perturbation.
        sigma_delta: standard deviation of their change in one movement [rad/m, rad].
        p_home: probability that the arm moves home at a line's end.
        home_step: the most that a joint turns in one movement on the way home [rad].
        stall: a line ends where the tip makes less than this fraction of the step.
    """

    box: UnitBox
    step: Float[Array, ""]
    sigma: Float[Array, ""]
    sigma_delta: Float[Array, ""]
    p_home: Float[Array, ""]
    home_step: Float[Array, ""]
    stall: Float[Array, ""]

    def init(self, home: Home) -> Walk:
        """The arm stands at home and the first line begins there."""
        joints, space = len(home.q), len(home.x)
        yes, no = jnp.array(True), jnp.array(False)
        return Walk(
            home.q,
            home.x,
            home.x,
            jnp.zeros(space),
            jnp.zeros((joints, space)),
            jnp.zeros(joints),
            ended=yes,
            homing=no,
            goes_home=no,
            fresh=yes,
        )

    def draw(self, key: jax.Array, count: int, home: Home) -> WalkNoise:
        """A step of the perturbation for each movement, and a direction in case a line begins."""
        joints, space = len(home.q), len(home.x)
        for_walk, for_direction, for_chance = jax.random.split(key, 3)
        walk = jax.random.normal(for_walk, (count, joints, space + 1))
        direction = jax.random.normal(for_direction, (count, space))
        direction = direction / jnp.linalg.norm(direction, axis=-1, keepdims=True)
        return WalkNoise(walk[:, :, :space], walk[:, :, space], direction, jax.random.uniform(for_chance, (count,)))

    def propose(self, state: Walk, noise: WalkNoise, predict: Predict, home: Home) -> tuple[Walk, Proposal]:
        """The next goal of the line (equation 4.1), with g(x*) + E(x*) (4.5); or the next movement on the way home."""
        state = self._perturb(state, noise)
        start = jnp.where(state.ended, state.x, state.goal)
        step = jnp.where(state.ended, self.step * noise.direction / self.box.space_span, state.step)
        goal = start + step
        perturbation = state.linear @ self.box.x_from_unit(goal) + state.constant
        reaching = predict(goal) + perturbation / self.box.joint_span
        most = self.home_step / self.box.joint_span
        returning = state.q + jnp.clip(home.q - state.q, -most, most)
        state = state._replace(goal=goal, step=step, ended=jnp.array(False), goes_home=noise.chance < self.p_home)
        q = jnp.where(state.homing, returning, jnp.clip(reaching, 0.0, 1.0))
        return state, Proposal(q, jnp.where(state.homing, home.x, goal))

    def observe(
        self, state: Walk, proposal: Proposal, x: Float[Array, " space"], home: Home
    ) -> tuple[Walk, Float[Array, ""]]:
        """Whether the line has ended (equation 4.2), and w_dir w_eff; on the way home w_eff alone."""
        moved = (x - state.x) * self.box.space_span
        asked = state.step * self.box.space_span
        effort = jnp.linalg.norm((proposal.q - state.q) * self.box.joint_span)
        distance = jnp.linalg.norm(moved)
        progress = jnp.sum(moved * asked)
        cosine = progress / jnp.maximum(distance * self.step, 1e-12)
        efficiency = jnp.minimum(1.0, distance / jnp.maximum(effort, 1e-12))
        weight = efficiency * jnp.where(state.homing, 1.0, (1.0 + cosine) / 2.0)
        at_home = state.homing & jnp.all(jnp.abs(proposal.q - home.q) < 1e-6)
        boundary = ~state.homing & (progress < self.stall * self.step**2)
        homing = (state.homing & ~at_home) | (boundary & state.goes_home)
        return state._replace(q=proposal.q, x=x, ended=at_home | boundary, homing=homing), weight

    def _perturb(self, state: Walk, noise: WalkNoise) -> Walk:
        """A random walk of A and b that keeps their variance: A <- c (A + N(0, sd^2)), c^2 = s^2 / (s^2 + sd^2)."""
        keep = self.sigma / jnp.sqrt(self.sigma**2 + self.sigma_delta**2)
        walk = lambda old, drawn: jnp.where(  # noqa: E731
            state.fresh, self.sigma * drawn, keep * (old + self.sigma_delta * drawn)
        )
        return state._replace(
            linear=walk(state.linear, noise.linear),
            constant=walk(state.constant, noise.constant),
            fresh=jnp.array(False),
        )


def direction_sampling(
    box: UnitBox,
    *,
    step: float = 0.02,
    sigma: float = 0.05,
    p_home: float = 0.5,
    home_step: float = 0.03,
    stall: float = 0.1,
) -> DirectionSampling:
    """Direction sampling for an arm of about one metre.

    Step and perturbation are Rolf's. He goes home at one line's end in ten; with one in two the arm keeps to one way of
    reaching, and lines that end when the tip stalls are short enough for it.

    Args:
        box: the body's unit box, of one scale for all axes of space (`around(..., isotropic=True)`).
        step: distance of one goal from the next [m].
        sigma: size of the perturbation [rad]; it changes by a tenth of this each movement.
        p_home: probability that the arm moves home at a line's end.
        home_step: the most that a joint turns in one movement on the way home [rad].
        stall: a line ends where the tip makes less than this fraction of the step.

    Raises:
        BadInput: a length or an angle is not positive, or a probability or fraction not in [0, 1].
    """
    for what, value in (("step", step), ("size of the perturbation", sigma), ("step home", home_step)):
        if not 0 < value < math.inf:
            raise BadInput(f"the {what} is {value}", remedy="give a positive number")
    for what, value in (("probability of going home", p_home), ("stall", stall)):
        if not 0 <= value <= 1:
            raise BadInput(f"the {what} is {value}", remedy="give a number from 0 to 1")
    as_array = lambda value: jnp.float32(value)  # noqa: E731
    return DirectionSampling(box, *(as_array(value) for value in (step, sigma, 0.1 * sigma, p_home, home_step, stall)))
