"""The ray-caster: what it sees lies on a surface, nothing is in between, and its pixels are a pinhole's."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from toddle.geometry.camera import Pinhole
from toddle.navigate.scenarios.draw_rooms import room
from toddle.navigate.scenarios.raycast import (
    CHEST_CAMERAS,
    HEIGHT,
    PITCH,
    SMALL,
    Eye,
    chest_eye,
    ray_caster,
    resized,
    seen_things,
)
from toddle.navigate.scenarios.raycast_kernels import FAR
from toddle.navigate.scenarios.rooms import SCENARIOS, Light, Room, Solids, solids

ROOMS = [room(scenario, "train", 40) for scenario in SCENARIOS]
EYES = [chest_eye(x, y, yaw) for x, y, yaw in ((0.0, 0.0, 0.0), (0.2, -0.1, 2.0), (-0.1, 0.1, -2.4))]


def outside(parts: Solids, points: np.ndarray) -> np.ndarray:
    """Signed distance of points to the nearest solid, by its definition; negative inside."""
    nearest = np.full(points.shape[:-1], np.inf)
    for number in range(len(parts.yaw)):
        cos, sin = math.cos(parts.yaw[number]), math.sin(parts.yaw[number])
        x, y, z = np.moveaxis(points - parts.middle[number], -1, 0)
        a, b = cos * x + sin * y, cos * y - sin * x
        over = [np.hypot(a, b), z] if parts.round[number] else [a, b, z]
        half = parts.half[number, [0, 2]] if parts.round[number] else parts.half[number]
        off = np.stack([np.abs(one) for one in over], -1) - half
        distance = np.linalg.norm(np.maximum(off, 0.0), axis=-1) + np.minimum(off.max(axis=-1), 0.0)
        nearest = np.minimum(nearest, distance)
    return nearest


def rays(eye: Eye, camera: Pinhole) -> np.ndarray:
    """Through the middle of each pixel, of length 1 along the optical axis."""
    v, u = np.mgrid[: camera.height, : camera.width]
    pixels = np.stack([u, v, np.ones_like(u)], -1).astype(float)
    return pixels @ np.linalg.inv(camera.matrix).T @ eye.axes.T


@pytest.mark.parametrize("drawn", ROOMS, ids=SCENARIOS)
def test_what_is_seen_lies_on_a_surface_and_nothing_is_before_it(drawn: Room) -> None:
    parts, camera = solids(drawn), Pinhole(32, 24, 23.6, 23.6, 15.6, 11.6)
    for eye in EYES:
        view = ray_caster(drawn).view(eye, camera)
        way = rays(eye, camera)
        assert view.depth.max() < 15
        ends = eye.position + view.depth[..., None].astype(float) * way
        assert np.abs(outside(parts, ends)).max() < 1e-5
        for share in np.linspace(0.02, 0.99, 25):
            between = eye.position + share * view.depth[..., None].astype(float) * way
            assert outside(parts, between).min() > -1e-5


@pytest.mark.parametrize("drawn", ROOMS, ids=SCENARIOS)
def test_each_pixel_is_of_its_thing(drawn: Room) -> None:
    parts = solids(drawn)
    for eye in EYES:
        view = ray_caster(drawn).view(eye)
        ends = eye.position + view.depth[..., None].astype(float) * rays(eye, SMALL)
        for thing in np.unique(view.thing).tolist():
            its = Solids(*(column[parts.thing == thing] for column in parts))
            assert np.abs(outside(its, ends[view.thing == thing])).max() < 1e-5
        assert (seen_things(drawn, eye) == view.thing).all()


def test_from_outside_the_hall_is_seen_too_and_beyond_it_nothing() -> None:
    drawn = ROOMS[0]
    eye = chest_eye(drawn.hall.x + 20.0, drawn.hall.y, math.pi, pitch=0.0)
    view = ray_caster(drawn).view(eye)
    seen = view.depth < FAR
    assert 0.02 < seen.mean() < 0.9
    assert (view.picture[~seen] == 0).all()
    ends = eye.position + view.depth[..., None].astype(float) * rays(eye, SMALL)
    assert np.abs(outside(solids(drawn), ends[seen])).max() < 1e-4


def test_light_scales_the_texture() -> None:
    drawn = ROOMS[0]
    eye = EYES[0]
    full = ray_caster(replace(drawn, light=Light((1.0, 1.0, 1.0), (), ()))).view(eye).picture
    dim = ray_caster(replace(drawn, light=Light((0.5, 0.5, 0.25), (), ()))).view(eye).picture
    assert np.abs(dim - full * np.array([0.5, 0.5, 0.25])).max() <= 1
    down = ray_caster(replace(drawn, light=Light((0.0, 0.0, 0.0), ((0.0, 0.0, -1.0),), ((1.0, 1.0, 1.0),)))).view(eye)
    ends = eye.position + down.depth[..., None].astype(float) * rays(eye, SMALL)
    floor = np.abs(ends[..., 2]) < 1e-4
    assert np.abs(down.picture[floor].astype(int) - full[floor]).max() <= 1
    upright = (down.thing == len(drawn.standing) + len(drawn.people)) & (ends[..., 2] > 0.01)
    assert (down.picture[upright] == 0).all()


def test_the_target_is_red_and_its_decoys_are() -> None:
    drawn = ROOMS[SCENARIOS.index("decoys")]
    view = ray_caster(drawn).view(chest_eye(0.0, 0.0, math.atan2(drawn.target.y, drawn.target.x)))
    red, green, _ = np.moveaxis(view.picture.astype(float), -1, 0)
    assert (red - green)[view.thing == 0].max() > 60
    others = [number for number, thing in enumerate(drawn.standing) if not number or thing.kind.startswith("red")]
    assert (red - green)[~np.isin(view.thing, others)].max() < 60


def test_a_smaller_camera_keeps_the_edges() -> None:
    whole = CHEST_CAMERAS.camera
    for small in (SMALL, resized(whole, 160, 120)):
        for edge, size, large in ((small.cx, small.width, whole.cx), (small.cy, small.height, whole.cy)):
            whole_size = whole.width if size == small.width else whole.height
            focal, whole_focal = (small.fx, whole.fx) if size == small.width else (small.fy, whole.fy)
            for side in (-0.5, 1.0):
                at = side if side < 0 else size - 0.5
                whole_at = side if side < 0 else whole_size - 0.5
                assert (at - edge) / focal == pytest.approx((whole_at - large) / whole_focal)


def test_the_chest_looks_ahead_and_down() -> None:
    eye = chest_eye(1.0, 2.0, math.pi / 2)
    assert eye.axes.T @ eye.axes == pytest.approx(np.eye(3))
    assert np.linalg.det(eye.axes) == pytest.approx(1.0)
    assert eye.axes[:, 2] == pytest.approx([0.0, math.cos(PITCH), -math.sin(PITCH)])
    assert eye.axes[:, 0] == pytest.approx([1.0, 0.0, 0.0])
    assert eye.position[2] == HEIGHT
    left = chest_eye(1.0, 2.0, math.pi / 2, aside=0.034)
    assert left.position - eye.position == pytest.approx([-0.034, 0.0, 0.0])


def test_people_are_where_they_are_said_to_be() -> None:
    drawn = ROOMS[SCENARIOS.index("person")]
    caster, number = ray_caster(drawn), len(drawn.standing)
    ahead = chest_eye(0.0, 0.0, math.atan2(drawn.target.y, drawn.target.x))
    at = np.array(drawn.people[0].points[1])
    view = caster.view(ahead, people=at[None])
    depth = view.depth[view.thing == number]
    assert len(depth) > 100
    towards = np.append(at, 0.9) - ahead.position
    assert depth.min() == pytest.approx(float(towards @ ahead.axes[:, 2]), abs=0.5)
    assert (caster.view(ahead, people=np.array([[0.0, 0.0]]) - 5 * at).thing != number).all()
