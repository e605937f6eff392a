"""Drawings of programs in pages, the pages' cameras, and people's input by keys and mouse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.geometry import FloatArray, vector, vector_from_proto, vector_to_proto
from simd_client.state import Named, name_of

MarkerKind = Literal["lines", "points", "text"]
"""Kind of a marker."""

MouseButton = Literal["left", "middle", "right"]
"""A button of a mouse."""

_BUTTONS: dict[proto.MouseButton, MouseButton] = {
    proto.MouseButton.MOUSE_BUTTON_LEFT: "left",
    proto.MouseButton.MOUSE_BUTTON_MIDDLE: "middle",
    proto.MouseButton.MOUSE_BUTTON_RIGHT: "right",
}


@dataclass(frozen=True, eq=False)
class Marker:
    """A drawing in the pages."""

    id: int
    kind: MarkerKind
    points: FloatArray
    """Points in metres: for lines (N, 2, 3), both ends of each; for points (N, 3); for a text (1, 3), its
    beginning."""
    text: str = ""
    """Text of a text marker."""
    colors: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    """Red, green, blue of each line or point, (N, 3) or (0, 3)."""
    color: tuple[float, float, float] | None = None
    """Red, green, blue of everything without separate colours. `None`: a colour that is visible in the
    page."""
    size: float = 1.0
    """For lines and points CSS pixels, for a text the height of a line in metres."""
    robot: str = ""
    """Robot that it moves with; empty: none."""
    link: str = ""
    """Link of the robot; empty: its root link."""
    life_time: float | None = None
    """Remaining wall seconds; `None`: it stays."""
    owner: str = ""
    """Creator, for people."""


@dataclass(frozen=True, eq=False)
class ViewCamera:
    """Camera of an open page."""

    client: str
    """The page's name."""
    position: FloatArray
    """World axes, metres."""
    target: FloatArray
    """Point that it orbits: world axes, metres."""
    up: FloatArray
    """World axes, of unit length."""
    field_of_view: float
    """Vertical field of view, radians."""
    width: int
    """Width of the picture, CSS pixels."""
    height: int
    """Height of the picture, CSS pixels."""
    age: float
    """Wall seconds since it last moved."""
    followed_version: int
    """Return value of the newest `set_camera` that the page has followed; 0: none."""


@dataclass(frozen=True)
class KeyEvent:
    """A key went down or up in a page. Repetitions of a held key are left out."""

    sequence: int
    client: str
    """The page's name."""
    key: str
    """`KeyboardEvent.key` of browsers: `a`, `A`, `ArrowUp`, `F1`."""
    code: str
    """`KeyboardEvent.code`, the position of the key regardless of its label: `KeyA`."""
    is_down: bool


@dataclass(frozen=True)
class MouseEvent:
    """The mouse moved over the picture of a page, or one of its buttons went down or up."""

    sequence: int
    client: str
    """The page's name."""
    x: float
    """Distance from the left of the picture, CSS pixels."""
    y: float
    """Distance from its top, CSS pixels."""
    button: MouseButton | None
    """Button; `None`: it moved."""
    is_down: bool
    """Whether the button went down."""


@dataclass(frozen=True)
class Input:
    """Keys and mouse after a sequence."""

    sequence: int
    """Sequence to continue from."""
    events: tuple[KeyEvent | MouseEvent, ...] = ()
    """Events in order."""
    missed: bool = False
    """Whether earlier events were lost: the daemon keeps the last 1,024."""


def drawn(points: npt.ArrayLike, shape: tuple[int, ...], what: str) -> list[float]:
    """Packs points as numbers. Raises `ValueError` for an array of another form than (N, *shape)."""
    array = np.asarray(points, dtype=np.float32)
    if array.shape == shape:
        array = array[None]
    if array.shape[1:] != shape or len(array) == 0:
        wanted = ", ".join(str(each) for each in shape)
        raise ValueError(f"{what} is of the form (N, {wanted}), not {array.shape}")
    return array.ravel().tolist()


