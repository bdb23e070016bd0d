"""The neuro-controller: a vector of weights that turns a goal into joint values (Martin 2009, section 2.1).

    a_o = tanh(tanh([inputs, 1] . w_i) . w_o)                                                            (1)

One hidden layer, a bias on the input alone, and |w_i| + |w_o| = (ni + 1) nh + nh no numbers. How a position becomes the
inputs and how a_o becomes joint values is not in the document; `Scale` says it here. Many controllers answer at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float


class Scale(NamedTuple):
    """A linear map of each coordinate: ``value = centre + half * unit``.

    Attributes:
        centre: the value where the unit is 0 [m or rad].
        half: what one unit is [m or rad].
    """

    centre: Float[np.ndarray, " coordinates"]
    half: Float[np.ndarray, " coordinates"]


class Shape(NamedTuple):
    """What all controllers of a run share.

    Attributes:
        hidden: neurons of the hidden layer.
        inputs: from positions [m] to what the network is given.
        outputs: from what the network answers, -1 to 1, to joint values [rad or m].
    """

    hidden: int
    inputs: Scale
    outputs: Scale

    @property
    def weights(self) -> int:
        """How many numbers a controller is."""
        return (len(self.inputs.half) + 1) * self.hidden + self.hidden * len(self.outputs.half)


def inputs_of(shape: Shape, goals: Float[np.ndarray, "goals space"]) -> Float[np.ndarray, "inputs goals"]:
    """What the network is given for each goal: its scaled coordinates, and 1 for the bias."""
    return np.vstack([((goals - shape.inputs.centre) / shape.inputs.half).T, np.ones(len(goals))])


def respond(
    shape: Shape, weights: Float[np.ndarray, "controllers weights"], inputs: Float[np.ndarray, "inputs goals"]
) -> Float[np.ndarray, "controllers joints goals"]:
    """Equation (1), as joint values [rad or m]; computed in the precision of the inputs."""
    return joints_of(shape, _activations(shape, weights.astype(inputs.dtype), inputs)[1])


def joints_of(
    shape: Shape, activations: Float[np.ndarray, "controllers joints goals"]
) -> Float[np.ndarray, "controllers joints goals"]:
    """Joint values [rad or m] for what output neurons answer."""
    centre, half = (values.astype(activations.dtype)[:, None] for values in shape.outputs)
    return centre[None] + half[None] * activations


def respond_with_slopes(
    shape: Shape, weights: Float[np.ndarray, "controllers weights"], inputs: Float[np.ndarray, "inputs goals"]
) -> tuple[Float[np.ndarray, "controllers joints goals"], Float[np.ndarray, "controllers goals joints weights"]]:
    """The answers, and how they change with the weights."""
    hidden, out = _activations(shape, weights, inputs)
    outgoing = _split(shape, weights)[1]
    by_sum = (1 - out**2) * shape.outputs.half[:, None]  # d answer / d (a_h . w_o)
    by_hidden = np.einsum("cjg,chj,chg->cgjh", by_sum, outgoing, 1 - hidden**2)  # d answer / d ([inputs, 1] . w_i)
    first = np.einsum("cgjh,ig->cgjih", by_hidden, inputs)
    last = np.zeros((*by_hidden.shape, out.shape[1]))
    for joint in range(out.shape[1]):
        last[:, :, joint, :, joint] = np.einsum("cg,chg->cgh", by_sum[:, joint], hidden)
    slopes = [part.reshape(*by_hidden.shape[:3], -1) for part in (first, last)]
    return joints_of(shape, out), np.concatenate(slopes, axis=3)


def _split(
    shape: Shape, weights: Float[np.ndarray, "controllers weights"]
) -> tuple[Float[np.ndarray, "controllers inputs hidden"], Float[np.ndarray, "controllers hidden joints"]]:
    """The two matrices w_i and w_o."""
    first = (len(shape.inputs.half) + 1) * shape.hidden
    return (
        weights[:, :first].reshape(len(weights), -1, shape.hidden),
        weights[:, first:].reshape(len(weights), shape.hidden, -1),
    )


def _activations(
    shape: Shape, weights: Float[np.ndarray, "controllers weights"], inputs: Float[np.ndarray, "inputs goals"]
) -> tuple[Float[np.ndarray, "controllers hidden goals"], Float[np.ndarray, "controllers joints goals"]]:
    """What the hidden and the output neurons answer."""
    incoming, outgoing = _split(shape, weights)
    rows = incoming.transpose(0, 2, 1).reshape(-1, len(inputs))  # one product for all controllers
    hidden = np.tanh(rows @ inputs).reshape(len(weights), shape.hidden, -1)
    return hidden, np.tanh(outgoing.transpose(0, 2, 1) @ hidden)
