"""Callbacks that Zenoh makes on its threads, and the closing of sessions with respect to running callbacks.

At its end the interpreter ends any thread that asks for it, by unwinding the thread's stack. Inside Zenoh's
frames that aborts the process: no callback may be running then."""

from __future__ import annotations

import _thread
import os
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

import zenoh

Item = TypeVar("Item")

# Wall seconds for the last instructions of a finished callback, after its count.
_RETURN_SECONDS = 0.002
# Wall seconds that a thread that drops a session waits for its closing.
_CLOSE_SECONDS = 0.5
# Placeholder for a thread that closes a session and has no number yet.
_CLOSER = 0


class _Running:
    """Threads of running callbacks."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        # Reentrant, since a garbage collection in here may close a session.
        self._changed = threading.Condition(threading.RLock())
        self._threads: list[int] = []

    def begin(self, thread: int) -> None:
        with self._changed:
            self._threads.append(thread)

    def end(self, thread: int) -> None:
        with self._changed:
            self._threads.remove(thread)
            self._changed.notify_all()

    def __enter__(self) -> None:
        self.begin(threading.get_ident())

    def __exit__(self, *_: object) -> None:
        self.end(threading.get_ident())

    def is_this_thread(self) -> bool:
        return threading.get_ident() in self._threads

    def wait(self, timeout: float) -> None:
        with self._changed:
            if not self._threads:
                return
            self._changed.wait_for(lambda: not self._threads, timeout)
        time.sleep(_RETURN_SECONDS)


_running = _Running()
# The child has no threads of the parent.
os.register_at_fork(after_in_child=_running.reset)


def callback(
    take: Callable[[Item], None], ended: Callable[[], None] | None = None
) -> zenoh.handlers.Callback[Item]:
    """Returns a handler that calls `take` with each item, and `ended` after the last, on a thread of Zenoh. A
    Python thread for it would keep the program from ending."""

    def counted(item: Item) -> None:
        with _running:
            take(item)

    def counted_end() -> None:
        with _running:
            if ended is not None:
                ended()

    make: Any = zenoh.handlers.Callback
    return make(counted, counted_end if ended is not None else None, indirect=False)


def close_anywhere(session: zenoh.Session) -> None:
    """Closes a dropped session, on whatever thread notices it, and whatever that thread holds: a garbage
    collection may notice it between any two instructions. Closing waits for running callbacks. One of them
    may be this one, or may wait for a lock of this thread. So another thread closes, and this one waits for
    it only for a limited time."""
    if session.is_closed():
        return
    close: Callable[[], None] = session.close  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    closed = threading.Event()

    def closing() -> None:
        try:
            close()
        finally:
            closed.set()
            _running.end(_CLOSER)

    # Counted from here on, so that the program does not end within it.
    _running.begin(_CLOSER)
    try:
        # A `Thread` does not fit: its start waits for locks of its module.
        _thread.start_new_thread(closing, ())
    except RuntimeError:
        # No further callback begins: the program ends.
        closing()
    if not _running.is_this_thread():
        closed.wait(_CLOSE_SECONDS)


def wait_for_callbacks(timeout: float) -> None:
    """Waits until no callback runs, for at most `seconds` seconds. Sessions are closed before."""
    _running.wait(timeout)
