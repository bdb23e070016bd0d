"""The rooms of `toddle.outside.simulation.stereo_scenes`: floor, walls, chairs and boxes, as MuJoCo is told of them."""

from __future__ import annotations

from typing import Any, Literal

import cv2
import mujoco
import numpy as np
from jaxtyping import Float, UInt8

Walls = Literal["rich", "medium", "plain"]

_CONTRAST = {"rich": 0.9, "medium": 0.35, "plain": 0.0}
_TEXELS = 256  # along a texture's side
_HIGH = 2.6  # [m]
_EXTINGUISHER = (0.75, 0.06, 0.05)


def furnished(seed: int, walls: Walls, pixels: int) -> mujoco.MjModel:
    """A room in front of a camera at x = 0 that looks along x.

    Args:
        seed: of everything in it.
        walls: how much there is to see on them; the furniture is textured in every room.
        pixels: side of the largest picture that is drawn.
    """
    draw = np.random.default_rng([seed, 1])
    spec: Any = mujoco.MjSpec()
    spec.visual.global_.offwidth = spec.visual.global_.offheight = pixels
    spec.visual.quality.offsamples = spec.visual.quality.shadowsize = 0
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.45] * 3, [0.35] * 3
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, dir=[draw.uniform(-0.5, 0.5), draw.uniform(-0.7, 0.7), -1],
        diffuse=[draw.uniform(0.2, 0.4)] * 3,
    )  # fmt: skip
    _shell(spec, draw, walls)
    for _ in range(int(draw.integers(3, 7))):
        ahead = draw.uniform(1.0, 2.6)
        at = np.array([ahead, draw.uniform(-0.6, 0.6) * ahead, 0.0])
        draw.choice([_chair, _box, _bottle])(spec, draw, at)
    return spec.compile()


def _shell(spec: Any, draw: np.random.Generator, walls: Walls) -> None:
    """Floor, ceiling and four walls; each is a plane that is seen from within."""
    ahead, left, right = draw.uniform(2.4, 4.5), draw.uniform(1.2, 2.5), draw.uniform(1.2, 2.5)
    middle, long, wide, half = (ahead - 1) / 2, (ahead + 1) / 2, (left + right) / 2, _HIGH / 2
    aside = (left - right) / 2
    surfaces = {
        "floor": ([middle, aside, 0], [long, wide], [0, 0, 1]),
        "ceiling": ([middle, aside, _HIGH], [long, wide], [0, 0, -1]),
        "ahead": ([ahead, aside, half], [half, wide], [-1, 0, 0]),
        "left": ([middle, left, half], [long, half], [0, -1, 0]),
        "right": ([middle, -right, half], [long, half], [0, 1, 0]),
    }
    for name, (at, size, normal) in surfaces.items():
        contrast = max(_CONTRAST[walls], 0.15 if name == "floor" else 0.0)
        material = _material(spec, draw, name, contrast, repeat=draw.uniform(0.5, 0.9), flat=True)
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE, pos=at, size=[*size, 1], quat=_facing(normal), material=material
        )


def _chair(spec: Any, draw: np.random.Generator, at: np.ndarray) -> None:
    """A seat, a back and four legs."""
    wide, seat, back = draw.uniform(0.18, 0.25), draw.uniform(0.38, 0.48), draw.uniform(0.3, 0.45)
    material = _material(spec, draw, f"chair{len(spec.geoms)}", draw.uniform(0.3, 0.9), repeat=2.0)
    body = spec.worldbody.add_body(pos=at, quat=_turned(draw.uniform(0, 2 * np.pi)))
    add = body.add_geom
    box = mujoco.mjtGeom.mjGEOM_BOX
    add(type=box, pos=[0, 0, seat], size=[wide, wide, 0.02], material=material)
    add(type=box, pos=[wide, 0, seat + back / 2], size=[0.015, wide, back / 2], material=material)
    for x, y in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        leg = [x * (wide - 0.02), y * (wide - 0.02), seat / 2]
        add(type=box, pos=leg, size=[0.016, 0.016, seat / 2], material=material)


def _box(spec: Any, draw: np.random.Generator, at: np.ndarray) -> None:
    size = draw.uniform([0.1, 0.1, 0.15], [0.25, 0.3, 0.6])
    material = _material(spec, draw, f"box{len(spec.geoms)}", draw.uniform(0.3, 0.9), repeat=2.0)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=[at[0], at[1], size[2]], size=size, material=material,
        quat=_turned(draw.uniform(0, np.pi)),
    )  # fmt: skip


def _bottle(spec: Any, draw: np.random.Generator, at: np.ndarray) -> None:
    """A fire extinguisher, or something like it."""
    half, wide = draw.uniform(0.2, 0.35), draw.uniform(0.07, 0.12)
    material = _material(spec, draw, f"bottle{len(spec.geoms)}", 0.5, repeat=2.0, colour=_EXTINGUISHER)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[at[0], at[1], half], size=[wide, half, 0], material=material
    )


def _material(
    spec: Any, draw: np.random.Generator, name: str, contrast: float, *, repeat: float, flat: bool = False,
    colour: tuple[float, float, float] | None = None,
) -> str:  # fmt: skip
    """A texture of its own, drawn at random.

    Args:
        spec: the room.
        draw: the source of chance.
        name: of texture and material.
        contrast: 0 (one colour) to 1.
        repeat: how often it is repeated along a metre.
        flat: for a plane; else for a solid, the same on all sides.
        colour: its mean; None for one at random.
    """
    mean = np.array(colour) if colour else draw.uniform(0.35, 0.75, 3)
    picture = _texture(draw, mean, contrast)
    kind = mujoco.mjtTexture.mjTEXTURE_2D if flat else mujoco.mjtTexture.mjTEXTURE_CUBE
    sides = picture if flat else np.concatenate([picture] * 6)
    texture = spec.add_texture(name=name, type=kind, width=_TEXELS, height=len(sides), nchannel=3)
    texture.data = sides.tobytes()
    material = spec.add_material(name=name, texuniform=True, texrepeat=[repeat, repeat], specular=0.1, shininess=0.1)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    return name


def _texture(
    draw: np.random.Generator, mean: Float[np.ndarray, "3"], contrast: float
) -> UInt8[np.ndarray, "rows columns 3"]:
    """Blots of five sizes around a mean colour; seamless, so that it can be repeated."""
    grain = np.zeros((_TEXELS, _TEXELS, 3), np.float32)
    for size in (8, 16, 32, 64, 128):
        small = draw.uniform(-1, 1, (size, size, 3)).astype(np.float32)
        small = 0.75 * small.mean(axis=2, keepdims=True) + 0.25 * small
        wrapped = np.pad(small, ((1, 1), (1, 1), (0, 0)), mode="wrap")
        step = _TEXELS // size
        large = cv2.resize(wrapped, None, fx=step, fy=step, interpolation=cv2.INTER_CUBIC)
        grain += large[step:-step, step:-step] * np.float32((8 / size) ** 0.25)
    return np.clip(255 * (mean + 0.4 * contrast * grain), 8, 247).astype(np.uint8)


def _facing(normal: Any) -> Float[np.ndarray, "4"]:
    """A quaternion that turns z into a normal."""
    found = np.empty(4)
    mujoco.mju_quatZ2Vec(found, np.asarray(normal, float))
    return found


def _turned(yaw: float) -> Float[np.ndarray, "4"]:
    return np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
