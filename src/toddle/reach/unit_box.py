"""The unit box: joint values and tip positions scaled so that 0 and 1 are the limits, and back.

Mahboob 2015 learns on positions normalised to the workspace and motors normalised to their range; one learning rate
and one perturbation then mean the same on every robot.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.failures import BadInput
from toddle.robots.body import Body


class UnitBox(eqx.Module):
    """Affine maps between physical values and the unit box.

    Attributes:
        joint_lower, joint_span: lower limit and range of each joint [rad or m].
        space_lower, space_span: lower edge and extent of the workspace along each axis [m].
    """

    joint_lower: Float[Array, " joints"]
    joint_span: Float[Array, " joints"]
    space_lower: Float[Array, " space"]
    space_span: Float[Array, " space"]

    def q_to_unit(self, q: Float[Array, "*batch joints"]) -> Float[Array, "*batch joints"]:
        """Joint values [rad or m] to the unit box."""
        return (q - _like(q, self.joint_lower)) / _like(q, self.joint_span)

    def q_from_unit(self, q: Float[Array, "*batch joints"]) -> Float[Array, "*batch joints"]:
        """Unit-box joint values to physical ones [rad or m]."""
        return _like(q, self.joint_lower) + q * _like(q, self.joint_span)

    def x_to_unit(self, x: Float[Array, "*batch space"]) -> Float[Array, "*batch space"]:
        """Tip positions [m] to the unit box."""
        return (x - _like(x, self.space_lower)) / _like(x, self.space_span)

    def x_from_unit(self, x: Float[Array, "*batch space"]) -> Float[Array, "*batch space"]:
        """Unit-box positions to metres."""
        return _like(x, self.space_lower) + x * _like(x, self.space_span)


def around(
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    positions: Float[np.ndarray, "samples space"],
    *,
    isotropic: bool = False,
) -> UnitBox:
    """The unit box of a body whose tip was seen at these positions [m].

    Args:
        lower, upper: joint limits [rad or m].
        positions: positions that the tip can take, enough of them to span the workspace [m].
        isotropic: one scale for all axes of space (distances keep their ratios), centred on the workspace.

    Raises:
        BadInput: the tip never moved, or a joint has no range.
    """
    low, high = positions.min(axis=0), positions.max(axis=0)
    span = high - low
    if not np.all(upper > lower):
        raise BadInput("a joint has no range", remedy="give each joint a lower limit below its upper one")
    if span.max() < 1e-6:
        raise BadInput("no joint moves the tip", remedy="name another tip with --tip, or other joints")
    span = np.full_like(span, span.max()) if isotropic else np.maximum(span, 1e-3 * span.max())
    middle = (low + high) / 2
    as_array = lambda values: jnp.asarray(values, jnp.float32)  # noqa: E731
    return UnitBox(as_array(lower), as_array(upper - lower), as_array(middle - span / 2), as_array(span))


@eqx.filter_jit
def sample_reachable(
    body: Body, key: jax.Array, count: int
) -> tuple[Float[Array, "count joints"], Float[Array, "count space"]]:
    """Joint values drawn uniformly over their ranges [rad or m], and where they bring the tip [m]."""
    fraction = jax.random.uniform(key, (count, len(body.joints)))
    q = _like(fraction, body.lower) + fraction * _like(fraction, body.upper - body.lower)
    return q, jax.vmap(body.forward)(q)


def _like(batch: Float[Array, "*batch axes"], row: Float[Array, " axes"]) -> Float[Array, "*batch axes"]:
    """The row for every entry of a batch."""
    return jnp.broadcast_to(row, batch.shape)
