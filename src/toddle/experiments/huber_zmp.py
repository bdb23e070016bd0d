"""The document's walker on Heicub, in physics: how far the zero moment point is off (Huber 2019, section 4.1.2).

The four tasks of figures 4.4 to 4.7 by commands of our own (the operator's are not printed), within the operator's
limits: straight, a curve, around an obstacle, half a turn and then straight. The document measures 3.24 +- 1.99 cm on
the real robot between the planned and the measured zero moment point (section 4.2.4, figure 4.25); ours is simulated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.teleoperation.commands import follow
from toddle.outside.walk_figures import distance_walked, zmp_distance
from toddle.outside.walk_record import Record, Recorder
from toddle.robots.catalogue import HUMANOIDS
from toddle.robots.humanoids import load_humanoid
from toddle.signals import Velocity
from toddle.walk.follower import Follower, follower
from toddle.walk.follower_state import FollowerConfig
from toddle.walk.loop import walk
from toddle.walk.scenarios import Leg


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        robot: who walks.
        seconds: how long each task is commanded [s].
        mean_cm: mean distance up to which the document counts as reproduced [cm].
    """

    robot: str = "heicub"
    seconds: float = 180.0
    mean_cm: float = 3.24


FULL = Parameters()
QUICK = replace(FULL, seconds=40.0)
TASKS: dict[str, tuple[tuple[float, Velocity], ...]] = {
    "straight": ((0.0, Velocity(0.15, 0.0, 0.0)),),
    "curve": ((0.0, Velocity(0.15, 0.0, 0.1)),),
    "obstacle": (
        (0.0, Velocity(0.15, 0.0, 0.0)),
        (0.2, Velocity(0.15, 0.0, -0.2)),
        (0.4, Velocity(0.15, 0.0, 0.2)),
        (0.8, Velocity(0.15, 0.0, -0.2)),
    ),
    "scanning": ((0.0, Velocity(0.0, 0.0, 0.2)), (0.6, Velocity(0.15, 0.0, 0.0))),
}
"""Velocities from shares of the time on; figures 4.4 to 4.7."""
VARIANTS = {
    "without servo feed-forward": FollowerConfig(feed_forward=False),
    "centre of mass fed back": FollowerConfig(feedback=1.0),
}
"""Of the straight walk."""


@dataclass(frozen=True)
class Printed:
    """What the document prints [cm]: user-controlled walking, section 4.2.4."""

    mean: float = 3.24
    std: float = 1.99


def run(task: Task) -> Outcome:
    """The tasks, two variants of the straight one, and their pictures."""
    parameters, document = FULL if task.full else QUICK, Printed()
    humanoid, gait = load_humanoid(parameters.robot), HUMANOIDS[parameters.robot].document_gait
    assert gait is not None
    jobs = {name: (name, FollowerConfig()) for name in TASKS}
    jobs |= {f"straight, {name}": ("straight", config) for name, config in VARIANTS.items()}
    records: dict[str, Record] = {}
    for number, (name, (legs, config)) in enumerate(jobs.items()):
        if task.stopped() and records:
            break
        task.tell(number / len(jobs), name)
        records[name] = walked(follower(humanoid, gait, config), legs, parameters.seconds)
        if name in TASKS:
            draw(name, records[name], follower(humanoid, gait), task.folder)
    distances = {name: 100 * zmp_distance(record) for name, record in records.items()}
    together = np.concatenate([distances[name] for name in TASKS if name in distances])
    rows = [
        Row("mean distance of planned and measured ZMP, all tasks", float(together.mean()), document.mean, "cm"),
        Row("its standard deviation", float(together.std()), document.std, "cm"),
    ]
    for name, distance in distances.items():
        rows.append(Row(f"{name}: mean distance", float(distance.mean()), None, "cm"))
        rows.append(Row(f"{name}: standard deviation", float(distance.std()), None, "cm"))
    figures = {
        name: {
            "mean_cm": float(distances[name].mean()), "std_cm": float(distances[name].std()),
            "fell": record.fell, "seconds": float(record.t[-1]), "distance_m": distance_walked(record, gait),
        }
        for name, record in records.items()
    }  # fmt: skip
    fell = [name for name, record in records.items() if record.fell]
    rows.append(Row("falls", float(len(fell)), None, ""))
    holds = not fell and float(together.mean()) <= parameters.mean_cm
    verdict = (
        f"{together.mean():.2f} +- {together.std():.2f} cm in simulation, {document.mean:g} +- {document.std:g} cm on "
        f"the real robot; {'fell: ' + ', '.join(fell) if fell else 'no fall'}"
    )
    return Outcome(tuple(rows), verdict, holds, parameters, figures)


def walked(walks: Follower, task: str, seconds: float) -> Record:
    """One task, to the stop."""
    legs = tuple(Leg(share * seconds, velocity) for share, velocity in TASKS[task])
    recorder = Recorder()
    for moment in walk(walks, HumanoidSimulation(walks.humanoid), follow(legs, seconds)):
        recorder.add(moment)
    return recorder.record()


def draw(name: str, record: Record, walks: Follower, folder: Path) -> None:
    """Footprints with both zero moment points (figures 4.4 to 4.7), and how far they are apart (figures 4.23, 4.24)."""
    from toddle.outside.walk_pictures import footprints, zmp_error

    number = 4 + list(TASKS).index(name)
    footprints(folder / f"figure-4-{number}.png", record, walks.gait, (), title=f"figure 4.{number}: {name}")
    zmp_error(folder / f"figure-4-24-{name}.png", record, title=f"figure 4.24: {name}")


EXPERIMENT = Experiment("huber-zmp", "Huber 2019, section 4.1.2 and figures 4.4-4.7, 4.24", run)
