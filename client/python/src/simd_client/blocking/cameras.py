# Generated from simd_client/aio/cameras.py by tools/make_blocking.py; do not edit.
"""Cameras of robots, and pictures from any viewpoint. A renderer, `simd-camera`, draws them."""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType

import numpy.typing as npt

from simd_client import proto
from simd_client.blocking.connection import Connection
from simd_client.attributes import FixedAttributes
from simd_client.errors import PictureTimeout
from simd_client.picture import (
    CameraInfo,
    CameraPicture,
    PictureLight,
    RendererInfo,
    camera_from_proto,
    light_to_proto,
    matrix_to_proto,
    picture_from_proto,
    renderer_from_proto,
)
from simd_client.proto import methods

# Wall seconds that one call waits for the next picture.
_TURN = 10.0


class Camera(FixedAttributes):
    """A camera of a robot."""

    def __init__(self, connection: Connection, robot: str, name: str) -> None:
        self._connection = connection
        self._robot = robot
        self._name = name

    @property
    def robot(self) -> str:
        """The robot's name."""
        return self._robot

    @property
    def name(self) -> str:
        """The sensor's name. Empty: the robot's only camera."""
        return self._name

    def picture(self, timeout: float = 10.0) -> CameraPicture:
        """Returns a picture of the present state or a later one; after `step`, of exactly that step. Raises
        `NoRenderer`, `PictureTimeout`, `PictureFailed`."""
        request = proto.GetPictureRequest(robot=self._robot, sensor=self._name, timeout=timeout)
        answer = self._connection.call(methods.GetPicture, request, wait=timeout)
        return picture_from_proto(answer.picture)

    def pictures(self, after: int = 0) -> PictureStream:
        """Iterates over pictures at the camera's rate, from now on or after a sequence. The newest wins:
        pictures that were not drawn in time are left out."""
        return PictureStream(self._connection, self._robot, self._name, after)

    def __repr__(self) -> str:
        return f"<Camera {self._robot}/{self._name}>"


class Cameras(FixedAttributes):
    """The cameras of a robot: its sensors of the kind `CameraSensor`."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._robot = robot

    def list(self) -> tuple[CameraInfo, ...]:
        """Returns the cameras, with statistics of drawn pictures."""
        cameras, _ = listed_cameras(self._connection)
        return tuple(camera for camera in cameras if camera.robot == self._robot)

    def get(self, name: str = "") -> Camera:
        """Returns the camera with this name; without a name, the robot's only camera. The camera's existence
        is checked when a picture is requested."""
        return Camera(self._connection, self._robot, name)

    def picture(self, name: str = "", timeout: float = 10.0) -> CameraPicture:
        """Returns a picture of the present state, like `Camera.picture`."""
        return self.get(name).picture(timeout)


class WorldCameras(FixedAttributes):
    """The cameras of all robots, and pictures from any point of view."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def list(self) -> tuple[CameraInfo, ...]:
        """Returns the cameras, with statistics of drawn pictures."""
        cameras, _ = listed_cameras(self._connection)
        return cameras

    def renderers(self) -> tuple[RendererInfo, ...]:
        """Returns the programs that draw pictures of this world."""
        _, renderers = listed_cameras(self._connection)
        return renderers

    def take(
        self,
        view: npt.ArrayLike,
        projection: npt.ArrayLike,
        width: int,
        height: int,
        *,
        color: bool = True,
        depth: bool = False,
        segmentation: bool = False,
        light: PictureLight | None = None,
        timeout: float = 10.0,
    ) -> CameraPicture:
        """Returns a picture of the present state. `view` is camera_from_world and `projection`
        clip_from_camera, with OpenGL's conventions, as `view_matrix` and `projection_matrix` return them.
        Sixteen numbers are read column by column. Raises `NoRenderer`, `PictureTimeout`, `PictureFailed`,
        `InvalidValue`."""
        request = proto.TakePictureRequest(
            view=matrix_to_proto(view, "a view"),
            projection=matrix_to_proto(projection, "a projection"),
            width=width,
            height=height,
            planes=proto.PicturePlanes(color=color, depth=depth, segmentation=segmentation),
            light=None if light is None else light_to_proto(light),
            timeout=timeout,
        )
        answer = self._connection.call(methods.TakePicture, request, wait=timeout)
        return picture_from_proto(answer.picture)


class PictureStream(FixedAttributes, Iterator[CameraPicture]):
    """Iterates over the pictures of a camera at its rate. It needs no `close`: the daemon follows the camera
    for five seconds after the last request. Belongs to one thread.
    """

    def __init__(self, connection: Connection, robot: str, camera: str, after: int) -> None:
        self._connection = connection
        self._robot = robot
        self._camera = camera
        self._after = after
        self._is_open = True

    def __iter__(self) -> PictureStream:
        return self

    def __next__(self) -> CameraPicture:
        """Returns the next picture."""
        while self._is_open:
            try:
                return self.wait(_TURN)
            except PictureTimeout:
                # A paused world has no next picture.
                continue
        raise StopIteration

    def wait(self, timeout: float) -> CameraPicture:
        """Returns the next picture. Raises `PictureTimeout` if none arrives within `timeout` seconds, and
        `NoRenderer`."""
        request = proto.GetPictureRequest(
            robot=self._robot,
            sensor=self._camera,
            moment=proto.PictureMoment.PICTURE_MOMENT_NEXT,
            after_sequence=self._after,
            timeout=timeout,
        )
        answer = self._connection.call(methods.GetPicture, request, wait=timeout)
        picture = picture_from_proto(answer.picture)
        self._after = picture.sequence
        return picture

    def close(self) -> None:
        """Ends the iteration."""
        self._is_open = False

    def __enter__(self) -> PictureStream:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def listed_cameras(connection: Connection) -> tuple[tuple[CameraInfo, ...], tuple[RendererInfo, ...]]:
    """Returns the cameras of all robots, and the renderers."""
    answer = connection.call(methods.ListCameras, proto.ListCamerasRequest())
    cameras = tuple(camera_from_proto(each) for each in answer.cameras)
    return cameras, tuple(renderer_from_proto(each) for each in answer.renderers)
