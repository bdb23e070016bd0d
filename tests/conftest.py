"""What holds for every test: shapes and types are enforced, compiled code is kept, nothing opens a window."""

from __future__ import annotations

import os
from pathlib import Path

_CACHE = Path(__file__).parent.parent / ".cache"
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(_CACHE / "jax"))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
os.environ.setdefault("JAX_NUMPY_DTYPE_PROMOTION", "strict")
os.environ.setdefault("JAX_NUMPY_RANK_PROMOTION", "raise")
os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["MPLBACKEND"] = "agg"

from hypothesis import settings
from jaxtyping import install_import_hook

# Before anything imports toddle: from here on a wrong shape in toddle raises where it happens.
install_import_hook("toddle", "beartype.beartype")

settings.register_profile("toddle", derandomize=True, deadline=None, max_examples=25, print_blob=True)
settings.load_profile("toddle")
