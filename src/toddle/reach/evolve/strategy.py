"""CMA-ES, many runs side by side: evolution with covariance matrix adaptation, as one batch of arrays.

After N. Hansen, The CMA Evolution Strategy: A Tutorial (arXiv:1604.00772), equations (38) to (58), with negative
weights and his constants; the numbers of the equations stand beside the lines. One run after another, in Python, would
need minutes; beside each other thirty need no loop. Martin 2009 takes populations of 50 and 1000 generations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

_SMALLEST = 1e-16  # eigenvalue of a covariance, relative to the step


class Constants(NamedTuple):
    """What depends on the numbers searched for and on the population alone; names as in the tutorial.

    Attributes:
        weights: of the samples, best first; the worse half is negative.
        selected: how many weights are positive (mu).
        mu_eff: variance-effective number of them.
        c_sigma, d_sigma: cumulation and damping of the step size.
        c_c: cumulation of the covariance's path.
        c_1, c_mu: learning rates of the rank-one and the rank-mu update.
        chi: expected length of a standard normal vector.
    """

    weights: Float[np.ndarray, " population"]
    selected: int
    mu_eff: float
    c_sigma: float
    d_sigma: float
    c_c: float
    c_1: float
    c_mu: float
    chi: float


class Search(NamedTuple):
    """The state of all runs; a new one follows from each generation.

    Attributes:
        mean: of the distribution that is sampled.
        sigma: its overall step size.
        covariance: its shape.
        axes, lengths: eigenvectors (as columns) of the covariance, and roots of its eigenvalues.
        sigma_path, covariance_path: evolution paths.
        generation: how many there were.
    """

    mean: Float[np.ndarray, "runs n"]
    sigma: Float[np.ndarray, " runs"]
    covariance: Float[np.ndarray, "runs n n"]
    axes: Float[np.ndarray, "runs n n"]
    lengths: Float[np.ndarray, "runs n"]
    sigma_path: Float[np.ndarray, "runs n"]
    covariance_path: Float[np.ndarray, "runs n"]
    generation: int


def constants(n: int, population: int) -> Constants:
    """The tutorial's settings for n numbers and so many samples a generation (table 1)."""
    selected = population // 2
    raw = math.log((population + 1) / 2) - np.log(np.arange(1, population + 1))
    mu_eff = raw[:selected].sum() ** 2 / (raw[:selected] ** 2).sum()
    mu_eff_minus = raw[selected:].sum() ** 2 / (raw[selected:] ** 2).sum()
    c_1 = 2 / ((n + 1.3) ** 2 + mu_eff)
    c_mu = min(1 - c_1 - 1e-8, 2 * (mu_eff - 2 + 1 / mu_eff) / ((n + 2) ** 2 + mu_eff))
    negative = min(1 + c_1 / c_mu, 1 + 2 * mu_eff_minus / (mu_eff + 2), (1 - c_1 - c_mu) / (n * c_mu))
    weights = np.where(raw >= 0, raw / raw[raw > 0].sum(), negative * raw / -raw[raw < 0].sum())
    c_sigma = (mu_eff + 2) / (n + mu_eff + 5)
    return Constants(
        weights=weights,
        selected=selected,
        mu_eff=float(mu_eff),
        c_sigma=float(c_sigma),
        d_sigma=float(1 + 2 * max(0.0, math.sqrt((mu_eff - 1) / (n + 1)) - 1) + c_sigma),
        c_c=float((4 + mu_eff / n) / (n + 4 + 2 * mu_eff / n)),
        c_1=float(c_1),
        c_mu=float(c_mu),
        chi=math.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n**2)),
    )


def begin(mean: Float[np.ndarray, "runs n"], sigma: float) -> Search:
    """All runs before their first generation: round distributions of this step size."""
    runs, n = mean.shape
    square = np.tile(np.eye(n), (runs, 1, 1))
    zero = np.zeros((runs, n))
    return Search(mean, np.full(runs, sigma), square, square, np.ones((runs, n)), zero, zero, 0)


def sample(search: Search, population: int, random: np.random.Generator) -> Float[np.ndarray, "runs population n"]:
    """What to try next: normal samples of each run's distribution (38 to 40)."""
    runs, n = search.mean.shape
    along = random.standard_normal((runs, population, n)) * search.lengths[:, None]
    return search.mean[:, None] + search.sigma[:, None, None] * (along @ search.axes.transpose(0, 2, 1))


def advance(
    search: Search,
    fixed: Constants,
    tried: Float[np.ndarray, "runs population n"],
    scores: Float[np.ndarray, "runs population"],
) -> Search:
    """One generation: what was tried, and how it scored (lower is better) (41 to 47)."""
    order = np.argsort(scores, axis=1, kind="stable")
    steps = (np.take_along_axis(tried, order[:, :, None], axis=1) - search.mean[:, None]) / search.sigma[:, None, None]
    n, generation = search.mean.shape[1], search.generation + 1
    step = np.einsum("k,rkn->rn", fixed.weights[: fixed.selected], steps[:, : fixed.selected])  # (41)
    round_steps = (steps @ search.axes) / search.lengths[:, None]  # B^T of C^(-1/2) y: of the same length
    round_step = np.einsum("rij,rj->ri", search.axes, ((step[:, None] @ search.axes)[:, 0] / search.lengths))

    c, keep = fixed.c_sigma, 1 - fixed.c_sigma
    sigma_path = keep * search.sigma_path + math.sqrt(c * (2 - c) * fixed.mu_eff) * round_step  # (43)
    length = np.linalg.norm(sigma_path, axis=1)
    sigma = search.sigma * np.exp(c / fixed.d_sigma * (length / fixed.chi - 1))  # (44)

    c = fixed.c_c
    steady = length / math.sqrt(1 - keep ** (2 * (generation + 1))) < (1.4 + 2 / (n + 1)) * fixed.chi
    path = (1 - c) * search.covariance_path + (steady * math.sqrt(c * (2 - c) * fixed.mu_eff))[:, None] * step  # (45)
    shrunk = n / ((round_steps**2).sum(axis=2) + 1e-8)
    weights = np.where(fixed.weights >= 0, fixed.weights, fixed.weights * shrunk)  # (46)
    kept = 1 + fixed.c_1 * ~steady * c * (2 - c) - fixed.c_1 - fixed.c_mu * fixed.weights.sum()
    covariance = (
        kept[:, None, None] * search.covariance
        + fixed.c_1 * path[:, :, None] * path[:, None]
        + fixed.c_mu * (steps.transpose(0, 2, 1) * weights[:, None]) @ steps
    )  # (47)
    axes, lengths = _axes(covariance)
    mean = search.mean + search.sigma[:, None] * step  # (42)
    return Search(mean, sigma, covariance, axes, lengths, sigma_path, path, generation)


def _axes(
    covariance: Float[np.ndarray, "runs n n"],
) -> tuple[Float[np.ndarray, "runs n n"], Float[np.ndarray, "runs n"]]:
    values, vectors = np.linalg.eigh((covariance + covariance.transpose(0, 2, 1)) / 2)
    return vectors, np.sqrt(np.maximum(values, _SMALLEST))
