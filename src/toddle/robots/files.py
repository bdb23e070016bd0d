"""A robot from a file: what its root element says it is decides how it is read, not its name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from toddle.failures import BadInput
from toddle.robots.chain import Chain
from toddle.robots.markup import parse, read_bytes

SUFFIXES = (".urdf", ".xml", ".mjcf")
_XACRO = "{http://www.ros.org/wiki/xacro}"


def read(path: Path, *, tip: str | None = None, base: str | None = None, joints: Sequence[str] | None = None) -> Chain:
    """The chain of a URDF or MJCF file; see `urdf.read_urdf` and `mjcf.read_mjcf`.

    Raises:
        BadInput: the file is neither, can't be used, or a name is not in it.
    """
    where = str(path)
    root = parse(read_bytes(path), where)
    if root.tag == "mujoco":
        from toddle.robots import mjcf

        return mjcf.chain_of(root, path, tip=tip, base=base, joints=joints)
    if root.tag == "robot":
        from toddle.robots import urdf

        if any(isinstance(e.tag, str) and e.tag.startswith(_XACRO) for e in root.iter()):
            raise BadInput(
                "the file holds xacro macros", where=where, remedy="expand it first: xacro FILE > robot.urdf"
            )
        return urdf.chain_of(root, where, tip=tip, base=base, joints=joints)
    raise BadInput(
        f"its root element is <{root.tag}>, neither <robot> (URDF) nor <mujoco> (MJCF)",
        where=where,
        remedy="name a robot's description",
    )
