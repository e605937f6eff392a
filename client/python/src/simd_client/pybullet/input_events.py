"""getKeyboardEvents and getMouseEvents: what is done with keys and mouse in the daemon's page, where one is open."""

from __future__ import annotations

from .connections import connected
from .input_queue import MouseEvent


def getKeyboardEvents(physicsClientId: int = 0) -> dict[int, int]:
    """Flags by code of the keys that are held down in the page or were pressed or released since the last call:
    KEY_IS_DOWN, KEY_WAS_TRIGGERED, KEY_WAS_RELEASED."""
    return connected(physicsClientId).input.keys()


def getMouseEvents(physicsClientId: int = 0) -> tuple[MouseEvent, ...]:
    """What the mouse did over the page's picture since the last call, each: 1 for a move and 2 for a button, x and y in CSS
    pixels, the number of the button (-1 for a move), and its flags."""
    return connected(physicsClientId).input.mouse()


__all__ = ["getKeyboardEvents", "getMouseEvents"]
