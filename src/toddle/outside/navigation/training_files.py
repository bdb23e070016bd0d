"""Interrupted runs on disk: all that learning needs to go on bit for bit.

A checkpoint is a pair of files in a numbered folder of its own; ``checkpoint.json`` names the newest one and the one
before it, and is written last, in one go. Whatever is cut off in between leaves the ones that it names untouched.
"""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from toddle.failures import BadInput
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.moments import Moments
from toddle.navigate.ppo.network import ActorCritic
from toddle.navigate.ppo.training import Training
from toddle.outside.files import make_folder, read_record, write_json, write_record
from toddle.outside.navigation.policy_files import config_from, filled, flat

_KIND, _FORMAT = "training run", "toddle checkpoints"
_KEPT = 2
_AGAIN = "start anew in another folder"
History = Mapping[str, np.ndarray]
"""The course so far, a row an update: the parts of `toddle.navigate.ppo.training.Report` by name."""


@dataclass(frozen=True, eq=False)
class Saved:
    """A run as it was saved.

    Attributes:
        config: how it learns.
        training: where it is.
        history: its course so far.
        source: what it learns on, for who resumes it.
        figures: so far.
        best: the networks and moments that did best in trials so far, None: none were held.
        passed_over: why the newest checkpoint was of no use, and the one before was taken; None: it was not.
    """

    config: PpoConfig
    training: Training
    history: History
    source: Mapping[str, Any]
    figures: Mapping[str, Any] = field(default_factory=dict)
    best: tuple[ActorCritic, Moments] | None = None
    passed_over: str | None = None


def save_training(
    folder: Path,
    config: PpoConfig,
    training: Training,
    history: History,
    source: Mapping[str, Any],
    *,
    figures: Mapping[str, Any] | None = None,
    best: tuple[ActorCritic, Moments] | None = None,
) -> None:
    """Save a run so that it can go on bit for bit; the last checkpoint but one is let go.

    Args:
        folder: of the run; made where it isn't there.
        config: how it learns.
        training: where it is: its parts are pytrees of arrays, on devices or not.
        history: its course so far.
        source: how its task is made again: plain values.
        figures: so far: plain values.
        best: what did best in trials so far.

    Raises:
        BadInput: the folder can't be made.
        ToddleError: a file can't be written; the checkpoints before are still there.
    """
    kept = _kept(folder, missing=())
    name = f"{_highest(folder) + 1:06d}"
    facts = {
        "config": dataclasses.asdict(config),
        "source": dict(source),
        "figures": dict(figures or {}),
        "best": best is not None,
    }
    tensors = flat("training", training) | {f"history.{part}": np.asarray(rows) for part, rows in history.items()}
    if best is not None:
        tensors |= flat("best", best)
    write_record(make_folder(folder / "checkpoints" / name), "training", _KIND, facts, tensors)
    kept = (name, *kept)[:_KEPT]
    write_json(folder / "checkpoint.json", {"format": _FORMAT, "version": 1, "checkpoints": list(kept)})
    for path in (folder / "checkpoints").iterdir():
        if path.name not in kept:
            shutil.rmtree(path, ignore_errors=True)


def read_training(folder: Path) -> tuple[PpoConfig, dict[str, Any]]:
    """How a saved run learns, and how its task is made again; what `load_training` needs a template from.

    Raises:
        BadInput: there is none, or it is truncated, altered, or not a run.
    """
    found = _newest(folder)
    return found[0], dict(found[1]["source"])


def read_figures(folder: Path) -> dict[str, Any]:
    """How far a saved run has come.

    Raises:
        BadInput: there is none, or it is truncated, altered, or not a run.
    """
    return dict(_newest(folder)[1]["figures"])


def load_training(folder: Path, template: Training) -> Saved:
    """Take up a saved run.

    Args:
        folder: of the run.
        template: a run of its configuration and task, or its shapes alone (`jax.eval_shape`); host arrays stay so.

    Raises:
        BadInput: there is none, or it is truncated, altered, or of another task or configuration.
    """
    config, facts, tensors, passed_over = _newest(folder)
    try:
        training = filled("training", template, tensors)
        best = filled("best", (template.network, template.observations), tensors) if facts["best"] else None
        history = {name[8:]: rows for name, rows in tensors.items() if name.startswith("history.")}
        return Saved(config, training, history, dict(facts["source"]), dict(facts["figures"]), best, passed_over)
    except (LookupError, TypeError, ValueError) as fault:
        raise BadInput(f"it does not fit this task ({fault})", where=str(folder), remedy=_AGAIN) from fault


def _newest(folder: Path) -> tuple[PpoConfig, dict[str, Any], dict[str, np.ndarray], str | None]:
    """The newest checkpoint that is whole: the last one, or else the one before it."""
    faults: list[BadInput] = []
    for name in _kept(folder):
        path = folder / "checkpoints" / name
        try:
            facts, tensors = read_record(path, "training", _KIND)
            config = _config(path, facts)
        except BadInput as fault:
            faults.append(fault)
        else:
            return config, facts, tensors, str(faults[0]) if faults else None
    raise faults[0]


def _config(path: Path, facts: Mapping[str, Any]) -> PpoConfig:
    try:
        if not all(isinstance(facts[name], dict) for name in ("source", "figures")):
            raise TypeError("source and figures")
        return config_from(facts["config"])
    except (LookupError, TypeError, ValueError, AttributeError, BadInput) as fault:
        raise BadInput(f"it is not a run of this version ({fault})", where=str(path), remedy=_AGAIN) from fault


def _kept(folder: Path, missing: tuple[str, ...] | None = None) -> tuple[str, ...]:
    """Names of the checkpoints, the newest first.

    Raises:
        BadInput: there are none (unless ``missing`` is given), or the file that names them is not ours.
    """
    path = folder / "checkpoint.json"
    try:
        found = json.loads(path.read_bytes()[:10_000])
        names = found["checkpoints"]
        if found["format"] != _FORMAT or found["version"] != 1 or not 1 <= len(names) <= _KEPT:
            raise ValueError
        if not all(re.fullmatch(r"\d{6}", name) for name in names):
            raise ValueError
        return tuple(names)
    except FileNotFoundError:
        if missing is not None:
            return missing
        raise BadInput("there is no run here", where=str(folder), remedy="name the folder of one") from None
    except OSError as fault:
        raise BadInput(f"it can't be read ({fault.strerror})", where=str(path), remedy="name another folder") from fault
    except (LookupError, TypeError, ValueError, RecursionError) as fault:
        raise BadInput("it does not name a run's checkpoints", where=str(path), remedy=_AGAIN) from fault


def _highest(folder: Path) -> int:
    """The greatest number that a checkpoint has had; one that was cut off counts too."""
    names = [path.name for path in (folder / "checkpoints").glob("*")]
    return max((int(name) for name in names if re.fullmatch(r"\d{6}", name)), default=0)
