"""The picture of a body that broke: error over movements, and when what was noticed, named and mended."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from toddle.outside.pictures import FAINT, INK, OURS, THEIRS, new_figure, plain_axes, save_figure

_LEAST = 1e-6  # [m] errors below are drawn there: a logarithm has no zero


def damage_course(
    path: Path,
    errors: Float[np.ndarray, " movements"],
    events: Sequence[tuple[int, str]],
    *,
    title: str,
    goal: float = 2e-3,
    unaware: Float[np.ndarray, " movements"] | None = None,
) -> None:
    """Distance between tip and target over the movements, on a logarithmic scale, with what happened when.

    Args:
        path: the PNG to write.
        errors: distance of each movement, the first one first [m]; nan: not known.
        events: the movement, counted from 1, and what happened or was noticed at it, in a few words.
        title: says robot and damage.
        goal: drawn as a line [m].
        unaware: the same movements' distances without repair, drawn beside [m].
    """
    figure = new_figure(8.0, 4.6)
    axes = plain_axes(figure)
    at = np.arange(1, len(errors) + 1)
    if unaware is not None:
        axes.plot(at, 1e3 * np.maximum(unaware, _LEAST), color=FAINT, lw=1, label="without repair")
    axes.plot(at, 1e3 * np.maximum(errors, _LEAST), color=OURS, lw=1.2, marker="o", ms=2.5, label="distance to target")
    axes.axhline(1e3 * goal, color=INK, lw=0.8, ls=":", label=f"{1e3 * goal:g} mm")
    axes.set(
        yscale="log", xlabel="movement", ylabel="distance between tip and target [mm]", xlim=(0.5, len(errors) + 0.5)
    )
    for row, (movement, what) in enumerate(events):
        axes.axvline(movement, color=THEIRS, lw=0.9, ls="--", alpha=0.6)
        # labels stand above the axes, each in its own row: events of neighbouring movements don't hide each other
        right = movement > 0.6 * len(errors)
        axes.annotate(
            f"{movement}: {what}",
            (movement, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(-3 if right else 3, 4 + 12 * (len(events) - 1 - row)),
            textcoords="offset points",
            ha="right" if right else "left",
            fontsize=8,
            color=THEIRS,
            annotation_clip=False,
        )
    axes.legend(frameon=False, fontsize=8)
    figure.suptitle(title)
    save_figure(figure, path)
