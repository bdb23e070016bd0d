"""A soft arm learned from its movements: segments of constant curvature whose geometry nobody told.

Per segment the bend vector is ``B u + b0`` and the arc length ``a . u + L0``, with u the segment's own actuators;
B, b0, a, L0, the foot, the tip and how many actuators a segment has are found from movements, by Levenberg-Marquardt
from several starts, wild movements left out. What regular arms have in common is learned on the way
(`curvature_prior`). The constant curvature is Webster and Jones' (2010), as Thuruthel et al. (2016) use it.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.model.curvature_chain import Shape, joint_slopes, number_slopes, places, tips
from toddle.reach.model.curvature_rest import Mended, best_order, rest_of
from toddle.reach.model.curvature_search import Found, groupings, searched, settled
from toddle.reach.model.misfit import LEAST, misfit
from toddle.reach.model.model import Fit, Model
from toddle.signals import Experience


@dataclass(frozen=True)
class Curvature:
    """A learned soft arm; a `toddle.reach.model.model.Model`.

    Attributes:
        shape: what its numbers mean.
        numbers: its geometry, see `toddle.reach.model.curvature_chain`.
        covariance: of the numbers.
    """

    shape: Shape
    numbers: Float[np.ndarray, " numbers"]
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


def fit_curvature(
    experience: Experience,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    *,
    joints: Sequence[str],
    seed: int,
    sizes: Sequence[int] | None = None,
    arcs_only: bool = False,
) -> Fit:
    """Learn a soft arm of segments of constant curvature from its movements.

    Where the movements say that its curvature isn't constant, a note says so, and what arcs miss is learned, too.

    Args:
        experience: movements; the noise of the tips may be anything, and some tips wild.
        lower: least actuator values [m].
        upper: greatest actuator values [m].
        joints: names of the actuators.
        seed: of the starts, and of which movements are held out.
        sizes: how many actuators each segment has, base first; None: two, three and four are tried.
        arcs_only: nothing but arcs of constant curvature, whatever they miss.

    Returns:
        The fit, of kind "curvature".

    Raises:
        BadInput: fewer movements than the geometry needs, actuators that the segments don't share out, or an
            actuator that never varies.
    """
    began, rng = time.perf_counter(), np.random.default_rng(seed)
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    q, x = np.asarray(experience.q, float), np.asarray(experience.x, float)
    shapes = _shapes(lower, upper, x.shape[1], sizes)
    _check(q, joints, shapes)
    found = settled(*searched(shapes, q, x, rng), q, x)
    fit = _fit(found, Curvature(found.shape, found.numbers, found.covariance), found.sigma, q, x, ())
    wrong = 0.0 if arcs_only else misfit(Experience(q, x), fit, seed=seed).size
    if wrong > LEAST:
        fit = _mended(found, Experience(q, x), wrong, seed)
    return replace(fit, seconds=time.perf_counter() - began)


def _mended(found: Found, experience: Experience, wrong: float, seed: int) -> Fit:
    """The fit with what arcs of constant curvature miss."""
    q, x, rng = experience.q, experience.x, np.random.default_rng(seed)
    notes = [f"its curvature isn't constant, or its actuators aren't linear: arcs miss the tip by {1e3 * wrong:.2g} mm"]
    better = best_order(found, q, x, rng)
    if better.shape.order > 1:
        notes.append(f"bends and lengths are of order {better.shape.order} in the actuators")
    structure, sensor = Curvature(better.shape, better.numbers, better.covariance), better.sigma
    fit = _fit(better, structure, sensor, q, x, tuple(notes))
    wrong, rest = misfit(experience, fit, seed=seed).size, None
    more = rest_of(better, q, x, rng) if wrong > LEAST else None
    if more is not None:
        rest, sensor = more
        notes.append(f"what is still missed was learned as a polynomial of order {rest.order} in all actuators")
        fit = _fit(better, Mended(structure, rest, 0.0), sensor, q, x, tuple(notes))
        wrong = misfit(experience, fit, seed=seed).size
    if wrong > LEAST:
        notes.append(f"the tip is still missed by {1e3 * wrong:.2g} mm")
    return _fit(better, Mended(structure, rest, wrong**2 / x.shape[1]), sensor, q, x, tuple(notes))


def _fit(
    found: Found,
    model: Model,
    sensor: float,
    q: Float[np.ndarray, "movements joints"],
    x: Float[np.ndarray, "movements space"],
    notes: tuple[str, ...],
) -> Fit:
    parts = ", ".join(map(str, found.shape.sizes))
    return Fit(
        model=model,
        kind="curvature",
        miss=np.linalg.norm(x - model.forward(q), axis=1),
        sensor=sensor,
        wild=~found.good,
        seconds=0.0,
        notes=(f"{len(found.shape.sizes)} segments of {parts} actuators", *notes),
    )


def _shapes(
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    space: int,
    sizes: Sequence[int] | None,
) -> list[Shape]:
    """The ways in which the actuators may be shared out."""
    if sizes is not None and sum(sizes) != len(lower):
        raise BadInput(
            f"segments of {', '.join(map(str, sizes))} actuators don't share out {len(lower)}",
            remedy="give the sizes of the segments, base first",
        )
    ways = groupings(len(lower)) if sizes is None else [tuple(sizes)]
    return [Shape(way, 1, (lower + upper) / 2, (upper - lower) / 2, space) for way in ways]


def _check(q: Float[np.ndarray, "movements joints"], joints: Sequence[str], shapes: list[Shape]) -> None:
    for name, column in zip(joints, q.T, strict=True):
        if len(column) and np.ptp(column) == 0:
            raise BadInput(f"actuator {name} never varies in the movements", remedy="move it, too")
    wanted = max(places(shape).total for shape in shapes)
    if len(q) < wanted:
        raise BadInput(
            f"{len(q)} movements are too few for a soft arm of {len(joints)} actuators",
            remedy=f"make {wanted} at least, better {4 * wanted}",
        )
