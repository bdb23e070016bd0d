import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from neat.nn import FeedForwardNetwork

from toddle.reach.evolve import neat as ours
from toddle.reach.evolve.genomes import Genomes, Nodes, activations, distances, first_genomes, without_lost_nodes

GROWING = ours.Settings(add_node=0.4, add_connection=0.4, room=6, threshold=1.0)


def evolved(generations: int, seed: int, runs: int = 2, population: int = 12) -> ours.Population:
    random = np.random.default_rng(seed)
    now = ours.begin(runs, population, 3, 2, GROWING, random)
    for _ in range(generations):
        now = ours.advance(now, random.uniform(0.1, 1.0, (runs, population)), GROWING, random)
    return now


def network_of(genomes: Genomes, nodes: Nodes, run: int, one: int) -> FeedForwardNetwork:
    """The same network by neat-python: nodes in the order of their depth."""
    depth = nodes.depth[run]
    later = [k for k in np.argsort(depth) if depth[k] > 0]
    enabled, weight = genomes.enabled[run, one], genomes.weight[run, one]
    links = [[(int(i), float(weight[i, k])) for i in np.flatnonzero(enabled[:, k])] for k in later]
    evaluations = [(int(k), np.tanh, sum, 0.0, 1.0, some) for k, some in zip(later, links, strict=True)]
    outputs = range(nodes.inputs, nodes.inputs + nodes.outputs)
    return FeedForwardNetwork(list(range(nodes.inputs)), list(outputs), evaluations)


def test_networks_answer_as_those_of_neat_python():
    now = evolved(30, 0)
    inputs = np.random.default_rng(1).standard_normal((3, 4))
    found = activations(now.genomes, now.nodes, inputs)
    assert np.isfinite(now.nodes.depth[:, 5:]).sum() > 4
    for run in range(2):
        for one in range(12):
            network = network_of(now.genomes, now.nodes, run, one)
            theirs = np.array([network.activate(list(inputs[:, k])) for k in range(4)]).T
            np.testing.assert_allclose(found[run, one], theirs, atol=1e-12)


@given(st.integers(0, 40), st.integers(0, 1000))
def test_whatever_happens_genomes_stay_sound(generations: int, seed: int):
    now = evolved(generations, seed)
    (weight, gene, enabled), nodes = now.genomes, now.nodes
    assert not np.any(enabled & ~gene)
    assert not np.any(weight[~gene])
    deeper = nodes.depth[:, :, None] < nodes.depth[:, None]  # False where a node is free
    assert not np.any(gene & ~deeper[:, None])
    assert np.all(np.any(gene[:, :, :3], axis=(2, 3)))
    used = np.any(gene, axis=(1, 2)) | np.any(gene, axis=(1, 3))
    np.testing.assert_array_equal(used[:, 5:], np.isfinite(nodes.depth[:, 5:]))
    assert now.member.min() >= 0
    for run in range(2):
        assert set(now.member[run]) == set(np.flatnonzero(now.alive[run]))


def test_at_first_each_input_leads_to_each_output():
    genomes, nodes = first_genomes(2, 3, 3, 2, 4, np.random.default_rng(0))
    assert np.all(genomes.gene[:, :, :3, 3:5])
    assert genomes.gene.sum() == 2 * 3 * 6
    assert np.all(np.abs(genomes.weight) <= 1)
    assert np.all(np.isnan(nodes.depth[:, 5:]))


def test_distances_are_those_counted_by_hand():
    genomes, _ = first_genomes(1, 2, 2, 1, 2, np.random.default_rng(0))
    weight, gene = np.zeros_like(genomes.weight), genomes.gene.copy()
    weight[0, 0, 0, 2], weight[0, 0, 1, 2] = 1.0, 2.0
    weight[0, 1, 0, 2], weight[0, 1, 1, 2] = 1.5, -1.0
    gene[0, 1, 0, 3] = gene[0, 1, 3, 2] = True  # two genes that the first has not
    pair = Genomes(weight, gene, gene)
    # two unmatched of genomes with less than 20 genes; weights differ by 0.5 and 3 over two matching ones
    between = 1.0 * 2 + 0.4 * (0.5 + 3.0) / 2
    np.testing.assert_allclose(distances(pair, pair, 1.0, 0.4)[0], [[0, between], [between, 0]], atol=1e-6)


def test_distances_are_a_matter_of_places_in_use_alone():
    now = evolved(20, 3)
    gap = distances(now.genomes, now.model, 1.0, 0.4)
    for run, one, model in ((0, 3, 0), (1, 11, 2), (1, 0, 5)):
        a = now.genomes.gene[run, one], now.model.gene[run, model]
        both = a[0] & a[1]
        apart = np.abs(now.genomes.weight[run, one] - now.model.weight[run, model])[both].mean() if both.any() else 0.0
        larger = max(a[0].sum(), a[1].sum())
        expected = (a[0] ^ a[1]).sum() / (1 if larger < 20 else larger) + 0.4 * apart
        np.testing.assert_allclose(gap[run, one, model], expected, rtol=1e-5)


def test_a_lost_node_gives_its_place_back():
    genomes, nodes = first_genomes(1, 1, 2, 1, 2, np.random.default_rng(0))
    nodes.depth[0, 3], nodes.split[0, 0, 2] = 0.5, 3
    kept = without_lost_nodes(genomes, nodes)
    assert np.isnan(kept.depth[0, 3])
    assert np.all(kept.split == -1)
    genomes.gene[0, 0, 0, 3] = genomes.gene[0, 0, 3, 2] = True
    kept = without_lost_nodes(genomes, nodes)
    assert kept.depth[0, 3] == 0.5
    assert kept.split[0, 0, 2] == 3


def test_without_hidden_nodes_it_is_one_layer_of_tanh():
    genomes, nodes = first_genomes(1, 1, 2, 1, 0, np.random.default_rng(0))
    value = activations(genomes, nodes, np.array([[0.3], [1.0]]))[0, 0, 0, 0]
    np.testing.assert_allclose(value, np.tanh(genomes.weight[0, 0, 0, 2] * 0.3 + genomes.weight[0, 0, 1, 2]))
