"""Dropped sessions are closed, whatever the noticing thread does."""

from __future__ import annotations

import threading
import time
from typing import Any, cast

from simd_client import zenoh_callbacks
from simd_client.zenoh_callbacks import close_anywhere, wait_for_callbacks


class Session:
    """A session with a `close` that waits for a running callback, as Zenoh's does."""

    def __init__(self) -> None:
        self.returned = threading.Event()
        self.closed = threading.Event()

    def is_closed(self) -> bool:
        return self.closed.is_set()

    def close(self) -> None:
        if self.returned.wait(10):
            self.closed.set()


def drop(session: Session) -> None:
    close_anywhere(cast(Any, session))


def test_a_thread_that_zenoh_waits_for_does_not_wait_for_zenoh() -> None:
    session = Session()
    # A garbage collection does it before the first instruction of a callback, or after the last.
    begin = time.monotonic()
    drop(session)
    session.returned.set()
    assert time.monotonic() - begin < 5
    assert session.closed.wait(10)


def test_a_session_is_closed_also_where_the_count_of_callbacks_is_held() -> None:
    session = Session()

    def called_back() -> None:
        with zenoh_callbacks._running:  # pyright: ignore[reportPrivateUsage]
            pass
        session.returned.set()

    with zenoh_callbacks._running._changed:  # pyright: ignore[reportPrivateUsage]
        threading.Thread(target=called_back, daemon=True).start()
        begin = time.monotonic()
        drop(session)
        assert time.monotonic() - begin < 5
    assert session.closed.wait(10)


def test_a_program_that_ends_waits_for_the_session_that_is_being_closed() -> None:
    session = Session()
    with zenoh_callbacks._running:  # pyright: ignore[reportPrivateUsage]
        drop(session)
    threading.Timer(0.3, session.returned.set).start()
    wait_for_callbacks(10)
    assert session.closed.is_set()


def test_a_dropped_session_is_closed() -> None:
    session = Session()
    session.returned.set()
    drop(session)
    assert session.closed.is_set()
