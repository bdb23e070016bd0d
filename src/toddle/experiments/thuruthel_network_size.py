"""How large a network, how many samples (Thuruthel 2016, section 3, figures 1a and 1b).

The figures' numbers aren't in the text. It says that the lowest size "which provides the preferred behavior" was taken,
20 units, for a fixed sample and fifty fixed targets, and that few samples are enough. Both are checked: fewer units are
worse and more gain little, and the error falls with the samples until they, too, gain little.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from toddle.experiments import thuruthel
from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.thuruthel import acting, learned, random_targets
from toddle.robots.body import Body
from toddle.robots.catalogue import load

CHOSEN = 20  # hidden units, section 3
LITTLE = 0.1  # a gain of less than this share of the error is little


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        arm: what the runs share.
        hidden: sizes of the network, each trained on `arm.samples`.
        samples: that a network of `arm.hidden` units is trained on.
        seeds: runs of each.
    """

    arm: thuruthel.Parameters
    hidden: tuple[int, ...] = (2, 5, 10, 15, 20, 25, 30)
    samples: tuple[int, ...] = (125, 250, 500, 1000, 2000, 4000, 8000, 16000)
    seeds: int = 3


FULL = Parameters(thuruthel.FULL)
QUICK = Parameters(thuruthel.QUICK, hidden=(5, 10, 20, 30), samples=(250, 1000, 2000, 4000), seeds=2)


def run(task: Task) -> Outcome:
    """Both halves of figure 1."""
    parameters = FULL if task.full else QUICK
    parameters = replace(parameters, seeds=task.seeds or parameters.seeds)
    arm = parameters.arm
    by_size = tried(task.part(0.0, 0.6), [replace(arm, hidden=size) for size in parameters.hidden], parameters.seeds)
    by_samples = tried(task.part(0.6, 1.0), [replace(arm, samples=n) for n in parameters.samples], parameters.seeds)
    draw(parameters, by_size, by_samples, task)
    sizes, amounts = parameters.hidden[: by_size.shape[1]], parameters.samples[: by_samples.shape[1]]
    size, amount = by_size[:, :, 2].mean(axis=0), by_samples[:, :, 2].mean(axis=0)
    rows = [
        Row(f"{hidden} units: {what}", float(value), None, unit)
        for hidden, values in zip(sizes, by_size.mean(axis=0), strict=True)
        for what, value, unit in zip(
            ("training error", "test error", "error"), values, ("half ranges", "half ranges", "mm"), strict=True
        )
    ]
    rows += [
        Row(f"{n:,} samples: {what}", float(value), None, "mm")
        for n, values in zip(amounts, by_samples[:, :, 2].T, strict=True)
        for what, value in (("error", values.mean()), ("error, worst run", values.max()))
    ]
    whole = len(sizes) == len(parameters.hidden) and len(amounts) == len(parameters.samples)
    chosen = sizes.index(CHOSEN) if CHOSEN in sizes else -1
    larger = float(size[chosen:].min())
    enough, few = larger >= (1 - LITTLE) * size[chosen], float(size[0]) > (1 + LITTLE) * size[chosen]
    falls = bool(amount[-1] < (1 - LITTLE) * amount[0] and amount[-1] > (1 - 2 * LITTLE) * amount[-2])
    verdict = (
        f"{CHOSEN} units settle {size[chosen]:.0f} mm from the targets, the best of the larger {larger:.0f}, "
        f"{sizes[0]} units {size[0]:.0f}; {amounts[0]:,} samples {amount[0]:.0f}, {amounts[-1]:,} {amount[-1]:.0f}; "
        f"means of {parameters.seeds} runs"
    )
    figures = {"by_size": by_size.round(4).tolist(), "by_samples": by_samples.round(4).tolist()}
    return Outcome(tuple(rows), verdict, bool(whole and enough and few and falls), parameters, figures)


def tried(task: Task, choices: list[thuruthel.Parameters], seeds: int) -> Float[np.ndarray, "runs choices 3"]:
    """For each run and choice: training and test error of the network, mean error of the solver [mm]."""
    body, columns = load(choices[0].robot), []
    for number, choice in enumerate(choices):
        if columns and task.stopped():
            break
        columns.append([scored(body, choice, task.seed, task.seed + run) for run in range(seeds)])
        task.tell((number + 1) / len(choices), f"{choice.hidden} units, {choice.samples:,} samples")
    return np.array(columns).transpose(1, 0, 2)


def scored(body: Body, choice: thuruthel.Parameters, targets_seed: int, seed: int) -> tuple[float, float, float]:
    """One network's errors; its targets are the same for all."""
    inverse, act = learned(body, choice, seed), acting(body)
    targets = random_targets(body, choice.targets, targets_seed)
    tips = act(inverse.solve(targets, act=act).q)[1]
    error = float(1000 * np.linalg.norm(tips - targets, axis=1).mean())
    return float(inverse.record.train_error[-1]), float(inverse.record.test_error[-1]), error


def draw(parameters: Parameters, by_size: np.ndarray, by_samples: np.ndarray, task: Task) -> None:
    """Figures 1a and 1b."""
    from toddle.outside import soft_pictures

    sizes = np.array(parameters.hidden[: by_size.shape[1]])
    soft_pictures.over_sizes(
        task.folder / "figure-1-a.png", sizes, {"training": by_size[:, :, 0], "testing": by_size[:, :, 1]},
        by_size[:, :, 2], x_label="hidden units", title=f"figure 1a: {parameters.arm.samples:,} samples",
    )  # fmt: skip
    amounts = np.array(parameters.samples[: by_samples.shape[1]])
    soft_pictures.over_sizes(
        task.folder / "figure-1-b.png", amounts, {}, by_samples[:, :, 2], x_label="samples",
        title=f"figure 1b: {parameters.arm.hidden} hidden units", logarithmic=True,
    )  # fmt: skip


EXPERIMENT = Experiment("thuruthel-network-size", "Thuruthel 2016, figures 1a, 1b", run)
