"""Pictures of a network that learned by watching, as the figures 4.16, 4.17 and 4.23 to 4.25 of Huber 2019."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.navigate.cloning.measures import AHEAD, TURNING, counts
from toddle.outside.pictures import FAINT, INK, OURS, THEIRS, new_figure, plain_axes, save_figure

_INKS = (OURS, THEIRS, INK, FAINT)


class Balance(NamedTuple):
    """Of one scenario.

    Attributes:
        scenario: its name.
        entropy: of the velocities ahead that were asked for [nat].
        mean: distance of planned and measured zero moment point [cm].
        spread: its standard deviation [cm].
    """

    scenario: str
    entropy: float
    mean: float
    spread: float


def loss_history(path: Path, runs: Mapping[str, Mapping[str, np.ndarray]], held: Mapping[str, float]) -> None:
    """Loss of the command over the looks that were learned from (figure 4.16).

    Args:
        path: the PNG to write.
        runs: by their names: columns ``looks`` and ``command``.
        held: the loss of each run's policy on drives that it did not learn from, dashed.
    """
    figure = new_figure()
    axes = plain_axes(figure)
    for number, (name, columns) in enumerate(runs.items()):
        ink = _INKS[number % len(_INKS)]
        axes.plot(columns["looks"], columns["command"], color=ink, lw=0.9, marker=".", ms=3, alpha=0.8, label=name)
        if name in held:
            axes.axhline(held[name], color=ink, ls="--", lw=1)
    axes.set(xlabel="looks learned from", ylabel="loss of the command", title="figure 4.16: dashed, unseen drives")
    axes.legend(frameon=False)
    save_figure(figure, path)


def velocity_histograms(
    path: Path, taught: Float[np.ndarray, "looks 2"], said: Float[np.ndarray, "looks 2"], title: str
) -> None:
    """What the teacher asked for beside what the network says, at the same looks (figure 4.17)."""
    figure = new_figure(9.0, 6.0)
    grid = figure.add_gridspec(2, 2)
    columns = (("velocity ahead [m/s]", AHEAD), ("turning velocity [rad/s]", TURNING))
    for row, (name, values) in enumerate((("teacher", taught), ("network", said))):
        for column, (label, edges) in enumerate(columns):
            axes = plain_axes(figure, grid[row, column])
            share = counts(values[:, column], edges) / max(len(values), 1)
            axes.bar(edges[:-1], share, np.diff(edges), align="edge", color=OURS if row else FAINT)
            axes.set(xlabel=label, ylabel="share of the looks", title=name)
    figure.suptitle(title)
    save_figure(figure, path)


def zmp_distances(path: Path, drivers: Mapping[str, Mapping[str, Float[np.ndarray, " ticks"]]]) -> None:
    """Distance of planned and measured zero moment point, a panel for each scenario (figures 4.23, 4.24).

    Args:
        path: the PNG to write.
        drivers: by their names, by scenario: the distance at each tick [m].
    """
    scenarios = list(dict.fromkeys(name for those in drivers.values() for name in those))
    figure = new_figure(5.0 * len(scenarios), 4.0)
    grid = figure.add_gridspec(1, len(scenarios))
    edges = np.linspace(0.0, 12.0, 61)
    for column, scenario in enumerate(scenarios):
        axes = plain_axes(figure, grid[0, column])
        for number, (driver, those) in enumerate(drivers.items()):
            distances = 100 * np.clip(np.asarray(those.get(scenario, np.zeros(0)), float), 0.0, 0.12)
            if len(distances):
                weights = np.full(len(distances), 1 / len(distances))
                axes.hist(distances, edges, weights=weights, histtype="step", color=_INKS[number], label=driver)
        axes.set(xlabel="distance of the zero moment points [cm]", ylabel="share of the ticks", title=scenario)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(frameon=False)
    figure.suptitle("figures 4.23 and 4.24")
    save_figure(figure, path)


def balance_over_entropy(path: Path, drivers: Mapping[str, Sequence[Balance]]) -> None:
    """Mean distance of the zero moment points over the entropy of the commands, a point a scenario (figure 4.25)."""
    figure = new_figure()
    axes = plain_axes(figure)
    for number, (driver, those) in enumerate(drivers.items()):
        options: dict[str, Any] = {"color": _INKS[number], "fmt": "o", "capsize": 3, "label": driver}
        axes.errorbar([one.entropy for one in those], [one.mean for one in those], [one.spread for one in those],
                      **options)  # fmt: skip
        for one in those:
            axes.annotate(one.scenario, (one.entropy, one.mean), xytext=(4, 4), textcoords="offset points", fontsize=7)
    axes.set(xlabel="entropy of the velocity ahead [nat]", ylabel="distance of the zero moment points [cm]")
    axes.set_title("figure 4.25: mean and standard deviation")
    axes.legend(frameon=False)
    save_figure(figure, path)
