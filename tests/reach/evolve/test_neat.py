import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from toddle.reach.evolve import neat
from toddle.reach.evolve.genomes import activations


def evolve_xor(settings: neat.Settings, runs: int, generations: int) -> np.ndarray:
    """Each run's lowest mean squared error on exclusive or, which no network without hidden nodes can learn."""
    random = np.random.default_rng(0)
    inputs = np.array([[-1.0, -1.0, 1.0, 1.0], [-1.0, 1.0, -1.0, 1.0], [1.0, 1.0, 1.0, 1.0]])
    wanted = np.array([-1.0, 1.0, 1.0, -1.0])
    now, best = neat.begin(runs, 50, 3, 1, settings, random), np.full(runs, np.inf)
    for _ in range(generations):
        out = activations(now.genomes, now.nodes, inputs)[:, :, 0]
        scores = ((out - wanted) ** 2).mean(axis=2)
        best = np.minimum(best, scores.min(axis=1))
        now = neat.advance(now, scores, settings, random)
    return best


def test_topology_grows_where_weights_are_not_enough():
    grown = evolve_xor(neat.Settings(add_node=0.05, add_connection=0.05), 8, 150)
    fixed = evolve_xor(neat.Settings(add_node=0.0, add_connection=0.0), 4, 60)
    assert np.all(fixed > 0.49)
    assert np.sum(grown < 0.05) >= 6


def test_the_best_is_never_lost():
    random, settings = np.random.default_rng(1), neat.Settings()
    inputs, wanted = random.standard_normal((3, 10)), random.uniform(-0.5, 0.5, (2, 10))
    now, last = neat.begin(4, 20, 3, 2, settings, random), np.full(4, np.inf)
    for _ in range(60):
        out = activations(now.genomes, now.nodes, inputs)
        scores = ((out - wanted) ** 2).mean(axis=(2, 3))
        assert np.all(scores.min(axis=1) <= last)
        last = scores.min(axis=1)
        now = neat.advance(now, scores, settings, random)


@given(st.integers(0, 1000))
def test_children_are_as_many_as_there_were_parents_and_species_share_them(seed: int):
    random, settings = np.random.default_rng(seed), neat.Settings(threshold=0.3)
    now = neat.begin(3, 20, 3, 2, settings, random)
    scores = 10.0 ** random.uniform(-6, 6, (3, 20))
    now = neat._progress(now, scores)
    children = neat._children(now, scores, settings)
    assert np.all(children.sum(axis=1) == 20)
    best = np.take_along_axis(now.member, scores.argmin(axis=1)[:, None], 1)
    assert np.all(np.take_along_axis(children, best, 1) >= 1)
    # twice the mean fitness, twice the children, up to rounding
    for run in range(3):
        fitness = [np.mean(1 / scores[run][now.member[run] == s]) for s in np.flatnonzero(now.alive[run])]
        share = 20 * np.array(fitness) / np.sum(fitness)
        assert np.all(np.abs(children[run][now.alive[run]] - share) < 2)


def test_parents_are_among_the_best_of_their_species():
    random, settings = np.random.default_rng(2), neat.Settings(threshold=0.3)
    now = neat.begin(2, 40, 3, 2, settings, random)
    scores = random.uniform(0.1, 1.0, (2, 40))
    children = neat._children(neat._progress(now, scores), scores, settings)
    first, second, copied = neat._parents(now, scores, children, settings, random)
    for run in range(2):
        for child in range(40):
            a, b = first[run, child], second[run, child]
            assert now.member[run, a] == now.member[run, b]
            assert scores[run, a] <= scores[run, b]
            mates = np.sort(scores[run][now.member[run] == now.member[run, a]])
            assert scores[run, b] <= mates[int(np.ceil(0.2 * len(mates))) - 1]
            assert not copied[run, child] or scores[run, a] == mates[0]


def test_weights_change_as_the_document_says():
    random = np.random.default_rng(3)
    settings = neat.Settings(crossover=0.0, add_node=0.0, add_connection=0.0, weight_cap=0.9)
    now = neat.begin(1, 2000, 4, 3, settings, random)
    scores = np.linspace(1.0, 2.0, 2000)[None]
    children = neat._children(neat._progress(now, scores), scores, settings)
    first, second, copied = neat._parents(now, scores, children, settings, random)
    bred = neat._bred(now.genomes, first, second, copied, settings, random)
    was = now.genomes.chosen(first)
    change = (bred.weight - was.weight)[was.gene & (np.abs(was.weight) < 0.4)]
    assert np.mean(change != 0) == np.clip(np.mean(change != 0), 0.48, 0.52)
    assert np.abs(change).max() <= 0.5
    assert np.std(change[change != 0]) == np.clip(np.std(change[change != 0]), 0.27, 0.31)  # 1 / sqrt(12)
    assert np.abs(bred.weight).max() <= 0.9
