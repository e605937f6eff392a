"""Pictures of the world: colours, depths, and visible links, as numpy arrays."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.errors import AnswerError
from simd_client.geometry import FloatArray
from simd_client.world import Stamp, stamp_from_proto

ColorImage = npt.NDArray[np.uint8]
"""Rows, columns, and red, green and blue."""

DepthImage = npt.NDArray[np.float32]
"""Rows and columns: metres along the optical axis, inf where nothing is seen."""

LinkImage = npt.NDArray[np.uint32]
"""Rows and columns: 0 where nothing is seen, else the number of a link."""


@dataclass(frozen=True)
class Intrinsics:
    """Intrinsics of a pinhole camera, pixels: u = fx x / z + cx and v = fy y / z + cy, with z forwards and y
    down. The centre of the upper left pixel is at 0, 0."""

    fx: float
    fy: float
    cx: float
    cy: float

    @property
    def matrix(self) -> FloatArray:
        """Returns `K` of ROS's `CameraInfo`: 3 x 3."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class PictureLight:
    """Direction and colour of the light, and its reflection by surfaces."""

    direction: Sequence[float] = (-0.5, 0.3, 1.0)
    """Towards the light, world axes."""
    color: Sequence[float] = (1.0, 1.0, 1.0)
    """Red, green and blue from 0 to 1."""
    ambient: float = 0.6
    """Ambient light, 0 to 1."""
    diffuse: float = 0.35
    """Diffuse light, by the cosine of its angle, 0 to 1."""
    specular: float = 0.05
    """Specular light, 0 to 1."""
    shadow: bool = False
    """Whether shadowed surfaces get only ambient light. Other renderers than `simd-camera` may not draw
    shadows."""


@dataclass(frozen=True)
class PictureRobot:
    """Numbers of a robot's links in a segmentation."""

    robot: str
    first_link: int
    """Number of its link 0."""
    links: int
    """Number of its links."""


@dataclass(frozen=True)
class CameraPicture:
    """Picture of a camera."""

    sequence: int
    """Larger than every earlier picture's."""
    stamp: Stamp
    """Stamp of the drawn state."""
    width: int
    height: int
    color: ColorImage | None
    """Colours; `None` if not requested, like the next two."""
    depth: DepthImage | None
    segmentation: LinkImage | None
    robots: tuple[PictureRobot, ...]
    """Links by the numbers of `segmentation`."""
    view: FloatArray
    """camera_from_world, 4 x 4. The camera looks along -z, with x to the right and y up."""
    projection: FloatArray
    """clip_from_camera, 4 x 4."""
    intrinsics: Intrinsics | None
    """Intrinsics of a robot's camera."""
    near: float
    """Near limit of view, metres."""
    far: float
    """Far limit of view, metres."""
    renderer: str
    """Name of the renderer."""

    def mask(self, robot: str, link: int | None = None) -> npt.NDArray[np.bool_]:
        """Returns the pixels of a robot, or of one of its links by its index. Raises `ValueError` without a
        segmentation, or for a robot that was absent."""
        if self.segmentation is None:
            raise ValueError("the picture has no segmentation: ask for one")
        for of in self.robots:
            if of.robot == robot:
                first, last = (0, of.links - 1) if link is None else (link, link)
                return (self.segmentation >= of.first_link + first) & (self.segmentation <= of.first_link + last)
        raise ValueError(f"robot `{robot}` was not there: {', '.join(of.robot for of in self.robots) or 'none was'}")


@dataclass(frozen=True)
class CameraInfo:
    """A camera of a robot."""

    robot: str
    name: str
    width: int
    height: int
    intrinsics: Intrinsics
    rate: float | None
    """Pictures per simulated second. `None`: one each step."""
    followed: bool
    """Whether pictures are drawn at its rate because a client wants them."""
    newest: Stamp | None
    """Stamp of its newest picture."""
    last_sequence: int
    """Sequence of its newest picture; 0 without one."""
    renderer: str
    """Renderer of its newest picture."""
    drawn: int
    """Number of pictures drawn at its rate."""
    missed: int
    """Number of due pictures that were not drawn."""


@dataclass(frozen=True)
class RendererInfo:
    """A program that draws pictures."""

    name: str
    drawn: int
    drawing: int
    """Number of assigned pictures that it has not drawn yet."""
    failed: int
    """Number of pictures that it failed to draw."""


def picture_from_proto(message: proto.CameraPicture) -> CameraPicture:
    """Unpacks a picture. Raises `AnswerError` if its size is wrong."""
    height, width = message.height, message.width

    def plane(name: str, dtype: str, depth: int) -> bytes | None:
        if not message.HasField(name):  # pyright: ignore[reportArgumentType]
            return None
        expected = height * width * depth * np.dtype(dtype).itemsize
        return _unpacked(getattr(message, name), expected, name)

    color, metres, links = plane("color", "u1", 3), plane("depth", "<f4", 1), plane("segmentation", "<u4", 1)
    return CameraPicture(
        sequence=message.sequence,
        stamp=stamp_from_proto(message.stamp),
        width=width,
        height=height,
        color=None if color is None else np.frombuffer(color, np.uint8).reshape(height, width, 3),
        depth=None if metres is None else np.frombuffer(metres, "<f4").reshape(height, width),
        segmentation=None if links is None else np.frombuffer(links, "<u4").reshape(height, width),
        robots=tuple(PictureRobot(of.robot, of.first_link, of.links) for of in message.robots),
        view=matrix_from_proto(message.view),
        projection=matrix_from_proto(message.projection),
        intrinsics=intrinsics_from_proto(message.intrinsics) if message.HasField("intrinsics") else None,
        near=message.near,
        far=message.far,
        renderer=message.renderer,
    )


