"""Functions for a window: drawing and keys. They do nothing, with one warning; drawings have numbers."""

from __future__ import annotations

from typing import Any

from .connections import connected

def _nothing(client: int, function: str) -> None:
    connected(client).say_once(f"{function} does nothing: a daemon has no window")


def _number(client: int, function: str, replaced: int) -> int:
    """Of a drawing: sliders have numbers of the same row, as in PyBullet."""
    _nothing(client, function)
    return replaced if replaced >= 0 else connected(client).sliders.number()


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
    """Draws nothing. Returns a number as for a line that was drawn."""
    return _number(physicsClientId, "addUserDebugLine", replaceItemUniqueId)


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
    """Draws nothing. Returns a number as for points that were drawn."""
    return _number(physicsClientId, "addUserDebugPoints", replaceItemUniqueId)


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
    """Draws nothing. Returns a number as for a text that was drawn."""
    return _number(physicsClientId, "addUserDebugText", replaceItemUniqueId)


def removeUserDebugItem(itemUniqueId: int, physicsClientId: int = 0) -> None:
    """Removes a slider or a button; of a drawing there is nothing to remove."""
    connected(physicsClientId).sliders.remove(itemUniqueId)


def removeAllUserDebugItems(physicsClientId: int = 0) -> None:
    """Does nothing. Sliders stay, as in PyBullet."""
    connected(physicsClientId)


def configureDebugVisualizer(
    flag: int = -1,
    enable: int = -1,
    lightPosition: Any = None,
    shadowMapResolution: int = -1,
    shadowMapWorldSize: int = -1,
    remoteSyncTransformInterval: float = -1.0,
    shadowMapIntensity: float = -1.0,
    rgbBackground: Any = None,
    physicsClientId: int = 0,
) -> None:
    """Does nothing: there is no window."""
    _nothing(physicsClientId, "configureDebugVisualizer")


def getKeyboardEvents(physicsClientId: int = 0) -> dict[int, int]:
    """Returns no key events."""
    _nothing(physicsClientId, "getKeyboardEvents")
    return {}


def getMouseEvents(physicsClientId: int = 0) -> tuple[()]:
    """Returns no mouse events."""
    _nothing(physicsClientId, "getMouseEvents")
    return ()


def getVREvents(deviceTypeFilter: int = 1, allAnalogAxes: int = 0, physicsClientId: int = 0) -> tuple[()]:
    """Returns no VR events."""
    _nothing(physicsClientId, "getVREvents")
    return ()


def setVRCameraState(
    rootPosition: Any = None,
    rootOrientation: Any = None,
    trackObject: int = -2,
    trackObjectFlag: int = -1,
    physicsClientId: int = 0,
) -> None:
    """Does nothing: there is no headset."""
    _nothing(physicsClientId, "setVRCameraState")


def setDebugObjectColor(
    objectUniqueId: int, linkIndex: int = -1, objectDebugColorRGB: Any = None, physicsClientId: int = 0
) -> None:
    """Colours nothing."""
    _nothing(physicsClientId, "setDebugObjectColor")


def submitProfileTiming(eventName: str = "", physicsClientId: int = 0) -> None:
    """Does nothing: there is no profile window."""
    connected(physicsClientId)


__all__ = [
    "addUserDebugLine",
    "addUserDebugPoints",
    "addUserDebugText",
    "configureDebugVisualizer",
    "getKeyboardEvents",
    "getMouseEvents",
    "getVREvents",
    "removeAllUserDebugItems",
    "removeUserDebugItem",
    "setDebugObjectColor",
    "setVRCameraState",
    "submitProfileTiming",
]
