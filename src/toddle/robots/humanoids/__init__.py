"""Humanoids by name, or from a URDF or MJCF file: `load_humanoid`."""

from __future__ import annotations

from pathlib import Path

from toddle.failures import unknown_name
from toddle.robots.humanoid import Humanoid


def load_humanoid(spec: str, config: Path | None = None) -> Humanoid:
    """The humanoid that a name or a file stands for.

    Args:
        spec: a name of the catalogue's ``HUMANOIDS``.
        config: a configuration file (TOML).

    Raises:
        BadInput: there is no such humanoid, or it can't be used.
    """
    from toddle.robots.humanoids import icub

    known = {"heicub": icub.heicub, "icub": icub.icub}
    if spec not in known:
        raise unknown_name("humanoid", spec, known)
    return known[spec]()