def _unpacked(plane: proto.PicturePlane, expected: int, name: str) -> bytes:
    data = plane.data
    if plane.compression == proto.PlaneCompression.PLANE_COMPRESSION_ZLIB:
        unpacker = zlib.decompressobj()
        try:
            data = unpacker.decompress(data, expected + 1)
        except zlib.error as problem:
            raise AnswerError(f"the daemon's answer cannot be understood: the {name} of a picture is broken: {problem}") from None
    elif plane.compression != proto.PlaneCompression.PLANE_COMPRESSION_UNSPECIFIED:
        raise AnswerError(f"the daemon's answer cannot be understood: the {name} of a picture is packed in an unknown way")
    if len(data) != expected:
        raise AnswerError(f"the daemon's answer cannot be understood: the {name} of a picture has another size")
    return data


def matrix_from_proto(values: Sequence[float]) -> FloatArray:
    """Returns a 4 x 4 matrix from numbers in column order."""
    return np.reshape(np.array(values, dtype=np.float64), (4, 4), order="F")


def matrix_to_proto(matrix: npt.ArrayLike, what: str) -> list[float]:
    """Returns the numbers of a 4 x 4 matrix, column by column; sixteen numbers are returned unchanged."""
    array = np.asarray(matrix, dtype=np.float64)
    if array.shape not in ((4, 4), (16,)):
        raise ValueError(f"{what} is 4 x 4, not the shape {array.shape}")
    return [float(value) for value in array.flatten(order="F")]


def intrinsics_from_proto(message: proto.CameraIntrinsics) -> Intrinsics:
    """Converts a camera's intrinsics."""
    return Intrinsics(message.fx, message.fy, message.cx, message.cy)


def light_to_proto(light: PictureLight) -> proto.PictureLight:
    """Converts a light to a message."""
    x, y, z = light.direction
    red, green, blue = light.color
    return proto.PictureLight(
        direction=proto.Vector3(x=x, y=y, z=z),
        color=proto.Color(red=red, green=green, blue=blue, alpha=1.0),
        ambient=light.ambient,
        diffuse=light.diffuse,
        specular=light.specular,
        shadow=light.shadow,
    )


def camera_from_proto(message: proto.CameraInfo) -> CameraInfo:
    """Converts a camera of a robot."""
    return CameraInfo(
        robot=message.robot,
        name=message.sensor,
        width=message.camera.width,
        height=message.camera.height,
        intrinsics=intrinsics_from_proto(message.intrinsics),
        rate=message.rate if message.HasField("rate") else None,
        followed=message.followed,
        newest=stamp_from_proto(message.newest) if message.HasField("newest") else None,
        last_sequence=message.last_sequence,
        renderer=message.renderer,
        drawn=message.drawn,
        missed=message.missed,
    )


def renderer_from_proto(message: proto.RendererInfo) -> RendererInfo:
    """Converts a program that draws pictures."""
    return RendererInfo(message.name, message.drawn, message.drawing, message.failed)


def view_matrix(eye: npt.ArrayLike, target: npt.ArrayLike, up: npt.ArrayLike = (0.0, 0.0, 1.0)) -> FloatArray:
    """Returns camera_from_world of a camera at `eye` that looks at `target`, metres and world axes, like
    `gluLookAt`. Raises `ValueError` if it looks at itself or along `up`."""
    begin, above = np.asarray(eye, dtype=np.float64), np.asarray(up, dtype=np.float64)
    back = begin - np.asarray(target, dtype=np.float64)
    right = np.cross(above, back)
    if np.linalg.norm(back) == 0.0 or np.linalg.norm(right) == 0.0:
        raise ValueError("a camera looks at another place than its own, and not along `up`")
    back, right = back / np.linalg.norm(back), right / np.linalg.norm(right)
    turn = np.stack([right, np.cross(back, right), back])
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = turn, -turn @ begin
    return view


def projection_matrix(field_of_view: float, aspect: float, near: float, far: float) -> FloatArray:
    """Returns clip_from_camera of a camera with a vertical field of view, rad, and width by height, like
    `gluPerspective`."""
    if not (0.0 < field_of_view < np.pi and aspect > 0.0 and 0.0 < near < far):
        raise ValueError("a field of view is between 0 and pi, and `near` is above 0 and below `far`")
    focal, depth = 1.0 / np.tan(0.5 * field_of_view), far - near
    projection = np.zeros((4, 4))
    projection[0, 0], projection[1, 1] = focal / aspect, focal
    projection[2, 2], projection[2, 3] = -(far + near) / depth, -2.0 * far * near / depth
    projection[3, 2] = -1.0
    return projection
