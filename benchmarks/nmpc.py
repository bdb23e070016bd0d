"""The default walking controller: time of an iteration, random programmes, and how well commands are tracked.

    PYTHONPATH=tests python benchmarks/nmpc.py [--out benchmarks/results/nmpc.json] [--programmes 10000]

Times are those of whole iterations (assembly, solver, everything around them), wall clock and processor time, on one
core. Peers in the same run: the same programmes through quadprog, through DAQP as plain quadratic programmes, and the
document's own form. The document's C++ program is published at 1.48 ms an iteration (HRP-2); it isn't run here.
"""

# pyright: reportMissingImports=false
# the tests are on the path, see above
from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections import Counter
from pathlib import Path

import daqp
import numpy as np
import quadprog
from walk import nmpc_oracle as oracle
from walk.gaits import HEICUB, HRP2
from walk.nmpc_cases import ICUB, random_circles, random_command, random_state
from walk.pattern.test_nmpc import Programme
from walk.pattern.test_nmpc_pattern import achieved, landings

from toddle.outside.versions import versions
from toddle.signals import Circle, Velocity
from toddle.walk.pattern.document import Document
from toddle.walk.pattern.feasible import cap, fastest
from toddle.walk.pattern.nmpc import NEVER, STILL, nmpc, plan
from toddle.walk.pattern.obstacles import NONE
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.quadratic import least_distance
from toddle.walk.pattern.reduced import Reduced

GAITS = {"icub": ICUB, "hrp2": HRP2, "heicub": HEICUB}
FIELD = [Circle(0.9, 0.3, 0.1), Circle(1.6, -0.4, 0.15), Circle(2.4, 0.35, 0.1)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=None)
    parser.add_argument("--programmes", type=int, default=10_000)
    arguments = parser.parse_args()
    result = {
        "benchmark": "nmpc",
        "microseconds": times(),
        "random_programmes": robustness(arguments.programmes),
        "tracking": {name: tracking(gait) for name, gait in GAITS.items()},
        "machine": f"{os.cpu_count()} cores, {platform.machine()}",
        "versions": versions(),
        "command": "PYTHONPATH=tests python benchmarks/nmpc.py",
    }
    print(json.dumps(result, indent=2))
    if arguments.out is not None:
        arguments.out.write_text(json.dumps(result, indent=2) + "\n")


def times() -> dict:
    """Iterations of a walk under commands that change each second, then the same programmes through peers."""
    rng = np.random.default_rng(0)
    walks = {"free": [], "three_circles": []}
    solver, quad, plain, document = [], [], [], []
    for name, field in (("free", []), ("three_circles", FIELD)):
        pattern = Reduced(ICUB)
        state, command = pattern.start(), Velocity(0.2, 0.0, 0.0)
        for k in range(3000):
            if k % 10 == 0:
                command = random_command(rng, 0.7) if name == "free" else Velocity(0.2, 0.0, 0.0)
            if name == "three_circles" and k % 150 == 0:
                state = pattern.start()
            last = state
            began = time.process_time_ns()
            state, interval = pattern.step(state, command, field)
            taken = time.process_time_ns() - began
            walks[name].append((interval.milliseconds * 1e3, taken / 1e3))
            if name == "free" and k % 15 == 10 and last.plan is not None and state.at.halt == NEVER:
                programme = Programme(pattern.problem, last.at, command, NONE, last.plan)
                solver.append(timed(lambda p=programme: least_distance(*p.problem)))
                quad.append(timed(lambda p=programme: by_quadprog(p)))
                plain.append(timed(as_quadratic(programme)))
    pattern = Document(HRP2)
    state = pattern.start()
    for _ in range(300):
        state, interval = pattern.step(state, Velocity(0.1, 0.0, 0.1), [])
        document.append(interval.milliseconds * 1e3)
    found = {f"iteration, {name}": spread(np.array(rows)) for name, rows in walks.items()}
    return found | {
        "solver alone": spread(solver),
        "quadprog, the same programme": spread(quad),
        "daqp, the same as a quadratic programme": spread(plain),
        "iteration of the document's form (hrp2)": spread(document),
    }


def timed(solve) -> float:
    """Microseconds, the least of three."""
    taken = []
    for _ in range(3):
        began = time.perf_counter_ns()
        solve()
        taken.append(time.perf_counter_ns() - began)
    return min(taken) / 1e3


