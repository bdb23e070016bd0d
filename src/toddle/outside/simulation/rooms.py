"""A room around the walking robot: what MuJoCo draws of it, and what the robot can run into.

What is drawn is one mesh for each surface, which is fast; what is touched are boxes and cylinders that are not drawn.
People are obstacles of the world, which `HumanoidSimulation.move` moves: a person's number is the place in the room's
``people``. They keep the yaw that they start with.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from toddle.failures import BadInput
from toddle.navigate.scenarios.raycast import CHEST_CAMERAS, PITCH
from toddle.navigate.scenarios.rooms import Part, Room, Surface, Thing, hall_parts
from toddle.navigate.scenarios.textures import texture
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.simulation.room_meshes import Mesh, joined, mesh, turned
from toddle.outside.simulation.world import OBSTACLE
from toddle.robots.humanoid import Humanoid
from toddle.signals import Circle

SHOWN, TOUCHED = 0, 5
"""Groups of geoms: those that are drawn, and those that are not."""

LEFT, RIGHT = "left_chest_camera", "right_chest_camera"
"""Names of the cameras, where the robot's eyes are, looking down."""

_EYES = "left_eye", "right_eye"
_THING = "thing"  # begins the names of what is touched
_SOLID = 3  # stops soles and shells, as the world's obstacles do
_ZNEAR, _ZFAR = 0.03, 25.0  # [m]


def room_simulation(
    humanoid: Humanoid, room: Room, options: WorldOptions | None = None, pitch: float = PITCH
) -> HumanoidSimulation:
    """The humanoid at the start of a room.

    Args:
        humanoid: the robot.
        room: where it is.
        options: the rest of the world; without circles, for a room has its own.
        pitch: how far the chest's cameras look down [rad].

    Raises:
        BadInput: the options have circles, or the humanoid lacks something, such as cameras left_eye and right_eye.
    """
    options = options or WorldOptions()
    if options.circles:
        raise BadInput(
            "the world has circles of its own", where="room", remedy="leave them out: people take their place"
        )
    if any(humanoid.spec.camera(eye) is None for eye in _EYES):
        raise BadInput("there are no cameras left_eye and right_eye", where=humanoid.name, remedy="give it eyes")
    circles = tuple(Circle(who.looks.x, who.looks.y, who.looks.radius) for who in room.people)
    return HumanoidSimulation(humanoid, replace(options, circles=circles), lambda spec: _furnish(spec, room, pitch))


def touched_kind(simulation: HumanoidSimulation, room: Room) -> str:
    """The kind of what the robot touches now, such as wall, person, chair; something: what has no name.

    Args:
        simulation: made by `room_simulation`.
        room: of the simulation.
    """
    model, data = simulation.model, simulation.data
    for geom in data.contact.geom[: data.ncon].ravel().tolist():
        name = str(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) or "")
        if name.startswith(_THING):
            number = int(name.removeprefix(_THING).split("_")[0])
            return "wall" if number == 0 else room.standing[number - 1].kind
        if name.startswith(OBSTACLE.format("")):
            return "person"
    return "something"


def _furnish(spec: Any, room: Room, pitch: float) -> None:
    spec.geom("floor").group = TOUCHED
    for number, surface in enumerate(room.surfaces):
        _material(spec, number, surface)
    hall = Thing("hall", room.hall.x, room.hall.y, room.hall.yaw, math.inf, hall_parts(room.hall))
    _show(spec, spec.worldbody, "room", (hall, *room.standing), room.surfaces)
    for number, thing in enumerate((hall, *room.standing)):
        for place, part in enumerate(thing.parts):
            if number or 0 < part.middle[2] < room.hall.height:  # the floor is there, and nobody reaches the ceiling
                _solid(spec, f"{_THING}{number}_{place}", thing, part)
    for number, person in enumerate(room.people):
        body = spec.body(OBSTACLE.format(number))
        spec.geom(OBSTACLE.format(number)).group = TOUCHED
        looks = replace(person.looks, x=0.0, y=0.0)
        _show(spec, body, f"person{number}", (looks,), room.surfaces, -float(body.pos[2]))
    _lights(spec, room)
    _cameras(spec, pitch)


