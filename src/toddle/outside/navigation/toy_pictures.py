"""Pictures of the point that walks to a goal, as the figures 4.29 to 4.31 of Huber 2019."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.patches import Circle

from toddle.outside.pictures import FAINT, INK, OURS, THEIRS, new_figure, plain_axes, save_figure

_EPOCH = 10_000  # steps


def games(
    path: Path,
    panels: Mapping[str, Sequence[Float[np.ndarray, "_ 4"]]],
    near: float,
    *,
    title: str,
    widest: float = 6.0,
) -> None:
    """Ways of the point from the origin to its goals, one panel beside the other (figures 4.29, 4.31).

    Args:
        path: the PNG to write.
        panels: by their titles, games: where the point and its goal were at each step.
        near: a goal is reached nearer than this.
        title: of the figure.
        widest: how far to each side is drawn.
    """
    figure = new_figure(5.0 * len(panels) + 0.4, 5.4)
    grid = figure.add_gridspec(1, len(panels))
    for k, (name, played) in enumerate(panels.items()):
        axes = plain_axes(figure, grid[k])
        for game in played:
            axes.plot(game[:, 0], game[:, 1], color=OURS, lw=0.8, alpha=0.7)
            axes.plot(*game[-1, :2], ".", color=INK, ms=4)
            axes.add_patch(Circle((float(game[-1, 2]), float(game[-1, 3])), near, color=THEIRS, alpha=0.12, lw=0))
            axes.plot(*game[-1, 2:], "o", color=THEIRS, ms=4)
        axes.plot(0, 0, "s", color=FAINT, ms=6)
        axes.set(xlabel="x", ylabel="y", title=name, xlim=(-widest, widest), ylim=(-widest, widest), aspect="equal")
    figure.suptitle(title)
    save_figure(figure, path)


def curves(
    path: Path,
    steps: Float[np.ndarray, " updates"],
    reward: Float[np.ndarray, "seeds updates"],
    deviation: Float[np.ndarray, "seeds updates"],
    *,
    title: str,
) -> None:
    """Mean reward of a step and the policy's standard deviation over epochs: mean and range of all seeds (figure 4.30).

    Args:
        path: the PNG to write.
        steps: made by the end of each update.
        reward: mean of a step, of each update.
        deviation: of the policy after each update.
        title: says which numbers were learned with.
    """
    figure = new_figure(9.0, 3.8)
    for position, values, label in ((121, reward, "mean reward of a step"), (122, deviation, "standard deviation")):
        axes = plain_axes(figure, position)
        _with_range(axes, steps / _EPOCH, values)
        axes.set(xlabel="epoch of 10,000 steps", ylabel=label, xlim=(0, float(steps[-1]) / _EPOCH))
        axes.legend(frameon=False)
    figure.suptitle(title)
    save_figure(figure, path)


def _with_range(axes: Any, x: np.ndarray, values: np.ndarray) -> None:
    axes.plot(x, values.mean(axis=0), lw=1.3, color=OURS, label=f"mean and range of {len(values)} seeds")
    axes.fill_between(x, values.min(axis=0), values.max(axis=0), color=OURS, alpha=0.18, lw=0)
