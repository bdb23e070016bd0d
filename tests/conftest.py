"""What holds for every test: shapes and types are enforced, compiled code is kept, nothing opens a window."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import jaxtyping
import pytest
from hypothesis import settings
from jaxtyping import install_import_hook

from toddle.outside.compile_cache import kernel_files, kernels_hash

SOURCE = Path(__file__).parents[1] / "src" / "toddle"
KERNELS = kernel_files(SOURCE)

# They take longest, so they go first: no worker is left with one of them in the end.
LONGEST = (
    "cli/test_navigate.py", "walk/pattern/test_batch.py", "test_examples.py", "test_cloning_training.py",
    "walk/test_batch_native.py", "test_walker_task.py", "test_cloning_files.py", "test_huber_ppo_walker.py",
    "cli/test_walk.py", "test_nmpc_walks.py", "test_navigate_record.py", "test_cloning_network.py",
    "test_huber_cloning.py", "test_probes.py", "test_navigate_clone.py", "test_huber_ppo_toy.py",
    "test_walk_hostile.py",
)  # fmt: skip

# All of this stands before anything imports jax, matplotlib or toddle.
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parents[1] / ".cache" / "jax"))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
os.environ.setdefault("JAX_NUMPY_DTYPE_PROMOTION", "strict")
os.environ.setdefault("JAX_NUMPY_RANK_PROMOTION", "raise")
os.environ["JAX_PLATFORMS"] = "cpu"
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_use_fusion_emitters=false")  # compiles a quarter quicker
os.environ.setdefault("NUMBA_CACHE_DIR", str(Path(__file__).parents[1] / ".cache" / "numba" / kernels_hash(KERNELS)))
os.environ["MPLBACKEND"] = "agg"
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # each worker has a core: a second thread of its would only wait


def checked() -> list[str]:
    """Every module of toddle but those with compiled kernels: Numba can't compile a function that is wrapped."""
    paths = [path for path in sorted(SOURCE.rglob("*.py")) if path not in KERNELS]
    modules = [path.relative_to(SOURCE.parent).with_suffix("").parts for path in paths]
    return [".".join(parts) for parts in modules if parts[-1] != "__init__"]


# From here on a wrong shape in toddle raises where it happens.
install_import_hook(checked(), "beartype.beartype")

settings.register_profile("toddle", derandomize=True, deadline=None, max_examples=25, print_blob=True)
settings.load_profile("toddle")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first."""
    items.sort(
        key=lambda item: next((at for at, name in enumerate(LONGEST) if str(item.path).endswith(name)), len(LONGEST))
    )


@pytest.fixture
def unchecked() -> Iterator[None]:
    """As a user has it: no types are enforced, so toddle itself must refuse what is wrong."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)