def marker_to_proto(
    *,
    color: npt.ArrayLike | None,
    robot: str | Named | None,
    link: str,
    life_time: float | None,
    replace: int | None,
) -> proto.Marker:
    """Common properties of all markers."""
    marker = proto.Marker(
        id=replace or 0,
        robot="" if robot is None else name_of(robot),
        link=link,
        life_time=life_time or 0.0,
    )
    if color is not None:
        red, green, blue = vector(color, 3, "a colour (red green blue)").tolist()
        marker.color.CopyFrom(proto.Color(red=red, green=green, blue=blue, alpha=1.0))
    return marker


def marker_from_proto(message: proto.Marker) -> Marker:
    """Converts from its message."""
    shape: Any = {}
    kind: MarkerKind = "lines"
    if message.HasField("text"):
        kind, text = "text", message.text
        shape = {"points": vector_from_proto(text.position)[None], "text": text.text, "size": text.size}
    elif message.HasField("points"):
        kind, points = "points", message.points
        shape = {"points": _rows(points.points, 3), "colors": _rows(points.colors, 3), "size": points.size}
    else:
        lines = message.lines
        ends = _rows(lines.points, 6).reshape(-1, 2, 3)
        shape = {"points": ends, "colors": _rows(lines.colors, 3), "size": lines.width}
    color = message.color
    return Marker(
        id=message.id,
        kind=kind,
        color=(color.red, color.green, color.blue) if message.HasField("color") else None,
        robot=message.robot,
        link=message.link,
        life_time=message.life_time or None,
        owner=message.owner,
        **shape,
    )


def _rows(values: Any, columns: int) -> FloatArray:
    return np.array(values, dtype=np.float64).reshape(-1, columns)


def camera_from_proto(message: proto.PageCamera) -> ViewCamera:
    """Converts from its message."""
    camera = message.camera
    return ViewCamera(
        client=message.client,
        position=vector_from_proto(camera.position),
        target=vector_from_proto(camera.target),
        up=vector_from_proto(camera.up),
        field_of_view=camera.field_of_view,
        width=camera.width,
        height=camera.height,
        age=message.age,
        followed_version=message.followed_version,
    )


def camera_to_proto(
    position: npt.ArrayLike, target: npt.ArrayLike, field_of_view: float | None
) -> proto.SetCameraRequest:
    """Builds the request that moves cameras."""
    return proto.SetCameraRequest(
        position=vector_to_proto(position, "a position"),
        target=vector_to_proto(target, "a target"),
        field_of_view=field_of_view or 0.0,
    )


def color_to_proto(robot: str, link: str, color: Sequence[float] | None) -> proto.LinkColor:
    """Converts the colour of a link, or the colour of its description. Raises `ValueError` for a colour of
    another length."""
    message = proto.LinkColor(robot=robot, link=link)
    if color is not None:
        if len(color) not in (3, 4):
            raise ValueError(f"a colour has 3 or 4 numbers, and not {len(color)}")
        red, green, blue, *alpha = map(float, color)
        message.color.CopyFrom(proto.Color(red=red, green=green, blue=blue, alpha=alpha[0] if alpha else 1.0))
    return message


def input_from_proto(message: proto.NextInputResponse) -> Input:
    """Converts from its message."""
    events = tuple(_event(each) for each in message.events if each.WhichOneof("kind"))
    return Input(message.sequence, events, message.missed)


def _event(message: proto.InputEvent) -> KeyEvent | MouseEvent:
    if message.HasField("key"):
        key = message.key
        return KeyEvent(message.sequence, message.client, key.key, key.code, key.is_down)
    mouse = message.mouse
    button = _BUTTONS.get(mouse.button)
    return MouseEvent(message.sequence, message.client, mouse.x, mouse.y, button, mouse.is_down)
