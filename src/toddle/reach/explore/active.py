"""Active exploration: go where there is most to learn (Moulin-Frier and Oudeyer 2013; Mahboob 2015, section 2.2.2).

The space that is chosen from, goals or motors, is cut into a regular grid of regions. Each keeps a window of its latest
errors; its interest is the learning progress in it: how far the mean errors of the older and of the newer half of the
window lie apart. Regions are chosen in proportion to their interest, now and then uniformly at random.

The error of a goal is the distance from where the tip came to be (competence). The error of motors is what the learner
would answer, after this movement, for the position they led to: |g(x) - q|, seen without another movement.

A grid over many joints has no end: regions cut the first three axes at most (the joints nearest to the base, which move
the tip the most), about a hundred of them in all; the other joints are drawn over their whole range.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from toddle.reach.explore.explorer import Explorer, Home, Predict, Proposal

_PER_AXIS = {1: 100, 2: 10, 3: 5}


class Interest(NamedTuple):
    """What is remembered of each region.

    Attributes:
        errors: its latest errors, the oldest first (unit box).
        entries: how often it was tried.
        progress: its interest; 0 until its window is full.
    """

    errors: Float[Array, "regions window"]
    entries: Int[Array, " regions"]
    progress: Float[Array, " regions"]


class Choice(NamedTuple):
    """Numbers from 0 to 1: which region (by interest, or uniformly), where in it; and normal noise for the motors."""

    region: Float[Array, "*count"]
    uniform: Float[Array, "*count"]
    place: Float[Array, "*count axes"]
    motor: Float[Array, "*count joints"]


def grid(axes: int) -> tuple[int, int]:
    """How many axes are cut, and into how many parts each."""
    cut = min(axes, 3)
    return cut, _PER_AXIS[cut]


def nothing_tried(axes: int, window: int) -> Interest:
    """The record before the first movement."""
    cut, parts = grid(axes)
    regions = parts**cut
    return Interest(jnp.zeros((regions, window)), jnp.zeros(regions, jnp.int32), jnp.zeros(regions))


def region_of(point: Float[Array, " axes"]) -> Int[Array, ""]:
    """The region that a point of the unit box lies in."""
    cut, parts = grid(len(point))
    index = jnp.clip(jnp.floor(point[:cut] * parts).astype(jnp.int32), 0, parts - 1)
    return jnp.sum(index * jnp.array([parts**axis for axis in range(cut)]))


def note(interest: Interest, region: Int[Array, ""], error: Float[Array, ""]) -> Interest:
    """The record after an error was seen in a region."""
    window = interest.errors.shape[1]
    latest = jnp.append(interest.errors[region, 1:], error)
    entries = interest.entries[region] + 1
    progress = jnp.abs(jnp.mean(latest[: window // 2]) - jnp.mean(latest[window // 2 :]))
    return Interest(
        interest.errors.at[region].set(latest),
        interest.entries.at[region].set(entries),
        interest.progress.at[region].set(jnp.where(entries >= window, progress, 0.0)),
    )


def choose(interest: Interest, choice: Choice, explore: Float[Array, ""]) -> Float[Array, " axes"]:
    """A point, uniform in a region chosen by interest; with probability `explore` in any region."""
    # a region whose window is not full yet is as interesting as the known ones are on average
    known = interest.entries >= interest.errors.shape[1]
    average = jnp.sum(interest.progress) / jnp.maximum(jnp.sum(known.astype(jnp.float32)), 1.0)
    weight = jnp.where(known, interest.progress, average) + 1e-12
    by_interest = jnp.cumsum(weight) / jnp.sum(weight)
    regions = len(weight)
    chosen = jnp.searchsorted(by_interest, choice.region)
    anyone = (choice.region * regions).astype(jnp.int32)
    region = jnp.minimum(jnp.where(choice.uniform < explore, anyone, chosen), regions - 1)
    cut, parts = grid(len(choice.place))
    index = region // jnp.array([parts**axis for axis in range(cut)]) % parts
    return choice.place.at[:cut].set((index.astype(jnp.float32) + choice.place[:cut]) / parts)


class ActiveGoalExploration(Explorer):
    """Goals from the regions in which competence changes most.

    Attributes:
        perturbation: standard deviation of the noise on each joint, as a fraction of its range.
        explore: probability of a region drawn uniformly.
        window: how many of its latest errors a region keeps.
    """

    perturbation: Float[Array, ""]
    explore: Float[Array, ""]
    window: int = eqx.field(static=True, default=20)

    def init(self, home: Home) -> Interest:
        """Nothing tried so far."""
        return nothing_tried(len(home.x), self.window)

    def draw(self, key: jax.Array, count: int, home: Home) -> Choice:
        """The numbers that choose a goal, and the noise."""
        return _draw(key, count, len(home.x), len(home.q))

    def propose(self, state: Interest, noise: Choice, predict: Predict, home: Home) -> tuple[Interest, Proposal]:
        """A goal where there is most to learn, and the learner's answer for it, perturbed."""
        goal = choose(state, noise, self.explore)
        q = predict(goal) + self.perturbation * noise.motor
        return state, Proposal(jnp.clip(q, 0.0, 1.0), goal)

    def observe(
        self, state: Interest, proposal: Proposal, x: Float[Array, " space"], home: Home
    ) -> tuple[Interest, Float[Array, ""]]:
        """The distance between goal and tip is noted in the goal's region; every sample counts alike."""
        error = jnp.linalg.norm(proposal.goal - x)
        return note(state, region_of(proposal.goal), error), jnp.float32(1.0)


class MotorInterest(NamedTuple):
    """The regions, and the last movement, whose error is asked of the learner before the next one."""

    interest: Interest
    q: Float[Array, " joints"]
    x: Float[Array, " space"]


class ActiveMotorExploration(Explorer):
    """Postures from the regions of joint space in which the inverse estimate changes most.

    Attributes:
        explore: probability of a region drawn uniformly.
        window: how many of its latest errors a region keeps.
    """

    explore: Float[Array, ""]
    window: int = eqx.field(static=True, default=20)

    def init(self, home: Home) -> MotorInterest:
        """Nothing tried so far; the arm stands at home."""
        return MotorInterest(nothing_tried(len(home.q), self.window), home.q, home.x)

    def draw(self, key: jax.Array, count: int, home: Home) -> Choice:
        """The numbers that choose a posture."""
        return _draw(key, count, len(home.q), 0)

    def propose(
        self, state: MotorInterest, noise: Choice, predict: Predict, home: Home
    ) -> tuple[MotorInterest, Proposal]:
        """A posture where there is most to learn; its goal is no better known than home."""
        error = jnp.linalg.norm(jnp.clip(predict(state.x), 0.0, 1.0) - state.q)
        interest = note(state.interest, region_of(state.q), error)
        return state._replace(interest=interest), Proposal(choose(interest, noise, self.explore), home.x)

    def observe(
        self, state: MotorInterest, proposal: Proposal, x: Float[Array, " space"], home: Home
    ) -> tuple[MotorInterest, Float[Array, ""]]:
        """The movement is kept until the learner has learned from it; every sample counts alike."""
        return state._replace(q=proposal.q, x=x), jnp.float32(1.0)


def _draw(key: jax.Array, count: int, axes: int, joints: int) -> Choice:
    """The numbers of `count` choices among points with this many axes."""
    for_choice, for_motor = jax.random.split(key)
    drawn = jax.random.uniform(for_choice, (count, axes + 2))
    return Choice(drawn[:, 0], drawn[:, 1], drawn[:, 2:], jax.random.normal(for_motor, (count, joints)))
