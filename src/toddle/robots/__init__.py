"""Bodies: rigid chains from URDF, MJCF and Denavit-Hartenberg tables, and the continuum arm.

Names are resolved when they are first used, so that importing this package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from toddle.robots.body import Body as Body
    from toddle.robots.body import Plant as Plant
    from toddle.robots.catalogue import Robot as Robot
    from toddle.robots.catalogue import describe as describe
    from toddle.robots.catalogue import load as load
    from toddle.robots.catalogue import names as names
    from toddle.robots.catalogue import record as record
    from toddle.robots.chain import Chain as Chain

_HOMES = {
    "Body": "body",
    "Plant": "body",
    "Robot": "catalogue",
    "describe": "catalogue",
    "load": "catalogue",
    "names": "catalogue",
    "record": "catalogue",
    "Chain": "chain",
}

__all__ = ["Body", "Chain", "Plant", "Robot", "describe", "load", "names", "record"]


def __getattr__(name: str) -> object:
    """Import a public name's module when the name is first asked for (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
