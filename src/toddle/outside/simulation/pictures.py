"""Pictures of a simulated humanoid, where the machine can draw: from around it, or through its own eyes."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from jaxtyping import UInt8

from toddle.failures import BadInput, ToddleError, unknown_name
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.signals import Footstep

VIEWS = {
    "side": (115.0, -12.0, 3.4),
    "front": (200.0, -12.0, 3.4),
    "behind": (20.0, -15.0, 3.4),
    "above": (90.0, -80.0, 5.0),
}
"""Azimuth and elevation [degrees] of cameras that follow the robot, and their distance in heights of its waist."""

_LARGEST = 1920, 1080
_GEOMS = 2000  # that a scene may hold, footprints among them
_COLOURS = (0.16, 0.44, 0.70, 0.55), (0.85, 0.45, 0.13, 0.55)  # of the left and the right foot's prints
_THICK = 0.0008  # of a footprint [m]


class Camera:
    """Draws one simulation, picture by picture."""

    def __init__(
        self,
        simulation: HumanoidSimulation,
        width: int = 640,
        height: int = 360,
        view: str = "side",
        *,
        shadows: bool = True,
    ) -> None:
        """Opens what draws.

        Args:
            simulation: what is drawn.
            width: of the pictures [pixels], up to 1920.
            height: of the pictures [pixels], up to 1080.
            view: one of `VIEWS`, or a camera of the robot's (left_eye, right_eye).
            shadows: whether there are any; they take most of the time where no graphics card draws.

        Raises:
            BadInput: there is no such view, or the size is out of range.
            ToddleError: nothing here can draw.
        """
        if not (0 < width <= _LARGEST[0] and 0 < height <= _LARGEST[1]):
            raise BadInput(
                f"{width} x {height} pixels", where="picture", remedy=f"at most {_LARGEST[0]} x {_LARGEST[1]}"
            )
        self._simulation = simulation
        self._size = mujoco.MjrRect(0, 0, width, height)
        self._camera = _camera(simulation, view)
        self._scene = mujoco.MjvScene(simulation.model, maxgeom=_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW.value] = shadows
        self._options, self._mouse = mujoco.MjvOption(), mujoco.MjvPerturb()
        self._gl, self._context = drawing(simulation.model, width, height)

    def picture(self, footprints: Sequence[Footstep] = ()) -> UInt8[np.ndarray, "height width 3"]:
        """The simulation as it is now.

        Args:
            footprints: soles that are drawn on the floor.

        Raises:
            ToddleError: the camera is closed.
        """
        if self._context is None:
            raise ToddleError("the camera is closed", where="picture", remedy="make another one")
        simulation, scene = self._simulation, self._scene
        mujoco.mj_kinematics(simulation.model, simulation.data)
        mujoco.mj_camlight(simulation.model, simulation.data)
        if self._camera.type == mujoco.mjtCamera.mjCAMERA_FREE:
            self._camera.lookat[:2] = simulation.data.site("waist").xpos[:2]
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(
            simulation.model, simulation.data, self._options, self._mouse, self._camera, everything, scene
        )
        for footstep in footprints[-(_GEOMS - scene.ngeom) :]:
            self._print(footstep)
        self._gl.make_current()
        pixels = np.empty((self._size.height, self._size.width, 3), np.uint8)
        mujoco.mjr_render(self._size, scene, self._context)
        mujoco.mjr_readPixels(pixels, None, self._size, self._context)
        return np.ascontiguousarray(pixels[::-1])

    def close(self) -> None:
        """Give back what draws."""
        if self._context is not None:
            self._gl.make_current()
            self._context.free()
            self._gl.free()
            self._context = None

    def _print(self, footstep: Footstep) -> None:
        gait, scene = self._simulation.humanoid.gait, self._scene
        cos, sin = math.cos(footstep.yaw), math.sin(footstep.yaw)
        middle = [footstep.x + cos * gait.foot_ahead, footstep.y + sin * gait.foot_ahead, _THICK]
        mujoco.mjv_initGeom(
            scene.geoms[scene.ngeom],
            mujoco.mjtGeom.mjGEOM_BOX,
            np.array([gait.foot_length / 2, gait.foot_width / 2, _THICK]),
            np.array(middle),
            np.array([cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0]),
            np.array(_COLOURS[footstep.side], np.float32),
        )
        scene.ngeom += 1


def _camera(simulation: HumanoidSimulation, view: str) -> mujoco.MjvCamera:
    model = simulation.model
    own = {model.camera(number).name: number for number in range(model.ncam)}
    camera = mujoco.MjvCamera()
    if view in own:
        camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, own[view]
    elif view in VIEWS:
        waist = float(simulation.data.site("waist").xpos[2])
        camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        camera.azimuth, camera.elevation, camera.distance = VIEWS[view]
        camera.distance *= waist
        camera.lookat[2] = 0.85 * waist
    else:
        raise unknown_name("view", view, [*VIEWS, *own], where=simulation.humanoid.name)
    return camera


def drawing(model: mujoco.MjModel, width: int, height: int) -> tuple[Any, Any]:
    """An OpenGL context and MuJoCo's; without a screen, and nothing said, that is EGL."""
    headless = sys.platform == "linux" and not any(os.environ.get(name) for name in ("MUJOCO_GL", "DISPLAY"))
    try:
        if headless:
            from mujoco.egl import GLContext
        else:
            from mujoco.gl_context import GLContext
        gl = GLContext(width, height)
        gl.make_current()
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, context)
    # what a machine without OpenGL raises is up to its libraries: ImportError, AttributeError, RuntimeError, FatalError
    except Exception as fault:
        reason = str(fault).partition("\n")[0] or type(fault).__name__
        raise ToddleError(
            f"nothing here can draw ({reason})",
            where="picture",
            remedy="install EGL or OSMesa and set MUJOCO_GL to egl or osmesa; toddle doctor tells what works",
        ) from fault
    return gl, context
