"""Pictures of errors that fall over generations, or differ between settings, on a logarithmic scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from toddle.outside.pictures import INK, OURS, THEIRS, new_figure, plain_axes, save_figure


def convergence(
    path: Path,
    courses: Mapping[str, Float[np.ndarray, "_ runs"]],
    levels: Mapping[str, float],
    *,
    title: str,
) -> None:
    """Lowest MSE so far over generations [units^2], all runs faint and the best bold (figures 5, 6 of Martin 2009).

    Args:
        path: the PNG to write.
        courses: of each method, a column a run.
        levels: the document's figures, drawn as dashed lines in the methods' order.
        title: says arm and figure.
    """
    figure = new_figure()
    axes = plain_axes(figure)
    for (name, course), color in zip(courses.items(), (OURS, THEIRS), strict=False):
        generations = np.arange(1, len(course) + 1)
        best = course[:, course[-1].argmin()]
        axes.plot(generations, course, color=color, lw=0.6, alpha=0.25)
        axes.plot(generations, best, color=color, lw=1.8, label=f"{name}, best of {course.shape[1]}")
    for (name, level), color in zip(levels.items(), (OURS, THEIRS), strict=False):
        axes.axhline(level, color=color, lw=1, ls="--", label=f"{name}: {level:g}")
    axes.set(yscale="log", xlabel="generation", ylabel="MSE [units²]", title=title)
    axes.set_xlim(0, None)
    axes.legend(frameon=False, fontsize=8)
    save_figure(figure, path)


def settings_beside(
    path: Path,
    names: Sequence[str],
    runs: Mapping[str, Sequence[Float[np.ndarray, " runs"]]],
    levels: Mapping[str, float],
    *,
    title: str,
) -> None:
    """Every run's MSE [units^2] under each setting, a panel for each arm; the bar is the median.

    Args:
        path: the PNG to write.
        names: of the settings.
        runs: of each arm, setting by setting.
        levels: of each arm the document's best, dashed.
        title: says the method.
    """
    figure = new_figure(9.0, 1.2 + 0.28 * len(names))
    for k, (arm, columns) in enumerate(runs.items()):
        axes = plain_axes(figure, 101 + 10 * len(runs) + k)
        for row, values in enumerate(columns):
            axes.scatter(values, np.full(len(values), row), s=10, color=OURS, alpha=0.5, linewidths=0)
            axes.plot([np.median(values)] * 2, [row - 0.3, row + 0.3], color=INK, lw=1.4)
        axes.axvline(levels[arm], color=THEIRS, lw=1, ls="--")
        axes.set_yticks(range(len(names)), names if k == 0 else [""] * len(names), fontsize=8)
        axes.set(xscale="log", xlabel="MSE [units²]", title=f"{arm} arm", ylim=(len(names) - 0.5, -0.5))
    figure.suptitle(title)
    save_figure(figure, path)
