"""Colours of links that a script sets, in the daemon's page.

They are collected for some milliseconds, like drawings, and a thread sends them: a script that changes a
colour at each step does not wait.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from simd_client.proto import Color, LinkColor, SetLinkColorsRequest, methods

from .errors import error
from .command_batch import CommandBatch

if TYPE_CHECKING:
    from .wire import Wire

Rgba = tuple[float, float, float, float]

# Maximum number in one request.
_MAX_COLORS = 4096


class LinkColors(CommandBatch):
    """Colours that wait to be sent."""

    def __init__(self, wire: Wire, say: Callable[[str], None]) -> None:
        super().__init__()
        self._wire = wire
        # Prints a sentence to the script's user, once.
        self._say = say
        # Colours by robot and link.
        self._waiting: dict[tuple[str, str], Rgba] = {}

    def paint(self, robot: str, link: str, color: Rgba) -> None:
        """Gives a link a colour soon."""
        with self._lock:
            self._waiting[robot, link] = color
            if len(self._waiting) >= _MAX_COLORS:
                self._send()
            else:
                self._send_soon()

    def _send(self) -> None:
        waiting, self._waiting = self._waiting, {}
        colors: list[LinkColor] = []
        for (robot, link), (red, green, blue, alpha) in waiting.items():
            color = Color(red=red, green=green, blue=blue, alpha=alpha)
            colors.append(LinkColor(robot=robot, link=link, color=color))
        if not colors:
            return
        try:
            self._wire.call_aside(methods.SetLinkColors, SetLinkColorsRequest(colors=colors))
        except error as refusal:
            # Another client may have removed a robot. A thread has no script to raise to.
            self._say(f"colours of links are not shown: {refusal}")
