"""Pictures of learning: reward and exploration over epochs, after Huber 2019, figure 4.30."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.ticker import MaxNLocator

from toddle.outside.pictures import FAINT, OURS, THEIRS, new_figure, plain_axes, save_figure


class Epochs(NamedTuple):
    """A course by epochs, of several seeds.

    Attributes:
        reward: sum in an epoch.
        explored: standard deviation of continuous actions at its end; entropy of discrete ones [nats].
        discrete: which of them it is.
    """

    reward: Float[np.ndarray, "seeds epochs"]
    explored: Float[np.ndarray, "seeds epochs"]
    discrete: bool


def epochs(history: Mapping[str, np.ndarray], length: int) -> Epochs:
    """A course in epochs of so many steps, whatever the length of an update: what lies between updates is interpolated.

    Args:
        history: parts of `toddle.navigate.ppo.training.Report` by name; leading axes: seeds, updates.
        length: of an epoch [steps].
    """
    discrete = not np.nan_to_num(history["deviation"]).any()
    rewards, explored, wide = [], [], history["entropy" if discrete else "deviation"]
    for steps, mean, width in zip(history["steps"], history["reward"], wide, strict=True):
        made = steps > 0  # else the seed was held, being in trouble
        ends = np.concatenate([[0], steps[made]]).astype(float)
        total = np.concatenate([[0.0], np.cumsum(mean[made] * np.diff(ends))])
        marks = np.arange(0, history["steps"].max() + 1, length, dtype=float)
        known = marks <= ends[-1]
        rewards.append(np.diff(np.where(known, np.interp(marks, ends, total), np.nan)))
        found = np.interp(marks[1:], ends[1:], width[made]) if made.any() else marks[1:]
        explored.append(np.where(known[1:], found, np.nan))
    return Epochs(np.array(rewards), np.array(explored), discrete)


def learning_curve(
    path: Path,
    history: Mapping[str, np.ndarray],
    *,
    title: str,
    epoch: int | None = None,
    published: float | None = None,
) -> None:
    """Reward an epoch (a) and how much is explored (b) over epochs: each seed, their mean and their spread.

    Args:
        path: the PNG to write.
        history: parts of `toddle.navigate.ppo.training.Report` by name; leading axes: seeds, updates.
        title: says what was learned.
        epoch: its length [steps]; None: an update.
        published: epoch by which the document's run had converged.
    """
    course = epochs(history, epoch or int(history["steps"].max()) // history["steps"].shape[1])
    name = "epoch" if epoch else "update"
    figure = new_figure(10.0, 4.2)
    figure.suptitle(title)
    explored = "entropy of the policy [nats]" if course.discrete else "standard deviation of the policy"
    parts = ((f"(a) reward in an {name}", course.reward), (f"(b) {explored}", course.explored))
    for place, (label, rows) in zip((121, 122), parts, strict=True):
        axes = plain_axes(figure, place)
        _band(axes, rows)
        if published is not None:
            axes.axvline(published, color=THEIRS, lw=1, ls="--", label=f"document converged by {published:g}")
        axes.set(xlabel=name, title=label, xlim=(1, max(2, rows.shape[1])))
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        if place == 122:
            axes.set_ylim(0, None)
        axes.legend(frameon=False)
    save_figure(figure, path)


def _band(axes: Any, rows: Float[np.ndarray, "seeds epochs"]) -> None:
    """The mean over seeds, from the least to the greatest around it, and each seed."""
    number = np.arange(1, rows.shape[1] + 1)
    seen = ~np.isnan(rows).all(axis=0)
    number, rows = number[seen], rows[:, seen]
    if len(rows) > 1:
        axes.fill_between(number, np.nanmin(rows, axis=0), np.nanmax(rows, axis=0), color=OURS, alpha=0.15, lw=0)
        for row in rows:
            axes.plot(number, row, color=FAINT, lw=0.5)
    label = "one seed" if len(rows) == 1 else f"mean of {len(rows)} seeds, least to greatest"
    axes.plot(number, np.nanmean(rows, axis=0), color=OURS, lw=1.8, label=label)
