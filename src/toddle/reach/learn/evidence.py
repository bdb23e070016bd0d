"""Levenberg-Marquardt steps of a one-hidden-layer network under MacKay's evidence: what `bayesian_network` trains by.

With E_D the squared errors and E_W the squared weights, F = beta E_D + alpha E_W is minimised, and after every step
(MacKay 1992; Foresee and Hagan 1997, with the Gauss-Newton Hessian)

    gamma = sum_i beta l_i / (beta l_i + alpha),  alpha = gamma / (2 E_W),  beta = (n - gamma) / (2 E_D),

where l_i are the eigenvalues of J'J and n counts the errors. J'J is decomposed once an iteration, into Q T Q' with T
tridiagonal, which has its eigenvalues: then the step of every damping trial mu, (beta J'J + (alpha + mu) I)^-1
(beta J'e + alpha w), costs no more than a substitution along T. J itself is never built. The outputs share the hidden
layer: with a the activations, p the slopes of the hidden sums and V the output weights, the blocks of J'J are
(V'V) * (p'p), V * (p'a) and I x (a'a), products with * being taken entry by entry.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import get_lapack_funcs

_sytrd, _sytrd_lwork, _sterf, _ormqr, _ptsv = get_lapack_funcs(
    ("sytrd", "sytrd_lwork", "sterf", "ormqr", "ptsv"), dtype=np.float64
)
_FIRST_DAMPING, _LESS, _MORE = 5e-3, 0.1, 10.0  # Foresee and Hagan's schedule of mu
_LEAST_DAMPING, _MOST_DAMPING = 1e-20, 1e10
_LEAST_SLOPE = 1e-7


class Weights(NamedTuple):
    """Of the hidden and of the output layer; the last column is the bias."""

    hidden: Float[np.ndarray, "hidden inputs_and_1"]
    output: Float[np.ndarray, "outputs hidden_and_1"]

    def flat(self) -> Float[np.ndarray, " weights"]:
        """All of them in a row, the hidden layer first."""
        return np.concatenate([self.hidden.ravel(), self.output.ravel()])

    def less(self, step: Float[np.ndarray, " weights"]) -> Weights:
        """The weights less a step, given in a row."""
        cut, (hidden, output) = self.hidden.size, self
        return Weights(hidden - step[:cut].reshape(hidden.shape), output - step[cut:].reshape(output.shape))


class Samples(NamedTuple):
    """Normalised samples; the last column of the inputs is ones."""

    x: Float[np.ndarray, "samples inputs_and_1"]
    y: Float[np.ndarray, "samples outputs"]


class Course(NamedTuple):
    """Where training stands.

    Attributes:
        weights: of the network.
        errors, squares: E_D and E_W.
        alpha, beta: what they weigh in F.
        gamma: how many weights the data determine.
        damping: mu of the step that led here.
    """

    weights: Weights
    errors: float
    squares: float
    alpha: float
    beta: float
    gamma: float
    damping: float


class Decomposed(NamedTuple):
    """A symmetric matrix as Q T Q'.

    Attributes:
        reflections, scales: Q, as LAPACK's sytrd leaves it.
        diagonal, beside: of T.
        eigenvalues: of the matrix.
    """

    reflections: Float[np.ndarray, "weights weights"]
    scales: Float[np.ndarray, " weights_less_1"]
    diagonal: Float[np.ndarray, " weights"]
    beside: Float[np.ndarray, " weights_less_1"]
    eigenvalues: Float[np.ndarray, " weights"]


def with_one(values: Float[np.ndarray, "batch columns"]) -> Float[np.ndarray, "batch columns_and_1"]:
    """A column of ones at the end: what the biases are multiplied by."""
    return np.concatenate([values, np.ones((len(values), 1))], axis=1)


def courses(weights: Weights, samples: Samples, iterations: int) -> Iterator[Course]:
    """Where training begins, and where it stands after each step that lowers F; it ends where none does."""
    squares, gamma = _squares(weights), float(len(weights.flat()))
    now = _weighed(Course(weights, squared_errors(weights, samples), squares, 0, 0, gamma, _FIRST_DAMPING), samples)
    gradient, matrix = normal_equations(weights, samples)
    yield now
    decomposed = decompose(matrix)
    for _ in range(iterations):
        slope = now.beta * gradient + now.alpha * now.weights.flat()
        new = _lower(now, slope, decomposed, samples) if np.linalg.norm(slope) >= _LEAST_SLOPE else None
        if new is None:
            return
        gradient, matrix = normal_equations(new.weights, samples)
        decomposed = decompose(matrix)
        curved = new.beta * np.maximum(decomposed.eigenvalues, 0)
        now = _weighed(new._replace(gamma=float(np.sum(curved / (curved + new.alpha)))), samples)
        yield now


def _weighed(course: Course, samples: Samples) -> Course:
    """alpha and beta by the evidence."""
    free = max(samples.y.size - course.gamma, 1.0)
    beta = free / (2 * max(course.errors, 1e-300))
    return course._replace(alpha=course.gamma / (2 * course.squares), beta=beta)


def _lower(
    now: Course, slope: Float[np.ndarray, " weights"], decomposed: Decomposed, samples: Samples
) -> Course | None:
    """The first step with a lower F, mu growing from trial to trial; None: there is none."""
    objective = now.beta * now.errors + now.alpha * now.squares
    downhill = turned(decomposed, slope, "T")
    damping = max(now.damping * _LESS, _LEAST_DAMPING)
    while damping <= _MOST_DAMPING:
        step = turned(decomposed, solved(decomposed, now.beta, now.alpha + damping, downhill), "N")
        weights = now.weights.less(step)
        errors, squares = squared_errors(weights, samples), _squares(weights)
        if now.beta * errors + now.alpha * squares < objective:
            return now._replace(weights=weights, errors=errors, squares=squares, damping=damping)
        damping *= _MORE
    return None


def squared_errors(weights: Weights, samples: Samples) -> float:
    """E_D of a network on samples."""
    activations = with_one(np.tanh(samples.x @ weights.hidden.T))
    return float(np.sum((activations @ weights.output.T - samples.y) ** 2))


def _squares(weights: Weights) -> float:
    return float(np.sum(weights.hidden**2) + np.sum(weights.output**2))


def normal_equations(
    weights: Weights, samples: Samples
) -> tuple[Float[np.ndarray, " weights"], Float[np.ndarray, "weights weights"]]:
    """J'e and J'J."""
    activations = np.tanh(samples.x @ weights.hidden.T)
    outputs, out, inputs = len(weights.output), weights.output[:, :-1], samples.x.shape[1]
    full = with_one(activations)
    errors = full @ weights.output.T - samples.y
    slopes = 1 - activations**2
    gradient = np.concatenate([(((errors @ out) * slopes).T @ samples.x).ravel(), (errors.T @ full).ravel()])
    phi = (slopes[:, :, None] * samples.x[:, None, :]).reshape(len(samples.x), -1)
    shared = np.repeat(np.repeat(out.T @ out, inputs, axis=0), inputs, axis=1)
    across = np.repeat(out, inputs, axis=1)[:, :, None] * (phi.T @ full)
    cut = phi.shape[1]
    matrix = np.empty((len(gradient), len(gradient)))
    matrix[:cut, :cut] = shared * (phi.T @ phi)
    matrix[cut:, :cut] = across.transpose(0, 2, 1).reshape(-1, cut)
    matrix[:cut, cut:] = matrix[cut:, :cut].T
    matrix[cut:, cut:] = np.kron(np.eye(outputs), full.T @ full)
    return gradient, matrix


def decompose(matrix: Float[np.ndarray, "weights weights"]) -> Decomposed:
    """Q, T and the eigenvalues of a symmetric matrix."""
    size, _ = _sytrd_lwork(len(matrix), lower=1)
    reflections, diagonal, beside, scales, _ = _sytrd(matrix, lower=1, lwork=int(size))
    eigenvalues, _ = _sterf(diagonal, beside)
    return Decomposed(reflections, scales, diagonal, beside, eigenvalues)


def turned(decomposed: Decomposed, vector: Float[np.ndarray, " weights"], how: str) -> Float[np.ndarray, " weights"]:
    """Q' v ("T") or Q v ("N"); the first row and column of Q are those of the identity."""
    tail, _, _ = _ormqr("L", how, decomposed.reflections[1:, :-1], decomposed.scales, vector[1:, None], 64)
    return np.concatenate([vector[:1], tail[:, 0]])


def solved(
    decomposed: Decomposed, beta: float, shift: float, vector: Float[np.ndarray, " weights"]
) -> Float[np.ndarray, " weights"]:
    """(beta T + shift I)^-1 v."""
    diagonal = beta * decomposed.diagonal + shift
    _, _, solution, _ = _ptsv(diagonal, beta * decomposed.beside, vector[:, None])
    return solution[:, 0]
