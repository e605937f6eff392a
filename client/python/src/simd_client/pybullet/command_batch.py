"""Commands of a script that wait for no answer: collected for some milliseconds, and sent together by a
thread."""

from __future__ import annotations

import threading

# Wall seconds that it waits for more, less than a page needs for a picture.
_GATHERED = 0.01


class CommandBatch:
    """Base class of a queue of commands. A derived class keeps them under `_lock`, and sends them in
    `_send`."""

    def __init__(self) -> None:
        # Guards the queue, also while it is sent.
        self._lock = threading.Lock()
        # Whether a thread will send the queue.
        self._is_due = False

    def flush(self) -> None:
        """Sends the queue."""
        with self._lock:
            self._send()

    def _send_soon(self) -> None:
        """Starts the sending thread; call with the lock."""
        if not self._is_due:
            self._is_due = True
            # It does not keep a script from ending; the connection's end sends the queue.
            timer = threading.Timer(_GATHERED, self._send_due)
            timer.daemon = True
            timer.start()

    def _send_due(self) -> None:
        with self._lock:
            self._is_due = False
            self._send()

    def _send(self) -> None:
        """Sends the queue, with the lock."""
        raise NotImplementedError
