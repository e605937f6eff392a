"""The colours that a script gives links, in the daemon's page.

They are gathered for some milliseconds, as drawings are, and a thread sends them: a script that changes a colour at each step waits for
nothing.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from simd_client.proto import Color, LinkColor, SetLinkColorsRequest, methods

from .errors import error

if TYPE_CHECKING:
    from .wire import Wire

Rgba = tuple[float, float, float, float]

# Wall seconds that a colour waits for more, which is less than a page needs for a picture.
_GATHERED = 0.01
# Of one request.
_MOST = 4096


class Looks:
    """Colours that wait to be sent."""

    def __init__(self, wire: Wire, say: Callable[[str], None]) -> None:
        self._wire = wire
        # Tells the script's user a sentence, once.
        self._say = say
        # Guards what is below, also while it is sent.
        self._lock = threading.Lock()
        # By robot and link.
        self._waiting: dict[tuple[str, str], Rgba] = {}
        # A thread is there that will send them.
        self._is_due = False

    def paint(self, robot: str, link: str, color: Rgba) -> None:
        """Gives a link a colour soon."""
        with self._lock:
            self._waiting[robot, link] = color
            if len(self._waiting) >= _MOST:
                self._send()
            elif not self._is_due:
                self._is_due = True
                # It does not keep a script from its end, which sends what waits.
                timer = threading.Timer(_GATHERED, self._send_due)
                timer.daemon = True
                timer.start()

    def flush(self) -> None:
        """Sends what waits."""
        with self._lock:
            self._send()

    def _send_due(self) -> None:
        with self._lock:
            self._is_due = False
            self._send()

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
            # Another client may have taken a robot away. A thread has no script to raise to.
            self._say(f"colours of links are not shown: {refusal}")
