"""Callbacks that Zenoh makes on its own threads, and what closes a session with respect to those that are running.

Python ends a thread that asks for the interpreter while the interpreter ends, by unwinding its stack. Through Zenoh's
frames that is an abort of the process: no callback may be running then."""

from __future__ import annotations

import _thread
import os
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

import zenoh

Item = TypeVar("Item")

# For the last instructions of a callback that was waited for, which are after its count.
_RETURN_SECONDS = 0.002
# How long who drops a session waits until it is closed.
_CLOSE_SECONDS = 0.5
# Instead of a thread that closes a session, which has no number yet.
_CLOSER = 0


class _Running:
    """The threads of those that are running."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        # Reentrant, since a collection of garbage in here may close a session.
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
# The threads of the parent are not in the child.
os.register_at_fork(after_in_child=_running.reset)


def callback(
    take: Callable[[Item], None], ended: Callable[[], None] | None = None
) -> zenoh.handlers.Callback[Item]:
    """A handler that calls `take` with each item, and `ended` after the last, on a thread of Zenoh's: a thread of
    Python's for it would keep the program from ending."""

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
    """Closes a session that was dropped, on whatever thread that is noticed, and whatever that thread holds: a collection
    of garbage may notice it, between any two instructions. Closing waits for callbacks that are running. One of them may be
    this one, or may wait for what this thread holds: so another thread closes, for which this one waits only for a while."""
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
        # Not a `Thread`, whose start waits for locks of its module.
        _thread.start_new_thread(closing, ())
    except RuntimeError:
        # None begins any more: the program ends.
        closing()
    if not _running.is_this_thread():
        closed.wait(_CLOSE_SECONDS)


def wait_for_callbacks(timeout: float) -> None:
    """Waits until none is running, for at most so many seconds. Sessions are closed before."""
    _running.wait(timeout)
