"""What a measurement ran on, in words, for those who read its figures."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def machine_in_words() -> str:
    """Such as "2 cores, AMD EPYC, Linux x86_64, JAX on cpu"."""
    import jax

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    device = jax.devices()[0]
    on = "cpu" if device.platform == "cpu" else f"{device.platform} ({device.device_kind})"
    return ", ".join(
        filter(None, [f"{cores} cores", _processor(), f"{platform.system()} {platform.machine()}", f"JAX on {on}"])
    )


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
