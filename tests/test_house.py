"""The house itself: versions agree, the licence and the types ship, the command line starts at once."""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import json
import re
import statistics
import subprocess
import sys
import time
import tomllib
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


def test_one_version_everywhere() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    newest = re.search(r"^## \[([^\]]+)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest is not None
    assert newest[1] == version
    assert importlib.metadata.version("toddle") == version


def test_the_licence_is_the_whole_apache_2() -> None:
    text = (ROOT / "LICENSE").read_text()
    assert "Version 2.0, January 2004" in text
    assert "END OF TERMS AND CONDITIONS" in text


def test_the_types_ship() -> None:
    assert (ROOT / "src/toddle/py.typed").is_file()


def test_help_answers_within_half_a_second() -> None:
    command = [sys.executable, "-c", "from toddle.cli import main; main(['--help'])"]
    times = []
    for _ in range(5):
        start = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, timeout=60)
        times.append(time.perf_counter() - start)
    assert statistics.median(times) < 0.5


def test_importing_toddle_imports_nothing_heavy() -> None:
    script = "import sys, toddle; print(sorted({'jax', 'mujoco', 'matplotlib'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True, timeout=60)
    assert done.stdout == "[]\n"


def test_the_readme_opens_with_the_loops_a_run_and_a_test() -> None:
    first_screen = "\n".join((ROOT / "README.md").read_text().splitlines()[:24])
    for part in ("the control loop", "the learning loop", "make demo", "make test"):
        assert part in first_screen


@pytest.fixture
def get_uv() -> ModuleType:
    spec = importlib.util.spec_from_file_location("get_uv", ROOT / "scripts" / "get_uv.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("platform", "machine", "libc", "wheel"),
    [
        ("linux", "x86_64", "glibc", "uv-1-py3-none-manylinux_2_17_x86_64.manylinux2014_x86_64.whl"),
        ("linux", "x86_64", "", "uv-1-py3-none-musllinux_1_1_x86_64.whl"),
        ("linux", "aarch64", "glibc", "uv-1-py3-none-manylinux_2_17_aarch64.musllinux_1_1_aarch64.whl"),
        ("linux", "aarch64", "", "uv-1-py3-none-manylinux_2_17_aarch64.musllinux_1_1_aarch64.whl"),
        ("darwin", "arm64", "", "uv-1-py3-none-macosx_11_0_arm64.whl"),
    ],
)
def test_uv_is_chosen_for_the_machine(
    get_uv: ModuleType, monkeypatch: pytest.MonkeyPatch, platform: str, machine: str, libc: str, wheel: str
) -> None:
    wheels = [
        "uv-1.tar.gz",
        "uv-1-py3-none-win_amd64.whl",
        "uv-1-py3-none-macosx_11_0_arm64.whl",
        "uv-1-py3-none-manylinux_2_17_aarch64.musllinux_1_1_aarch64.whl",
        "uv-1-py3-none-manylinux_2_17_x86_64.manylinux2014_x86_64.whl",
        "uv-1-py3-none-musllinux_1_1_x86_64.whl",
    ]
    monkeypatch.setattr(get_uv.sys, "platform", platform)
    monkeypatch.setattr(get_uv.platform, "machine", lambda: machine)
    monkeypatch.setattr(get_uv.platform, "libc_ver", lambda: (libc, ""))
    assert [name for name in wheels if get_uv.fits(name)] == [wheel]


@pytest.mark.parametrize("altered", [False, True])
def test_uv_is_taken_only_with_the_right_checksum(
    get_uv: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, altered: bool
) -> None:
    wheel = tmp_path / "uv-1-py3-none-manylinux_2_17_x86_64.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("uv-1.data/scripts/uv", "#!/bin/sh\necho uv 1\n")
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    index = tmp_path / "index.json"
    checksum = digest[::-1] if altered else digest
    file = {"filename": wheel.name, "url": wheel.name, "digests": {"sha256": checksum}}
    index.write_text(json.dumps({"urls": [file]}))
    monkeypatch.setattr(get_uv, "INDEX", index.as_uri())
    monkeypatch.setattr(get_uv, "fits", lambda name: True)
    if altered:
        with pytest.raises(RuntimeError, match="checksum"):
            get_uv.by_download(str(tmp_path / "scratch"))
    else:
        get_uv.keep(get_uv.by_download(str(tmp_path / "scratch")), str(tmp_path / "tools" / "bin" / "uv"))
        assert subprocess.check_output([tmp_path / "tools" / "bin" / "uv"], text=True) == "uv 1\n"
