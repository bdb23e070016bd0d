"""How well could a network of this size reach at all? Trained directly through the true kinematics, to the best it can.

No exploration is involved: the distance between targets and where the answers bring the tip is followed downhill (Adam,
Kingma and Ba 2015) from several random starts. What this can't reach, no way of babbling can.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.reach.learn.perceptron import Layer, Layers, Perceptron
from toddle.reach.session import Session
from toddle.reach.unit_box import UnitBox, sample_reachable
from toddle.robots.body import Body

_REACHABLE = 20_000
_BATCH = 256
_RATE = 0.02
_TINY = 1e-12  # [m^2]


def capacity(session: Session, *, starts: int, steps: int, seed: int) -> float:
    """The least mean error on the test set that a session's perceptron comes to [mm].

    Args:
        session: the body, its unit box, the perceptron and the test set.
        starts: random initial weights that are tried; the best counts.
        steps: of Adam, on 256 random reachable targets each.
        seed: of weights and targets.
    """
    learner = session.setting.learner
    assert isinstance(session.body, Body)
    assert isinstance(learner, Perceptron)
    for_targets, for_starts = jax.random.split(jax.random.key(seed))
    reachable = sample_reachable(session.body, for_targets, _REACHABLE)[1]
    keys = jax.random.split(for_starts, starts)
    targets = jnp.asarray(session.targets, jnp.float32)
    errors = _train(session.setting.box, session.body, learner, reachable, targets, keys, steps)
    return 1000 * float(np.min(errors))


@eqx.filter_jit
def _train(
    box: UnitBox, body: Body, learner: Perceptron, reachable: Array, targets: Array, keys: jax.Array, steps: int
) -> Float[Array, " starts"]:
    """Mean errors on the targets after training from each start [m]."""

    def errors(layers: Layers, x: Array) -> Array:
        q = jax.vmap(lambda target: learner.predict(layers, target))(box.x_to_unit(x))
        # joints stop at their limits, but the slope is followed beyond them, lest an answer stick there
        q = q + jax.lax.stop_gradient(jnp.clip(q, 0.0, 1.0) - q)
        missed = jax.vmap(body.forward)(box.q_from_unit(q)) - x
        return jnp.sqrt(jnp.sum(missed**2, axis=-1) + _TINY)  # a distance of zero has no slope

    def from_start(key: jax.Array) -> Array:
        layers = _start(key, (targets.shape[1], *learner.hidden, len(body.joints)))
        still = jax.tree.map(jnp.zeros_like, layers)

        def step(state: tuple[Layers, Layers, Layers], i: Array) -> tuple[tuple[Layers, Layers, Layers], None]:
            layers, mean, square = state
            rows = jax.random.randint(jax.random.fold_in(key, i), (_BATCH,), 0, _REACHABLE)
            slope = jax.grad(lambda now: jnp.mean(errors(now, reachable[rows])))(layers)
            mean = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, mean, slope)
            square = jax.tree.map(lambda s, g: 0.999 * s + 0.001 * g * g, square, slope)
            count = i.astype(jnp.float32) + 1.0
            rate = _RATE * (1.0 - count / (steps + 1)) * jnp.sqrt(1.0 - 0.999**count) / (1.0 - 0.9**count)
            layers = jax.tree.map(lambda p, m, s: p - rate * m / (jnp.sqrt(s) + 1e-8), layers, mean, square)
            return (layers, mean, square), None

        (layers, _, _), _ = jax.lax.scan(step, (layers, still, still), jnp.arange(steps))
        return jnp.mean(errors(layers, targets))

    return jax.vmap(from_start)(keys)


def _start(key: jax.Array, sizes: tuple[int, ...]) -> Layers:
    keys = jax.random.split(key, len(sizes) - 1)
    draw = lambda k, below, above: 3.0 * jax.random.normal(k, (above, below)) / jnp.sqrt(below)  # noqa: E731
    layers = [
        Layer(draw(k, below, above), jnp.zeros(above))
        for k, below, above in zip(keys, sizes[:-1], sizes[1:], strict=True)
    ]
    return Layers(tuple(layers), None)
