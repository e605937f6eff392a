"""Plugins and switches within Bullet: functions behave as if no plugin existed."""

from __future__ import annotations

from typing import Any

from .connections import connected


def loadPlugin(pluginPath: str, postFix: str = "", physicsClientId: int = 0) -> int:
    """Returns -1, as PyBullet does for an unknown plugin: the daemon accepts none."""
    del postFix
    connected(physicsClientId).say_once(f"loadPlugin: {pluginPath} is not loaded: the daemon takes no plugins")
    return -1


def executePluginCommand(
    pluginUniqueId: int,
    textArgument: str = "",
    intArgs: Any = None,
    floatArgs: Any = None,
    physicsClientId: int = 0,
) -> int:
    """Returns -1, as PyBullet does for an unloaded plugin."""
    connected(physicsClientId)
    return -1


def unloadPlugin(pluginUniqueId: int, physicsClientId: int = 0) -> None:
    """Does nothing: no plugin is loaded."""
    connected(physicsClientId)


def setInternalSimFlags(flags: int, physicsClientId: int = 0) -> None:
    """Does nothing: the flags are for experiments within Bullet."""
    connected(physicsClientId)


__all__ = ["executePluginCommand", "loadPlugin", "setInternalSimFlags", "unloadPlugin"]
