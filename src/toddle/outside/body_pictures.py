"""Pictures of a learned body: how sure it is where, and how its model sits in the movements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from toddle.outside.pictures import INK, OURS, THEIRS, new_figure, plain_axes, save_figure, space_axes


def expected_error(
    path: Path, x: Float[np.ndarray, "points space"], errors: Float[np.ndarray, " points"], *, title: str
) -> None:
    """The error that the skill expects, over the space it reaches.

    Args:
        path: of the PNG.
        x: where the tip is [m].
        errors: the error expected there [m].
        title: of the picture.
    """
    figure = new_figure(10.5, 4.6)
    axes = space_axes(figure, x.shape[1], 121)
    millimetres = 1000 * errors
    top = float(np.percentile(millimetres, 98))
    dots = axes.scatter(*x.T, c=millimetres, s=5, cmap="viridis", vmin=0, vmax=top, linewidths=0)
    figure.colorbar(dots, ax=axes, label="error to expect [mm]", shrink=0.75, pad=0.12)
    axes.set_title(f"{title}: error to expect")
    bars = plain_axes(figure, 122)
    bars.hist(millimetres, bins=np.linspace(0, max(top, 1e-9), 60).tolist(), color=OURS)
    bars.axvline(float(np.median(millimetres)), color=THEIRS, ls="--", label=f"median {np.median(millimetres):.2f} mm")
    bars.set(xlabel="error to expect [mm]", ylabel="postures")
    bars.legend(frameon=False)
    save_figure(figure, path)


def misses(
    path: Path,
    miss: Float[np.ndarray, " movements"],
    wild: Bool[np.ndarray, " movements"],
    sensor: float,
    *,
    title: str,
) -> None:
    """By how much each movement misses the model, and which were left out.

    Args:
        path: of the PNG.
        miss: distance between the seen and the modelled tip [m].
        wild: movements that the fit left out.
        sensor: standard deviation of the seen tip on each axis, as found [m].
        title: of the picture.
    """
    figure = new_figure()
    axes = plain_axes(figure)
    number, millimetres = np.arange(1, len(miss) + 1), np.maximum(1000 * miss, 1e-9)
    axes.plot(number[~wild], millimetres[~wild], ".", color=OURS, ms=4, label="learned from")
    if wild.any():
        axes.plot(number[wild], millimetres[wild], "x", color=THEIRS, ms=5, label=f"{wild.sum()} left out")
        axes.set_yscale("log")
    axes.axhline(1000 * sensor, color=INK, lw=1, ls="--", label=f"noise on each axis, as found: {1000 * sensor:.2g} mm")
    axes.set(xlabel="movement", ylabel="seen tip to modelled tip [mm]", title=title)
    axes.legend(frameon=False, fontsize=9)
    save_figure(figure, path)
