"""A body learned by a plain network, from some thousand movements, with nothing assumed but smoothness.

Three hidden layers of products, h = (W z + a) * (V z + b), and a linear output (the "bilinear" gated unit of Shazeer
2020, "GLU variants improve transformer"): a polynomial of degree eight in what goes in, cosine and sine of each joint
that is an angle, else its value. Trained by Adam (Kingma and Ba 2015) on squared error, the rate falling as a half
cosine; asked in NumPy, so that answers need no JAX. How wrong it may be comes from movements that it was not trained
on.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.model.covariance import Doubt, doubt_from, learn_covariance
from toddle.reach.model.kernel import PART, check_count, fit_kernel
from toddle.reach.model.model import Fit
from toddle.signals import Experience

WIDTH, _LAYERS, _BATCH, _CHUNK = 128, 3, 512, 100
_RATE, _B1, _B2, _STEPS = (
    1e-2,
    0.9,
    0.99,
    20_000,
)  # of Adam
_HELD_OUT = 1000
FEWEST = 4000  # movements; an arm of seven joints is learned about equally well by a kernel from 3000


class Layer(NamedTuple):
    """Products of two linear maps, in float32.

    Attributes:
        first, second: their weights.
        first_bias, second_bias: their biases.
    """

    first: Float[np.ndarray, "inputs width"]
    second: Float[np.ndarray, "inputs width"]
    first_bias: Float[np.ndarray, " width"]
    second_bias: Float[np.ndarray, " width"]


@dataclass(frozen=True)
class Network:
    """A network for the tip; a `toddle.reach.model.model.Model`.

    Attributes:
        turns: joints whose value is an angle.
        middle, half: centre and half of each joint's range, that others than angles are scaled by [rad or m].
        layers: from the inputs on.
        out: weights of the linear output.
        mean, scale: of the tip [m].
        doubt: how wrong it may be.
    """

    turns: Bool[np.ndarray, " joints"]
    middle: Float[np.ndarray, " joints"]
    half: Float[np.ndarray, " joints"]
    layers: tuple[Layer, ...]
    out: Float[np.ndarray, "width space"]
    mean: Float[np.ndarray, " space"]
    scale: float
    doubt: Doubt

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        return len(self.mean)

    def forward(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space"]:
        """Tip positions [m] for joint values [rad or m]."""
        z = inputs(q, self.turns, self.middle, self.half)
        for layer in self.layers:
            z = (z @ layer.first + layer.first_bias) * (z @ layer.second + layer.second_bias)
        return self.mean + self.scale * (z @ self.out).astype(float)

    def slope(
        self, q: Float[np.ndarray, "batch joints"]
    ) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
        """Tip positions [m], and how they change with the joint values."""
        z, tilt = inputs(q, self.turns, self.middle, self.half), self._input_slopes(q)
        for layer in self.layers:
            one, other = z @ layer.first + layer.first_bias, z @ layer.second + layer.second_bias
            # of every joint at once: the product's rule, carried forward
            tilt = (tilt @ layer.first) * other[:, None] + (tilt @ layer.second) * one[:, None]
            z = one * other
        slope = self.scale * (tilt @ self.out).astype(float)
        return self.mean + self.scale * (z @ self.out).astype(float), slope.transpose(0, 2, 1)

    def spread(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space space"]:
        """Covariance of what the model may be wrong by at each posture [m^2]."""
        return self.doubt.at(q)

    def _input_slopes(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch joints inputs"]:
        angle, count = np.flatnonzero(self.turns), int(self.turns.sum())
        others = np.flatnonzero(~self.turns)
        tilt = np.zeros((len(q), len(self.turns), 2 * count + len(others)), np.float32)
        tilt[:, angle, np.arange(count)] = -np.sqrt(2) * np.sin(q[:, angle])
        tilt[:, angle, count + np.arange(count)] = np.sqrt(2) * np.cos(q[:, angle])
        tilt[:, others, 2 * count + np.arange(len(others))] = np.sqrt(3) / self.half[others]
        return tilt


def inputs(
    q: Float[np.ndarray, "batch joints"],
    turns: Bool[np.ndarray, " joints"],
    middle: Float[np.ndarray, " joints"],
    half: Float[np.ndarray, " joints"],
) -> Float[np.ndarray, "batch inputs"]:
    """What goes into the network, of about unit variance: cosines and sines of angles, then the others, scaled."""
    angle = q[:, turns]
    others = ((q - middle) / half)[:, ~turns]
    parts = [np.sqrt(2) * np.cos(angle), np.sqrt(2) * np.sin(angle), np.sqrt(3) * others]
    return np.concatenate(parts, axis=1).astype(np.float32)


def fit_network(
    experience: Experience,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    *,
    turns: Bool[np.ndarray, " joints"] | None = None,
    seed: int = 0,
    fewest: int = FEWEST,
    steps: int = 16_000,
    seconds: float = 60.0,
    tell: Callable[[float], None] | None = None,
) -> Fit:
    """Learn any body of which nothing is known.

    Args:
        experience: the movements [rad or m, m].
        lower, upper: the joints' limits [rad or m].
        turns: joints whose value is an angle [rad]; None: all of them or none, whichever explains the movements better.
        seed: of the first weights and of the order of the movements.
        fewest: from fewer movements a kernel is learned instead (`fit_kernel`), which makes more of them
            and takes a fraction of the time.
        steps: of training; they take about a minute of one core.
        seconds: training ends by then [s], its rate falling sooner. In time, the same seed gives the same network.
        tell: called with the fraction done.

    Returns:
        The fit, of kind "network" or "kernel".

    Raises:
        BadInput: there are fewer than four movements a joint.
    """
    if len(experience.q) < fewest:
        return fit_kernel(experience, lower, upper, turns=turns, seed=seed, tell=tell)
    start = time.perf_counter()
    check_count(experience, len(lower))
    order = np.random.default_rng(seed).permutation(len(experience.q))
    q, x = experience.q[order], experience.x[order]
    evidence = learn_covariance(q, x, lower, upper, turns, mend=False)
    turns, held = evidence.embedding.turns, min(_HELD_OUT, len(q) // 5)
    middle, half = (lower + upper) / 2, np.where(upper > lower, (upper - lower) / 2, 1.0)
    mean, scale = x.mean(0), float(x.std()) or 1.0
    z, y = inputs(q, turns, middle, half), ((x - mean) / scale).astype(np.float32)
    left = seconds - (time.perf_counter() - start)
    layers, out = _trained(z[held:], y[held:], seed, (steps, max(left, 0.5 * seconds)), tell or (lambda _: None))
    bare = doubt_from(evidence.embedding, evidence.noise, q[held : held + PART], x.shape[1])
    model = Network(turns, middle, half, layers, out, mean, scale, bare)
    doubt = _calibrated(bare, q[:held], x[:held] - model.forward(q[:held]))
    model = Network(turns, middle, half, layers, out, mean, scale, doubt)
    miss = np.linalg.norm(experience.x - model.forward(experience.q), axis=1)
    sensor = float(np.sqrt(np.mean(miss**2) / x.shape[1]))
    notes = (
        f"nothing was assumed but smoothness (joint values taken {'as angles' if turns.any() else 'as no angles'})",
    )
    return Fit(model, "network", miss, sensor, np.zeros(len(miss), bool), time.perf_counter() - start, notes)


def _calibrated(doubt: Doubt, q: Float[np.ndarray, "held joints"], missed: Float[np.ndarray, "held space"]) -> Doubt:
    """Doubt scaled to what movements that were held out were missed by, the noise of looking included."""
    part, size = np.log(doubt.open(q)), np.log(np.sum(missed**2, axis=1) + 1e-18)
    power = float(np.clip(np.polyfit(part, size, 1)[0], 0.0, 4.0)) if np.ptp(part) > 0.1 else 0.0
    scatter = (missed / np.exp(power * part)[:, None]).T @ missed / len(missed)
    return doubt._replace(scatter=scatter, law=(0.0, power))


def _trained(
    z: Float[np.ndarray, "movements inputs"],
    y: Float[np.ndarray, "movements space"],
    seed: int,
    budget: tuple[int, float],
    tell: Callable[[float], None],
) -> tuple[tuple[Layer, ...], Float[np.ndarray, "width space"]]:
    """Train the layers and the output, some hundred steps between looks at the clock."""
    import jax
    import jax.numpy as jnp

    def loss(weights: tuple, z: jax.Array, y: jax.Array) -> jax.Array:
        for layer in weights[0]:
            z = (z @ layer.first + layer.first_bias[None]) * (z @ layer.second + layer.second_bias[None])
        return jnp.mean((z @ weights[1] - y) ** 2)

    @jax.jit
    def chunk(state: tuple, rows: jax.Array, rate: jax.Array, z: jax.Array, y: jax.Array) -> tuple:
        def step(state: tuple, some: jax.Array) -> tuple[tuple, None]:
            weights, first, second, count = state
            slope = jax.grad(loss)(weights, z[some], y[some])
            first = jax.tree.map(lambda m, g: _B1 * m + (1 - _B1) * g, first, slope)
            second = jax.tree.map(lambda v, g: _B2 * v + (1 - _B2) * g * g, second, slope)
            count = count + 1.0
            long = rate * jnp.sqrt(1 - _B2**count) / (1 - _B1**count)
            weights = jax.tree.map(lambda w, m, v: w - long * m / (jnp.sqrt(v) + 1e-8), weights, first, second)
            return (weights, first, second, count), None

        return jax.lax.scan(step, state, rows)[0]

    steps, seconds = budget
    rng, z_all, y_all = np.random.default_rng(seed), jnp.asarray(z), jnp.asarray(y)
    weights = jax.tree.map(jnp.asarray, _first_weights(rng, z.shape[1], y.shape[1]))
    still = jax.tree.map(jnp.zeros_like, weights)
    state, start = (weights, still, still, jnp.zeros((), jnp.float32)), time.perf_counter()
    for count in range(0, steps, _CHUNK):
        done = max(count / steps, (time.perf_counter() - start) / seconds)
        if done >= 1:
            break
        rate = _RATE * min(1.0, (count / _CHUNK + 1) / 5) * 0.5 * (1 + np.cos(np.pi * done)) + 1e-7
        rows = jnp.asarray(rng.integers(0, len(z), (_CHUNK, min(_BATCH, len(z)))))
        state = jax.block_until_ready(chunk(state, rows, jnp.asarray(rate, jnp.float32), z_all, y_all))
        tell(done)
    return jax.tree.map(np.asarray, state[0])


def _first_weights(rng: np.random.Generator, inputs: int, space: int) -> tuple[tuple[Layer, ...], np.ndarray]:
    """Normal weights that keep the variance; the second map begins about 1, so that products begin as sums."""
    sizes = [inputs] + [WIDTH] * _LAYERS

    def normal(fan: int, width: int) -> np.ndarray:
        return (rng.normal(size=(fan, width)) / np.sqrt(fan)).astype(np.float32)

    ones, zeros = np.ones(WIDTH, np.float32), np.zeros(WIDTH, np.float32)
    layers = tuple(Layer(normal(fan, WIDTH), normal(fan, WIDTH), zeros, ones) for fan in sizes[:-1])
    return layers, normal(WIDTH, space)
