"""Soft arms other than the bionic handling assistant: other layouts, and bodies whose curvature isn't constant.

A segment of k actuators at angles alpha_j and distances r_j from its middle line, with lengths l_j, has

    bend b = -(2 / k) sum_j ((l_j - m_j) / r_j) (cos alpha_j, sin alpha_j),  arc length = mean(l),

with m_j the middle of its range; for three actuators in a ring that is Thuruthel's (2016), whatever m. Three things
make it no arc of constant curvature that is linear in the actuators: a taper t (the curvature grows along the arc, by
the factor 1 - t at the foot, 1 + t at the head), actuators that answer with l = q + c (u^2 - 1) h + d (u^3 - u) h (u in
[-1, 1] over the range, h half of it), and sag (a segment bends downwards by an angle in proportion to what it carries
and to how far it lies on its side).
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.robots.body import Body
from toddle.robots.continuum import turn_and_shift

_PIECES = 6  # arcs that a tapered segment is made of


class SoftVariant(Body):
    """A soft arm of any layout; every deviation from constant curvature is zero where it isn't wanted.

    Attributes:
        name: the robot's name.
        joints: names of the actuators, base first.
        lower: least lengths [m].
        upper: greatest lengths [m].
        home: where learning starts [m].
        sizes: how many actuators each segment has, base first.
        around: angle of each actuator about its segment's middle line [rad].
        radii: distance of each actuator from it [m].
        gaps: straight stiff piece after each segment [m].
        tilt: bend vector of the foot against the base frame's z axis [rad].
        offset: of the tip in the last segment's frame [m].
        taper: of each segment.
        square: c of each actuator.
        cube: d of each actuator.
        sag: how far a segment that lies on its side bends downwards for each metre of arm beyond its foot [rad/m].
    """

    name: str = eqx.field(static=True)
    joints: tuple[str, ...] = eqx.field(static=True)
    lower: Float[Array, " joints"]
    upper: Float[Array, " joints"]
    home: Float[Array, " joints"]
    sizes: tuple[int, ...] = eqx.field(static=True)
    around: Float[Array, " joints"]
    radii: Float[Array, " joints"]
    gaps: Float[Array, " segments"]
    tilt: Float[Array, "2"]
    offset: Float[Array, "3"]
    taper: Float[Array, " segments"]
    square: Float[Array, " joints"]
    cube: Float[Array, " joints"]
    sag: Float[Array, " segments"]

    @property
    def space(self) -> int:
        """The tip's position has three coordinates."""
        return 3

    def forward(self, q: Float[Array, " joints"]) -> Float[Array, "3"]:
        """Tip position [m] in the base frame for actuator values q [m]."""
        return self.pose(q)[:3, 3]

    def pose(self, q: Float[Array, " joints"]) -> Float[Array, "4 4"]:
        """Homogeneous transform from the base to the tip [m] for actuator values q [m]."""
        bends, arcs = self._bends(q)
        turn, _ = turn_and_shift(self.tilt, jnp.zeros((), q.dtype))
        place = jnp.zeros(3, q.dtype)
        for i in range(len(self.sizes)):
            beyond = arcs[i:].sum() + self.gaps[i:].sum()
            down = -turn[2, :2]  # gravity across the segment, in its foot's frame
            bend = bends[i] + self.sag[i] * beyond * down
            turn, place = _along(turn, place, bend, arcs[i], self.taper[i])
            place = place + self.gaps[i] * turn[:, 2]
        place = place + turn @ self.offset
        return jnp.eye(4, dtype=q.dtype).at[:3, :3].set(turn).at[:3, 3].set(place)

    def _bends(self, q: Float[Array, " joints"]) -> tuple[Float[Array, "segments 2"], Float[Array, " segments"]]:
        """Bend vector [rad] and arc length [m] of each segment, sag left out."""
        half = (self.upper - self.lower) / 2
        u = (q - self.lower) / half - 1
        lengths = q + half * (self.square * (u * u - 1) + self.cube * (u**3 - u))
        towards = jnp.stack([jnp.cos(self.around), jnp.sin(self.around)], axis=1) / self.radii[:, None]
        bends, arcs, first = [], [], 0
        for size in self.sizes:
            own = slice(first, first + size)
            bends.append(-2 / size * (lengths - self.lower - half)[own] @ towards[own])
            arcs.append(lengths[own].mean())
            first += size
        return jnp.stack(bends), jnp.stack(arcs)


