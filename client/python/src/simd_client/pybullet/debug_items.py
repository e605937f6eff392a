"""PyBullet's debug lines, points and texts: the daemon's markers, which its page draws."""

from __future__ import annotations

from typing import Any

from simd_client.proto import Color, Marker, MarkerLines, MarkerPoints, MarkerText, Quaternion, Vector3

from .arguments import ORIGIN, UPRIGHT, Pose, Vector, floats, quaternion, vector
from .connections import connected
from .errors import error
from .rotations import compose
from .world import World

# Height in metres of a text of size 1.
_TEXT = 0.1
# Limits of the daemon: CSS pixels, bytes, seconds.
_WIDEST = 100.0
_LONGEST = 1024
_YEAR = 365.0 * 86400.0


def addUserDebugLine(
    lineFromXYZ: Any,
    lineToXYZ: Any,
    lineColorRGB: Any = None,
    lineWidth: float = 1.0,
    lifeTime: float = 0.0,
    parentObjectUniqueId: int = -1,
    parentLinkIndex: int = -1,
    replaceItemUniqueId: int = -1,
    physicsClientId: int = 0,
) -> int:
    """Draws a line in the page, its width in CSS pixels, for `lifeTime` wall seconds (0: until it is
    removed). Returns its number."""
    world = connected(physicsClientId)
    frame, marker = _begin(world, lineColorRGB, lifeTime, parentObjectUniqueId, parentLinkIndex)
    ends = [vector(lineFromXYZ, "Error converting lineFrom[3]"), vector(lineToXYZ, "Error converting lineTo[3]")]
    points = [number for end in ends for number in _placed(frame, end)]
    marker.lines.CopyFrom(MarkerLines(points=points, width=_pixels(lineWidth)))
    return _draw(world, marker, replaceItemUniqueId)


def addUserDebugPoints(
    pointPositions: Any,
    pointColorsRGB: Any,
    pointSize: float = 1.0,
    lifeTime: float = 0.0,
    parentObjectUniqueId: int = -1,
    parentLinkIndex: int = -1,
    replaceItemUniqueId: int = -1,
    physicsClientId: int = 0,
) -> int:
    """Draws points in the page, their size in CSS pixels. Returns one number for all of them."""
    world = connected(physicsClientId)
    frame, marker = _begin(world, None, lifeTime, parentObjectUniqueId, parentLinkIndex)
    positions = [vector(each, "pointPositions must be a list of 3 numbers each") for each in _rows(pointPositions)]
    colors = [vector(each, "pointColorsRGB must be a list of 3 numbers each") for each in _rows(pointColorsRGB)]
    if not positions or len(positions) != len(colors):
        raise error("Number of positions and colors must be the same and above 0.")
    points = [number for each in positions for number in _placed(frame, each)]
    shades = [_share(number) for each in colors for number in each]
    marker.points.CopyFrom(MarkerPoints(points=points, colors=shades, size=_pixels(pointSize)))
    return _draw(world, marker, replaceItemUniqueId)


def addUserDebugText(
    text: str,
    textPosition: Any,
    textColorRGB: Any = None,
    textSize: float = 1.0,
    lifeTime: float = 0.0,
    textOrientation: Any = None,
    parentObjectUniqueId: int = -1,
    parentLinkIndex: int = -1,
    replaceItemUniqueId: int = -1,
    physicsClientId: int = 0,
) -> int:
    """Draws a text in the page, a tenth of `textSize` metres high; without an orientation it faces the camera. Returns its
    number."""
    world = connected(physicsClientId)
    frame, marker = _begin(world, textColorRGB, lifeTime, parentObjectUniqueId, parentLinkIndex)
    position = vector(textPosition, "Error converting textPositionObj[3]")
    turn = UPRIGHT
    if textOrientation is not None:
        turn = quaternion(textOrientation, "Error converting textOrientation[4]")
    (x, y, z), (qx, qy, qz, qw) = compose(frame, (position, turn))
    words = "".join(letter if letter.isprintable() else " " for letter in str(text))
    # A long text is cut; an empty one draws nothing.
    words = words.encode()[:_LONGEST].decode(errors="ignore") or " "
    size = min(max(float(textSize), 1e-3), 1e4) * _TEXT
    marker.text.CopyFrom(MarkerText(text=words, position=Vector3(x=x, y=y, z=z), size=size))
    if textOrientation is not None:
        marker.text.orientation.CopyFrom(Quaternion(x=qx, y=qy, z=qz, w=qw))
    return _draw(world, marker, replaceItemUniqueId)


def removeUserDebugItem(itemUniqueId: int, physicsClientId: int = 0) -> None:
    """Removes a drawing, a slider or a button."""
    world = connected(physicsClientId)
    if not world.sliders.remove(itemUniqueId):
        world.drawings.remove(itemUniqueId)


def removeAllUserDebugItems(physicsClientId: int = 0) -> None:
    """Removes the script's drawings. Sliders stay, as in PyBullet."""
    connected(physicsClientId).drawings.remove_all()


def _begin(world: World, color: Any, life_time: float, parent: int, link: int) -> tuple[Pose, Marker]:
    """Returns common properties of markers, and link_from_inertia of the link that they move with: PyBullet's
    positions are relative to centers of mass."""
    marker = Marker(life_time=min(max(float(life_time), 0.0), _YEAR))
    shades = [] if color is None else floats(color, "Error converting lineColorRGB[3]")
    # As in PyBullet, a color of another length means none.
    if len(shades) == 3:
        red, green, blue = (_share(each) for each in shades)
        marker.color.CopyFrom(Color(red=red, green=green, blue=blue, alpha=1.0))
    body = world.bodies.get(parent)
    name = body.link_name(link) if body is not None else None
    # As in PyBullet, an item on an unknown body stays in the world.
    if body is None or name is None:
        return (ORIGIN, UPRIGHT), marker
    marker.robot, marker.link = body.robot, name
    return body.frame(name), marker


def _draw(world: World, marker: Marker, replaced: int) -> int:
    number = replaced if replaced >= 0 else world.sliders.number()
    world.drawings.draw(number, marker)
    return number


def _placed(frame: Pose, point: Vector) -> Vector:
    return compose(frame, (point, UPRIGHT))[0]


def _rows(values: Any) -> list[Any]:
    try:
        return list(values)
    except TypeError:
        raise error("addUserDebugPoints needs lists of positions and of colors") from None


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)


def _pixels(width: float) -> float:
    return min(max(floats([width], "a width must be a number")[0], 0.1), _WIDEST)


__all__ = [
    "addUserDebugLine",
    "addUserDebugPoints",
    "addUserDebugText",
    "removeAllUserDebugItems",
    "removeUserDebugItem",
]
