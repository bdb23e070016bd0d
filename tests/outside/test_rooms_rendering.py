"""Rooms in physics: drawn and cast pictures agree, the cameras are pinholes, and what stands there can be touched."""

from __future__ import annotations

import functools
import math

import mujoco
import numpy as np
import pytest
from box_biped import biped as without_eyes
from scipy import ndimage

from toddle.failures import BadInput, ToddleError
from toddle.navigate.scenarios.draw_rooms import room
from toddle.navigate.scenarios.raycast import CHEST_CAMERAS, resized
from toddle.navigate.scenarios.rooms import Room, Scenario, Split, Style
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.simulation.rooms import LEFT, RIGHT, room_simulation
from toddle.outside.simulation.stereo_cameras import CastCamera, StereoCamera, eye, open_cameras
from toddle.robots.humanoid import Humanoid
from toddle.robots.humanoids import load_humanoid
from toddle.signals import Circle

CASES: list[tuple[Scenario, Split, Style]] = [
    ("straight", "train", "seen"),
    ("person", "validation", "seen"),
    ("decoys", "test", "unseen"),
]


@functools.cache
def heicub() -> Humanoid:
    return load_humanoid("heicub")


@pytest.fixture(scope="module", params=CASES, ids=lambda case: "-".join(case))
def stage(request: pytest.FixtureRequest) -> tuple[Room, HumanoidSimulation]:
    scenario, split, style = request.param
    drawn = room(scenario, split, 7, style)
    return drawn, room_simulation(heicub(), drawn)


def drawing(simulation: HumanoidSimulation, width: int, height: int) -> StereoCamera:
    try:
        return StereoCamera(simulation, width, height)
    except ToddleError as refused:
        pytest.skip(refused.line)


