"""Where compiled code is kept: the user's wish first, a folder of ours next, nowhere without a word."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from toddle.outside.compile_cache import use_compile_cache


def test_the_folder_is_the_users_cache(tmp_path: Path) -> None:
    settings = {"XDG_CACHE_HOME": str(tmp_path)}
    folder = use_compile_cache(settings)
    assert folder is not None
    assert folder.is_dir()
    assert folder.is_relative_to(tmp_path / "toddle" / "jax")
    assert settings["JAX_COMPILATION_CACHE_DIR"] == str(folder)
    assert settings["XLA_PYTHON_CLIENT_PREALLOCATE"] == "false"
    home: dict[str, str] = {"HOME": str(tmp_path)}
    assert use_compile_cache(home) == tmp_path / ".cache" / "toddle" / "jax" / folder.name


def test_what_the_user_has_set_stays(tmp_path: Path) -> None:
    settings = {
        "JAX_COMPILATION_CACHE_DIR": str(tmp_path),
        "NUMBA_CACHE_DIR": str(tmp_path),
        "XLA_PYTHON_CLIENT_PREALLOCATE": "true",
    }
    before = dict(settings)
    assert use_compile_cache(settings) == tmp_path
    assert settings == before


def test_a_place_that_cannot_be_written_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    settings = {"XDG_CACHE_HOME": str(tmp_path / "file")}
    assert use_compile_cache(settings) is None
    assert "JAX_COMPILATION_CACHE_DIR" not in settings


def test_a_second_process_finds_what_the_first_compiled(tmp_path: Path) -> None:
    script = (
        "from toddle.outside.compile_cache import use_compile_cache; use_compile_cache();"
        "import jax, jax.monitoring as m; hits = [];"
        "m.register_event_listener(lambda event, **_: hits.append(event));"
        "jax.jit(lambda x: x * 3 + 1)(1.0).block_until_ready();"
        "print(hits.count('/jax/compilation_cache/cache_hits'))"
    )
    ours = {key: value for key, value in os.environ.items() if not key.startswith("JAX_")}
    environment = {**ours, "XDG_CACHE_HOME": str(tmp_path), "JAX_PLATFORMS": "cpu"}
    said = [
        subprocess.run(
            [sys.executable, "-W", "error", "-c", script],
            env=environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
        for _ in range(2)
    ]
    assert [int(run.stdout) for run in said] == [0, 1]
    assert said[1].stderr == ""
