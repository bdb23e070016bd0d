"""Which policies drive by what they see."""

from __future__ import annotations

import json
from pathlib import Path


def is_cloned(folder: Path) -> bool:
    """Whether a folder says that it holds a policy that learned by watching; whether it is whole is for others."""
    try:
        told = json.loads((folder / "policy.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(told, dict) and told.get("format") == "toddle cloned"