def _along(
    turn: Float[Array, "3 3"],
    place: Float[Array, "3"],
    bend: Float[Array, "2"],
    arc: Float[Array, ""],
    taper: Float[Array, ""],
) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
    """Turn and place [m] at a segment's head, from those at its foot."""

    def piece(
        carry: tuple[Float[Array, "3 3"], Float[Array, "3"]], where: Float[Array, ""]
    ) -> tuple[tuple[Float[Array, "3 3"], Float[Array, "3"]], None]:
        turn, place = carry
        step, shift = turn_and_shift((1 + taper * where) / _PIECES * bend, arc / _PIECES)
        return (turn @ step, place + turn @ shift), None

    middles = (2 * jnp.arange(_PIECES, dtype=turn.dtype) + 1) / _PIECES - 1
    return jax.lax.scan(piece, (turn, place), middles)[0]


def bha_variant(*, taper: float = 0.0, nonlinear: float = 0.0, sag: float = 0.0, seed: int = 0) -> SoftVariant:
    """The bionic handling assistant with a curvature that isn't constant.

    Args:
        taper: of each segment, about this much.
        nonlinear: of each actuator, square and cube up to this much.
        sag: of each segment, about this much [rad/m].
        seed: of how much it is in each.
    """
    ring = np.tile(2 * np.pi / 3 * np.arange(3), 3)
    return _variant(
        "bha_variant",
        (3, 3, 3),
        around=ring,
        radii=np.repeat([0.100, 0.093, 0.079], 3),
        lower=np.full(9, 0.1),
        upper=np.full(9, 0.3),
        uneven=_uneven((3, 3, 3), taper, nonlinear, sag, np.random.default_rng(seed)),
    )


def random_soft_arm(
    seed: int, *, size: int | None = None, taper: float = 0.0, nonlinear: float = 0.0, sag: float = 0.0
) -> SoftVariant:
    """A soft arm that nobody named: two to four segments, uneven rings and ranges, a tilted foot, an offset tip.

    Args:
        seed: of everything.
        size: actuators in each segment: 2 (across each other), 3 or 4; None: drawn.
        taper: of each segment, about this much.
        nonlinear: of each actuator, square and cube up to this much.
        sag: of each segment, about this much [rad/m].
    """
    rng = np.random.default_rng(seed)
    segments = int(rng.integers(2, 5))
    own = int(rng.integers(2, 5)) if size is None else size
    sizes = (own,) * segments
    count = own * segments
    share = 2 * np.pi / own if own > 2 else np.pi / 2
    around = share * np.tile(np.arange(own), segments) + np.repeat(rng.uniform(-np.pi, np.pi, segments), own)
    lower = np.repeat(rng.uniform(0.08, 0.15, segments), own)
    return _variant(
        f"soft_{seed}",
        sizes,
        around=around + rng.uniform(-0.2, 0.2, count),
        radii=np.repeat(rng.uniform(0.05, 0.1, segments), own) * rng.uniform(0.9, 1.1, count),
        lower=lower,
        upper=lower + np.repeat(rng.uniform(0.06, 0.12, segments), own),
        uneven=_uneven(sizes, taper, nonlinear, sag, rng),
        gaps=rng.uniform(0.0, 0.03, segments),
        tilt=rng.normal(size=2),
        offset=rng.uniform(-0.03, 0.03, 3),
    )


def _uneven(
    sizes: tuple[int, ...], taper: float, nonlinear: float, sag: float, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """How far each segment and actuator is from constant curvature."""
    segments, count = len(sizes), sum(sizes)
    return {
        "taper": taper * rng.uniform(0.7, 1.3, segments),
        "square": nonlinear * rng.uniform(-1, 1, count),
        "cube": nonlinear * rng.uniform(-1, 1, count),
        "sag": sag * rng.uniform(0.7, 1.3, segments),
    }


def _variant(
    name: str,
    sizes: tuple[int, ...],
    *,
    around: Float[np.ndarray, " joints"],
    radii: Float[np.ndarray, " joints"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    uneven: dict[str, np.ndarray],
    gaps: Float[np.ndarray, " segments"] | None = None,
    tilt: Float[np.ndarray, "2"] | None = None,
    offset: Float[np.ndarray, "3"] | None = None,
) -> SoftVariant:
    def single(values: Float[np.ndarray, " _"] | None, count: int) -> Float[Array, " _"]:
        return jnp.asarray(np.zeros(count) if values is None else values, jnp.float32)

    count = len(around)
    own = [f"segment_{i + 1}_length_{j + 1}" for i, size in enumerate(sizes) for j in range(size)]
    return SoftVariant(
        name=name,
        joints=tuple(own),
        lower=single(lower, count),
        upper=single(upper, count),
        home=single((lower + upper) / 2, count),
        sizes=sizes,
        around=single(around, count),
        radii=single(radii, count),
        gaps=single(gaps, len(sizes)),
        tilt=single(tilt, 2),
        offset=single(offset, 3),
        **{key: single(values, len(values)) for key, values in uneven.items()},
    )
