"""Learned bodies on disk, and the movements of a run that isn't at its end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from toddle.failures import BadInput
from toddle.outside.files import make_folder, read_record, write_record
from toddle.outside.records import Tensors, put_together, taken_apart
from toddle.reach.body_config import BodyConfig
from toddle.reach.body_skill import BodySkill
from toddle.reach.model.covariance import Doubt, Embedding
from toddle.reach.model.crippled import Crippled
from toddle.reach.model.curvature import Curvature
from toddle.reach.model.curvature_chain import Shape
from toddle.reach.model.curvature_rest import Mended, Rest
from toddle.reach.model.kernel import Kernel
from toddle.reach.model.model import Fit
from toddle.reach.model.multilinear import Multilinear
from toddle.reach.model.network import Layer, Network
from toddle.reach.model.rigid import Rigid
from toddle.robots.body import Body, Plant, Resumable
from toddle.robots.catalogue import Choice
from toddle.robots.linkage import Linkage
from toddle.signals import Experience

BODY = "body"
_RUN, _AGAIN = "movements", "learn it again"
_CLASSES: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        BodyConfig, BodySkill, Choice, Crippled, Curvature, Doubt, Embedding, Experience, Fit, Kernel, Layer, Linkage,
        Mended, Multilinear, Network, Rest, Rigid, Shape,
    )
}  # fmt: skip
"""What a skill's files may name: nothing else is ever made of them."""


def save_body(skill: BodySkill, folder: Path) -> Path:
    """Save a learned body; returns the folder.

    Raises:
        BadInput: the folder can't be made.
    """
    path, tensors = make_folder(folder), Tensors()
    facts = {BODY: taken_apart(skill, "skill", tensors)}
    write_record(path, "skill", "skill", facts, tensors)
    return path


def body_from(facts: Mapping[str, Any], tensors: Mapping[str, np.ndarray]) -> BodySkill:
    """The skill that was saved.

    Raises:
        LookupError, TypeError, ValueError: it is none of this version.
    """
    skill = put_together(facts[BODY], tensors, _CLASSES)
    if not isinstance(skill, BodySkill):
        raise ValueError(f"it holds a {type(skill).__name__}")
    count = len(skill.joints)
    for name in ("lower", "upper", "home"):
        if np.shape(getattr(skill, name)) != (count,):
            raise ValueError(f"{name} has shape {np.shape(getattr(skill, name))}")
    for name, tensor in tensors.items():
        if tensor.dtype.kind == "f" and not np.all(np.isfinite(tensor)):
            raise ValueError(f"{name} is not finite")
    return skill


def save_movements(
    folder: Path, experience: Experience, config: BodyConfig, facts: Mapping[str, Any], robot: Body | Plant
) -> None:
    """Save the movements of a run, so that it can go on.

    Args:
        folder: where; it must exist.
        experience: the movements made so far.
        config: the run's configuration.
        facts: how its robot was loaded, for who resumes it.
        robot: what moves; its state is saved where it has one.
    """
    tensors = Tensors()
    state = robot.state() if isinstance(robot, Resumable) else {}
    made = taken_apart((experience, config, state), "made", tensors)
    write_record(folder, _RUN, _RUN, {"made": made, "source": dict(facts)}, tensors)


def read_movements_made(folder: Path) -> tuple[Experience, BodyConfig, dict[str, Any], dict[str, np.ndarray]]:
    """The movements of a run, its configuration, how its robot was loaded, and the robot's state.

    Raises:
        BadInput: there are none, or the files are truncated, altered, or something else.
    """
    facts, tensors = read_record(folder, _RUN, _RUN)
    try:
        experience, config, state = put_together(facts["made"], tensors, _CLASSES)
        return experience, replace(config), dict(facts["source"]), state
    except (LookupError, TypeError, ValueError, BadInput) as fault:
        raise BadInput(f"it is not a run of this version ({fault})", where=str(folder), remedy=_AGAIN) from fault
