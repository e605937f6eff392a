"""Functions for a window and a headset. They do nothing, with one warning."""

from __future__ import annotations

from typing import Any

from .connections import connected


def _nothing(client: int, function: str) -> None:
    connected(client).say_once(f"{function} does nothing: a daemon has no window")


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
    "configureDebugVisualizer",
    "getVREvents",
    "setDebugObjectColor",
    "setVRCameraState",
    "submitProfileTiming",
]
