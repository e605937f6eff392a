"""Pictures in PyBullet's form. The renderer is test code: it sees one number everywhere."""

from __future__ import annotations

import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import ModuleType

import numpy as np
import pytest

import simd_client
from simd_client.proto import GetEntityInfoRequest, NextPictureRequest, PictureTask, PutPictureRequest, methods
from simd_client.pybullet.connections import connected
from simd_client.pybullet.pictures import depth_buffer

from .conftest import SEVEN_ARM

SIZE = (4, 2)
METRES = (0.5, 1.0, 2.0, np.inf)


def answer(task: PictureTask) -> PutPictureRequest:
    """The left upper pixel is red, depths differ from column to column, and so do links."""
    width, height = task.width, task.height
    colours = np.zeros((height, width, 3), np.uint8)
    colours[0, 0] = (255, 0, 0)
    put = PutPictureRequest(id=task.id, renderer="test")
    put.color.data = colours.tobytes()
    put.depth.data = np.tile(np.array(METRES, "<f4"), (height, 1)).tobytes()
    if task.planes.segmentation:
        put.segmentation.data = np.tile(np.array([1, 2, 3, 0], "<u4"), (height, 1)).tobytes()
    return put


@contextmanager
def rendering() -> Generator[list[PictureTask]]:
    """Runs a renderer of the script's world within the context; yields its tasks."""
    ended, tasks = threading.Event(), list[PictureTask]()
    with simd_client.connect(connected(0).wire.endpoint) as client:
        client.call(methods.NextPicture, NextPictureRequest(renderer="test"))

        def draw() -> None:
            while not ended.is_set():
                found = client.call(methods.NextPicture, NextPictureRequest(renderer="test", timeout=0.2), wait=0.2)
                if found.HasField("task"):
                    tasks.append(found.task)
                    client.call(methods.PutPicture, answer(found.task))

        thread = threading.Thread(target=draw)
        thread.start()
        try:
            yield tasks
        finally:
            ended.set()
            thread.join()


def test_a_picture_is_as_pybullet_has_it(script: ModuleType) -> None:
    robot = script.loadURDF(str(SEVEN_ARM), useFixedBase=True)
    near, far = 0.25, 10.0
    view = script.computeViewMatrix([2, 0, 1], [0, 0, 1], [0, 0, 1])
    projection = script.computeProjectionMatrixFOV(60, 2.0, near, far)
    with rendering() as tasks:
        width, height, colours, depths, bodies = script.getCameraImage(
            *SIZE, view, projection, lightDirection=[0, 0, 3], lightAmbientCoeff=0.9
        )
        linked = script.getCameraImage(*SIZE, view, projection, flags=script.ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX)[4]
        plain = script.getCameraImage(*SIZE, view, projection, flags=script.ER_NO_SEGMENTATION_MASK)[4]
    assert (width, height) == SIZE
    assert (colours.shape, colours.dtype) == ((2, 4, 4), np.uint8)
    assert colours[0, 0].tolist() == [255, 0, 0, 255] and colours[1, 3].tolist() == [0, 0, 0, 255]
    # Inverse of the manual's formula: depth = far near / (far - (far - near) buffer).
    assert (depths.shape, depths.dtype) == ((2, 4), np.float32)
    back = far * near / (far - (far - near) * depths[0, :3].astype(np.float64))
    np.testing.assert_allclose(back, METRES[:3], rtol=1e-5)
    assert depths[1, 3] == 1.0
    assert bodies.dtype == np.int32 and bodies[0].tolist() == [robot, robot, robot, -1]
    names = {script.getBodyInfo(robot)[0].decode(): -1}
    for joint in range(script.getNumJoints(robot)):
        names[script.getJointInfo(robot, joint)[12].decode()] = joint
    name = connected(0).bodies[robot].robot
    entity = connected(0).wire.call(methods.GetEntityInfo, GetEntityInfoRequest(robot=name)).entity
    links = [link.name for link in entity.links][:3]
    assert linked[0].tolist() == [robot + ((names[link] + 1) << 24) for link in links] + [-1]
    assert (plain == -1).all()
    first = tasks[0]
    assert list(first.view) == pytest.approx(view) and list(first.projection) == pytest.approx(projection)
    assert (first.light.direction.z, first.light.ambient, first.light.diffuse) == (3.0, 0.9, 0.35)
    assert (first.near, first.far) == pytest.approx((near, far))


def test_a_depth_buffer_ends_at_the_planes(script: ModuleType) -> None:
    numbers: list[float] = script.computeProjectionMatrix(-1, 1, -1, 1, 0.5, 8.0)
    projection = np.array(numbers, np.float64).reshape(4, 4, order="F")
    buffer = depth_buffer(np.array([[0.5, 8.0, 100.0, 0.1, np.inf]], np.float32), projection)
    np.testing.assert_allclose(buffer, [[0.0, 1.0, 1.0, 0.0, 1.0]], atol=1e-6)


def test_impossible_cameras_are_refused(script: ModuleType) -> None:
    for arguments in ((0, 3), (4097, 3), (4, 3, [1.0] * 15)):
        with pytest.raises(script.error, match="getCameraImage"):
            script.getCameraImage(*arguments)


def test_matrices_of_no_camera_are_an_empty_picture(script: ModuleType, capfd: pytest.CaptureFixture[str]) -> None:
    """PyBullet draws something, or nothing, for any numbers."""
    view = script.computeViewMatrix([1, 1, 1], [0, 0, 0], [0, 0, 1])
    unit = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    for projection in (unit, script.computeProjectionMatrixFOV(60, 1, 0, 10), script.computeProjectionMatrixFOV(60, 1, 10, 1)):
        columns, rows, colours, depths, bodies = script.getCameraImage(4, 3, view, projection)
        assert (columns, rows, colours.shape) == (4, 3, (3, 4, 4))
        assert (depths == 1.0).all() and (bodies == -1).all()
    assert "a picture is empty: projection is one from 1 m to -1 m" in capfd.readouterr().err
