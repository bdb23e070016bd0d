"""PPO on environments of Gymnasium that everyone knows: ten seeds each, judged on whole episodes nobody learned from.

    python -m benchmarks.navigation.gym                 # about four CPU minutes
    python -m benchmarks.navigation.gym --envs CartPole-v1 --seeds 3 --out runs/gym.json

Times are CPU seconds of the process, kept to one core, environments included. What is compiled counts apart, once for
each process.
"""

from __future__ import annotations

import argparse
import dataclasses
import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import jax
import numpy as np

from toddle.navigate.policy import policy_of
from toddle.navigate.ppo.presets import preset
from toddle.outside.files import write_json
from toddle.outside.machine import machine_in_words
from toddle.outside.navigation.gym_training import GymTraining
from toddle.outside.navigation.gym_trial import Episodes, gym_episodes
from toddle.outside.versions import versions

ROOT = Path(__file__).parents[2]
RESULT = ROOT / "benchmarks" / "results" / "navigation_gym.json"
ASKED = {"Pendulum-v1": -200.0, "CartPole-v1": 500.0}
"""Mean return that each is to reach at least."""
EPISODES, FIRST_SEED = 100, 1_000_000


def main() -> None:
    parser = argparse.ArgumentParser(
        "python -m benchmarks.navigation.gym", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--envs", nargs="+", choices=tuple(ASKED), default=tuple(ASKED))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=RESULT)
    asked = parser.parse_args()
    content: dict[str, Any] = {
        "benchmark": "navigation_gym",
        "what": f"mean returns of {EPISODES} episodes that start from seeds not trained on, by the likeliest actions",
        "command": "python -m benchmarks.navigation.gym",
        "machine": machine_in_words(),
        "versions": versions(),
        "environments": {},
    }
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(asked.workers, spawn, initializer=on_one_core) as pool:
        runs = {name: pool.map(one, [name] * asked.seeds, range(asked.seeds)) for name in asked.envs}
        for name, rows in runs.items():
            content["environments"][name] = summary(name, list(rows))
            write_json(asked.out, content)


def on_one_core() -> None:
    """Of this process: all threads on one core."""
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[os.getpid() % len(cores)]})


def summary(name: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """All seeds of one environment."""
    means = [row["return_mean"] for row in rows]
    return {
        "asked": ASKED[name],
        "reached": sum(mean >= ASKED[name] for mean in means),
        "seeds": len(rows),
        "worst": min(means),
        "median": float(np.median(means)),
        "best": max(means),
        "config": dataclasses.asdict(preset(name)),
        "runs": rows,
    }


def one(name: str, seed: int) -> dict[str, Any]:
    """One run, from nothing to a policy and what it earns."""
    config = preset(name)
    learner = GymTraining(name, config)
    began = time.process_time()
    training, _ = learner.advance(learner.init(jax.random.key(seed)))
    jax.block_until_ready(training.updates)
    first, began = time.process_time() - began, time.process_time()
    for _ in range(config.updates - 1):
        training, _ = learner.advance(training)
    jax.block_until_ready(training.updates)
    taken = time.process_time() - began
    learner.close()
    each = taken / (config.updates - 1)
    policy = policy_of(training, config, learner.copies.spaces.actions)
    sure = gym_episodes(name, policy, FIRST_SEED, EPISODES)
    noisy = gym_episodes(name, policy, FIRST_SEED, EPISODES, noisy=True)
    row = {
        "env": name,
        "seed": seed,
        "steps": config.updates * config.batch,
        "train_seconds": round(taken + each, 2),
        "compile_seconds": round(max(first - each, 0.0), 2),
        "steps_per_second": round(config.batch / each),
        "return_mean": _mean(sure),
        "return_worst": round(float(sure.total.min()), 1),
        "noisy_return_mean": _mean(noisy),
        "noisy_return_worst": round(float(noisy.total.min()), 1),
    }
    print(row, flush=True)
    return row


def _mean(episodes: Episodes) -> float:
    return round(float(episodes.total.mean()), 2)


if __name__ == "__main__":
    main()
