"""Online learning: one run inside ``scan``, a family of 250 side by side, and a plain numpy loop, in one process.

    python benchmarks/online_learning.py [--out benchmarks/results/online_learning.json]

The peer is the same algorithm (goal and motor babbling, Mahboob 2015, with an online perceptron of 10 hidden units on
the arm of NICU) as one would write it with numpy, a movement at a time. Times are CPU seconds of the process, so that
other work on the machine does not count; medians of the repeats.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from statistics import median

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import toddle
from toddle.outside.compile_cache import use_compile_cache
from toddle.outside.versions import versions
from toddle.reach import loop
from toddle.reach.config import ReachConfig
from toddle.reach.session import open_session
from toddle.robots.chain import Chain

HIDDEN, RATE, PERTURBATION = 10, 0.717, 0.233
SINGLE, FAMILY, RUNS, NUMPY, REPEATS = 100_000, 5_000, 250, 4_000, 5


def cpu_seconds(work: Callable[[], object]) -> float:
    work()
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return median(times)


def numpy_loop(chain: Chain, setting: loop.Setting, count: int, seed: int) -> list[np.ndarray]:
    """The peer: the algorithm with numpy, one movement at a time."""
    rng = np.random.default_rng(seed)
    before, tip = np.asarray(chain.before, float), np.asarray(chain.tip, float)
    low, span = np.asarray(setting.box.joint_lower, float), np.asarray(setting.box.joint_span, float)
    space_low, space_span = np.asarray(setting.box.space_lower, float), np.asarray(setting.box.space_span, float)

    def forward(q: np.ndarray) -> np.ndarray:
        pose = np.eye(4)
        for fixed, angle in zip(before, q, strict=True):
            turn = np.eye(4)
            cos, sin = np.cos(angle), np.sin(angle)
            turn[:2, :2] = [[cos, -sin], [sin, cos]]
            pose = pose @ fixed @ turn
        return (pose @ tip)[:3, 3]

    sizes = (3, HIDDEN, len(low))
    weights = [rng.uniform(-1, 1, (b, a)) for a, b in pairwise(sizes)]
    biases = [np.zeros(b) for b in sizes[1:]]

    def activations(x: np.ndarray) -> list[np.ndarray]:
        layers = [x]
        for w, b in zip(weights, biases, strict=True):
            layers.append(1 / (1 + np.exp(-(w @ layers[-1] + b))))
        return layers

    x, ended = np.asarray(setting.home.x, float), True
    goal_step, motor_step = np.zeros(3), np.zeros(len(low))
    for _ in range(count):
        if ended:
            goal_step = PERTURBATION * rng.choice([-1.0, 1.0], 3)
            motor_step = PERTURBATION * rng.choice([-1.0, 1.0], len(low))
        motors = activations(x + goal_step)[-1] + motor_step
        ended = bool(np.any((motors <= 0) | (motors >= 1)))
        motors = np.clip(motors, 0, 1)
        reached = (forward(low + motors * span) - space_low) / space_span
        ended = ended or np.sum((reached - x) ** 2) < 0.01 * np.sum(goal_step**2)
        x = reached
        layers = activations(x)
        delta = (motors - layers[-1]) * layers[-1] * (1 - layers[-1])
        for i in reversed(range(len(weights))):
            below = layers[i]
            back = (delta @ weights[i]) * below * (1 - below)
            weights[i] += RATE * np.outer(delta, below)
            biases[i] += RATE * delta
            delta = back
    return weights


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=None)
    out = parser.parse_args().out
    use_compile_cache()
    body = toddle.load("nicu")
    config = ReachConfig(hidden=(HIDDEN,), learning_rate=RATE, perturbation=PERTURBATION, network="plain")
    session = open_session(body, config)

    @eqx.filter_jit
    def one(key: jax.Array) -> loop.Progress:
        return loop.advance(session.setting, body, loop.begin(session.setting, key), SINGLE)[0]

    @eqx.filter_jit
    def family(keys: jax.Array) -> loop.Progress:
        return jax.vmap(lambda k: loop.advance(session.setting, body, loop.begin(session.setting, k), FAMILY)[0])(keys)

    key = jax.random.key(0)
    keys = jax.random.split(key, RUNS)
    rates = {
        "one_run_samples_per_cpu_second": SINGLE / cpu_seconds(lambda: jax.block_until_ready(one(key).learner)),
        "family_samples_per_cpu_second": RUNS
        * FAMILY
        / cpu_seconds(lambda: jax.block_until_ready(family(keys).learner)),
    }
    assert isinstance(body, Chain)
    rates["numpy_samples_per_cpu_second"] = NUMPY / cpu_seconds(lambda: numpy_loop(body, session.setting, NUMPY, 0))
    result = {
        "benchmark": "online_learning",
        "what": f"goal and motor babbling, NICU, {HIDDEN} hidden units; medians of {REPEATS}",
        **{name: round(rate) for name, rate in rates.items()},
        "one_run_over_numpy": round(rates["one_run_samples_per_cpu_second"] / rates["numpy_samples_per_cpu_second"], 1),
        "family_over_numpy": round(rates["family_samples_per_cpu_second"] / rates["numpy_samples_per_cpu_second"], 1),
        "device": str(jnp.zeros(1).devices().pop().platform),
        "machine": f"{os.cpu_count()} cores, {platform.machine()}",
        "versions": versions(),
        "command": "python benchmarks/online_learning.py",
        "seed": 0,
    }
    text = json.dumps(result, indent=2)
    print(text)
    if out is not None:
        out.write_text(text + "\n")


if __name__ == "__main__":
    main()
