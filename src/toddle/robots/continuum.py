"""The bionic handling assistant: a soft arm of three segments, each bent by three actuators that lengthen.

Constant curvature per segment, as in Thuruthel et al. 2016. With the actuator lengths l1, l2, l3 [m] at
radius r,

    g = sqrt(l1^2 + l2^2 + l3^2 - l1 l2 - l1 l3 - l2 l3),  bend angle theta = 2 g / (3 r),
    bend direction phi = atan2(sqrt(3) (l3 - l2), l2 + l3 - 2 l1),  arc length = mean(l).

A straight segment (g = 0) has no direction phi, and atan2 and sqrt have no derivative there. Written with the
bend vector ``b = theta (cos phi, sin phi)`` all of that disappears: b is linear in the lengths, and the tip
and the turn of a segment are smooth functions of b and theta^2 = b.b.
"""

from __future__ import annotations

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.robots.body import Body

_SERIES_BELOW = 0.5  # [rad^2] beneath this theta^2 the series is used: exact there, and cosine would cancel


class Continuum(Body):
    """A soft arm: segments in a row, three actuator lengths each, no gap between them.

    Attributes:
        name: the robot's name.
        joints: names of the actuators, base first, three a segment.
        lower: least lengths [m].
        upper: greatest lengths [m].
        home: where learning starts [m].
        radii: distance of a segment's actuators from its middle line [m].
    """

    name: str = eqx.field(static=True)
    joints: tuple[str, ...] = eqx.field(static=True)
    lower: Float[Array, " joints"]
    upper: Float[Array, " joints"]
    home: Float[Array, " joints"]
    radii: Float[Array, " segments"]

    @property
    def space(self) -> int:
        """The tip's position has three coordinates."""
        return 3

    def forward(self, q: Float[Array, " joints"]) -> Float[Array, "3"]:
        """Tip position [m] in the base frame, z along the straight arm, for actuator lengths q [m]."""
        turns, shifts = self._segments(q)
        point = shifts[-1]
        for i in reversed(range(len(self.radii) - 1)):
            point = turns[i] @ point + shifts[i]
        return point

    def pose(self, q: Float[Array, " joints"]) -> Float[Array, "4 4"]:
        """Homogeneous transform from the base to the tip [m] for actuator lengths q [m]."""
        turns, shifts = self._segments(q)
        turn, shift = turns[0], shifts[0]
        for i in range(1, len(self.radii)):
            turn, shift = turn @ turns[i], turn @ shifts[i] + shift
        return jnp.eye(4, dtype=q.dtype).at[:3, :3].set(turn).at[:3, 3].set(shift)

    def _segments(self, q: Float[Array, " joints"]) -> tuple[Float[Array, "segments 3 3"], Float[Array, "segments 3"]]:
        return jax.vmap(segment)(q.reshape(-1, 3), self.radii)


def segment(lengths: Float[Array, "3"], radius: Float[Array, ""]) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
    """Turn and shift [m] from a segment's foot to its head, for its actuator lengths [m] at a radius [m]."""
    second, third = lengths[1] - lengths[0], lengths[2] - lengths[0]
    arc = lengths[0] + (second + third) / 3  # the mean, without rounding where all are equal
    bx, by = (second + third) / (3 * radius), math.sqrt(3) * (third - second) / (3 * radius)
    return turn_and_shift(jnp.stack([bx, by]), arc)


def turn_and_shift(bend: Float[Array, "2"], arc: Float[Array, ""]) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
    """Turn and shift [m] along an arc [m] that bends by an angle |bend| [rad] towards its direction."""
    bx, by = bend[0], bend[1]
    sinc, versine = _sinc_and_versine(bx * bx + by * by)
    zero = jnp.zeros_like(bx)
    # Rodrigues' formula about the axis (-by, bx, 0): the segment bends towards (bx, by) and does not twist.
    cross = jnp.array([[zero, zero, bx], [zero, zero, by], [-bx, -by, zero]])
    turn = jnp.eye(3, dtype=bend.dtype) + sinc * cross + versine * (cross @ cross)
    return turn, arc * jnp.stack([versine * bx, versine * by, sinc])


def _sinc_and_versine(square: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """``sin(t) / t`` and ``(1 - cos t) / t^2`` of t^2, with exact value and derivative at zero.

    Both branches are computed (``where``), so the closed form is given a harmless argument where it is not
    used.
    """
    small = square < _SERIES_BELOW
    t = jnp.sqrt(jnp.where(small, 1.0, square))
    series = jnp.where(small, square, 0.0)
    sinc = jnp.where(small, _series(series, 1), jnp.sin(t) / t)
    versine = jnp.where(small, _series(series, 2), (1 - jnp.cos(t)) / (t * t))
    return sinc, versine


def _series(square: Float[Array, ""], first: int) -> Float[Array, ""]:
    """The sum of ``(-square)^k / (2 k + first)!``, to double precision for squares up to one half."""
    total = jnp.ones_like(square)
    for k in range(8, 0, -1):
        total = 1 - square * total / ((2 * k + first) * (2 * k + first - 1))
    return total / first


def bha() -> Continuum:
    """The nine-actuator bionic handling assistant of Thuruthel et al. 2016.

    Radii .100, .093 and .079 m; lengths .1 to .3 m. Its home is the paper's: every length .3 m, which is also
    the upper limit, tip (0, 0, .9) m.
    """
    ones = jnp.ones(9, jnp.float32)
    return Continuum(
        name="bha",
        joints=tuple(f"segment_{i}_length_{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
        lower=0.1 * ones,
        upper=0.3 * ones,
        home=0.3 * ones,
        radii=jnp.array([0.100, 0.093, 0.079], jnp.float32),
    )
