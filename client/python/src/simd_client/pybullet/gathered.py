"""What a script says one by one and waits for no answer to: gathered for some milliseconds, and sent together by a thread."""

from __future__ import annotations

import threading

# Wall seconds that it waits for more, which is less than a page needs for a picture.
_GATHERED = 0.01


class Gathered:
    """What waits to be sent. Who derives from it keeps it, under `_lock`, and sends it in `_send`."""

    def __init__(self) -> None:
        # Guards what waits, also while it is sent.
        self._lock = threading.Lock()
        # A thread is there that will send it.
        self._is_due = False

    def flush(self) -> None:
        """Sends what waits."""
        with self._lock:
            self._send()

    def _send_soon(self) -> None:
        """To be called with the lock."""
        if not self._is_due:
            self._is_due = True
            # It does not keep a script from its end, where the connection's end sends what waits.
            timer = threading.Timer(_GATHERED, self._send_due)
            timer.daemon = True
            timer.start()

    def _send_due(self) -> None:
        with self._lock:
            self._is_due = False
            self._send()

    def _send(self) -> None:
        """Sends what waits, with the lock."""
        raise NotImplementedError
