"""Where the fit of an arm starts: at random, and how a start is judged without knowing the noise.

A start that ended in a wrong minimum misses by what the joints say: its residuals can be foretold from cosines and
sines of the joint values. Those of a right one can't (a test of lack of fit, by the ratio of variances).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.reach.model.screw_arms import Arms, from_lines
from toddle.reach.model.screw_steps import Seen

_CHI_MEDIAN = {1: 0.4549, 2: 1.3863, 3: 2.3660, 6: 5.3481}  # medians of chi-square distributions


def random_arms(
    count: int, seen: Seen, slides: Float[np.ndarray, " axes"], motor: np.ndarray, rng: np.random.Generator
) -> Arms:
    """Arms with axes in any direction, about as far apart as the tips that were seen."""
    spread = 0.6 * np.sqrt(seen.x.var(axis=0).sum())
    middle = np.median(seen.x, axis=0)
    shape = (count, len(motor), 3)
    along, through, tip = rng.normal(size=shape), rng.normal(size=shape), rng.normal(size=(count, 3))
    if seen.rows == 2:
        along[..., :2] = 0.0
        through[..., 2] = tip[..., 2] = 0.0
    kinds, motors = np.tile(slides, (count, 1)), np.tile(motor, (count, 1))
    return from_lines(along, middle + spread * through, kinds, middle + spread * tip, motors)


def robust_sigma(square: Float[np.ndarray, "*arms movements"], rows: int) -> Float[np.ndarray, "*arms"]:
    """Standard deviation of each row's miss [m], from the median of the squared misses."""
    return np.asarray(np.sqrt(np.median(square, axis=-1) / _CHI_MEDIAN[rows]))


def lack_of_fit(
    miss: Float[np.ndarray, "rows movements"], q: Float[np.ndarray, "movements joints"], rng: np.random.Generator
) -> float:
    """How much better the joint values foretell the misses than chance would: about 1 where nothing is left to tell.

    Returns:
        The ratio of variances, less 1, in its standard deviations.
    """
    movements = q.shape[0]
    single = np.concatenate([np.cos(q), np.sin(q)], axis=1)
    single = single - single.mean(axis=0)
    first, second = np.triu_indices(single.shape[1], 1)
    count = min(max(movements // 3, 1), 60)
    pairs = rng.permutation(len(first))[: max(count - single.shape[1], 0)]
    told = np.concatenate([np.ones((movements, 1)), single, single[:, first[pairs]] * single[:, second[pairs]]], axis=1)
    told = told[:, : count + 1]
    basis = np.linalg.qr(told)[0]
    within = ((miss @ basis) ** 2).sum()
    rest = max((miss**2).sum() - within, 1e-300)
    top, bottom = len(miss) * basis.shape[1], len(miss) * (movements - basis.shape[1])
    ratio = within / top / (rest / bottom)
    return float((ratio - 1) / np.sqrt(2 / top + 2 / bottom))
