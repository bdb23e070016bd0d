"""Humanoids by name, or from a URDF or MJCF file: `load_humanoid`."""

from __future__ import annotations

from pathlib import Path

from toddle.robots.humanoid import Humanoid

__all__ = ["load_humanoid"]


def load_humanoid(spec: str, config: Path | None = None) -> Humanoid:
    """The humanoid that a name or a file stands for.

    Args:
        spec: a name of the catalogue's ``HUMANOIDS``; the path of a URDF or MJCF file; or that of a configuration
            file (.toml) which names one with its key ``model``.
        config: a configuration file (TOML, the keys of `toddle.robots.humanoids.settings.Settings`); what it says
            goes before what is known of a named robot.

    Raises:
        BadInput: there is no such humanoid, or it can't be used; the line names file, key and remedy.
    """
    from toddle.robots.humanoids import config as configuration
    from toddle.robots.humanoids.description import read
    from toddle.robots.humanoids.infer import humanoid

    path, settings = configuration.found(spec, config)
    said = config or (Path(spec) if Path(spec).suffix.lower() == ".toml" else None)
    where = str(path) if said is None else f"{said} on {path.name}"
    return humanoid(read(path, settings.base, settings.without, where), settings, where)
