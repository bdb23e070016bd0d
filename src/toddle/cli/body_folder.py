"""The folder that ``toddle reach`` leaves of a learned body."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from toddle.reach.body_skill import BodySkill

_SHOWN = 4_000  # points of a picture


def leave(folder: Path, skill: BodySkill) -> None:
    """Write what a run leaves beside its skill: configuration, figures, test points, pictures."""
    from toddle.outside.files import write_json
    from toddle.outside.versions import versions

    facts = {"source": asdict(skill.source), **asdict(skill.config), "why": skill.why, "versions": versions()}
    write_json(folder / "config.json", facts)
    write_json(folder / "figures.json", skill.figures)
    pairs = zip(skill.targets.tolist(), skill.errors, strict=True)
    points = [{"position_m": list(x), "error_mm": 1000 * error} for x, error in pairs]
    write_json(folder / "points.json", {"fixed": points})
    _draw(folder, skill)


def _draw(folder: Path, skill: BodySkill) -> None:
    """The pictures of a run."""
    from toddle.outside import body_pictures, pictures

    title = f"{skill.source.called}, {skill.fit.kind}"
    home = skill.fit.model.forward(skill.home[None])[0]
    pictures.explored_space(
        folder / "explored.png", skill.experience.x[:_SHOWN], home, title=f"{title}: where the tip was seen"
    )
    if len(skill.errors):
        pictures.targets_by_error(folder / "fixed.png", skill.targets, skill.errors, title=f"{title}: fixed test set")
    q = np.random.default_rng(0).uniform(skill.lower, skill.upper, (_SHOWN, len(skill.joints)))
    mean, _ = skill.expectation.at(q)
    body_pictures.expected_error(folder / "expected.png", skill.fit.model.forward(q), mean, title=title)
    body_pictures.misses(
        folder / "misses.png", skill.fit.miss, skill.fit.wild, skill.fit.sensor, title=f"{title}: misses of the fit"
    )
