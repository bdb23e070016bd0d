"""Runs of evolution side by side: populations are tried on all goals at once, and the best of each run is kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.evolve import neat, strategy
from toddle.reach.evolve.controller import Shape, inputs_of, joints_of, respond
from toddle.reach.evolve.genomes import Genomes, Nodes, activations
from toddle.reach.evolve.score import Arm, scores

Tell = Callable[[float], bool]
"""Called with the share of the generations that are done; what it returns says whether to stop."""


@dataclass(frozen=True)
class Effort:
    """How much is tried.

    Attributes:
        runs: side by side, each with its own luck.
        population: individuals of a run.
        generations: of each run.
        seed: of all of them.
    """

    runs: int = 30
    population: int = 50
    generations: int = 1000
    seed: int = 0


class Evolution(NamedTuple):
    """What runs came to.

    Attributes:
        course: lowest mean squared distance so far, generation by generation [m^2].
        answers: joint values of each run's best controller for any goals: (goals space) -> (runs joints goals).
    """

    course: Float[np.ndarray, "generations runs"]
    answers: Callable[[Float[np.ndarray, "goals space"]], Float[np.ndarray, "runs joints goals"]]

    @property
    def mse(self) -> Float[np.ndarray, " runs"]:
        """The lowest of each run [m^2]."""
        return self.course[-1]


def evolve_weights(
    arm: Arm,
    shape: Shape,
    goals: Float[np.ndarray, "goals space"],
    effort: Effort,
    *,
    sigma: float,
    tell: Tell = lambda done: False,
) -> Evolution:
    """CMA-ES on the weights of a network of fixed shape; every run starts at zero weights.

    Args:
        arm: whose forward kinematics scores.
        shape: of the controllers.
        goals: to be reached [m].
        effort: runs, population, generations.
        sigma: first step size, of all weights.
        tell: see `Tell`.
    """
    random = np.random.default_rng(effort.seed)
    inputs = inputs_of(shape, goals).astype(np.float32)  # scores need no more, and it is twice as fast
    constants = strategy.constants(shape.weights, effort.population)
    search = strategy.begin(np.zeros((effort.runs, shape.weights)), sigma)
    best, kept, course = np.full(effort.runs, np.inf), np.zeros((effort.runs, shape.weights)), []
    runs = np.arange(effort.runs)
    for generation in range(effort.generations):
        tried = strategy.sample(search, effort.population, random)
        q = respond(shape, tried.reshape(-1, shape.weights), inputs)
        scored = scores(arm, q, goals).reshape(effort.runs, -1)
        search = strategy.advance(search, constants, tried, scored)
        first = scored.argmin(axis=1)
        better = scored[runs, first] < best
        best, kept = np.minimum(best, scored[runs, first]), np.where(better[:, None], tried[runs, first], kept)
        course.append(best)
        if tell((generation + 1) / effort.generations):
            break
    return Evolution(np.stack(course), lambda asked: respond(shape, kept, inputs_of(shape, asked)))


def evolve_networks(
    arm: Arm,
    shape: Shape,
    goals: Float[np.ndarray, "goals space"],
    effort: Effort,
    *,
    settings: neat.Settings,
    tell: Tell = lambda done: False,
) -> Evolution:
    """NEAT, from networks without hidden nodes; of the shape only the scales are used.

    Args:
        arm: whose forward kinematics scores.
        shape: its scales; NEAT finds the hidden nodes.
        goals: to be reached [m].
        effort: runs, population, generations.
        settings: of NEAT.
        tell: see `Tell`.
    """
    random = np.random.default_rng(effort.seed)
    inputs = inputs_of(shape, goals).astype(np.float32)
    now = neat.begin(effort.runs, effort.population, len(inputs), len(arm.lower), settings, random)
    best, course = np.full(effort.runs, np.inf), []
    kept, nodes = now.genomes.chosen(np.zeros((effort.runs, 1), int)), now.nodes
    for generation in range(effort.generations):
        q = _answers(shape, now.genomes, now.nodes, inputs)
        scored = scores(arm, q.reshape(-1, *q.shape[2:]), goals).reshape(effort.runs, -1)
        first = scored.argmin(axis=1)[:, None]
        lowest = np.take_along_axis(scored, first, 1)[:, 0]
        kept, nodes = _better(lowest < best, (now.genomes.chosen(first), now.nodes), (kept, nodes))
        best = np.minimum(best, lowest)
        course.append(best)
        if tell((generation + 1) / effort.generations) or generation + 1 == effort.generations:
            break
        now = neat.advance(now, scored, settings, random)
    return Evolution(np.stack(course), lambda asked: _answers(shape, kept, nodes, inputs_of(shape, asked))[:, 0])


def _answers(
    shape: Shape, genomes: Genomes, nodes: Nodes, inputs: Float[np.ndarray, "inputs goals"]
) -> Float[np.ndarray, "runs population joints goals"]:
    """Joint values of every network."""
    out = activations(genomes, nodes, inputs)
    return joints_of(shape, out.reshape(-1, *out.shape[2:])).reshape(out.shape)


def _better(
    better: Bool[np.ndarray, " runs"], new: tuple[Genomes, Nodes], old: tuple[Genomes, Nodes]
) -> tuple[Genomes, Nodes]:
    """Of each run the new individual and its run's nodes where it is better, else the old ones."""
    genomes = Genomes(*(np.where(better[:, None, None, None], a, b) for a, b in zip(new[0], old[0], strict=True)))
    depth = np.where(better[:, None], new[1].depth, old[1].depth)
    split = np.where(better[:, None, None], new[1].split, old[1].split)
    return genomes, new[1]._replace(depth=depth, split=split)
