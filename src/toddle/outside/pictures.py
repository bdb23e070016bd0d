"""Pictures of a run: error over samples, space explored, test targets coloured by their error.

After Mahboob 2015, figures 4.6-4.8, C.1 and C.2.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Bool, Float
from matplotlib.figure import Figure

from toddle.outside.files import write_bytes

INK, OURS, THEIRS, FAINT = "#222222", "#1f6fb4", "#d1603d", "#9aa7b1"
_STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "axes.axisbelow": True,
    "figure.dpi": 150,
}


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, whole or not at all."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", bbox_inches="tight")
    write_bytes(path, buffer.getvalue())


def new_figure(width: float = 7.0, height: float = 4.2) -> Figure:
    """An empty figure in toddle's style [inches]; independent of any display."""
    with mpl.rc_context(_STYLE):
        return Figure(figsize=(width, height), layout="constrained")


def plain_axes(figure: Figure, position: Any = 111, **options: Any) -> Any:
    """Axes in toddle's style."""
    with mpl.rc_context(_STYLE):
        return figure.add_subplot(position, **options)


def error_over_samples(
    path: Path,
    samples: Sequence[int],
    fixed: Sequence[float],
    seen: Sequence[float],
    *,
    title: str,
    published: dict[str, float] | None = None,
) -> None:
    """Mean open-loop error on both test sets [mm] over the movements made (figures 4.6, 5.4-5.7).

    Args:
        path: the PNG to write.
        samples: movements at each test.
        fixed, seen: mean errors [mm].
        title: says robot and method.
        published: the document's own errors [mm], drawn as dashed lines.
    """
    figure = new_figure()
    axes = plain_axes(figure)
    axes.plot(samples, fixed, color=OURS, lw=1.2, label="fixed test set")
    axes.plot(samples, seen, color=OURS, lw=1.0, alpha=0.45, label="seen test set")
    for name, value in (published or {}).items():
        axes.axhline(value, color=THEIRS, lw=1, ls="--", label=f"document, {name.split('_')[0]}: {value:g} mm")
    axes.set(xlabel="movements", ylabel="mean error [mm]", title=title, ylim=(0, None))
    axes.set_xlim(0, max(samples, default=1))
    axes.legend(frameon=False)
    save_figure(figure, path)


def explored_space(
    path: Path, seen: Float[np.ndarray, "kept space"], home: Float[np.ndarray, " space"], *, title: str
) -> None:
    """Positions that the tip visited, and where it started [m] (figures 4.7, 4.10, 5.8, A.5-A.8)."""
    figure = new_figure(6.4, 5.4)
    axes = space_axes(figure, seen.shape[1])
    axes.scatter(*seen.T, s=3, color=OURS, alpha=0.35, linewidths=0)
    axes.scatter(*home, s=40, color=THEIRS, label="home")
    axes.set_title(title)
    axes.legend(frameon=False, loc="upper right")
    save_figure(figure, path)


def coverage(
    path: Path,
    samples: Sequence[int],
    covered: Sequence[float],
    visited: Bool[np.ndarray, " cells"],
    reachable: Bool[np.ndarray, " cells"],
    space: int,
    *,
    title: str,
) -> None:
    """How much of the reachable space was visited: over the movements made, and where, seen from above.

    Args:
        path: the PNG to write.
        samples: movements at each test.
        covered: the share of the reachable cells that were visited, 0 to 1.
        visited, reachable: the cells of the grid over the workspace, x fastest.
        space: coordinates of a position.
        title: says robot and method.
    """
    figure = new_figure(10.0, 4.4)
    left = plain_axes(figure, 121)
    left.plot(samples, [100 * share for share in covered], color=OURS, lw=1.4)
    left.set(xlabel="movements", ylabel="visited [% of the reachable cells]", ylim=(0, 102), title=title)
    left.set_xlim(0, max(samples, default=1))
    size = round(len(reachable) ** (1 / space))
    columns = tuple(grid.reshape((size,) * space).reshape(-1, size, size) for grid in (visited & reachable, reachable))
    seen, there = (grid.sum(axis=0) for grid in columns)
    share = np.where(there > 0, 100 * seen / np.maximum(there, 1), np.nan)
    right = plain_axes(figure, 122)
    right.grid(visible=False)
    image = right.imshow(share, origin="lower", cmap="viridis", vmin=0, vmax=100)
    right.set(xticks=[], yticks=[], xlabel="x", ylabel="y", title="reachable space from above")
    figure.colorbar(image, ax=right, label="visited [%]", shrink=0.8)
    save_figure(figure, path)


def targets_by_error(
    path: Path,
    targets: Float[np.ndarray, "points space"],
    errors: Float[np.ndarray, " points"],
    *,
    title: str,
) -> None:
    """Test targets coloured by their open-loop error, and the errors point by point (figures 4.8, C.1, C.2)."""
    figure = new_figure(10.5, 4.6)
    axes = space_axes(figure, targets.shape[1], 121)
    millimetres = 1000 * errors
    dots = axes.scatter(
        *targets.T, c=millimetres, s=26, cmap="viridis", vmin=0, vmax=float(np.percentile(millimetres, 95))
    )
    figure.colorbar(dots, ax=axes, label="error [mm]", shrink=0.75, pad=0.12)
    axes.set_title(title)
    bars = plain_axes(figure, 122)
    bars.bar(np.arange(len(errors)), millimetres, color=OURS, width=0.9)
    bars.axhline(millimetres.mean(), color=THEIRS, lw=1, ls="--", label=f"mean {millimetres.mean():.1f} mm")
    bars.set(xlabel="test target", ylabel="error [mm]")
    bars.legend(frameon=False)
    save_figure(figure, path)


def space_axes(figure: Figure, space: int, position: Any = 111) -> Any:
    """Equal axes in the plane or in space [m]."""
    if space == 2:
        axes = plain_axes(figure, position)
        axes.set_aspect("equal")
    else:
        axes = plain_axes(figure, position, projection="3d")
        axes.set_zlabel("z [m]")
        axes.set_box_aspect((1, 1, 1))
    axes.set(xlabel="x [m]", ylabel="y [m]")
    return axes
