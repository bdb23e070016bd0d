"""Pictures of the humanoid: drawn where something can draw, refused in one line where nothing can."""

from __future__ import annotations

import numpy as np
import pytest
from box_biped import biped

from toddle.failures import BadInput, ToddleError
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.simulation.pictures import VIEWS, Camera
from toddle.signals import Footstep


@pytest.fixture(scope="module")
def simulation() -> HumanoidSimulation:
    return HumanoidSimulation(biped())


@pytest.mark.parametrize("view", list(VIEWS))
def test_a_picture_shows_robot_and_footprints(simulation: HumanoidSimulation, view: str) -> None:
    try:
        camera = Camera(simulation, 160, 90, view)
    except ToddleError as refused:
        pytest.skip(refused.line)
    bare = camera.picture()
    printed = camera.picture([Footstep(0, 0.3, 0.2, 0.5), Footstep(1, -0.3, -0.2, 0.5)])
    assert bare.shape == (90, 160, 3)
    assert np.std(bare) > 10
    changed = np.abs(bare.astype(int) - printed).max(axis=2) > 20
    assert 0 < changed.sum() < 0.2 * changed.size
    camera.close()
    with pytest.raises(ToddleError, match="the camera is closed"):
        camera.picture()


def test_what_is_no_view_or_no_size_is_refused(simulation: HumanoidSimulation) -> None:
    with pytest.raises(BadInput, match="did you mean side"):
        Camera(simulation, view="sid")
    with pytest.raises(BadInput, match="0 x 90 pixels"):
        Camera(simulation, 0, 90)


def test_a_machine_that_cannot_draw_says_so(simulation: HumanoidSimulation, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("no OpenGL platform")

    monkeypatch.setattr("mujoco.MjrContext", broken)
    with pytest.raises(ToddleError, match=r"nothing here can draw.*MUJOCO_GL"):
        Camera(simulation)
