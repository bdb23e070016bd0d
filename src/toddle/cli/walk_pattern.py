"""``toddle walk --pattern-only``: the walking pattern without a body, its trajectory and its figures."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toddle.cli.run_folder import new_folder
from toddle.cli.walk_folder import leave, tell

if TYPE_CHECKING:
    from toddle.cli.walk import Task, Walk
    from toddle.robots.gait import Gait
    from toddle.signals import Velocity
    from toddle.walk.pattern.plan import Pattern

_ROUNDING = 1e-9
_STOPPING = 4  # steps, in which every gait comes to stand


def make_pattern(asked: Walk) -> int:
    """Make the pattern, leave a folder, tell the figures; returns the exit code."""
    from toddle.cli.walk import DEFAULT_ROBOT, task_of, tell_capped
    from toddle.outside.walk_figures import figures_of
    from toddle.outside.walk_record import record_of_pattern
    from toddle.walk.pattern.trajectory import walk_pattern

    spec = asked.robot or DEFAULT_ROBOT
    gait = _gait(asked, spec)
    task = task_of(asked, gait)
    pattern = _pattern(asked, gait)
    through = _passed if asked.weights == "document" else _capped(gait)
    tell_capped(task, through, spec)
    folder = new_folder(asked.out, f"walk-{Path(spec).stem}")
    allowed: list[Velocity] = []
    _ = pattern.step(pattern.start(), task.legs[0].velocity, task.circles)  # compiled, before the clock runs
    began = time.perf_counter()
    command = _command(task, gait, through, allowed)
    trajectory = walk_pattern(pattern, gait, command, _iterations(asked, task, gait), task.circles)
    wall = time.perf_counter() - began
    record = record_of_pattern(trajectory, gait, allowed)
    until = task.seconds + gait.still * gait.sample
    figures = {"robot": spec, "scenario": task.name, **figures_of(record, gait, until=until, wall=wall)}
    leave(folder, record, gait, figures, _config(asked, spec, gait, task), task.circles)
    tell(figures, folder, as_json=asked.json)
    return 0


def _gait(asked: Walk, spec: str) -> Gait:
    """How the robot steps; in Huber 2019, where its weights are asked for and the robot occurs there."""
    from toddle.robots.catalogue import HUMANOIDS
    from toddle.robots.humanoids import load_humanoid

    known = HUMANOIDS.get(spec)
    if known is not None and asked.config is None:
        gait = known.document_gait if asked.weights == "document" else known.gait
        if gait is not None:
            return gait
    return load_humanoid(spec, asked.config).gait


def _pattern(asked: Walk, gait: Gait) -> Pattern[Any]:
    if asked.weights == "document":
        from toddle.walk.pattern.document import Document

        return Document(gait, deadline=math.inf if asked.deadline is None else asked.deadline)
    from toddle.walk.pattern.reduced import Reduced

    return Reduced(gait, deadline_ms=asked.deadline)


def _iterations(asked: Walk, task: Task, gait: Gait) -> int:
    """How many the commands take and, in our form, the stop; there an iteration also ends where a step does."""
    if asked.weights == "document":
        return max(math.ceil(task.seconds / gait.sample - _ROUNDING), 1)
    each = math.ceil(gait.step_time / gait.sample - _ROUNDING)
    return each * math.ceil(task.seconds / gait.step_time + _STOPPING)


def _command(
    task: Task, gait: Gait, through: Callable[[Velocity], Velocity], allowed: list[Velocity]
) -> Callable[[float], Velocity]:
    """The velocity at each iteration, which is remembered in ``allowed``."""
    from toddle.signals import STILL
    from toddle.walk.scenarios import velocity_at

    def command(t: float) -> Velocity:
        walked = t - gait.still * gait.sample
        wanted = through(velocity_at(task.legs, max(walked, 0.0))) if walked < task.seconds - _ROUNDING else STILL
        allowed.append(wanted)
        return wanted

    return command


def _passed(velocity: Velocity) -> Velocity:
    """The document's own pattern takes a command as it comes."""
    return velocity


def _capped(gait: Gait) -> Callable[[Velocity], Velocity]:
    """Ours, within what the robot may be asked and its steps can follow."""
    from toddle.signals import STILL
    from toddle.walk.gate import gate
    from toddle.walk.pattern.feasible import cap

    return lambda velocity: cap(gate(STILL, velocity, gait.fastest, gait.sample, limited=False), gait)


def _config(asked: Walk, spec: str, gait: Gait, task: Task) -> dict[str, Any]:
    """What a reader needs to make the same again."""
    return {
        "robot": spec,
        "pattern_only": True,
        "weights": asked.weights,
        "deadline_ms": asked.deadline,
        "scenario": task.name,
        "legs": [[leg.t, *leg.velocity] for leg in task.legs],
        "seconds": task.seconds,
        "obstacles": [list(circle) for circle in task.circles],
        "gait": asdict(gait),
    }
