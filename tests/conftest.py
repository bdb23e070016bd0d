"""What holds for every test: shapes and types are enforced, compiled code is kept, nothing opens a window."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import jaxtyping
import pytest
from hypothesis import settings
from jaxtyping import install_import_hook

# All of this stands before anything imports jax, matplotlib or toddle.
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parents[1] / ".cache" / "jax"))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
os.environ.setdefault("JAX_NUMPY_DTYPE_PROMOTION", "strict")
os.environ.setdefault("JAX_NUMPY_RANK_PROMOTION", "raise")
os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["MPLBACKEND"] = "agg"

# From here on a wrong shape in toddle raises where it happens.
install_import_hook("toddle", "beartype.beartype")

settings.register_profile("toddle", derandomize=True, deadline=None, max_examples=25, print_blob=True)
settings.load_profile("toddle")


@pytest.fixture
def unchecked() -> Iterator[None]:
    """As a user has it: no types are enforced, so toddle itself must refuse what is wrong."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)
