"""One file for each table or figure of a document; `names` lists them, `experiment_named` finds one.

A file is imported when it is asked for, so that naming the experiments costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from toddle.failures import unknown_name

if TYPE_CHECKING:
    from toddle.experiments.experiment import Experiment

NAMES = (
    "huber-cloning",
    "huber-patterns",
    "huber-ppo-toy",
    "huber-ppo-walker",
    "huber-zmp",
    "mahboob-hyperparameters",
    "mahboob-nicu",
    "mahboob-slp-mlp",
    "mahboob-suralp",
    "mahboob-planar5",
    "martin-evolution",
    "martin-generalisation",
    "martin-sensitivity",
    "rolf-direction-sampling",
    "thuruthel-network-size",
    "thuruthel-points",
    "thuruthel-circle",
    "thuruthel-locked",
)
"""The only place to edit to add one: its file has the same name, with underscores, and defines ``EXPERIMENT``."""


def experiment_named(name: str) -> Experiment:
    """The experiment of this name.

    Raises:
        BadInput: there is none; the nearest are named.
    """
    if name not in NAMES:
        raise unknown_name("experiment", name, NAMES, where="toddle experiment")
    return importlib.import_module(f"{__name__}.{name.replace('-', '_')}").EXPERIMENT
