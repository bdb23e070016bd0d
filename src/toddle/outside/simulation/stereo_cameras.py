"""The pair of cameras on the walking robot's chest, sway and all: what they see of a room, drawn or cast.

Both ways give pinhole pictures of the same geometry: `drawn` by MuJoCo with whatever OpenGL the machine has, `cast` by
rays where it has none. The robot's own body is not in the picture: the cameras stand in front of the chest.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float32, UInt8

from toddle.failures import BadInput, ToddleError
from toddle.geometry.camera import RectifiedCameras
from toddle.navigate.scenarios.raycast import CHEST_CAMERAS, Eye, RayCaster, View, ray_caster, resized
from toddle.navigate.scenarios.rooms import Room
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.simulation.pictures import drawing
from toddle.outside.simulation.rooms import LEFT, RIGHT

_AXES = np.diag([1.0, -1.0, -1.0])  # from MuJoCo's camera, which looks along its -z, to OpenCV's
_GEOMS = 500  # that a scene may hold


class StereoPicture(NamedTuple):
    """What both cameras see at one moment, and the truth.

    Attributes:
        left: red, green, blue.
        right: likewise.
        depth: of the left one's pixels, along the optical axis [m].
    """

    left: UInt8[np.ndarray, "rows columns 3"]
    right: UInt8[np.ndarray, "rows columns 3"]
    depth: Float32[np.ndarray, "rows columns"]


class StereoCamera:
    """Draws what the chest's cameras see, with OpenGL.

    Attributes:
        cameras: how they look.
    """

    def __init__(self, simulation: HumanoidSimulation, width: int = 320, height: int = 240) -> None:
        """Opens what draws.

        Args:
            simulation: made by `rooms.room_simulation`.
            width: of the pictures [pixels]; 3 for each 4 of it is the height, or pixels are no squares.
            height: of the pictures [pixels].

        Raises:
            BadInput: there are no such cameras, or the size is out of range.
            ToddleError: nothing here can draw.
        """
        self.cameras = _cameras(simulation, width, height)
        self._simulation = simulation
        model = simulation.model
        self._size = mujoco.MjrRect(0, 0, width, height)
        self._views = []
        for name in (LEFT, RIGHT):
            camera = mujoco.MjvCamera()
            camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, model.camera(name).id
            self._views.append(camera)
        self._scene = mujoco.MjvScene(model, maxgeom=_GEOMS)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION, mujoco.mjtRndFlag.mjRND_HAZE):
            self._scene.flags[flag.value] = False
        self._options, self._mouse = mujoco.MjvOption(), mujoco.MjvPerturb()
        self._options.geomgroup[:] = 0
        self._options.geomgroup[0] = 1
        self._options.flags[mujoco.mjtVisFlag.mjVIS_STATIC.value] = True
        self._gl, self._context = drawing(model, width, height)
        self._near, self._far = (float(edge * model.stat.extent) for edge in (model.vis.map.znear, model.vis.map.zfar))

    def see(self) -> StereoPicture:
        """What both cameras see now.

        Raises:
            ToddleError: the cameras are closed.
        """
        if self._context is None:
            raise ToddleError("the cameras are closed", where="picture", remedy="make others")
        self._gl.make_current()
        _update(self._simulation)
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        model, data = self._simulation.model, self._simulation.data
        mujoco.mjv_updateScene(model, data, self._options, self._mouse, self._views[0], everything, self._scene)
        left, depth = self._draw(deep=True)
        mujoco.mjv_updateCamera(model, data, self._views[1], self._scene)
        right, _ = self._draw(deep=False)
        return StereoPicture(left, right, depth)

    def close(self) -> None:
        """Give back what draws."""
        if self._context is not None:
            self._gl.make_current()
            self._context.free()
            self._gl.free()
            self._context = None

    def _draw(self, *, deep: bool) -> tuple[UInt8[np.ndarray, "rows columns 3"], Float32[np.ndarray, "rows columns"]]:
        shape = self._size.height, self._size.width
        pixels = np.empty((*shape, 3), np.uint8)
        raw = np.empty(shape, np.float32)
        mujoco.mjr_render(self._size, self._scene, self._context)
        mujoco.mjr_readPixels(pixels, raw if deep else None, self._size, self._context)
        depth = self._near / (1.0 - raw * (1.0 - self._near / self._far)) if deep else raw
        return np.ascontiguousarray(pixels[::-1]), np.ascontiguousarray(depth[::-1].astype(np.float32))


class CastCamera:
    """What the chest's cameras see, by rays: small pictures without OpenGL.

    Attributes:
        cameras: how they look.
    """

    def __init__(self, simulation: HumanoidSimulation, room: Room, width: int = 80, height: int = 60) -> None:
        """Makes the room ready for rays.

        Args:
            simulation: made by `rooms.room_simulation`.
            room: of the simulation.
            width: of the pictures [pixels].
            height: likewise.

        Raises:
            BadInput: there are no such cameras, or the size is out of range.
        """
        self.cameras = _cameras(simulation, width, height)
        self._simulation = simulation
        self._people = len(room.people)
        self._caster: RayCaster = ray_caster(room)

    def see(self) -> StereoPicture:
        """What both cameras see now."""
        left, right = self.view(LEFT), self.view(RIGHT)
        return StereoPicture(left.picture, right.picture, left.depth)

    def view(self, name: str = LEFT) -> View:
        """What one camera sees now, with the thing that each pixel shows."""
        _update(self._simulation)
        people = self._simulation.data.mocap_pos[: self._people, :2].copy()
        return self._caster.view(eye(self._simulation, name), self.cameras.camera, people)

    def close(self) -> None:
        """There is nothing to give back."""


def open_cameras(
    simulation: HumanoidSimulation, room: Room, width: int = 320, height: int = 240
) -> StereoCamera | CastCamera:
    """The chest's cameras by OpenGL where the machine has it, else by rays.

    Args:
        simulation: made by `rooms.room_simulation`.
        room: of the simulation.
        width: of the pictures [pixels].
        height: likewise.

    Raises:
        BadInput: there are no such cameras, or the size is out of range.
    """
    try:
        return StereoCamera(simulation, width, height)
    except BadInput:
        raise
    except ToddleError:
        return CastCamera(simulation, room, width, height)


def eye(simulation: HumanoidSimulation, name: str = LEFT) -> Eye:
    """Where one of the chest's cameras is, as MuJoCo last computed it."""
    number = simulation.model.camera(name).id
    axes = simulation.data.cam_xmat[number].reshape(3, 3) @ _AXES
    return Eye(simulation.data.cam_xpos[number].copy(), axes)


def _update(simulation: HumanoidSimulation) -> None:
    """Places as the configuration now is: after a step MuJoCo's are those of its start."""
    mujoco.mj_kinematics(simulation.model, simulation.data)
    mujoco.mj_camlight(simulation.model, simulation.data)


def _cameras(simulation: HumanoidSimulation, width: int, height: int) -> RectifiedCameras:
    names = {simulation.model.camera(number).name for number in range(simulation.model.ncam)}
    if LEFT not in names:
        raise BadInput("the robot has no cameras on its chest", where="picture", remedy="make it by room_simulation")
    if not (0 < width <= 1280 and 0 < height <= 960):
        raise BadInput(f"{width} x {height} pixels", where="picture", remedy="at most 1280 x 960")
    return RectifiedCameras(resized(CHEST_CAMERAS.camera, width, height), CHEST_CAMERAS.baseline)