def _material(spec: Any, number: int, surface: Surface) -> None:
    pixels = texture(surface)
    made = spec.add_texture(
        name=f"surface{number}",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        width=pixels.shape[1],
        height=pixels.shape[0],
        nchannel=3,
    )
    made.data = pixels.tobytes()
    material = spec.add_material(name=f"surface{number}", specular=0.0, shininess=0.0, texrepeat=[1.0, 1.0])
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = f"surface{number}"


def _show(
    spec: Any, body: Any, name: str, things: Sequence[Thing], surfaces: Sequence[Surface], raised: float = 0.0
) -> None:
    """A mesh for each surface."""
    for number, surface in enumerate(surfaces):
        pieces: list[Mesh] = []
        for thing in things:
            parts = [part for part in thing.parts if part.surface == number]
            if parts:
                pieces.append(turned(mesh(parts, surface.tile), thing.x, thing.y, thing.yaw))
        if not pieces:
            continue
        whole, called = joined(pieces), f"{name}_{number}"
        made = spec.add_mesh(name=called, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
        made.uservert, made.usernormal = whole.vertices.ravel(), whole.normals.ravel()
        made.usertexcoord = whole.texture.ravel()
        made.userface = made.userfacenormal = made.userfacetexcoord = whole.faces.ravel()
        _ = body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=called,
            material=f"surface{number}",
            pos=[0.0, 0.0, raised],
            contype=0,
            conaffinity=0,
            group=SHOWN,
            mass=0.0,
        )


def _solid(spec: Any, name: str, thing: Thing, part: Part) -> None:
    (a, b, z), cos, sin = part.middle, math.cos(thing.yaw), math.sin(thing.yaw)
    radius, _, half = part.half
    round_ = part.shape == "cylinder"
    _ = spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER if round_ else mujoco.mjtGeom.mjGEOM_BOX,
        size=[radius, half, 0.0] if round_ else list(part.half),
        pos=[thing.x + cos * a - sin * b, thing.y + sin * a + cos * b, z],
        quat=[math.cos(thing.yaw / 2), 0.0, 0.0, math.sin(thing.yaw / 2)],
        contype=_SOLID,
        conaffinity=0,
        group=TOUCHED,
    )


def _lights(spec: Any, room: Room) -> None:
    """The room's light instead of the world's."""
    for light in list(spec.lights):
        spec.delete(light)
    for direction, colour in zip(room.light.directions, room.light.colours, strict=True):
        _ = spec.worldbody.add_light(
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            dir=list(direction),
            diffuse=list(colour),
            ambient=[0.0, 0.0, 0.0],
            specular=[0.0, 0.0, 0.0],
            castshadow=False,
        )
    look = spec.visual
    look.headlight.ambient, look.headlight.diffuse = list(room.light.ambient), [0.0, 0.0, 0.0]
    look.headlight.specular = [0.0, 0.0, 0.0]
    look.quality.shadowsize, look.quality.offsamples = 0, 0
    look.map.znear, look.map.zfar = _ZNEAR / spec.stat.extent, _ZFAR / spec.stat.extent


def _cameras(spec: Any, pitch: float) -> None:
    """Two cameras where the eyes are, turned down about their own x."""
    camera = CHEST_CAMERAS.camera
    down = np.array([math.cos(pitch / 2), -math.sin(pitch / 2), 0.0, 0.0])
    for name, eye in zip((LEFT, RIGHT), _EYES, strict=True):
        seat, turned_down = spec.camera(eye), np.zeros(4)
        mujoco.mju_mulQuat(turned_down, np.array(seat.quat), down)
        _ = seat.parent.add_camera(
            name=name,
            pos=seat.pos,
            quat=turned_down,
            resolution=[camera.width, camera.height],
            sensor_size=[camera.width * 1e-5, camera.height * 1e-5],
            focal_pixel=[camera.fx, camera.fy],
            # MuJoCo moves the picture, not the camera's axis
            principal_pixel=[(camera.width - 1) / 2 - camera.cx, (camera.height - 1) / 2 - camera.cy],
        )
