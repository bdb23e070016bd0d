"""Robots that other packages hold: the iCub of icub-models, and whatever robot_descriptions knows.

Both packages are extras. robot_descriptions fetches a robot's files from the network when its module is
imported, so that happens only when that very robot is asked for, and every failure of it becomes one line.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType

from toddle.failures import BadInput, MissingExtra
from toddle.robots import files
from toddle.robots.chain import Chain

ICUB_MODEL = "iCubGazeboV2_5"
ICUB_TIP = "r_hand_dh_frame"  # in the palm; r_hand itself sits in the wrist, where the last joint can't move it


def icub_arm(tip: str | None = None, base: str | None = None, joints: Sequence[str] | None = None) -> Chain:
    """The right arm of the iCub, from its chest to its hand: seven joints.

    Args:
        tip: another link to watch; None: ``r_hand_dh_frame``, in the palm.
        base: another link to start from; None: ``chest``. From ``root_link`` the three joints of the torso
            join in.
        joints: names of the actuated joints; None: all of them.

    Raises:
        MissingExtra: the package icub-models is not installed.
    """
    try:
        import icub_models
    except ImportError:
        raise MissingExtra("icub-models", "icub", what_for="icub_arm") from None
    path = Path(icub_models.get_model_file(ICUB_MODEL))
    arm = files.read(path, tip=tip or ICUB_TIP, base=base or "chest", joints=joints)
    return replace(arm, name="icub_arm")


def descriptions() -> Mapping[str, object]:
    """The names that robot_descriptions knows; none where it is not installed. Fetches nothing."""
    try:
        from robot_descriptions import DESCRIPTIONS
    except ImportError:
        return {}
    return DESCRIPTIONS


def full_name(name: str) -> str | None:
    """The one description that a name stands for: its own, or the only one that begins like it.

    Raises:
        BadInput: a short name stands for several.
    """
    known = descriptions()
    if name in known:
        return name
    found = [full for full in (f"{name}_description", f"{name}_mj_description") if full in known]
    if len(found) > 1:
        raise BadInput(
            f"robot_descriptions has {len(found)} robots called {name!r}",
            remedy=f"name one: {', '.join(found)}",
        )
    return found[0] if found else None


def described(name: str, tip: str | None = None, base: str | None = None, joints: Sequence[str] | None = None) -> Chain:
    """A robot of the package robot_descriptions, which fetches what is not here from the network.

    Args:
        name: a name in full, such as ``panda_mj_description``.
        tip: the link whose position is reported.
        base: the link in whose frame it is reported.
        joints: names of the actuated joints.

    Raises:
        BadInput: the files can't be had, are of no format that is read, or can't be used.
    """
    module = _fetched(name)
    path = getattr(module, "URDF_PATH", None) or getattr(module, "MJCF_PATH", None)
    if not path:
        raise BadInput("it has neither a URDF nor an MJCF file", where=name, remedy="choose another description")
    return files.read(Path(path), tip=tip, base=base, joints=joints)


def _fetched(name: str) -> ModuleType:
    """Import the description's module, which may clone a repository and talk about it on standard output."""
    asks = os.environ.get("GIT_TERMINAL_PROMPT")
    os.environ["GIT_TERMINAL_PROMPT"] = "0"  # a password prompt would wait for ever
    try:
        with contextlib.redirect_stdout(sys.stderr):
            return importlib.import_module(f"robot_descriptions.{name}")
    except Exception as error:
        reason = next((line.strip() for line in str(error).splitlines() if "fatal" in line), str(error))
        raise BadInput(
            f"its files can't be had ({type(error).__name__}: {reason[:200]})",
            where=name,
            remedy="check the network, or give the path of a URDF or MJCF file",
        ) from None
    finally:
        if asks is None:
            del os.environ["GIT_TERMINAL_PROMPT"]
        else:
            os.environ["GIT_TERMINAL_PROMPT"] = asks
