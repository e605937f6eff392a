"""Cameras. Their pictures have the number of steps in each pixel."""

from __future__ import annotations

import numpy as np
import pytest
from daemon import Daemon
from renderer import EYE, rendering

import simd_client
from simd_client import Robot, Simulation, aio, projection_matrix, view_matrix


def test_a_camera_sees_the_step_that_was_asked_for(daemon: Daemon, sim: Simulation, arm: Robot) -> None:
    arm.sensors.create(EYE, "eye", rate=100)
    camera = arm.cameras.get("eye")
    with rendering(daemon):
        for step in (5, 6):
            sim.step(5 if step == 5 else 1)
            picture = camera.picture()
            assert (picture.stamp.step, picture.width, picture.height, picture.renderer) == (step, 4, 3, "test")
            assert picture.color is not None and picture.depth is not None and picture.segmentation is None
            assert picture.color.shape == (3, 4, 3) and (picture.color == step).all()
            assert picture.depth.dtype == np.float32 and (picture.depth == step).all()
        assert arm.cameras.picture().sequence == picture.sequence, "the world stands still"
        with pytest.raises(simd_client.SensorNotFound):
            arm.cameras.picture("nose")
        assert [each.name for each in sim.cameras.renderers()] == ["test"]
    (info,) = sim.cameras.list()
    assert (info.robot, info.name, info.rate, info.renderer, info.newest) == ("arm", "eye", 100.0, "test", picture.stamp)
    assert arm.cameras.list() == (info,)
    focal = 2.0 / np.tan(0.6)
    assert picture.intrinsics is not None
    np.testing.assert_allclose(picture.intrinsics.matrix, [[focal, 0, 1.5], [0, focal, 1], [0, 0, 1]])


def test_pictures_come_at_the_rate_of_the_camera(daemon: Daemon, sim: Simulation, arm: Robot) -> None:
    arm.sensors.create(EYE, "eye", rate=100)
    with rendering(daemon), arm.cameras.get("eye").pictures() as pictures:
        with pytest.raises(simd_client.PictureTimeout):
            pictures.wait(0.05)
        for step in (10, 20):
            sim.step(10)
            assert next(pictures).stamp.step == step


def test_a_picture_is_taken_from_anywhere(daemon: Daemon, sim: Simulation, arm: Robot) -> None:
    with rendering(daemon):
        picture = sim.take_picture((1, 1, 1), (0, 0, 0), width=8, height=4, depth=True, segmentation=True)
        np.testing.assert_allclose(picture.view, view_matrix((1, 1, 1), (0, 0, 0)))
        np.testing.assert_allclose(picture.projection, projection_matrix(1.0, 2.0, 0.05, 100.0))
        assert picture.segmentation is not None and picture.mask("arm", 0).all() and not picture.mask("arm", 1).any()
        with pytest.raises(ValueError, match="leg"):
            picture.mask("leg")
        with pytest.raises(simd_client.InvalidValue, match="view"):
            sim.cameras.take(np.zeros((4, 4)), projection_matrix(1.0, 1.0, 0.1, 1.0), 4, 4)


def test_matrices_are_those_of_opengl() -> None:
    view = view_matrix((1, 2, 3), (1, 5, 3))
    # Points ahead are at -z, and points above at y.
    np.testing.assert_allclose(view @ [1, 4, 3.5, 1], [0, 0.5, -2, 1], atol=1e-12)
    projection = projection_matrix(np.pi / 2, 2.0, 1.0, 5.0)
    for point, seen in (((0, 0, -1), (0, 0, -1)), ((0, 0, -5), (0, 0, 1)), ((4, 2, -2), (1, 1, 0.25))):
        clip = projection @ [*point, 1]
        np.testing.assert_allclose(clip[:3] / clip[3], seen, atol=1e-12)
    with pytest.raises(ValueError, match="another place"):
        view_matrix((1, 2, 3), (1, 2, 3))


def test_without_a_renderer_the_sentence_says_what_to_start() -> None:
    with Daemon("--paused") as alone, simd_client.connect(alone.endpoint) as sim:
        with pytest.raises(simd_client.NoRenderer, match="simd-camera --endpoint"):
            sim.take_picture((1, 1, 1), (0, 0, 0))


async def test_pictures_are_awaited(daemon: Daemon, sim: Simulation, arm: Robot) -> None:
    arm.sensors.create(EYE, "eye")
    sim.step(3)
    with rendering(daemon):
        async with aio.connect(daemon.endpoint) as asynchronous:
            robot = await asynchronous.robot("arm")
            picture = await robot.cameras.picture("eye")
            assert picture.stamp.step == 3
