"""Pictures that set an experiment beside its document: heat maps, scatter, bars with deviations, courses, ways."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from toddle.outside.pictures import FAINT, INK, OURS, THEIRS, new_figure, plain_axes, save_figure


def heat_maps_beside(
    path: Path,
    ours: Float[np.ndarray, "rows columns"],
    document: Float[np.ndarray, "rows columns"],
    rows: Sequence[str],
    columns: Sequence[str],
    *,
    row_label: str,
    title: str,
) -> None:
    """Two heat maps on one scale [m], ours left; nan: not tried (figures 4.2, 4.3, 4.5 of Mahboob 2015)."""
    figure = new_figure(10.0, 1.6 + 0.17 * max(len(rows), 12))
    both = np.array([ours, document])
    low, high = float(np.nanmin(both)), float(np.nanmax(both))
    image: Any = None
    for k, (name, values) in enumerate((("ours", ours), ("document", document))):
        axes = plain_axes(figure, 121 + k)
        axes.grid(visible=False)
        axes.set_facecolor("#eeeeee")
        image = axes.imshow(values, aspect="auto", cmap="viridis", vmin=low, vmax=high, interpolation="nearest")
        axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", fontsize=7)
        axes.set_yticks(range(len(rows)), rows, fontsize=7)
        axes.set_title(name)
        if k == 0:
            axes.set_ylabel(row_label)
    figure.colorbar(image, label="mean error [m]", ax=figure.axes)
    figure.suptitle(title)
    save_figure(figure, path)


def scatter_beside(
    path: Path,
    ours: Float[np.ndarray, " cells"],
    document: Float[np.ndarray, " cells"],
    groups: Sequence[str],
    *,
    title: str,
) -> None:
    """Each cell's error, ours over the document's, both logarithmic [m]; the line is equality."""
    figure = new_figure(6.2, 5.4)
    axes = plain_axes(figure)
    ends = [0.9 * float(min(ours.min(), document.min())), 1.1 * float(max(ours.max(), document.max()))]
    axes.plot(ends, ends, color=FAINT, lw=1)
    for k, group in enumerate(dict.fromkeys(groups)):
        chosen = np.array([name == group for name in groups])
        marker = "o^sDv"[k // 10 % 5]
        axes.scatter(document[chosen], ours[chosen], s=14, marker=marker, color=f"C{k % 10}", label=group)
    axes.set(xscale="log", yscale="log", xlabel="document [m]", ylabel="ours [m]", title=title, xlim=ends, ylim=ends)
    axes.legend(frameon=False, fontsize=6, ncols=2)
    save_figure(figure, path)


def means_and_deviations(
    path: Path,
    labels: Sequence[str],
    ours: tuple[Sequence[float], Sequence[float]],
    document: tuple[Sequence[float], Sequence[float]],
    *,
    x_label: str,
    title: str,
) -> None:
    """Means with their deviations as bars, ours beside the document's [m] (figure 4.4 of Mahboob 2015)."""
    figure = new_figure(7.5, 4.2)
    axes = plain_axes(figure)
    at = np.arange(len(labels))
    for name, shift, color, (mean, deviation) in (
        ("ours", -0.12, OURS, ours),
        ("document", 0.12, THEIRS, document),
    ):
        axes.errorbar(at + shift, mean, yerr=deviation, fmt="o", ms=4, capsize=3, lw=1, color=color, label=name)
    axes.set_xticks(at, labels)
    axes.set(xlabel=x_label, ylabel="mean error [m]", title=title, ylim=(0, None))
    axes.legend(frameon=False)
    save_figure(figure, path)


def courses(
    path: Path,
    lines: Mapping[str, tuple[np.ndarray, np.ndarray]],
    levels: Mapping[str, float],
    *,
    x_label: str,
    y_label: str,
    title: str,
) -> None:
    """Lines over one axis; dashed levels are the document's figures."""
    figure = new_figure()
    axes = plain_axes(figure)
    for k, (name, (x, y)) in enumerate(lines.items()):
        axes.plot(x, y, lw=1.2, color=f"C{k}", label=name)
    for (name, level), style in zip(levels.items(), ("--", ":", "-."), strict=False):
        axes.axhline(level, color=INK, lw=0.9, ls=style, label=name)
    axes.set(xlabel=x_label, ylabel=y_label, title=title, ylim=(0, None))
    axes.legend(frameon=False)
    save_figure(figure, path)


def discovery(path: Path, positions: Mapping[str, Float[np.ndarray, "_ space"]], *, title: str) -> None:
    """Visited positions in the plane [m], a panel each, the base in red (figures A.5 to A.8 of Mahboob 2015)."""
    figure = new_figure(3.0 * max(len(positions), 1), 3.4)
    for k, (name, visited) in enumerate(positions.items()):
        axes = plain_axes(figure, 101 + 10 * len(positions) + k)
        axes.scatter(*visited.T, s=1, color=OURS, alpha=0.5, linewidths=0)
        axes.scatter(0, 0, s=25, color=THEIRS)
        axes.set_aspect("equal")
        axes.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.05), xlabel="x [m]")
        axes.set_title(name, fontsize=8)
    figure.suptitle(title, fontsize=10)
    save_figure(figure, path)


def paths_beside(path: Path, lines: Mapping[str, Float[np.ndarray, "_ 2"]], *, title: str) -> None:
    """Ways in the plane [m] drawn over each other, seen from above (figures 4.1, 4.2 of Huber 2019)."""
    figure = new_figure(9.0, 4.2)
    axes = plain_axes(figure)
    for k, (name, way) in enumerate(lines.items()):
        axes.plot(*way.T, lw=1.4, color=(OURS, THEIRS, INK)[k % 3], ls=("-", "--", ":")[k % 3], label=name)
    axes.set(xlabel="x [m]", ylabel="y [m]", title=title)
    axes.legend(frameon=False)
    save_figure(figure, path)
