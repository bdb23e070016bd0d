"""Continuous motor babbling of any body, as movements in physical units (Thuruthel 2016, section 3)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.observe import observer
from toddle.robots.body import Body, Plant
from toddle.signals import Experience


def babble(
    body: Body | Plant, samples: int, *, eps: float | None = None, noise: float = 0.0, seed: int = 0
) -> Experience:
    """Continuous motor babbling: a walk from home through the joint space, reflected at the limits.

    Each step is uniform in the ball of radius eps, joints measured as shares of their ranges.

    Args:
        body: who moves.
        samples: steps of the walk.
        eps: the greatest length of a step; None: `suited_eps`.
        noise: each coordinate of the seen tip is off by up to this, uniformly [m].
        seed: of the walk and of the noise.

    Returns:
        Home and the `samples` movements after it, as they were commanded and seen.

    Raises:
        BadInput: no samples, no step or no joint range.
    """
    lower, upper = limits_of(body)
    eps = suited_eps(len(lower)) if eps is None else eps
    if samples < 1 or not eps > 0 or not noise >= 0:
        raise BadInput(
            f"{samples} samples, steps of {eps:g}, noise of {noise:g}", where="babbling", remedy="give positive numbers"
        )
    drawn = np.random.default_rng(seed)
    q = np.empty((samples + 1, len(lower)))
    q[0] = np.clip((np.asarray(body.home, float) - lower) / (upper - lower), 0, 1)
    direction = drawn.normal(size=(samples, len(lower)))
    length = eps * drawn.uniform(size=(samples, 1)) ** (1 / len(lower))
    for i, change in enumerate(length * direction / np.linalg.norm(direction, axis=1, keepdims=True)):
        q[i + 1] = _reflected(q[i] + change)
    q = lower + q * (upper - lower)
    x = observer(body)(q)
    return Experience(q, x + drawn.uniform(-noise, noise, x.shape))


def suited_eps(joints: int) -> float:
    """The length of a step that suits an arm: 0.4 of the diagonal of its joint space, 1.2 for nine joints."""
    return 0.4 * joints**0.5


def limits_of(body: Body | Plant) -> tuple[Float[np.ndarray, " joints"], Float[np.ndarray, " joints"]]:
    """Lower and upper limits of the joints [rad or m].

    Raises:
        BadInput: a joint has no range.
    """
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    for name, fine in zip(body.joints, np.isfinite(lower + upper) & (upper > lower), strict=True):
        if not fine:
            raise BadInput("it has no range", where=f"joint {name}", remedy="give it a lower limit below its upper one")
    return lower, upper


def _reflected(q: Float[np.ndarray, " joints"]) -> Float[np.ndarray, " joints"]:
    """Joint values folded back into their ranges, 0 to 1."""
    return 1 - np.abs(1 - np.mod(q, 2))
