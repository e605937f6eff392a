"""getKeyboardEvents and getMouseEvents: keys and mouse in the daemon's page, if one is open."""

from __future__ import annotations

from .connections import connected
from .input_queue import MouseEvent


def getKeyboardEvents(physicsClientId: int = 0) -> dict[int, int]:
    """Returns flags, by code, of the page's keys that are held down, or were pressed or released since the
    last call. The flags are KEY_IS_DOWN, KEY_WAS_TRIGGERED and KEY_WAS_RELEASED."""
    return connected(physicsClientId).input.keys()


def getMouseEvents(physicsClientId: int = 0) -> tuple[MouseEvent, ...]:
    """Returns each mouse event over the page's picture since the last call. It has 1 for a move or 2 for a
    button, x and y in CSS pixels, the button's number, and flags. The number is -1 for a move."""
    return connected(physicsClientId).input.mouse()


__all__ = ["getKeyboardEvents", "getMouseEvents"]
