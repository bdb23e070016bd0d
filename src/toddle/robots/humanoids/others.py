"""Humanoids of other makers, from the package example-robot-data: nothing is said of them, all is inferred."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

from toddle.failures import MissingExtra
from toddle.robots.humanoids.settings import Settings

_PACKAGE = "example-robot-data"
_TALOS = "talos_data/robots/talos_reduced.urdf"
_G1 = "g1_description/urdf/g1_29dof_rev_1_0.urdf"


def talos() -> tuple[Path, Settings]:
    """TALOS of PAL Robotics: 90 kg."""
    return _file(_TALOS, "talos"), Settings(name="talos")


def g1() -> tuple[Path, Settings]:
    """G1 of Unitree: 33 kg."""
    return _file(_G1, "g1"), Settings(name="g1")


def _file(name: str, robot: str) -> Path:
    """A file of the package, which says itself where its files lie."""
    try:
        files = importlib.metadata.files(_PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    for file in files:
        if file.as_posix().endswith(f"robots/{name}"):
            return Path(str(file.locate())).resolve()
    raise MissingExtra(_PACKAGE, "humanoids", what_for=robot)
