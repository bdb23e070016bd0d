"""The folder that a run of ``toddle reach`` leaves, and what it prints of it."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from toddle.failures import BadInput

if TYPE_CHECKING:
    import numpy as np

    from toddle.reach.body_skill import BodySkill
    from toddle.reach.session import Cycle, Session
    from toddle.reach.skill import Skill

FILES = (
    "run.json", "run.safetensors", "movements.json", "movements.safetensors", "skill.json", "skill.safetensors",
    "config.json", "figures.json", "course.json", "points.json", "error.png", "explored.png", "coverage.png",
    "fixed.png", "seen.png", "expected.png", "misses.png", "damage.json", "damage.png",
)  # fmt: skip


_TOLD_ELSEWHERE = ("changes", "damage_said", "movements", "why")


def refuse_used(out: Path | None) -> None:
    """Refuse a folder in which a new run would write over something."""
    if out is None:
        return
    if os.path.lexists(out) and not os.path.isdir(out):
        raise BadInput("it is no folder", where=f"--out {out}", remedy="name another")
    found = [name for name in FILES if os.path.lexists(out / name)]
    if found and found[0] in ("run.json", "movements.json"):
        raise BadInput("it holds a run already", where=str(out), remedy=f"go on with --resume {out}, or name another")
    if found:
        raise BadInput(f"its {found[0]} would be written over", where=str(out), remedy="name another with --out")


def new_folder(out: Path | None, spec: str) -> Path:
    """The folder that a new run writes into.

    Raises:
        BadInput: it can't be made, or nothing can be written into it.
    """
    from toddle.outside.files import make_folder

    if out is not None:
        return make_folder(out)
    name = re.sub(r"[^\w.-]+", "-", Path(spec).stem if Path(spec).suffix else spec).strip("-") or "robot"
    number = 1
    while os.path.lexists(folder := Path("runs") / (name if number == 1 else f"{name}-{number}")):
        number += 1
    return make_folder(folder)


def leave(folder: Path, session: Session, cycle: Cycle, skill: Skill) -> None:
    """Write what a run leaves beside its skill: configuration, figures, course of learning, test points, pictures."""
    from toddle.outside.files import write_json
    from toddle.outside.versions import versions
    from toddle.reach.api import seen_test

    facts = {"source": asdict(skill.source), **asdict(skill.config), "versions": versions()}
    write_json(folder / "config.json", facts)
    write_json(folder / "figures.json", skill.figures)
    course = {name: [float(getattr(s, name)) for s in cycle.history] for name in cycle.history[0]._fields}
    write_json(folder / "course.json", course)
    tests = {"fixed": (skill.targets, skill.errors), "seen": seen_test(session, cycle)}
    points = {
        name: [{"position_m": list(x), "error_mm": 1000 * e} for x, e in zip(targets.tolist(), errors, strict=True)]
        for name, (targets, errors) in tests.items()
    }
    write_json(folder / "points.json", points)
    _draw(folder, session, cycle, skill, course, tests)


def _draw(
    folder: Path,
    session: Session,
    cycle: Cycle,
    skill: Skill,
    course: Mapping[str, list[float]],
    tests: Mapping[str, tuple[np.ndarray, np.ndarray]],
) -> None:
    """The pictures of a run."""
    import numpy as np

    from toddle.outside import pictures

    title = f"{session.body.name}, {skill.config.method}"
    samples = [int(count) for count in course["samples"]]
    pictures.error_over_samples(
        folder / "error.png",
        samples,
        [1000 * error for error in course["fixed_error"]],
        [1000 * error for error in course["seen_error"]],
        title=f"{title}: error over movements",
        published=_published(skill),
    )
    home = np.asarray(session.setting.box.x_from_unit(session.setting.home.x))
    pictures.explored_space(folder / "explored.png", skill.seen, home, title=f"{title}: explored space")
    visited, reachable = np.asarray(cycle.progress.seen.visited), np.asarray(session.reachable_cells)
    pictures.coverage(
        folder / "coverage.png", samples, course["coverage"], visited, reachable, skill.seen.shape[1], title=title
    )
    for name, (targets, errors) in tests.items():
        pictures.targets_by_error(folder / f"{name}.png", targets, errors, title=f"{title}: {name} test set")


def _published(skill: Skill | BodySkill) -> dict[str, float]:
    """The document's figures for what was run, where it has any [mm]."""
    from toddle.robots.catalogue import record

    known = record(skill.source.spec)
    return dict(known.published) if known and skill.config.method == "goal-and-motor-babbling" else {}


def tell_figures(skill: Skill | BodySkill, folder: Path, *, as_json: bool) -> None:
    """Print the figures: one JSON object, or a table beside the document's."""
    from toddle.outside.files import finite
    from toddle.outside.terminal import print_table

    if as_json:
        print(json.dumps(finite({**skill.figures, "folder": str(folder)})))
        return
    published = _published(skill)
    shown = {name: value for name, value in skill.figures.items() if name not in _TOLD_ELSEWHERE}
    rows = [
        [name.replace("_", " "), _figure(value), *([_figure(published.get(name, ""))] if published else [])]
        for name, value in shown.items()
    ]
    title = f"{skill.figures['robot']} after {skill.figures['samples']} movements"
    print_table(title, ("", "this run", *(["document"] if published else [])), rows)
    print(f"figures, pictures and the skill: {folder}")
    if len(skill.targets):
        middle = " ".join(f"{value:.3f}" for value in skill.targets[len(skill.targets) // 2])
        print(f"ask it: toddle reach --skill {folder} --target {middle}")


def _figure(value: object) -> str:
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.2f}" if abs(value) >= 0.1 else f"{value:.2g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_figure(inner)}" for name, inner in value.items())
    if isinstance(value, list | tuple):
        return " ".join(map(_figure, value))
    return str(value)
