"""A network of one hidden layer whose weight decay is set by the data: Bayesian-regularised Levenberg-Marquardt.

Tan-sigmoid hidden units, linear outputs, inputs and outputs normalised to [-1, 1], 70 % of the samples to train on
and 30 % to test on (Thuruthel 2016, section 3, after Foresee and Hagan 1997). `toddle.reach.learn.evidence` takes the
steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.learn.evidence import Samples, Weights, courses, squared_errors, with_one


@dataclass(frozen=True)
class Scale:
    """An affine map of each column to [-1, 1].

    Attributes:
        middle: what becomes 0.
        half: what is one unit.
    """

    middle: Float[np.ndarray, " columns"]
    half: Float[np.ndarray, " columns"]

    def to_unit(self, values: Float[np.ndarray, "batch columns"]) -> Float[np.ndarray, "batch columns"]:
        """Values as the network has them."""
        return (values - self.middle) / self.half

    def from_unit(self, values: Float[np.ndarray, "batch columns"]) -> Float[np.ndarray, "batch columns"]:
        """The network's values in the units of the samples."""
        return self.middle + values * self.half


@dataclass(frozen=True)
class BayesianNetwork:
    """A trained network.

    Attributes:
        weights: of both layers.
        x_scale, y_scale: normalisation of inputs and outputs.
    """

    weights: Weights
    x_scale: Scale
    y_scale: Scale

    def predict(self, x: Float[np.ndarray, "batch inputs"]) -> Float[np.ndarray, "batch outputs"]:
        """Outputs for inputs, in the units of the samples."""
        return self.y_scale.from_unit(with_one(self._activations(x)) @ self.weights.output.T)

    def slope(self, x: Float[np.ndarray, "batch inputs"]) -> Float[np.ndarray, "batch outputs inputs"]:
        """How each output changes with each input, in the units of the samples."""
        into = self.weights.hidden[:, :-1] / self.x_scale.half
        out = self.weights.output[:, :-1] * self.y_scale.half[:, None]
        return np.einsum("oh,bh,hi->boi", out, 1 - self._activations(x) ** 2, into)

    def _activations(self, x: Float[np.ndarray, "batch inputs"]) -> Float[np.ndarray, "batch hidden"]:
        return np.tanh(with_one(self.x_scale.to_unit(x)) @ self.weights.hidden.T)


class Record(NamedTuple):
    """How training went: row 0 is the network that it began with, every other row a step.

    Attributes:
        alpha, beta: what squared weights and squared errors weigh.
        gamma: how many weights the data determine.
        damping: mu of the step.
        train_error, test_error: root mean square error in the training and the test set, as a share of half the range
            of an output; nan where there is no test set.
    """

    alpha: Float[np.ndarray, " rows"]
    beta: Float[np.ndarray, " rows"]
    gamma: Float[np.ndarray, " rows"]
    damping: Float[np.ndarray, " rows"]
    train_error: Float[np.ndarray, " rows"]
    test_error: Float[np.ndarray, " rows"]


def train(
    x: Float[np.ndarray, "samples inputs"],
    y: Float[np.ndarray, "samples outputs"],
    *,
    hidden: int = 20,
    seed: int = 0,
    iterations: int = 100,
    share: float = 0.7,
    tell: Callable[[int, float], None] | None = None,
) -> tuple[BayesianNetwork, Record]:
    """A network trained on samples.

    Args:
        x, y: inputs and outputs, in any units.
        hidden: units of the hidden layer.
        seed: of the first weights, and of which samples are for training.
        iterations: at most so many steps.
        share: of the samples that is trained on; the others only test (Thuruthel 2016: 0.7).
        tell: called after each step with its number and the training error.

    Returns:
        The network, and how training went.

    Raises:
        BadInput: samples that are too few, don't match or hold a value that is no number; an option out of range.
    """
    _check(x, y, hidden, iterations, share)
    drawn = np.random.default_rng(seed)
    order, count = drawn.permutation(len(x)), max(1, round(share * len(x)))
    x_scale, y_scale = _spanning(x[order[:count]]), _spanning(y[order[:count]])
    whole = Samples(with_one(x_scale.to_unit(x[order])), y_scale.to_unit(y[order]))
    taught, tested = (Samples(whole.x[part], whole.y[part]) for part in (slice(count), slice(count, None)))
    weights, rows = _first_weights(drawn, hidden, taught), []
    for number, course in enumerate(courses(weights, taught, iterations)):
        weights, errors = course.weights, [_rms(course.weights, part) for part in (taught, tested)]
        rows.append((course.alpha, course.beta, course.gamma, course.damping, *errors))
        if tell is not None and number:
            tell(number, errors[0])
    return BayesianNetwork(weights, x_scale, y_scale), Record(*np.array(rows).T)


def _check(x: np.ndarray, y: np.ndarray, hidden: int, iterations: int, share: float) -> None:
    if len(x) != len(y):
        raise BadInput(f"{len(x)} inputs and {len(y)} outputs", where="samples", remedy="give as many of both")
    if len(x) < 2:
        raise BadInput(f"there are {len(x)}", where="samples", remedy="give at least two")
    bad = ~(np.isfinite(x).all(axis=1) & np.isfinite(y).all(axis=1))
    if bad.any():
        raise BadInput(f"a value of row {int(bad.argmax())} is no number", where="samples", remedy="leave the row out")
    if hidden < 1:
        raise BadInput(f"{hidden} hidden units", where="hidden", remedy="give at least one")
    if iterations < 0:
        raise BadInput(f"{iterations} steps", where="iterations", remedy="give 0 or more")
    if not 0 < share <= 1:
        raise BadInput(f"a share of {share:g}", where="share", remedy="give more than 0 and at most 1")


def _spanning(values: Float[np.ndarray, "samples columns"]) -> Scale:
    """What maps the least value of each column to -1 and the greatest to 1; a column that never varies to 0."""
    low, high = values.min(axis=0), values.max(axis=0)
    return Scale((low + high) / 2, np.where(high > low, (high - low) / 2, 1.0))


def _first_weights(drawn: np.random.Generator, hidden: int, samples: Samples) -> Weights:
    """Nguyen and Widrow 1990: the hidden units share the input range between them."""
    inputs, outputs = samples.x.shape[1] - 1, samples.y.shape[1]
    size = 0.7 * hidden ** (1 / inputs)
    slopes = drawn.uniform(-1, 1, (hidden, inputs))
    slopes *= size / np.linalg.norm(slopes, axis=1, keepdims=True)
    biases = size * np.linspace(-1, 1, hidden) * np.sign(slopes[:, 0])
    return Weights(np.column_stack([slopes, biases]), drawn.uniform(-0.5, 0.5, (outputs, hidden + 1)))


def _rms(weights: Weights, samples: Samples) -> float:
    return float(np.sqrt(squared_errors(weights, samples) / samples.y.size)) if samples.y.size else float("nan")