def spread(rows) -> dict:
    """Median and 99th percentile, without the first few."""
    rows = np.asarray(rows)[5:]
    if rows.ndim == 2:
        return {"wall": spread(rows[:, 0]), "processor, with the walk around it": spread(rows[:, 1])}
    figures = {"least": rows.min(), "median": np.median(rows), "p99": np.percentile(rows, 99)}
    return {name: round(float(figure), 1) for name, figure in figures.items()}


def by_quadprog(programme: Programme) -> np.ndarray:
    """The least-distance problem with its slacks as unknowns, each scaled to weight 1; low rows, then high rows."""
    matrix, low, high, _, slack = programme.problem
    n, soft = matrix.shape[1], len(matrix) - programme.hard
    wide = np.hstack([matrix, np.vstack([np.zeros((programme.hard, soft)), np.diag(np.sqrt(slack[programme.hard :]))])])
    other = np.hstack([-matrix, wide[:, n:]])
    rows, bounds = np.vstack([wide[low > -1e29], other[high < 1e29]]), np.r_[low[low > -1e29], -high[high < 1e29]]
    return quadprog.solve_qp(np.eye(n + soft), np.zeros(n + soft), rows.T, bounds)[0][:n]


def as_quadratic(programme: Programme):
    """The same in jerks, feet and yaws, factored at each solve."""
    matrix, low, high, marks, _ = programme.problem
    back = np.linalg.inv(programme.map)
    hessian, rows = back.T @ back, np.ascontiguousarray(matrix @ back)
    return lambda: daqp.solve(hessian, np.zeros(len(hessian)), rows, high, low, marks)


def robustness(count: int) -> dict:
    """Random moments, commands, kicks and circles; each answer judged by constraints written from the geometry."""
    rng, problem = np.random.default_rng(1), nmpc(ICUB)
    statuses, infinite, worst, apart, compared = Counter(), 0, 0.0, 0.0, 0
    for k in range(count):
        kick = float(rng.choice([0.0, 0.3, 1.0, 10.0]))
        state, velocity = random_state(ICUB, rng, kick), random_command(rng, 2.0)
        circles = random_circles(state, rng, 8)
        last = plan(problem, state, random_command(rng, 2.0), circles) if k % 2 else None
        found = plan(problem, state, velocity, circles, last)
        statuses[found.status.value] += 1
        infinite += not np.isfinite([*found.jerk, *found.feet.ravel(), *found.zmp.ravel()]).all()
        asked = velocity if state.halt == NEVER else STILL
        pinned = last is not None and state.remaining <= problem.freeze
        if found.status == Status.SOLVED and not pinned:
            x = oracle.packed(found)
            for row in oracle.rows(problem, state, asked, NONE, x, x):
                if row.kind in ("hull", "turn"):
                    worst = max(worst, row.low - row.value, row.value - row.high)
            if k % 20 == 0 and kick < 1 and state.remaining > problem.freeze:
                guess = last or plan(problem, state, velocity, circles)
                programme = Programme(problem, state, asked, circles, guess)
                again = plan(problem, state, velocity, circles, guess)
                try:
                    x = programme.origin + programme.map @ by_quadprog(programme)
                except ValueError:
                    statuses["quadprog failed"] += 1
                    continue
                apart, compared = max(apart, float(np.abs(x[16:19] - again.feet[:, 0]).max())), compared + 1
    return {
        "programmes": count,
        "statuses": dict(statuses),
        "answers not finite": infinite,
        "worst violation of hull [m] or yaw [rad]": round(worst, 6),
        "compared with quadprog": compared,
        "greatest difference of a landing [m]": float(f"{apart:.1e}"),
    }


def tracking(gait) -> dict:
    """Steady speed against commands all over the range, of which a third at its edge."""
    rng, far, errors = np.random.default_rng(2), np.array(fastest(gait)), []
    for k in range(60):
        wild = Velocity(*(far * rng.uniform(-1, 1, 3) * (rng.random(3) < 0.7) * (3.0 if k % 3 == 0 else 0.8)).tolist())
        asked = np.array(cap(wild, gait))
        if np.abs(asked).max() < 1e-3:
            continue
        got = achieved(gait, landings(Reduced(gait), Velocity(*asked.tolist()), 26)[-10:])
        errors.append(np.abs(got - asked) / np.maximum(np.abs(asked), 0.1 * far))
    return {
        "fastest": [round(float(x), 4) for x in far],
        "commands": len(errors),
        "median_percent": round(100 * float(np.median(np.max(errors, axis=1))), 3),
        "worst_percent": [round(100 * float(x), 2) for x in np.max(errors, axis=0)],
    }


if __name__ == "__main__":
    main()
