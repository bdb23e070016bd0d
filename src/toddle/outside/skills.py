"""Skills and interrupted runs on disk.

What they hold is rebuilt from their configuration first, as shapes without values; the tensors must then fit exactly.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from toddle.failures import BadInput, ToddleError
from toddle.outside.body_skills import BODY, body_from, save_body
from toddle.outside.files import make_folder, read_record, write_record
from toddle.reach import loop
from toddle.reach.body_skill import BodySkill
from toddle.reach.config import ReachConfig
from toddle.reach.methods import make_learner
from toddle.reach.session import Cycle, Session, start
from toddle.reach.skill import Skill
from toddle.reach.unit_box import UnitBox
from toddle.robots.body import Resumable
from toddle.robots.catalogue import Choice

_SKILL, _RUN = "skill", "run"
_AGAIN = "learn it again"
_BOX = ("joint_lower", "joint_span", "space_lower", "space_span")
_PLAIN = ("home", "seen", "postures", "targets", "errors")


def save(skill: Skill | BodySkill, folder: str | os.PathLike[str]) -> Path:
    """Save a skill; returns the folder.

    Raises:
        BadInput: the folder can't be made.
    """
    if isinstance(skill, BodySkill):
        return save_body(skill, Path(folder))
    path = make_folder(Path(folder))
    facts = {
        "source": asdict(skill.source),
        "joints": skill.joints,
        "hidden": skill.hidden,
        "config": asdict(skill.config),
        "figures": dict(skill.figures),
    }
    tensors = {name: np.asarray(getattr(skill, name)) for name in _PLAIN}
    tensors |= {f"box.{name}": np.asarray(getattr(skill.box, name)) for name in _BOX}
    tensors |= _flat("state", skill.state)
    write_record(path, "skill", _SKILL, facts, tensors)
    return path


def load_skill(folder: str | os.PathLike[str]) -> Skill | BodySkill:
    """Load a saved skill; it answers as it did before, bit for bit.

    Raises:
        BadInput: there is none, or it is truncated, altered, or not a skill.
    """
    path = Path(folder)
    facts, tensors = read_record(path, "skill", _SKILL)
    try:
        if BODY in facts:
            return body_from(facts, tensors)
        config = _config(facts["config"])
        box = UnitBox(*(jnp.asarray(tensors[f"box.{name}"]) for name in _BOX))
        hidden = replace(config, hidden=tuple(facts["hidden"])).hidden or ()
        learner = make_learner(config, box, hidden)
        space, joints = len(box.space_lower), len(box.joint_lower)
        template = jax.eval_shape(learner.init, jax.random.key(0), jnp.zeros(space), jnp.zeros(joints))
        state = _unflat("state", template, tensors)
        _check(tensors, joints, space)
        home, seen, postures, targets, errors = (tensors[name] for name in _PLAIN)
        names = _texts(facts["joints"], joints)
        return Skill(
            choice_from(facts["source"]), names, home, config, hidden, box,
            learner, state, seen, postures, targets, errors, dict(facts["figures"]),
        )  # fmt: skip
    except (LookupError, TypeError, ValueError, BadInput) as fault:
        raise BadInput(f"it is not a skill of this version ({fault})", where=str(path), remedy=_AGAIN) from fault


def _check(tensors: Mapping[str, np.ndarray], joints: int, space: int) -> None:
    """Refuse tensors that don't fit each other, or that aren't finite."""
    points, seen = len(tensors["targets"]), len(tensors["seen"])
    shapes = {
        "home": (joints,),
        "seen": (seen, space),
        "postures": (seen, joints),
        "targets": (points, space),
        "errors": (points,),
    }
    shapes |= {"box.joint_span": (joints,), "box.space_span": (space,)}
    for name, shape in shapes.items():
        if tensors[name].shape != shape or not len(tensors[name]):
            raise ValueError(f"{name} has shape {list(tensors[name].shape)}")
    for name, tensor in tensors.items():
        if not np.all(np.isfinite(tensor)):
            raise ValueError(f"{name} is not finite")


def save_run(folder: Path, session: Session, cycle: Cycle, source: Mapping[str, Any]) -> None:
    """Save a run so that it can go on bit for bit.

    Args:
        folder: where; it must exist.
        session: the run.
        cycle: how far it came.
        source: how its robot was loaded, for who resumes it.
    """
    tensors = _flat("progress", _with_key_data(cycle.progress))
    tensors |= {f"history.{name}": _column(cycle, name) for name in loop.Scores._fields}
    tensors |= _of_the_robot(session)
    if isinstance(session.body, Resumable):
        tensors |= {f"plant.{name}": value for name, value in session.body.state().items()}
    write_record(folder, "run", _RUN, {"config": asdict(session.config), "source": dict(source)}, tensors)


def read_run(folder: Path) -> tuple[ReachConfig, dict[str, Any], dict[str, np.ndarray]]:
    """What a saved run was: its configuration, how its robot was loaded, and its tensors.

    Raises:
        BadInput: there is none, or it is truncated, altered, or not a run.
    """
    facts, tensors = read_record(folder, "run", _RUN)
    try:
        return _config(facts["config"]), dict(facts["source"]), tensors
    except (LookupError, TypeError, ValueError, BadInput) as fault:
        raise BadInput(f"it is not a run of this version ({fault})", where=str(folder), remedy=_AGAIN) from fault


def resume(session: Session, tensors: Mapping[str, np.ndarray], where: str) -> Cycle:
    """Take a saved run up again in a session made from its configuration.

    Raises:
        BadInput: the tensors are of another robot or version.
    """
    template = eqx.filter_eval_shape(lambda: _with_key_data(start(session).progress))
    try:
        for name, now in _of_the_robot(session).items():
            if tensors[name].shape != now.shape or not np.allclose(tensors[name], now, rtol=1e-4, atol=1e-5):
                raise ValueError(f"{name} was {tensors[name]} and is {now}")
        progress = _unflat("progress", template, tensors)
        rows = zip(*(tensors[f"history.{name}"] for name in loop.Scores._fields), strict=True)
        history = tuple(loop.Scores(*row) for row in rows)
        plant = {name[6:]: value for name, value in tensors.items() if name.startswith("plant.")}
        if isinstance(session.body, Resumable):
            session.body.restore(plant)
    except (KeyError, TypeError, ValueError, ToddleError) as fault:
        raise BadInput(f"it does not fit this robot ({fault})", where=where, remedy=_AGAIN) from fault
    key = jax.random.wrap_key_data(progress.key)
    return Cycle(progress._replace(key=key), history)


def choice_from(facts: Mapping[str, Any]) -> Choice:
    """What was asked for, from its saved form.

    Raises:
        LookupError, TypeError, ValueError: it is none.
    """
    (spec,) = _texts([facts["spec"]], 1)
    tip, base = (None if facts[name] is None else _texts([facts[name]], 1)[0] for name in ("tip", "base"))
    joints = facts["joints"]
    return Choice(spec, tip, base, None if joints is None else _texts(joints, len(joints)))


def _texts(values: Any, count: int) -> tuple[str, ...]:
    if not isinstance(values, list) or len(values) != count or not all(isinstance(text, str) for text in values):
        raise ValueError(f"{values!r} are not {count} names")
    return tuple(values)


def _of_the_robot(session: Session) -> dict[str, np.ndarray]:
    """What tells one robot from another: its limits, the extent of its workspace, its home."""
    box, home = session.setting.box, session.setting.home
    tensors = {f"box.{name}": np.asarray(getattr(box, name)) for name in _BOX}
    return tensors | {"home.q": np.asarray(home.q), "home.x": np.asarray(home.x)}


def _config(facts: Mapping[str, Any]) -> ReachConfig:
    hidden = facts["hidden"]
    return ReachConfig(**{**facts, "hidden": None if hidden is None else tuple(hidden)})


def _with_key_data(progress: loop.Progress) -> loop.Progress:
    return progress._replace(key=jax.random.key_data(progress.key))


def _column(cycle: Cycle, name: str) -> np.ndarray:
    return np.array([getattr(scores, name) for scores in cycle.history])


def _flat(name: str, tree: Any) -> dict[str, np.ndarray]:
    """The leaves of a pytree by their path."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(tree)
    return {name + jax.tree_util.keystr(path): np.asarray(leaf) for path, leaf in leaves}


def _unflat(name: str, template: Any, tensors: Mapping[str, np.ndarray]) -> Any:
    """The pytree of a template's structure, filled with the tensors of its paths."""
    leaves, structure = jax.tree_util.tree_flatten_with_path(template)
    filled = []
    for path, leaf in leaves:
        tensor = tensors[name + jax.tree_util.keystr(path)]
        if tensor.shape != leaf.shape or tensor.dtype != leaf.dtype:
            raise ValueError(f"{name}{jax.tree_util.keystr(path)} is {tensor.dtype}{list(tensor.shape)}")
        filled.append(jnp.asarray(tensor))
    return jax.tree_util.tree_unflatten(structure, filled)
