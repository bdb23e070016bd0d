"""Compiled code is kept on disk, so that a second start doesn't compile again; only the command line asks."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import MutableMapping, Sequence
from pathlib import Path


def use_compile_cache(environment: MutableMapping[str, str] | None = None) -> Path | None:
    """Tell JAX and Numba, before they are imported, where to keep what they compile; what the user has set stays.

    Args:
        environment: where they look for their settings; the process's own by default.

    Returns:
        JAX's folder, or None where none can be written: then every start compiles again.
    """
    settings = os.environ if environment is None else environment
    _keep_kernels(settings)
    settings.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")
    if "JAX_COMPILATION_CACHE_DIR" in settings:
        return Path(settings["JAX_COMPILATION_CACHE_DIR"])
    folder = cache_home(settings) / "jax" / _processor()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    if not os.access(folder, os.W_OK | os.X_OK):
        return None
    settings["JAX_COMPILATION_CACHE_DIR"] = str(folder)
    settings.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    settings.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
    return folder


def kernel_files(source: Path) -> list[Path]:
    """The files with kernels that Numba compiles."""
    return [path for path in sorted(source.rglob("*.py")) if "from numba import" in path.read_text()]


def kernels_hash(files: Sequence[Path]) -> str:
    """Names a state of the kernels: Numba by itself doesn't notice that one which another file calls has changed."""
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:12]


def _keep_kernels(settings: MutableMapping[str, str]) -> None:
    if "NUMBA_CACHE_DIR" in settings:
        return
    package = Path(__file__).parents[1]
    state = kernels_hash([path for part in ("walk", "reach", "navigate") for path in kernel_files(package / part)])
    folder = cache_home(settings) / "numba" / f"{_processor()}-{state}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    settings["NUMBA_CACHE_DIR"] = str(folder)


def cache_home(environment: MutableMapping[str, str]) -> Path:
    """Where toddle keeps what it can make again: XDG_CACHE_HOME, or ~/.cache, and ``toddle`` in it."""
    home = environment.get("XDG_CACHE_HOME") or Path(environment.get("HOME", os.path.expanduser("~"))) / ".cache"
    return Path(home) / "toddle"


def _processor() -> str:
    """A name for this kind of processor: machines that can't run each other's code may share a home."""
    try:
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
    except OSError:
        lines = [platform.processor()]
    features = next((line for line in lines if line.lower().startswith(("flags", "features"))), lines[0])
    return f"{platform.machine()}-{hashlib.sha256(features.encode()).hexdigest()[:12]}"
