"""The figures of a run: open-loop and closed-loop errors, apart; speeds; by the names that the JSON output uses."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np
from jaxtyping import Float

Map = Callable[[np.ndarray], np.ndarray]


def errors_of(predict: Map, observe: Map, targets: Float[np.ndarray, "points space"]) -> Float[np.ndarray, " points"]:
    """Open-loop errors: distance between each target and where its one-shot answer brings the tip [m]."""
    return np.linalg.norm(observe(predict(targets)) - targets, axis=1)


def error_figures(name: str, errors: Float[np.ndarray, " points"]) -> dict[str, float]:
    """Mean, median, 99th percentile and maximum of errors [m], in millimetres."""
    millimetres = 1000 * errors
    return {
        f"{name}_mean_mm": float(millimetres.mean()),
        f"{name}_median_mm": float(np.median(millimetres)),
        f"{name}_p99_mm": float(np.percentile(millimetres, 99)),
        f"{name}_max_mm": float(millimetres.max()),
    }


def query_figures(one: Map, many: Map, targets: Float[np.ndarray, "points space"]) -> Mapping[str, float]:
    """How long a query takes [us]: one target at a time, and each of 4,096 at once; medians, warm."""
    batch = np.resize(targets, (4096, targets.shape[1])).astype(np.float32)
    return {
        "query_us_single": 1e6 * _median_seconds(lambda: one(batch[0]), 200),
        "query_us_batch4096": 1e6 * _median_seconds(lambda: many(batch), 11) / 4096,
    }


def _median_seconds(call: Callable[[], object], repeats: int) -> float:
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return float(np.median(times))
