"""Keys and mouse in the daemon's page, with PyBullet's queue and numbers."""

from __future__ import annotations

import re
import time
from collections import deque
from typing import TYPE_CHECKING

from simd_client.proto import InputEvent, KeyInput, MouseButton, MouseInput, NextInputRequest, methods

from . import constants

if TYPE_CHECKING:
    from .wire import Wire

MouseEvent = tuple[int, float, float, int, int]

# Wall seconds between two requests: a loop without pauses asks no more often than a person can type.
_INTERVAL = 0.004
# PyBullet's capacity.
_MOUSE_EVENTS = 256
# Seconds that the daemon waits for an event, practically none: 0 would mean a second.
_NO_WAIT = 1e-9
_MOVE_EVENT, _BUTTON_EVENT = 1, 2

_KEYS = {
    "ArrowLeft": constants.B3G_LEFT_ARROW,
    "ArrowRight": constants.B3G_RIGHT_ARROW,
    "ArrowUp": constants.B3G_UP_ARROW,
    "ArrowDown": constants.B3G_DOWN_ARROW,
    "PageUp": constants.B3G_PAGE_UP,
    "PageDown": constants.B3G_PAGE_DOWN,
    "Home": constants.B3G_HOME,
    "End": constants.B3G_END,
    "Insert": constants.B3G_INSERT,
    "Delete": constants.B3G_DELETE,
    "Backspace": constants.B3G_BACKSPACE,
    "Shift": constants.B3G_SHIFT,
    "Control": constants.B3G_CONTROL,
    "Alt": constants.B3G_ALT,
    "Enter": constants.B3G_RETURN,
    "Escape": 27,
    "Tab": 9,
    **{f"F{number}": constants.B3G_F1 + number - 1 for number in range(1, 16)},
}

_BUTTONS = {
    MouseButton.MOUSE_BUTTON_LEFT: 0,
    MouseButton.MOUSE_BUTTON_MIDDLE: 1,
    MouseButton.MOUSE_BUTTON_RIGHT: 2,
}


def code_of(key: KeyInput) -> int | None:
    """Returns PyBullet's code of a key: its character without Shift, or one of B3G. `None` for an unknown
    key."""
    digit = re.fullmatch(r"(?:Digit|Numpad)([0-9])", key.code)
    if digit is not None:
        return ord(digit[1])
    if len(key.key) == 1:
        letter = key.key.lower()
        return ord(letter) if len(letter) == 1 else None
    return _KEYS.get(key.key)


class InputQueue:
    """Events since the script's last call."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._sequence: int | None = None
        self._asked = 0.0
        # Flags by code.
        self._keys: dict[int, int] = {}
        self._mouse: deque[MouseEvent] = deque(maxlen=_MOUSE_EVENTS)

    def keys(self) -> dict[int, int]:
        """Returns keys that are down, and keys that went down or up since the last call."""
        self._fetch()
        found = self._keys
        down = constants.KEY_IS_DOWN
        self._keys = {code: down for code, flags in found.items() if flags & down}
        return found

    def mouse(self) -> tuple[MouseEvent, ...]:
        """Returns the mouse events since the last call."""
        self._fetch()
        found = tuple(self._mouse)
        self._mouse.clear()
        return found

    def _fetch(self) -> None:
        now = time.monotonic()
        if self._sequence is not None and now - self._asked < _INTERVAL:
            return
        self._asked = now
        request = NextInputRequest(after_sequence=self._sequence, timeout=_NO_WAIT)
        answer = self._wire.call(methods.NextInput, request)
        self._sequence = answer.sequence
        if answer.missed:
            # The lost events may include the release of a key.
            for code in list(self._keys):
                self._release(code)
        for event in answer.events:
            self._take(event)

    def _take(self, event: InputEvent) -> None:
        if event.HasField("mouse"):
            self._mouse.append(_mouse_event(event.mouse))
            return
        code = code_of(event.key)
        if code is None:
            return
        if not event.key.is_down:
            self._release(code)
        elif not self._keys.get(code, 0) & constants.KEY_IS_DOWN:
            self._keys[code] = self._keys.get(code, 0) | constants.KEY_IS_DOWN | constants.KEY_WAS_TRIGGERED

    def _release(self, code: int) -> None:
        self._keys[code] = (self._keys.get(code, 0) | constants.KEY_WAS_RELEASED) & ~constants.KEY_IS_DOWN


def _mouse_event(mouse: MouseInput) -> MouseEvent:
    button = _BUTTONS.get(mouse.button)
    if button is None:
        return _MOVE_EVENT, mouse.x, mouse.y, -1, 0
    down = constants.KEY_IS_DOWN | constants.KEY_WAS_TRIGGERED
    return _BUTTON_EVENT, mouse.x, mouse.y, button, down if mouse.is_down else constants.KEY_WAS_RELEASED
