"""``toddle navigate export``: a learned policy as a file that answers without toddle."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from toddle.cli.arguments import parse
from toddle.cli.options import POSITIONAL


@dataclass(frozen=True)
class Export:
    """A learned policy becomes a file that answers without toddle, its normaliser inside.

    Attributes:
        file: where to; its ending says what it becomes: .onnx, or .jax for jax.export.
        policy: the folder that toddle navigate ppo or toddle navigate clone left.
    """

    file: Annotated[Path, POSITIONAL]
    policy: Path


def main(argv: Sequence[str]) -> int:
    """Write the file; returns the exit code."""
    asked = parse(Export, argv, prog="toddle navigate export")
    from toddle.outside.navigation.cloning_files import load_cloned
    from toddle.outside.navigation.export_cloned import export_cloned
    from toddle.outside.navigation.export_policy import export_policy
    from toddle.outside.navigation.policy_files import load_policy
    from toddle.outside.navigation.room_policies import is_cloned

    if is_cloned(asked.policy):
        export_cloned(load_cloned(asked.policy), asked.file)
    else:
        export_policy(load_policy(asked.policy), asked.file)
    print(f"the policy, to be used without toddle: {asked.file}", file=sys.stderr)
    return 0
