"""Get uv, without root and without touching anything outside one folder: ``python3 get_uv.py .tools``.

Leaves FOLDER/bin/uv. Runs on any Python from 3.8 on, with nothing but the standard library, and tries in turn
what a bare machine may lack: a virtual environment with pip, pip alone, and PyPI's index with its checksums.
"""

import hashlib
import io
import json
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import urllib.parse
import urllib.request
import zipfile

INDEX = "https://pypi.org/pypi/uv/json"


def main(folder):
    """Try each way in turn; the first whose uv runs is kept."""
    target = os.path.join(folder, "bin", "uv")
    reasons = []
    for way in (by_virtual_environment, by_pip, by_download):
        with tempfile.TemporaryDirectory() as scratch:
            try:
                keep(way(scratch), target)
                return 0
            except Exception as fault:
                reasons.append("{}: {}".format(way.__name__, " ".join(str(fault).split())[:300]))
    print("could not get uv; tried\n  " + "\n  ".join(reasons), file=sys.stderr)
    print("install it by hand: https://docs.astral.sh/uv/getting-started/installation/", file=sys.stderr)
    return 1


def by_virtual_environment(scratch):
    """A virtual environment of its own, and pip in it (Debian's python3 may lack ensurepip)."""
    call(sys.executable, "-m", "venv", scratch)
    call(os.path.join(scratch, "bin", "python"), "-m", "pip", "install", "--quiet", "uv")
    return os.path.join(scratch, "bin", "uv")


def by_pip(scratch):
    """This Python's own pip, told to install into a folder (it may be missing)."""
    call(sys.executable, "-m", "pip", "install", "--quiet", "--target", scratch, "uv")
    return os.path.join(scratch, "bin", "uv")


def by_download(scratch):
    """The wheel of this platform from PyPI, its checksum compared, unzipped."""
    with urllib.request.urlopen(INDEX, timeout=60) as answer:
        files = json.load(answer)["urls"]
    wheel = next((f for f in files if fits(f["filename"])), None)
    if wheel is None:
        raise RuntimeError("PyPI has no wheel of uv for " + sysconfig.get_platform())
    with urllib.request.urlopen(urllib.parse.urljoin(INDEX, wheel["url"]), timeout=180) as answer:
        content = answer.read()
    if hashlib.sha256(content).hexdigest() != wheel["digests"]["sha256"]:
        raise RuntimeError("the checksum of {} does not match".format(wheel["filename"]))
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        inside = next(name for name in archive.namelist() if name.endswith(".data/scripts/uv"))
        return archive.extract(inside, scratch)


def fits(filename):
    """Whether a wheel runs on this machine; one wheel may carry several platform tags."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    if sys.platform == "darwin":
        system, machine = "macosx_", "arm64" if machine == "aarch64" else machine
    else:
        system = "manylinux_" if platform.libc_ver()[0] == "glibc" else "musllinux_"
    tags = filename[: -len(".whl")].split("-")[-1].split(".") if filename.endswith(".whl") else []
    return any(tag.startswith(system) and tag.endswith("_" + machine) for tag in tags)


def call(*command):
    """Run a command; its last line is the reason when it fails."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        raise RuntimeError((done.stdout.strip().splitlines() or [f"exit code {done.returncode}"])[-1])


def keep(uv, target):
    """See the new uv run, then move it to its place in one step."""
    os.chmod(uv, 0o755)
    call(uv, "--version")
    os.makedirs(os.path.dirname(target), exist_ok=True)
    shutil.copy2(uv, target + ".new")
    os.replace(target + ".new", target)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1] if len(sys.argv) > 1 else ".tools"))
