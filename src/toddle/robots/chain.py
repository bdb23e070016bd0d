"""A rigid chain of revolute and prismatic axes, described once, as frozen arrays.

Frames are chosen so that every axis turns about, or slides along, its own z: the tip's transform is
``T(q) = before[0] Z(m_0) before[1] Z(m_1) ... tip`` with constant ``before`` and ``Z`` a turn about z or a
slide along it. What a file or a table calls an axis in another direction is folded into the constants. A
mimic joint is an axis whose motion is ``m = gain @ q + offset`` of the actuated joints.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.robots.body import Body

_UNROLL = 16  # longer chains loop over their axes: a compiled line for each of 50 axes takes longer than it saves


class Chain(Body):
    """A rigid arm as a product of z-axis motions and constant transforms.

    Attributes:
        name: the robot's name.
        joints: names of the actuated joints, base first.
        lower: lower limits [rad, or m for a sliding joint].
        upper: upper limits [rad or m].
        home: where learning starts [rad or m].
        before: transform from each axis' predecessor (or the base) to its own frame at zero motion [m].
        slides: 1.0 where the axis is prismatic, 0.0 where it is revolute.
        gain: motion of each axis for a unit of each actuated joint (identity rows, but for mimic joints).
        offset: motion of each axis when all joints are zero [rad or m].
        tip: transform from the last axis' frame to the tip [m].
        coordinates: which of x, y, z the tip's position is reported in: (0, 1) for a planar arm.
        links: names of the links that each axis carries, up to the next one; empty where they have none.
        notes: what was inferred where nothing was named, in sentences.
    """

    name: str = eqx.field(static=True)
    joints: tuple[str, ...] = eqx.field(static=True)
    lower: Float[Array, " joints"]
    upper: Float[Array, " joints"]
    home: Float[Array, " joints"]
    before: Float[Array, "axes 4 4"]
    slides: Float[Array, " axes"]
    gain: Float[Array, "axes joints"]
    offset: Float[Array, " axes"]
    tip: Float[Array, "4 4"]
    coordinates: tuple[int, ...] = eqx.field(static=True, default=(0, 1, 2))
    links: tuple[tuple[str, ...], ...] = eqx.field(static=True, default=())
    notes: tuple[str, ...] = eqx.field(static=True, default=())

    @property
    def carriers(self) -> dict[str, str]:
        """The joint that carries each link, by the link's name."""
        moved_by = [self.joints[int(jnp.argmax(jnp.abs(row)))] for row in self.gain]
        return {link: joint for joint, links in zip(moved_by, self.links, strict=False) for link in links}

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        return len(self.coordinates)

    def forward(self, q: Float[Array, " joints"]) -> Float[Array, " space"]:
        """Tip position [m] for joint values q [rad or m].

        Works backwards from the tip, on one point instead of whole transforms: this is what the learning loop
        spends its time on.
        """
        motion = self.gain @ q + self.offset
        slide = motion * self.slides
        cos, sin = jnp.cos(motion - slide), jnp.sin(motion - slide)
        point = self.tip[:3, 3]
        if len(self.slides) <= _UNROLL:
            for i in reversed(range(len(self.slides))):
                point = _carry(point, self.before[i], cos[i], sin[i], slide[i])
        else:
            point, _ = jax.lax.scan(
                lambda p, axis: (_carry(p, *axis), None), point, (self.before, cos, sin, slide), reverse=True
            )
        return point[jnp.array(self.coordinates)]

    def pose(self, q: Float[Array, " joints"]) -> Float[Array, "4 4"]:
        """Homogeneous transform from the base to the tip [m] for joint values q [rad or m]."""
        motion = self.gain @ q + self.offset
        axes = self.before @ jax.vmap(z_motion)(motion, self.slides)
        start = jnp.eye(4, dtype=axes.dtype)
        pose, _ = jax.lax.scan(lambda frame, axis: (frame @ axis, None), start, axes)
        return pose @ self.tip


def z_motion(motion: Float[Array, ""], slides: Float[Array, ""]) -> Float[Array, "4 4"]:
    """The transform of one axis: a turn about z by motion [rad], or a slide along z by motion [m]."""
    turn, slide = motion * (1 - slides), motion * slides
    cos, sin = jnp.cos(turn), jnp.sin(turn)
    zero, one = jnp.zeros_like(cos), jnp.ones_like(cos)
    rows = [
        [cos, -sin, zero, zero],
        [sin, cos, zero, zero],
        [zero, zero, one, slide],
        [zero, zero, zero, one],
    ]
    return jnp.array(rows)


def _carry(
    point: Float[Array, "3"],
    before: Float[Array, "4 4"],
    cos: Float[Array, ""],
    sin: Float[Array, ""],
    slide: Float[Array, ""],
) -> Float[Array, "3"]:
    """The same point, seen from one axis further down the chain."""
    x, y, z = point
    moved = jnp.stack([cos * x - sin * y, sin * x + cos * y, z + slide])
    return before[:3, :3] @ moved + before[:3, 3]
