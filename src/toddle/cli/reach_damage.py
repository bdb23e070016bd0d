"""The part of ``toddle reach --damage``: the learned body goes on working, breaks, notices and adapts."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from toddle.reach.body_skill import BodySkill
    from toddle.reach.working import Step, Work
    from toddle.robots.body import Body

_BEFORE = 15  # movements before the first damage that are drawn
_BACK = 0.002  # error up to which it counts as recovered [m]


def go_on_working(skill: BodySkill, body: Body, work: Work, folder: Path) -> dict[str, Any]:
    """Work on while the body breaks; leaves the course of errors as a picture and as JSON.

    Args:
        skill: what was learned.
        body: what it was learned on.
        work: what breaks, and when.
        folder: the run's.

    Returns:
        The figures of it.
    """
    from toddle.outside.damage_pictures import damage_course
    from toddle.outside.files import write_json
    from toddle.outside.terminal import stoppable
    from toddle.reach.working import work as working

    steps: list[Step] = []
    with stoppable() as stop:
        for step in working(skill, body, work):
            steps.append(step)
            if step.news:
                print(f"{skill.source.called}: movement {step.movement}: {step.news}", file=sys.stderr)
            if stop.asked:
                break
    course = [
        {
            "movement": step.movement, "target_m": step.target.tolist(), "error_mm": 1000 * step.error,
            "surprise": step.alarm.surprise, "news": step.news,
        }
        for step in steps
    ]  # fmt: skip
    figures = figures_of(steps, work)
    write_json(
        folder / "damage.json", {"damages": [str(damage) for damage in work.damages], "steps": course, **figures}
    )
    shown = [step for step in steps if step.movement > work.damages[0].at - _BEFORE] or steps
    start = shown[0].movement - 1
    happened = [(damage.at - start, str(damage)) for damage in work.damages]
    noticed = [(step.movement - start, step.news) for step in shown if step.news]
    damage_course(
        folder / "damage.png",
        np.array([step.error for step in shown]),
        sorted(happened + noticed),
        title=f"{skill.source.called}: error over movements, from movement {start + 1} on",
    )
    return figures


def figures_of(steps: list[Step], work: Work) -> dict[str, Any]:
    """When the first damage was noticed, and when the errors were back."""
    first = work.damages[0].at
    since = [step for step in steps if step.movement >= first]
    before = [step.error for step in steps if step.movement < first]
    noticed = next((step.movement - first + 1 for step in since if step.news), None)
    named = next((step.news for step in reversed(since) if step.news), None)
    back = next(
        (
            step.movement - first + 1
            for i, step in enumerate(since)
            if step.error < _BACK and np.nanmax([s.error for s in since[i : i + 10]]) < _BACK
        ),
        None,
    )
    return {
        "damage_noticed_after_movements": noticed,
        "damage_said": named,
        "damage_back_under_2mm_after_movements": back,
        "damage_false_alarms": sum(bool(step.news) for step in steps if step.movement < first),
        "damage_error_before_mean_mm": 1000 * float(np.mean(before)) if before else None,
        "damage_error_last_ten_mean_mm": 1000 * float(np.mean([step.error for step in since[-10:]])) if since else None,
    }
