"""A soft arm learned from its movements: segments of constant curvature whose geometry nobody told.

Per segment the bend vector is ``B u + b0`` and the arc length ``a . u + L0``, with u the segment's own actuators;
B, b0, a, L0, the foot, the tip and how many actuators a segment has are found from movements, by Levenberg-Marquardt
from several starts, wild movements left out. What regular arms have in common is learned on the way
(`curvature_prior`). The constant curvature is Webster and Jones' (2010), as Thuruthel et al. (2016) use it.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.model.curvature_chain import Shape, joint_slopes, number_slopes, places, tips
from toddle.reach.model.curvature_descent import Seen, descend, doubted, quadratic, spread_of, tame
from toddle.reach.model.curvature_prior import joined, learned, regularities, sizes_of_numbers, weak
from toddle.reach.model.curvature_start import quadratic_of, start
from toddle.reach.model.model import Fit
from toddle.signals import Experience

_STARTS, _START_MOVEMENTS, _START_ITERATIONS = 8, 300, 60
_SAME = 1.05  # two starts that end within this ratio of spread have found the same arm

Numbers = Float[np.ndarray, " numbers"]


@dataclass(frozen=True)
class Curvature:
    """A learned soft arm; a `toddle.reach.model.model.Model`.

    Attributes:
        shape: what its numbers mean.
        numbers: its geometry, see `toddle.reach.model.curvature_chain`.
        covariance: of the numbers.
    """

    shape: Shape
    numbers: Numbers
    covariance: Float[np.ndarray, "numbers numbers"]

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        return self.shape.space

    def forward(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space"]:
        """Tip positions [m] for actuator values [m]."""
        return tips(self.shape, self.numbers, q)

    def slope(
        self, q: Float[np.ndarray, "batch joints"]
    ) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
        """Tip positions [m], and how they change with the actuator values [m/m]."""
        return joint_slopes(self.shape, self.numbers, q)

    def spread(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space space"]:
        """Covariance of what the model may be wrong by at each posture [m^2]."""
        slope = number_slopes(self.shape, self.numbers, q)[1]
        return slope @ self.covariance @ slope.transpose(0, 2, 1)


@dataclass(frozen=True)
class _Found:
    """An arm as a start ended, and its cost."""

    shape: Shape
    numbers: Numbers
    sigma: float
    cost: float


def fit_curvature(
    experience: Experience,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    *,
    joints: Sequence[str],
    seed: int,
    sizes: Sequence[int] | None = None,
) -> Fit:
    """Learn a soft arm of segments of constant curvature from its movements.

    Args:
        experience: movements; the noise of the tips may be anything, and some tips wild.
        lower: least actuator values [m].
        upper: greatest actuator values [m].
        joints: names of the actuators.
        seed: of the starts.
        sizes: how many actuators each segment has, base first; None: two, three and four are tried.

    Returns:
        The fit, of kind "curvature"; its sensor's deviation includes what the structure can't explain.

    Raises:
        BadInput: fewer movements than the geometry needs, actuators that no segments of two to four share out,
            or an actuator that never varies.
    """
    began = time.perf_counter()
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    q, x = np.asarray(experience.q, float), np.asarray(experience.x, float)
    _check(q, joints)
    shapes = [
        Shape(tuple(each), 1, (lower + upper) / 2, (upper - lower) / 2, x.shape[1])
        for each in ([tuple(sizes)] if sizes is not None else groupings(len(joints)))
    ]
    if not shapes or sum(shapes[0].sizes) != len(joints):
        raise BadInput(
            f"{len(joints)} actuators are not shared out by segments of {sizes or 'two, three or four'}",
            remedy="give the sizes of the segments, base first",
        )
    wanted = max(places(shape).total for shape in shapes)
    if len(q) < wanted:
        raise BadInput(
            f"{len(q)} movements are too few for a soft arm of {len(joints)} actuators",
            remedy=f"make {wanted} movements at least, better {4 * wanted}",
        )
    rng = np.random.default_rng(seed)
    scale = float(np.sqrt(np.median(((x - np.median(x, axis=0)) ** 2).sum(1)))) + 1e-9
    some = rng.permutation(len(q))[:_START_MOVEMENTS]
    found = min((_searched(shape, q[some], x[some], scale, rng) for shape in shapes), key=lambda one: one.cost)
    return _polished(found, q, x, scale, began, joints)


def groupings(count: int) -> list[tuple[int, ...]]:
    """How actuators may be shared out: equal segments of three, two or four, else mixed ones of three and two."""
    if count == 1:
        return [(1,)]
    equal = [(size,) * (count // size) for size in (3, 2, 4) if count % size == 0]
    if equal:
        return equal
    return [tuple(sizes) for sizes in _mixed(count)]


def _mixed(count: int) -> list[list[int]]:
    if count == 0:
        return [[]]
    return [[size, *rest] for size in (3, 2) if size <= count for rest in _mixed(count - size)]


def _searched(
    shape: Shape,
    q: Float[np.ndarray, "movements joints"],
    x: Float[np.ndarray, "movements space"],
    scale: float,
    rng: np.random.Generator,
) -> _Found:
    """The best of several starts, judged by the median miss; two that agree are enough."""
    known = quadratic_of(shape, q, x)
    prior, sizes = joined(weak(shape, scale), places(shape).total), sizes_of_numbers(shape, scale)
    ends: list[tuple[float, Numbers]] = []
    for number in range(_STARTS):
        numbers, weight = start(shape, known, scale, number, rng), known.weight
        for width, iterations in ((0.3, _START_ITERATIONS), (0.1, 15)):
            numbers, _ = descend(shape, numbers, Seen(q, x, weight), prior, sizes, 0.03 * scale, iterations)
            weight = doubted(x - tips(shape, numbers, q), width * scale)
        ends.append((spread_of(x - tips(shape, numbers, q)), numbers))
        ends.sort(key=lambda end: end[0])
        if len(ends) > 1 and ends[1][0] < _SAME * ends[0][0]:
            break
    sigma, numbers = ends[0]
    informed = x.size * np.log(sigma) + 0.5 * len(numbers) * np.log(x.size)  # Schwarz' criterion
    return _Found(shape, numbers, sigma, informed)


def _polished(
    found: _Found,
    q: Float[np.ndarray, "movements joints"],
    x: Float[np.ndarray, "movements space"],
    scale: float,
    began: float,
    joints: Sequence[str],
) -> Fit:
    """All movements, the noise and the regularities learned from them, the wild movements left out."""
    shape, numbers, sigma = found.shape, found.numbers, found.sigma
    floor, sizes = joined(weak(shape, scale), len(numbers)), sizes_of_numbers(shape, scale)
    groups, known = [], 0.0
    good = tame(x - tips(shape, numbers, q), sigma)
    covariance = np.zeros((len(numbers), len(numbers)))
    for _ in range(4):
        prior = joined([*weak(shape, scale), *groups], len(numbers))
        numbers, _ = descend(shape, numbers, Seen(q, x, good.astype(float)), prior, sizes, sigma, 20)
        miss = x - tips(shape, numbers, q)
        good = tame(miss, spread_of(miss))
        seen = Seen(q, x, good.astype(float))
        data = quadratic(shape, numbers, seen, sigma)
        covariance = np.linalg.inv(data.precision + prior.precision)
        known = float(np.trace(covariance @ data.precision))
        sigma = float(np.sqrt((miss[good] ** 2).sum() / max(miss[good].size - known, 1.0)))
        data = quadratic(shape, numbers, seen, sigma)
        groups = learned(groups or regularities(shape, numbers, scale), data, floor)
    miss = x - tips(shape, numbers, q)
    return Fit(
        model=Curvature(shape, numbers, covariance),
        kind="curvature",
        miss=np.linalg.norm(miss, axis=1),
        sensor=sigma,
        wild=~good,
        seconds=time.perf_counter() - began,
        notes=(f"{len(shape.sizes)} segments of {', '.join(map(str, shape.sizes))} actuators",),
    )


def _check(q: Float[np.ndarray, "movements joints"], joints: Sequence[str]) -> None:
    for name, column in zip(joints, q.T, strict=True):
        if np.ptp(column) == 0:
            raise BadInput(f"actuator {name} never varies in the movements", remedy="move it, too")
