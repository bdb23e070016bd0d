"""Pictures of the soft arm's experiments, as the figures 1 and 2 of Thuruthel 2016."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from toddle.outside.pictures import FAINT, INK, OURS, THEIRS, new_figure, plain_axes, save_figure


def over_sizes(
    path: Path,
    sizes: Int[np.ndarray, " sizes"],
    lines: Mapping[str, Float[np.ndarray, "runs sizes"]],
    performance: Float[np.ndarray, "runs sizes"],
    *,
    x_label: str,
    title: str,
    logarithmic: bool = False,
) -> None:
    """Errors of networks, and of the solver that uses them, over a size: means, and the range of all runs (figure 1).

    Args:
        path: the PNG to write.
        sizes: of the network or of what it learned from.
        lines: root mean square errors of the networks, as a share of half an output's range.
        performance: the solver's mean error [mm].
        x_label: what is varied.
        title: of the figure.
        logarithmic: the sizes' axis.
    """
    figure = new_figure(9.0 if lines else 5.4, 3.8)
    places = [121, 122] if lines else [111]
    right = plain_axes(figure, places[-1])
    if lines:
        left = plain_axes(figure, 121)
        for k, (name, values) in enumerate(lines.items()):
            _with_range(left, sizes, values, (OURS, THEIRS)[k % 2], name)
        left.set(xlabel=x_label, ylabel="network's error [half range]", ylim=(0, None))
        left.legend(frameon=False)
    _with_range(right, sizes, performance, OURS, "mean and range of the runs")
    right.set(xlabel=x_label, ylabel="distance from the target [mm]", ylim=(0, None))
    right.legend(frameon=False)
    if logarithmic:
        for axes in figure.axes:
            axes.set_xscale("log")
            axes.set_xticks(sizes, [f"{size:,}" for size in sizes], rotation=45)
            axes.minorticks_off()
    figure.suptitle(title)
    save_figure(figure, path)


def _with_range(axes: Any, x: np.ndarray, values: np.ndarray, color: str, name: str) -> None:
    axes.plot(x, values.mean(axis=0), "o-", ms=4, lw=1.3, color=color, label=name)
    axes.fill_between(x, values.min(axis=0), values.max(axis=0), color=color, alpha=0.15, lw=0)


def targets_and_answers(
    path: Path, targets: Float[np.ndarray, "points 3"], answers: Float[np.ndarray, "points 3"], *, title: str
) -> None:
    """Targets and where the tip came to instead, joined by lines [m] (figure 2a)."""
    figure = new_figure(6.0, 5.4)
    axes = _room(figure, 111, np.concatenate([targets, answers]))
    for target, answer in zip(targets, answers, strict=True):
        axes.plot(*np.array([target, answer]).T, color=FAINT, lw=1)
    axes.scatter(*targets.T, s=22, color=THEIRS, label="target")
    axes.scatter(*answers.T, s=22, color=OURS, marker="^", label="tip")
    axes.set_title(title)
    axes.legend(frameon=False, loc="upper right")
    save_figure(figure, path)


def errors_and_steps(
    path: Path, errors: Float[np.ndarray, " points"], steps: Int[np.ndarray, " points"], *, title: str
) -> None:
    """For each target the final error [mm], and the steps until the arm settled (figure 2b)."""
    figure = new_figure(8.0, 4.6)
    mean, deviation = errors.mean(), errors.std()
    top, bottom = plain_axes(figure, 211), plain_axes(figure, 212)
    at = np.arange(1, len(errors) + 1)
    top.bar(at, errors, color=OURS, width=0.8)
    top.axhline(mean, color=INK, lw=1, label=f"{mean:.1f} ± {deviation:.1f} mm")
    top.axhspan(max(mean - deviation, 0), mean + deviation, color=INK, alpha=0.08, lw=0)
    top.set(ylabel="error [mm]", title=title)
    bottom.bar(at, steps, color=FAINT, width=0.8)
    bottom.axhline(steps.mean(), color=INK, lw=1, label=f"{steps.mean():.2f} ± {steps.std():.2f} steps")
    bottom.set(xlabel="target", ylabel="steps to settle")
    for axes, values in ((top, errors), (bottom, steps)):
        axes.set_ylim(0, 1.3 * float(values.max()))
        axes.legend(frameon=False, loc="upper right")
    save_figure(figure, path)


def ways_in_space(
    path: Path,
    ways: Mapping[str, Float[np.ndarray, "points 3"]],
    start: Float[np.ndarray, "3"],
    *,
    title: str,
) -> None:
    """Ways of the tip [m], in space and from above; the first is the one asked for (figures 2c, 2e)."""
    figure = new_figure(10.0, 4.8)
    everything = np.concatenate([*ways.values(), start[None]])
    space, above = _room(figure, 121, everything), plain_axes(figure, 122)
    for k, (name, way) in enumerate(ways.items()):
        style = {"color": (INK, OURS, THEIRS)[k % 3], "lw": 1.3, "ls": "-"} | ({} if k else {"ls": "--", "zorder": 3})
        space.plot(*way.T, **style, label=name)
        above.plot(*way[:, :2].T, **style, label=name)
    space.scatter(*start, s=30, color=FAINT, label="start")
    above.scatter(*start[:2], s=30, color=FAINT)
    above.set_aspect("equal")
    above.set(xlabel="x [m]", ylabel="y [m]", title="from above")
    space.set_title(title)
    space.legend(frameon=False, loc="upper left", fontsize=8)
    save_figure(figure, path)


def errors_along(path: Path, lines: Mapping[str, Float[np.ndarray, " points"]], around: int, *, title: str) -> None:
    """Errors along a way that is gone round more than once [mm], each round's mean and deviation (figures 2d, 2f)."""
    figure = new_figure(8.0, 4.0)
    axes = plain_axes(figure)
    for k, (name, errors) in enumerate(lines.items()):
        color = (OURS, THEIRS)[k % 2]
        rounds = errors.reshape(-1, around)
        said = ", ".join(f"{mean:.1f} ± {std:.1f}" for mean, std in zip(rounds.mean(1), rounds.std(1), strict=True))
        axes.plot(np.arange(1, len(errors) + 1), errors, color=color, lw=1.3, label=f"{name}: {said} mm")
    for ends in range(around, max(map(len, lines.values())), around):
        axes.axvline(ends + 0.5, color=FAINT, lw=0.8, ls=":")
    axes.set(xlabel="step", ylabel="error [mm]", title=title)
    axes.set_ylim(0, 1.3 * max(float(errors.max()) for errors in lines.values()))
    axes.legend(frameon=False, loc="upper right")
    save_figure(figure, path)


def _room(figure: Any, position: int, points: Float[np.ndarray, "points 3"]) -> Any:
    """Axes in space [m], as long in every direction, around all points."""
    axes = plain_axes(figure, position, projection="3d")
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, 0.55 * float((high - low).max())
    ends = np.stack([middle - half, middle + half], axis=1)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", xlim=ends[0], ylim=ends[1], zlim=ends[2])
    axes.set_box_aspect((1, 1, 1))
    axes.locator_params(nbins=5)
    return axes
