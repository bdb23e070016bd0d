"""The genomes of NEAT as arrays: networks of any topology, all runs and all individuals side by side.

A gene is a connection between two nodes, and its innovation number is the pair of them: nodes are numbered run by run,
and who splits a connection that another one split gets the same new node (Stanley, Miikkulainen 2002, section 3.2). So
genes of two genomes line up by their place in a matrix. Every node has a depth, between that of the nodes it came
between; connections lead to deeper nodes only, and so all networks of a run can be evaluated node by node in one order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

Matrix = Float[np.ndarray, "runs population nodes nodes"]
Mask = Bool[np.ndarray, "runs population nodes nodes"]


class Genomes(NamedTuple):
    """All individuals of all runs. Nodes: inputs and bias first, then outputs, then room for hidden ones.

    Attributes:
        weight: from node to node; 0 where there is no gene.
        gene: whether there is one.
        enabled: whether it is expressed.
    """

    weight: Matrix
    gene: Mask
    enabled: Mask

    def chosen(self, rows: Int[np.ndarray, "runs chosen"]) -> Genomes:
        """Of each run these individuals."""
        runs = np.arange(len(rows))[:, None]
        return Genomes(*(part[runs, rows] for part in self))


class Nodes(NamedTuple):
    """What the individuals of a run have in common.

    Attributes:
        inputs: how many inputs there are, the bias among them.
        outputs: how many outputs.
        depth: of each node, 0 for inputs, 1 for outputs; NaN where a hidden node's place is free.
        split: the hidden node that came between two nodes; -1: none did.
    """

    inputs: int
    outputs: int
    depth: Float[np.ndarray, "runs nodes"]
    split: Int[np.ndarray, "runs nodes nodes"]


def first_genomes(
    runs: int, population: int, inputs: int, outputs: int, room: int, random: np.random.Generator
) -> tuple[Genomes, Nodes]:
    """Every input connected to every output, weights uniform in -1 to 1; room for so many hidden nodes."""
    nodes = inputs + outputs + room
    gene = np.zeros((runs, population, nodes, nodes), bool)
    gene[:, :, :inputs, inputs : inputs + outputs] = True
    weight = np.where(gene, random.uniform(-1, 1, gene.shape), 0.0)
    depth = np.full((runs, nodes), np.nan)
    depth[:, :inputs], depth[:, inputs : inputs + outputs] = 0.0, 1.0
    return Genomes(weight, gene, gene), Nodes(inputs, outputs, depth, np.full((runs, nodes, nodes), -1))


def activations(
    genomes: Genomes, nodes: Nodes, inputs: Float[np.ndarray, "inputs goals"]
) -> Float[np.ndarray, "runs population outputs goals"]:
    """What the outputs answer, each node tanh of its weighted inputs; in the inputs' precision."""
    weight = np.where(genomes.enabled, genomes.weight, 0.0).astype(inputs.dtype)
    runs, population, size, _ = weight.shape
    first, last = nodes.inputs, nodes.inputs + nodes.outputs
    value = np.zeros((runs, population, size, inputs.shape[1]), inputs.dtype)
    value[:, :, :first] = inputs
    hidden = np.sort(np.where(np.isnan(nodes.depth[:, last:]), np.inf, nodes.depth[:, last:]), axis=1)
    order = last + np.argsort(nodes.depth[:, last:], axis=1)  # NaN comes last
    run = np.arange(runs)
    for k in range(int(np.isfinite(hidden).sum(axis=1).max(initial=0))):
        incoming = weight[run, :, :, order[:, k]]
        value[run, :, order[:, k]] = np.tanh((incoming[:, :, None] @ value)[:, :, 0])
    return np.tanh(weight[:, :, :, first:last].transpose(0, 1, 3, 2) @ value)


def distances(
    genomes: Genomes, models: Genomes, by_gene: float, by_weight: float
) -> Float[np.ndarray, "runs population models"]:
    """Compatibility distances, c1 (excess + disjoint) / N + c3 mean |weight difference|; N: genes of the larger genome.

    Stanley takes N = 1 for genomes of less than 20 genes, and so do we.
    """
    places = _places_in_use(genomes.gene, models.gene)
    gene, model_gene = (_at(places, part.gene) for part in (genomes, models))
    weight, model_weight = (_at(places, part.weight).astype(np.float32) for part in (genomes, models))
    both = gene[:, :, None] & model_gene[:, None]
    matching = both.sum(axis=3)
    count, model_count = gene.sum(axis=2)[:, :, None], model_gene.sum(axis=2)[:, None]
    larger = np.maximum(count, model_count)
    apart = np.where(both, np.abs(weight[:, :, None] - model_weight[:, None]), np.float32(0)).sum(axis=3)
    unmatched = (count + model_count - 2 * matching) / np.where(larger < 20, 1, larger)
    return by_gene * unmatched + by_weight * apart.astype(float) / np.maximum(matching, 1)


def without_lost_nodes(genomes: Genomes, nodes: Nodes) -> Nodes:
    """Nodes that no individual has any more give their place back."""
    used = (genomes.gene.any(axis=(1, 2)) | genomes.gene.any(axis=(1, 3))) | (
        np.arange(nodes.depth.shape[1]) < nodes.inputs + nodes.outputs
    )
    lost = np.take_along_axis(~used, nodes.split.clip(0).reshape(len(used), -1), axis=1).reshape(nodes.split.shape)
    return nodes._replace(
        depth=np.where(used, nodes.depth, np.nan),
        split=np.where(lost | ~used[:, :, None] | ~used[:, None], -1, nodes.split),
    )


def _places_in_use(*genes: Bool[np.ndarray, "runs _ nodes nodes"]) -> Int[np.ndarray, "runs places"]:
    """Where in a run's matrices anybody has a gene; runs with fewer such places get some empty ones."""
    used = np.logical_or.reduce([part.any(axis=1).reshape(len(part), -1) for part in genes])
    return np.argsort(~used, axis=1, kind="stable")[:, : used.sum(axis=1).max()]


def _at(
    places: Int[np.ndarray, "runs places"], part: Shaped[np.ndarray, "runs some nodes nodes"]
) -> Shaped[np.ndarray, "runs some places"]:
    return np.take_along_axis(part.reshape(*part.shape[:2], -1), places[:, None], axis=2)
