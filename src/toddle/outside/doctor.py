"""What this machine has and lacks, each lack with the command that mends it.

Whatever may hang or crash (a graphics driver, an accelerator's runtime) is asked in a process of its own, with
a time limit.
"""

from __future__ import annotations

import os
import platform
import re
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from toddle.outside.compile_cache import cache_home

_TIME_LIMIT = 60  # [s] for one question to another process; a cold import of JAX takes some

_ASK_JAX = "import jax; print(', '.join(f'{d.platform}:{d.id} {d.device_kind}' for d in jax.devices()))"
_ASK_GL = """\
import mujoco
model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><geom size="1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.Renderer(model, 16, 16)
renderer.update_scene(data)
assert renderer.render().any()
print("draws")
"""
_ASK_FFMPEG = "import imageio_ffmpeg as film; print(film.get_ffmpeg_version())"
_ASK_HUMANOID = """\
from toddle.robots.humanoids import load_humanoid
robot = load_humanoid("heicub")
print(f"{len(robot.joints)} joints, {robot.mass:.2f} kg")
"""


@dataclass(frozen=True)
class Finding:
    """One part of the machine.

    Attributes:
        part: its name.
        present: whether it is there and works.
        found: its version or its state, or what is wrong with it.
        core: whether nothing works without it.
        remedy: the command that mends a lack.
    """

    part: str
    present: bool
    found: str
    core: bool = False
    remedy: str = ""


def examine() -> tuple[Finding, ...]:
    """Look at this machine; takes a few seconds, most of them for the first picture of each GL backend."""
    slow: tuple[Callable[[], Finding], ...] = (_jax_devices, _gl_backend, _ffmpeg, _humanoid)
    with ThreadPoolExecutor(len(slow)) as pool:
        asked = [pool.submit(ask) for ask in slow]
        quick = [_python(), *_packages(), *_extras(), _cache(), _port(), _machine()]
        found = [answer.result() for answer in asked]
        return (*quick, *found, *(_rooms(finding) for finding in found if finding.part == "GL backend"))


def _python() -> Finding:
    good = sys.version_info >= (3, 11)
    return Finding("Python", good, platform.python_version(), True, "install Python 3.11 or newer")


def _packages() -> Iterator[Finding]:
    """What the package says it needs, and which version is there."""
    for line in requires("toddle") or []:
        if "extra ==" not in line:
            yield _package(re.split(r"[^\w.-]", line)[0], core=True)


def _extras() -> list[Finding]:
    return [
        _package("example-robot-data", remedy="pip install 'toddle[humanoids]'"),
        _package("robot-descriptions", remedy="pip install 'toddle[descriptions]'"),
    ]


def _package(name: str, *, core: bool = False, remedy: str = "") -> Finding:
    try:
        return Finding(name, True, version(name), core)
    except PackageNotFoundError:
        return Finding(name, False, "not installed", core, remedy or f"pip install {name}")


def _jax_devices() -> Finding:
    good, answer = _ask(_ASK_JAX)
    return Finding("JAX devices", good, answer, True, "pip install --upgrade --force-reinstall jax")


def _gl_backend() -> Finding:
    """The backends of MuJoCo's that draw here, the first being the one to choose."""
    with ThreadPoolExecutor(3) as pool:
        names = ("egl", "osmesa", "glfw")
        answers = list(pool.map(lambda name: _ask(_ASK_GL, MUJOCO_GL=name), names))
    working = [name for name, (good, _) in zip(names, answers, strict=True) if good]
    if not working:
        remedy = "sudo apt-get install libegl1 libosmesa6"
        return Finding("GL backend", False, "none of egl, osmesa, glfw draws", remedy=remedy)
    chosen = os.environ.get("MUJOCO_GL")
    if chosen in (None, "") or chosen in working:
        return Finding("GL backend", True, ", ".join(working))
    return Finding("GL backend", False, f"MUJOCO_GL={chosen} draws nothing", remedy=f"export MUJOCO_GL={working[0]}")


def _rooms(backend: Finding) -> Finding:
    """What makes pictures of the rooms that robots walk in; small ones can be made on every machine."""
    way = f"drawn by {backend.found.split(', ')[0]}" if backend.present else "small ones only, by rays instead of GL"
    return Finding("room pictures", True, way)


def _cache() -> Finding:
    folder = cache_home(os.environ)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder):
            return Finding("cache folder", True, str(folder))
    except OSError as fault:
        remedy = f"export XDG_CACHE_HOME={Path(tempfile.gettempdir()) / 'cache'}"
        return Finding("cache folder", False, f"{folder}: {fault.strerror}", remedy=remedy)


def _port() -> Finding:
    try:
        with socket.create_server(("127.0.0.1", 0)) as server:
            return Finding("loopback port", True, f"free, for example {server.getsockname()[1]}")
    except OSError as fault:
        return Finding("loopback port", False, str(fault.strerror), remedy="sudo ip link set lo up")


def _machine() -> Finding:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return Finding("machine", True, f"{cores} cores, {memory:.0f} GiB, {platform.system()} {platform.machine()}")


def _ffmpeg() -> Finding:
    """What writes films; the package imageio-ffmpeg brings it along."""
    good, answer = _ask(_ASK_FFMPEG)
    return Finding("ffmpeg", good, answer, remedy="pip install --force-reinstall imageio-ffmpeg")


def _humanoid() -> Finding:
    """The robot that walks when none is named, read with all its meshes."""
    good, answer = _ask(_ASK_HUMANOID)
    return Finding("heicub", good, answer, remedy="pip install --force-reinstall icub-models")


def _ask(code: str, **environment: str) -> tuple[bool, str]:
    """Run Python code in a process of its own: whether it ended well, and the last line it said."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_TIME_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {_TIME_LIMIT} s"
    said = (done.stdout if done.returncode == 0 else done.stderr).strip().splitlines()
    return done.returncode == 0, said[-1] if said else f"exit code {done.returncode}"
