"""NEAT, many runs side by side: weights and topology evolve together, and new structure is protected by species.

After Stanley, Miikkulainen 2002; what Martin 2009 (section 4.3) prints of the parameters is taken, the rest is
Stanley's but for what `Settings` names. Fitness is 1 / MSE: it is positive, and no unit changes who gets more children.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from toddle.reach.evolve.genomes import Genomes, Nodes, distances, first_genomes, without_lost_nodes


@dataclass(frozen=True)
class Settings:
    """Of NEAT; the first six are the document's.

    Attributes:
        add_node, add_connection: probability that a child's network grows so.
        mutate_weight: probability that a weight changes.
        weight_range: width of the change, uniform around 0.
        weight_cap: the largest weight.
        re_enable: probability that an inherited disabled gene is expressed again.
        crossover: probability that a child has two parents.
        survivors: share of a species that may have children.
        by_gene, by_weight: coefficients c1 = c2 and c3 of the compatibility distance.
        threshold: distance at which a species ends.
        species: that a run has at most; whoever fits none then joins the nearest.
        patience: generations without progress after which a species has no children, unless it holds the best.
        room: hidden nodes that a run holds at a time, at most.
    """

    add_node: float = 0.002
    add_connection: float = 0.002
    mutate_weight: float = 0.5
    weight_range: float = 1.0
    weight_cap: float = 1000.0
    re_enable: float = 0.25
    crossover: float = 0.75
    survivors: float = 0.2
    by_gene: float = 1.0
    by_weight: float = 0.4
    threshold: float = 0.5
    species: int = 10
    patience: int = 15
    room: int = 12


class Population(NamedTuple):
    """All runs between two generations.

    Attributes:
        genomes, nodes: the individuals.
        member: the species of each.
        model: an individual of each species, to which the next generation is compared.
        alive: which species there are.
        best: lowest MSE that each had.
        stale: generations since then.
    """

    genomes: Genomes
    nodes: Nodes
    member: Int[np.ndarray, "runs population"]
    model: Genomes
    alive: Bool[np.ndarray, "runs species"]
    best: Float[np.ndarray, "runs species"]
    stale: Int[np.ndarray, "runs species"]


def begin(
    runs: int, population: int, inputs: int, outputs: int, settings: Settings, random: np.random.Generator
) -> Population:
    """The first generation: no hidden node, and one species."""
    genomes, nodes = first_genomes(runs, population, inputs, outputs, settings.room, random)
    model = genomes.chosen(np.zeros((runs, settings.species), int))
    alive = np.zeros((runs, settings.species), bool)
    alive[:, 0] = True
    free = Population(
        genomes, nodes, np.zeros((runs, population), int), model, alive,
        np.full(alive.shape, np.inf), np.zeros(alive.shape, int),
    )  # fmt: skip
    return _in_species(free, settings)


def advance(
    now: Population, scores: Float[np.ndarray, "runs population"], settings: Settings, random: np.random.Generator
) -> Population:
    """The next generation: fitness is shared within species, the best have children, children mutate."""
    now = _progress(now, scores)
    children = _children(now, scores, settings)
    first, second, copied = _parents(now, scores, children, settings, random)
    genomes = _bred(now.genomes, first, second, copied, settings, random)
    genomes, nodes = _grown(genomes, now.nodes, copied, settings, random)
    model = now.genomes.chosen(_drawn_members(now, random))
    grown = now._replace(genomes=genomes, nodes=without_lost_nodes(genomes, nodes), model=model)
    return _in_species(grown, settings)


def _progress(now: Population, scores: Float[np.ndarray, "runs population"]) -> Population:
    """What each species came to."""
    best = np.stack([np.where(now.member == s, scores, np.inf).min(axis=1) for s in range(now.alive.shape[1])], axis=1)
    better = best < now.best
    return now._replace(best=np.minimum(best, now.best), stale=np.where(better, 0, now.stale + 1))


def _children(
    now: Population, scores: Float[np.ndarray, "runs population"], settings: Settings
) -> Int[np.ndarray, "runs species"]:
    """How many children each species has: its share of the mean fitness of all species (explicit fitness sharing)."""
    population = scores.shape[1]
    mine = now.member[:, None] == np.arange(now.alive.shape[1])[None, :, None]
    size = mine.sum(axis=2)
    shared = (mine / np.maximum(scores, 1e-300)[:, None]).sum(axis=2) / np.maximum(size, 1)
    holds_best = np.take_along_axis(now.member, scores.argmin(axis=1)[:, None], 1) == np.arange(now.alive.shape[1])
    shared = np.where(now.alive & (size > 0) & ((now.stale <= settings.patience) | holds_best), shared, 0.0)
    exact = shared / shared.sum(axis=1, keepdims=True) * population
    # whole numbers that add up, and at least one child for the species of the best
    children = np.floor(exact).astype(int)
    order = np.argsort(children - exact - holds_best, axis=1, kind="stable")
    rank = np.argsort(order, axis=1)
    return children + (rank < population - children.sum(axis=1, keepdims=True))


def _parents(
    now: Population,
    scores: Float[np.ndarray, "runs population"],
    children: Int[np.ndarray, "runs species"],
    settings: Settings,
    random: np.random.Generator,
) -> tuple[Int[np.ndarray, "runs population"], Int[np.ndarray, "runs population"], Bool[np.ndarray, "runs population"]]:
    """For each child its parents, the better one first (the same twice without crossover), and which are champions."""
    runs, population = scores.shape
    order = np.lexsort((scores, now.member), axis=1)  # species by species, best first
    size = (now.member[:, None] == np.arange(children.shape[1])[None, :, None]).sum(axis=2)
    start = np.cumsum(size, axis=1) - size
    ends = np.cumsum(children, axis=1)
    place = np.arange(population)
    species = (place[None, :, None] >= ends[:, None]).sum(axis=2)  # of each child
    pick = lambda values: np.take_along_axis(values, species, 1)  # noqa: E731
    able = np.ceil(settings.survivors * pick(size)).astype(int)
    drawn = [pick(start) + (random.random((runs, population)) * able).astype(int) for _ in range(2)]
    champion = (place == pick(ends - children)) & (pick(children) > 1)
    first = np.where(champion, pick(start), drawn[0])
    second = np.where(champion | (random.random((runs, population)) >= settings.crossover), first, drawn[1])
    better, other = np.minimum(first, second), np.maximum(first, second)  # of one species: by their order
    return np.take_along_axis(order, better, 1), np.take_along_axis(order, other, 1), champion


def _bred(
    genomes: Genomes,
    first: Int[np.ndarray, "runs population"],
    second: Int[np.ndarray, "runs population"],
    copied: Bool[np.ndarray, "runs population"],
    settings: Settings,
    random: np.random.Generator,
) -> Genomes:
    """Children: matching genes from either parent, all others from the first; then weights change."""
    child = genomes.chosen(first)
    place = run, who, source, target = np.nonzero(child.gene)
    mate, free = (run, second[run, who], source, target), ~copied[run, who]
    luck = random.random((4, len(run)))
    taken = genomes.gene[mate] & (luck[0] < 0.5)
    enabled = np.where(taken, genomes.enabled[mate], child.enabled[place])
    child.enabled[place] = enabled | (free & (luck[1] < settings.re_enable))
    weight = np.where(taken, genomes.weight[mate], child.weight[place])
    change = np.where(free & (luck[2] < settings.mutate_weight), settings.weight_range * (luck[3] - 0.5), 0.0)
    child.weight[place] = (weight + change).clip(-settings.weight_cap, settings.weight_cap)
    return child


def _grown(
    genomes: Genomes,
    nodes: Nodes,
    copied: Bool[np.ndarray, "runs population"],
    settings: Settings,
    random: np.random.Generator,
) -> tuple[Genomes, Nodes]:
    """New nodes and connections, in the few children that get any; they are changed in place."""
    nodes = nodes._replace(depth=nodes.depth.copy(), split=nodes.split.copy())
    for run, child in np.argwhere((random.random(copied.shape) < settings.add_node) & ~copied):
        _add_node(genomes, nodes, int(run), int(child), random)
    for run, child in np.argwhere((random.random(copied.shape) < settings.add_connection) & ~copied):
        _add_connection(genomes, nodes, int(run), int(child), random)
    return genomes, nodes


def _add_node(genomes: Genomes, nodes: Nodes, run: int, child: int, random: np.random.Generator) -> None:
    """Split an expressed connection: 1 leads to the new node, the old weight away from it."""
    weight, gene, enabled = (part[run, child] for part in genomes)
    source, target = random.choice(np.argwhere(enabled))
    new = nodes.split[run, source, target]
    if new < 0:
        free = np.flatnonzero(np.isnan(nodes.depth[run]))
        if not len(free):
            return
        new = nodes.split[run, source, target] = free[0]
        nodes.depth[run, new] = (nodes.depth[run, source] + nodes.depth[run, target]) / 2
    elif gene[source, new]:
        return
    enabled[source, target] = False
    weight[source, new], weight[new, target] = 1.0, weight[source, target]
    gene[source, new] = gene[new, target] = enabled[source, new] = enabled[new, target] = True


def _add_connection(genomes: Genomes, nodes: Nodes, run: int, child: int, random: np.random.Generator) -> None:
    """Connect two nodes that are not, the second one deeper."""
    weight, gene, enabled = (part[run, child] for part in genomes)
    depth = nodes.depth[run]
    mine = gene.any(axis=0) | gene.any(axis=1)
    open_pairs = np.argwhere(~gene & mine[:, None] & mine[None] & (depth[:, None] < depth[None]))
    if len(open_pairs):
        source, target = random.choice(open_pairs)
        weight[source, target] = random.uniform(-1, 1)
        gene[source, target] = enabled[source, target] = True


def _drawn_members(now: Population, random: np.random.Generator) -> Int[np.ndarray, "runs species"]:
    """An individual of each species."""
    luck = random.random(now.member.shape)
    return np.stack([np.where(now.member == s, luck, -1.0).argmax(axis=1) for s in range(now.alive.shape[1])], axis=1)


def _in_species(now: Population, settings: Settings) -> Population:
    """Every individual joins the first species whose model it is near to, or founds one while there is room."""
    apart = _gaps(now.genomes, now.model, settings)
    apart = np.where(now.alive[:, None], apart, np.inf)
    model = Genomes(*(part.copy() for part in now.model))
    alive, best, stale = now.alive.copy(), now.best.copy(), now.stale.copy()
    while True:
        strange = apart.min(axis=2) > settings.threshold
        runs = np.flatnonzero(strange.any(axis=1) & ~alive.all(axis=1))
        if not len(runs):
            break
        place, founder = alive[runs].argmin(axis=1), strange[runs].argmax(axis=1)
        for part, mine in zip(model, now.genomes, strict=True):
            part[runs, place] = mine[runs, founder]
        alive[runs, place], best[runs, place], stale[runs, place] = True, np.inf, 0
        some = Genomes(*(part[runs] for part in now.genomes))
        apart[runs, :, place] = _gaps(some, some.chosen(founder[:, None]), settings)[:, :, 0]
    near = apart <= settings.threshold
    member = np.where(near.any(axis=2), near.argmax(axis=2), apart.argmin(axis=2))
    kept = (member[:, None] == np.arange(settings.species)[None, :, None]).any(axis=2)
    return Population(
        now.genomes, now.nodes, member, model, kept, np.where(kept, best, np.inf), np.where(kept, stale, 0)
    )


def _gaps(genomes: Genomes, models: Genomes, settings: Settings) -> Float[np.ndarray, "runs population models"]:
    return distances(genomes, models, settings.by_gene, settings.by_weight)