@pytest.mark.parametrize(("width", "height"), [(320, 240), (80, 60)])
def test_drawn_and_cast_agree_but_at_edges(stage: tuple[Room, HumanoidSimulation], width: int, height: int) -> None:
    drawn, simulation = stage
    camera = drawing(simulation, width, height)
    seen, cast = camera.see(), CastCamera(simulation, drawn, width, height).view()
    camera.close()
    off = np.abs(seen.depth - cast.depth)
    low, high = ndimage.minimum_filter(cast.depth, 3) - 0.002, ndimage.maximum_filter(cast.depth, 3) + 0.002
    assert ((seen.depth < low) | (seen.depth > high)).mean() < 1e-4
    assert np.median(off) < 2e-5
    assert (off > 0.01).mean() < 0.005
    smooth = high - low < 0.1 * cast.depth
    assert smooth.mean() > 0.7
    colour = np.abs(seen.left.astype(int) - cast.picture)
    assert colour[smooth].mean() < 8
    shifted = np.abs(np.roll(seen.left, width // 8, axis=1).astype(int) - cast.picture)
    assert colour.mean() < 0.6 * shifted.mean()


def test_a_point_is_drawn_where_a_pinhole_has_it(stage: tuple[Room, HumanoidSimulation]) -> None:
    """The target's middle, seen from the left and from the right camera, by K [R | t]."""
    drawn, simulation = stage
    camera = CastCamera(simulation, drawn, 320, 240)
    radius = drawn.target.parts[0].half[0]
    for name in (LEFT, RIGHT):
        view, place = camera.view(name), eye(simulation, name)
        rows, columns = np.nonzero(view.thing == 0)
        if len(rows) < 50:
            pytest.skip("the target is hardly in view")
        middle = np.array([drawn.target.x, drawn.target.y, 0.25])
        u, v, w = CHEST_CAMERAS.camera.matrix @ (place.axes.T @ (middle - place.position))
        row = rows == round(v / w)
        assert row.any()
        assert columns[row].mean() == pytest.approx(u / w, abs=236.0 * radius / w)
    between = eye(simulation, RIGHT).position - eye(simulation, LEFT).position
    assert eye(simulation).axes.T @ between == pytest.approx([CHEST_CAMERAS.baseline, 0.0, 0.0], abs=1e-9)


def test_the_right_picture_is_the_left_one_moved_by_the_disparity(stage: tuple[Room, HumanoidSimulation]) -> None:
    drawn, simulation = stage
    camera = CastCamera(simulation, drawn, 320, 240)
    left, right = camera.view(LEFT), camera.view(RIGHT)
    disparity = 236.0 * CHEST_CAMERAS.baseline / left.depth
    columns = np.rint(np.arange(320)[None] - disparity).astype(int)
    rows = np.broadcast_to(np.arange(240)[:, None], columns.shape)
    inside = columns >= 0
    there = right.depth[rows[inside], columns[inside]]
    assert np.median(np.abs(there - left.depth[inside])) < 0.01
    assert (np.abs(there - left.depth[inside]) < 0.05).mean() > 0.85


def test_left_is_left_in_both_ways(stage: tuple[Room, HumanoidSimulation]) -> None:
    drawn, simulation = stage
    cast = CastCamera(simulation, drawn, 160, 120)
    pair, left, right = cast.see(), cast.view(LEFT), cast.view(RIGHT)
    assert (pair.left == left.picture).all()
    assert (pair.right == right.picture).all()
    assert (pair.depth == left.depth).all()
    camera = drawing(simulation, 160, 120)
    seen = camera.see()
    camera.close()
    for picture, same, other in ((seen.left, left, right), (seen.right, right, left)):
        near, far = (np.abs(picture.astype(int) - view.picture).mean() for view in (same, other))
        assert near < 0.7 * far


def test_the_drawn_size_is_the_cameras() -> None:
    simulation = room_simulation(heicub(), room("curve", "train", 1))
    camera = drawing(simulation, 160, 120)
    seen = camera.see()
    assert seen.left.shape == seen.right.shape == (120, 160, 3)
    assert seen.depth.shape == (120, 160)
    assert camera.cameras.camera == resized(CHEST_CAMERAS.camera, 160, 120)
    assert seen.left.std() > 5
    assert (seen.left != seen.right).mean() > 0.1
    camera.close()
    with pytest.raises(ToddleError, match="the cameras are closed"):
        camera.see()


def test_a_room_changes_nothing_that_is_not_touched() -> None:
    """The same servo targets move the robot the same way, bit for bit, in a room and on the bare floor."""
    simulations = HumanoidSimulation(heicub()), room_simulation(heicub(), room("search", "train", 2))
    ends = []
    for simulation in simulations:
        simulation.reset()
        target = simulation.humanoid.home[7:].copy()
        for tick in range(30):
            simulation.tick(target + 0.02 * math.sin(0.3 * tick))
        assert not simulation.touched.any()
        ends.append(simulation.data.qpos.copy())
    assert (ends[0] == ends[1]).all()


def test_furniture_and_walls_are_touched(stage: tuple[Room, HumanoidSimulation]) -> None:
    drawn, simulation = stage
    home = simulation.humanoid.home
    walls = drawn.hall
    edge = np.array([walls.x, walls.y]) + (walls.half[0] + 0.03) * np.array([math.cos(walls.yaw), math.sin(walls.yaw)])
    places = [(drawn.target.x, drawn.target.y), (drawn.things[0].x, drawn.things[0].y), tuple(edge.tolist())]
    simulation.reset()
    assert not simulation.truth().touching.any()
    clear = float(simulation.truth().clearance.min())
    assert clear > 0.2
    for x, y in places:
        q = home.copy()
        q[:2] = x, y
        simulation.reset(q)
        found = simulation.truth()
        assert found.touching.any()
        assert found.clearance.min() < 0
    simulation.reset()


def test_the_clearance_is_that_of_the_nearest_pair(stage: tuple[Room, HumanoidSimulation]) -> None:
    """Every geom of the robot against every one that stands around, without any shortcut."""
    drawn, simulation = stage
    model, data = simulation.model, simulation.data
    stands = np.flatnonzero(model.geom_contype & 2).tolist()
    robot = [geom for geom in range(model.ngeom) if model.geom_conaffinity[geom] and model.geom_bodyid[geom]]
    nearest = []
    for thing in drawn.standing[:2]:
        q = simulation.humanoid.home.copy()
        q[:2] = thing.x - thing.radius - 0.3, thing.y
        simulation.reset(q)
        every = [mujoco.mj_geomDistance(model, data, one, other, 1.0, None) for one in robot for other in stands]
        nearest.append(min(every))
        assert simulation.truth().clearance.min() == pytest.approx(min(every), abs=1e-6)
    assert min(nearest) < 0.5
    simulation.reset()


def test_people_are_moved_and_felt_and_seen() -> None:
    drawn = room("person", "train", 3)
    simulation = room_simulation(heicub(), drawn)
    camera = CastCamera(simulation, drawn)
    number = len(drawn.standing)
    ahead = 1.0, 0.0
    simulation.move(0, *ahead)
    assert (camera.view().thing == number).sum() > 200
    simulation.move(0, 0.0, 0.0)
    simulation.tick(simulation.humanoid.home[7:])
    assert simulation.touched.any()
    drawn_one = drawing(simulation, 80, 60)
    simulation.reset()
    simulation.move(0, *ahead)
    near = drawn_one.see().depth
    simulation.move(0, -4.0, 0.0)
    assert (drawn_one.see().depth > near + 0.3).mean() > 0.05
    drawn_one.close()


def test_without_gl_rays_take_over(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("no OpenGL platform")

    drawn = room("straight", "train", 1)
    simulation = room_simulation(heicub(), drawn)
    monkeypatch.setattr("mujoco.MjrContext", broken)
    camera = open_cameras(simulation, drawn, 80, 60)
    assert isinstance(camera, CastCamera)
    seen = camera.see()
    assert seen.left.shape == seen.right.shape == (60, 80, 3)
    camera.close()
    with pytest.raises(BadInput, match="0 x 60 pixels"):
        open_cameras(simulation, drawn, 0, 60)


def test_what_is_no_room_simulation_is_refused() -> None:
    with pytest.raises(BadInput, match="circles of its own"):
        room_simulation(heicub(), room("straight", "train", 1), WorldOptions(circles=(Circle(1.0, 0.0, 0.1),)))
    with pytest.raises(BadInput, match="no cameras left_eye"):
        room_simulation(without_eyes(), room("straight", "train", 1))
    with pytest.raises(BadInput, match="no cameras on its chest"):
        StereoCamera(HumanoidSimulation(heicub()))
