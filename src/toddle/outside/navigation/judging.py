"""How good a policy is at what it learned: without noise, on starts that training never saw.

The point gets the document's test, ten runs of 10,000 steps (Huber 2019, section 4.3.1). A walker gets goals of its own
on its walking pattern, each of which an independent planner can reach.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from toddle.navigate.policy import Policy
from toddle.navigate.scenarios.layouts import Layout
from toddle.navigate.scenarios.planner import solvable_layouts
from toddle.navigate.task import Outcome, Task
from toddle.navigate.tasks.walker import WalkerTask
from toddle.navigate.trial import Episode, episodes_from, tally
from toddle.outside.navigation.gym_trial import gym_episodes
from toddle.outside.navigation.named_tasks import refuse_unfit
from toddle.outside.navigation.statistics import wilson

TESTS, TEST_STEPS = 10, 10_000
"""Of the document."""


def judge(task: Task[Any], policy: Policy, seed: int, episodes: int) -> dict[str, Any]:
    """Figures of a policy on its task; see `walked` and `tested`.

    Raises:
        BadInput: the policy sees or does something else.
    """
    refuse_unfit(policy, task)
    if isinstance(task, WalkerTask):
        return walked(task, policy, seed, episodes)
    return tested(task, policy, seed)


def score(figures: Mapping[str, Any]) -> float:
    """What the better of two policies has more of: wins; losses count ten times; then speed."""
    if "wins_least" in figures:
        return float(figures["wins"] - 10 * figures["losses"])
    slow = figures["seconds_mean"] if figures["wins"] else 0.0
    return float(figures["wins"] - figures["collisions"] - figures["falls"] - 1e-3 * slow)


def tested(task: Task[Any], policy: Policy, seed: int) -> dict[str, Any]:
    """The document's deterministic test: wins and losses are means of ten runs."""
    found = tally(task, policy, jax.random.key(seed), TESTS, TEST_STEPS)
    counts = np.asarray(found.outcomes)
    wins, losses = counts[:, Outcome.WON], counts[:, Outcome.LOST]
    ended = int(counts[:, 1:].sum())
    return {
        "success_rate": float(wins.sum() / ended) if ended else 0.0,
        "wins": float(wins.mean()),
        "wins_least": int(wins.min()),
        "losses": float(losses.mean()),
        "return_mean": float(np.asarray(found.total).sum() / ended) if ended else math.nan,
    }


def walked(task: WalkerTask, policy: Policy, seed: int, episodes: int) -> dict[str, Any]:
    """Goals on the walking pattern.

    Args:
        task: what it learned.
        policy: to be judged.
        seed: of goals, obstacles and people.
        episodes: how many.
    """
    layouts, _, _ = solvable_layouts(seed, episodes, circles=task.circles, goal=task.goal, body=task.body)
    starting, key = jax.random.split(jax.random.key(seed))
    begun = jax.vmap(task.begin)(_arrays(layouts), jax.random.split(starting, episodes))
    steps = math.ceil(task.seconds / task.dt)
    return walked_figures(task, episodes_from(task, policy, begun, key, steps))


def walked_figures(task: WalkerTask, found: Episode) -> dict[str, Any]:
    """Of many episodes: shares, counts and means; the mean time is that of the won ones."""
    outcome, length = np.asarray(found.outcome), np.asarray(found.length)
    counts = {kind: int((outcome == kind).sum()) for kind in Outcome}
    wins = counts[Outcome.WON]
    low, high = wilson(wins, len(outcome))
    return {
        "episodes": len(outcome), "success_rate": wins / len(outcome), "wilson_low": low, "wilson_high": high,
        "wins": wins, "losses": len(outcome) - wins, "collisions": counts[Outcome.COLLIDED],
        "falls": counts[Outcome.FELL], "late": counts[Outcome.LATE] + counts[Outcome.GOES_ON],
        "lost": counts[Outcome.LOST], "return_mean": float(np.asarray(found.total).mean()),
        "seconds_mean": float(length[outcome == Outcome.WON].mean() * task.dt) if wins else math.nan,
    }  # fmt: skip


def judge_gym(name: str, policy: Policy, seed: int, episodes: int) -> dict[str, Any]:
    """Episodes of a Gymnasium environment; what winning is, only the environment knows.

    Raises:
        BadInput: the environment is of no use, or the policy doesn't fit it.
    """
    found = gym_episodes(name, policy, seed, episodes)
    total = found.total.astype(float)
    return {
        "episodes": len(total), "return_mean": float(total.mean()), "return_std": float(total.std()),
        "return_least": float(total.min()), "length_mean": float(found.length.mean()),
    }  # fmt: skip


def _arrays(layouts: Layout) -> Layout:
    return Layout(jnp.asarray(layouts.goal, jnp.float32), jnp.asarray(layouts.circles, jnp.float32))
