"""What drives through rooms are worth, in figures: of all of them, and of each scenario."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from toddle.navigate.scenarios.rooms import SCENARIOS
from toddle.navigate.task import Outcome
from toddle.outside.navigation.room_run import RoomFinish
from toddle.outside.navigation.statistics import wilson

BINS = np.linspace(-0.15, 0.3, 46)
"""Edges of the histogram of velocities ahead, 0.01 m/s each; what is faster counts as fastest."""


def command_entropy(ahead: Float[np.ndarray, " decisions"], bins: Float[np.ndarray, " edges"] = BINS) -> float:
    """Entropy of the velocities that were asked for [nat]: ``-sum p log p`` over a histogram (Huber 2019, 4.2).

    The document prints the sum without its sign; Shannon's has it, and is never negative.

    Args:
        ahead: velocities [m/s]; the document uses those ahead for its comparison with balance.
        bins: edges of the histogram.
    """
    counts, _ = np.histogram(np.clip(ahead, bins[0], bins[-1]), bins)
    share = counts[counts > 0] / max(counts.sum(), 1)
    return float(-(share * np.log(share)).sum()) + 0.0


def figures_of(finishes: Sequence[RoomFinish]) -> dict[str, Any]:
    """Of many drives, and the same under each scenario's name; means of times are those of the won ones."""
    named = {name: [one for one in finishes if one.room.scenario == name] for name in SCENARIOS}
    return {**_figures(finishes), **{name: _figures(some) for name, some in named.items() if some}}


def _figures(finishes: Sequence[RoomFinish]) -> dict[str, Any]:
    outcomes = Counter(finish.outcome for finish in finishes)
    won, count = outcomes[Outcome.WON], len(finishes)
    low, high = wilson(won, count)
    asked = np.concatenate([finish.asked for finish in finishes]) if finishes else np.zeros((0, 3))
    took = np.concatenate([finish.inference_ms for finish in finishes]) if finishes else np.zeros(0)
    return {
        "episodes": count,
        "success_rate": won / count if count else float("nan"),
        "wilson_low": low,
        "wilson_high": high,
        "spl": _mean([finish.spl for finish in finishes]),
        "collisions": outcomes[Outcome.COLLIDED],
        "falls": outcomes[Outcome.FELL],
        "late": outcomes[Outcome.LATE],
        "touched": dict(Counter(finish.touched for finish in finishes if finish.touched)),
        "seconds_mean": _mean([finish.seconds for finish in finishes if finish.outcome == Outcome.WON]),
        "zmp_error_mean_cm": 100 * _mean([finish.zmp_error for finish in finishes]),
        "zmp_error_std_cm": 100 * _mean([finish.zmp_spread for finish in finishes]),
        "command_entropy": command_entropy(asked[:, 0]),
        "inference_ms_median": float(np.median(took)) if len(took) else float("nan"),
    }


def _mean(numbers: Sequence[float]) -> float:
    known = np.array([number for number in numbers if np.isfinite(number)])
    return float(known.mean()) if len(known) else float("nan")
