"""Walkers closed over themselves, by every path: iterations per second, by the clock and by processor time.

    python benchmarks/nmpc_walkers.py [--out benchmarks/results/nmpc_walkers.json]

An iteration is whole: command, assembly, solver, and where the first jerk leads. Each path walks the same walkers from
standing, under random commands that change every fourth sample, among three circles; the named peer in the same run
is the single walker's own path. The paths take turns, so that each meets the machine's other load; the fastest counts.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from toddle.outside.batch_solver import Cores, cores
from toddle.outside.machine import machine_in_words
from toddle.outside.navigation.nmpc_walks import nmpc_walks, threaded
from toddle.outside.versions import versions
from toddle.robots.humanoids import load_humanoid
from toddle.signals import Circle, Velocity
from toddle.walk.pattern.batch import start_batch, step_batch
from toddle.walk.pattern.batch_daqp import plan_each
from toddle.walk.pattern.batch_native import start_native, step_native
from toddle.walk.pattern.nmpc_problem import Nmpc
from toddle.walk.pattern.reduced import Reduced

SIZES = (1, 64, 256, 1024)
HOLD = 4
TURNS = 3
MOST_ROUNDS = 400
SLOW = {"JAX batch, on the processor": 64}  # walkers at most: a thousand take a minute
CIRCLES = np.array([[1.0, 0.3, 0.2], [2.0, -0.5, 0.3], [1.5, 1.0, 0.2]])

Rounds = Callable[[int], object]
"""Walks so many rounds of `HOLD` iterations of each walker."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=None)
    arguments = parser.parse_args()
    pattern, rates = Reduced(load_humanoid("heicub").gait), {}
    with cores(pattern.problem, 2) as pool:
        for size in SIZES:
            paths = dict(the_paths(pattern, pool, size))
            for name, rate in measured(paths, size).items():
                rates.setdefault(name, {})[size] = rate
                print(size, name, rate, flush=True)
    result = {
        "benchmark": "nmpc_walkers",
        "what": f"iterations per second, 3 circles; fastest of {TURNS}; cpu: per second of this process's processors",
        "iterations_per_second": rates,
        "jax_batch": "not measured above 64 walkers",
        "seed": 0,
        "load_average": round(os.getloadavg()[0], 1),
        "machine": machine_in_words(),
        "versions": versions(),
        "command": "python benchmarks/nmpc_walkers.py",
    }
    if arguments.out is not None:
        arguments.out.write_text(json.dumps(result, indent=2) + "\n")
    print(json.dumps(result, indent=2))


def the_paths(pattern: Reduced, pool: Cores, size: int) -> Iterator[tuple[str, Rounds]]:
    """Every way to walk so many walkers."""
    problem = pattern.problem
    yield "one by one", lambda rounds: one_by_one(pattern, size, rounds)
    yield "processes, two, plans alone", plans_alone(problem, size, pool.plan)
    yield "one after the other, plans alone", plans_alone(problem, size, lambda *given: plan_each(problem, *given))
    for threads in (1, 2):
        shares = threaded(threads)
        yield (
            f"native, {threads} thread{'s' * (threads > 1)}",
            lambda rounds, shares=shares: native(problem, size, rounds, shares),
        )
    yield "native, 2 threads, inside JAX", in_jax(size)
    if size <= SLOW["JAX batch, on the processor"]:
        yield "JAX batch, on the processor", batch(problem, size)


def measured(paths: dict[str, Rounds], size: int) -> dict[str, dict[str, float]]:
    """Each path's fastest turn, of about half a second each."""
    rounds, found = {}, {}
    for name, walk in paths.items():
        walk(1)  # compiles
        began = time.perf_counter()
        walk(2)
        rounds[name] = int(np.clip(0.5 / (time.perf_counter() - began) * 2, 2, MOST_ROUNDS))
    for _ in range(TURNS):
        for name, walk in paths.items():
            began, used = time.perf_counter(), time.process_time()
            walk(rounds[name])
            iterations = size * HOLD * rounds[name]
            wall, cpu = time.perf_counter() - began, time.process_time() - used
            best = found.setdefault(name, {"wall": 0.0, "cpu": 0.0})
            best["wall"] = max(best["wall"], round(iterations / wall, 1))
            best["cpu"] = max(best["cpu"], round(iterations / cpu, 1))
    for name in found:
        if "processes" in name:
            found[name].pop("cpu")  # most of it is used elsewhere
    return found


def commands(size: int, rounds: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1, 1, (rounds, size, 3)) * [0.3, 0.1, 0.3]


def around(size: int) -> np.ndarray:
    return np.repeat(CIRCLES[None], size, axis=0)


def one_by_one(pattern: Reduced, size: int, rounds: int) -> None:
    circles, asked = [Circle(*row) for row in CIRCLES.tolist()], commands(size, rounds).tolist()
    for walker in range(size):
        state = pattern.start()
        for command in asked:
            for _ in range(HOLD):
                state, _ = pattern.step(state, Velocity(*command[walker]), circles)


def native(problem: Nmpc, size: int, rounds: int, shares) -> None:
    walk, circles = start_native(problem, size), around(size)
    for asked in commands(size, rounds):
        walk = step_native(problem, walk, asked, circles, hold=HOLD, shares=shares)


def plans_alone(problem: Nmpc, size: int, plan: Callable) -> Rounds:
    """Plans at one moment of the walks, for paths that don't close the loop."""
    circles, asked = around(size), commands(size, 3)
    walk = start_native(problem, size)
    for velocities in asked:
        walk = step_native(problem, walk, velocities, circles, hold=HOLD)

    def walks(rounds: int) -> None:
        for _ in range(HOLD * rounds):
            plan(walk.at, asked[0], circles, walk.plan)

    return walks


def in_jax(size: int) -> Rounds:
    """As tasks take it: behind the gate, a callback from a scan."""
    walker = nmpc_walks(load_humanoid("heicub"), solver="native", hold=HOLD, threads=2)
    circles = jnp.asarray(CIRCLES, jnp.float32)
    start = jax.vmap(lambda _: walker.start())(jnp.arange(size))
    one = jax.vmap(lambda state, command: walker.advance(state, command, circles))
    rows = jnp.asarray(commands(size, MOST_ROUNDS), jnp.float32)
    run = jax.jit(lambda state, rounds: jax.lax.fori_loop(0, rounds, lambda k, s: one(s, rows[k]), state))
    return lambda rounds: jax.block_until_ready(run(start, rounds))


def batch(problem: Nmpc, size: int) -> Rounds:
    circles = jnp.asarray(around(size), jnp.float32)

    def held(walk, asked):
        return jax.lax.fori_loop(0, HOLD, lambda _, w: step_batch(problem, w, asked, circles), walk)

    step, start = jax.jit(held), start_batch(problem, size)

    def walks(rounds: int) -> None:
        walk = start
        for asked in jnp.asarray(commands(size, rounds), jnp.float32):
            walk = step(walk, asked)
        jax.block_until_ready(walk)

    return walks


if __name__ == "__main__":
    main()
