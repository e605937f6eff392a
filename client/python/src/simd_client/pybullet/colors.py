"""Colours and textures of visual shapes: changeVisualShape and related functions. The daemon's page shows the
colours; textures have numbers."""

from __future__ import annotations

from typing import Any

from .arguments import floats, rgba
from .connections import connected
from .errors import error
from .loading import found
from .world import World

_NOT_DRAWN = "textures that a script loads have numbers, and are not drawn"
# "unchanged".
_NO_TEXTURE = -2


def changeVisualShape(
    objectUniqueId: int,
    linkIndex: int,
    shapeIndex: int = -1,
    textureUniqueId: int = -2,
    rgbaColor: Any = None,
    specularColor: Any = None,
    flags: int = -1,
    physicsClientId: int = 0,
) -> None:
    """Gives all shapes of a link a colour, as in PyBullet; getVisualShapeData then returns it. An unknown
    link is ignored."""
    del shapeIndex, flags
    world = connected(physicsClientId)
    if textureUniqueId not in (_NO_TEXTURE, -1):
        world.say_once(f"changeVisualShape: {_NOT_DRAWN}")
    body = world.bodies.get(objectUniqueId)
    if specularColor is not None:
        # It is not drawn, and as in PyBullet it may have any length.
        floats(specularColor, "specularColor must be numbers")
    if rgbaColor is None:
        return
    color = rgba(rgbaColor, "rgbaColor must be numbers")
    if body is None or body.link_name(linkIndex) is None:
        return
    body.colors[linkIndex] = color
    world.paint(body, linkIndex)


def resetVisualShapeData(
    objectUniqueId: int,
    linkIndex: int,
    shapeIndex: int = -1,
    textureUniqueId: int = -2,
    rgbaColor: Any = None,
    specularColor: Any = None,
    flags: int = -1,
    physicsClientId: int = 0,
) -> None:
    """Old name of changeVisualShape."""
    changeVisualShape(
        objectUniqueId, linkIndex, shapeIndex, textureUniqueId, rgbaColor, specularColor, flags, physicsClientId
    )


def loadTexture(textureFilename: str, physicsClientId: int = 0) -> int:
    """Returns the number of a picture, for changeVisualShape. It is not drawn; a missing file is an error."""
    world = connected(physicsClientId)
    world.say_once(f"loadTexture: {_NOT_DRAWN}")
    found(world, textureFilename, "Error loading texture.")
    world.textures += 1
    return world.textures - 1


def changeTexture(
    textureUniqueId: int, pixels: Any, width: int, height: int, physicsClientId: int = 0
) -> None:
    """Replaces a picture's pixels, three values each, and draws nothing."""
    del textureUniqueId
    world: World = connected(physicsClientId)
    world.say_once(f"changeTexture: {_NOT_DRAWN}")
    if len(pixels) != 3 * int(width) * int(height):
        raise error(f"changeTexture: {width} by {height} pixels have {3 * int(width) * int(height)} values, and not {len(pixels)}")


__all__ = ["changeTexture", "changeVisualShape", "loadTexture", "resetVisualShapeData"]
