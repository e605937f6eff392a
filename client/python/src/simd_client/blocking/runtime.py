"""Waits on the calling thread. `simd_client.aio.runtime` has the same names for asyncio."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from time import sleep
from typing import TypeVar

from simd_client.errors import DeadlineExceeded, SimdError, Unavailable
from simd_client.link import MAX_REPLIES, Answer, AnyMethod, Link

__all__ = [
    "LONGEST",
    "Background",
    "LatestSample",
    "in_thread",
    "queries",
    "query",
    "query_until_silent",
    "replies",
    "sleep",
]

LONGEST = 3_600.0
"""Maximum time, in seconds, of a call that ends with the daemon's silence: the longest stream of a daemon."""

Item = TypeVar("Item")
Result = TypeVar("Result")


def query(link: Link, method: AnyMethod, payload: bytes, timeout: float) -> bytes:
    """Sends a request and waits for its reply. Returns the reply's bytes."""
    return link.query(method, payload, timeout)


def queries(
    link: Link, requests: Sequence[tuple[AnyMethod, bytes]], timeout: float
) -> list[bytes | BaseException]:
    """Sends several requests at once and waits for all replies: the bytes of each, or its error."""
    arrived: dict[int, Answer] = {}
    ended: list[None] = []
    has_ended = threading.Condition()

    def end() -> None:
        with has_ended:
            ended.append(None)
            has_ended.notify()

    for index, (method, payload) in enumerate(requests):
        link.start(method, payload, timeout, partial(arrived.__setitem__, index), end)
    with has_ended:
        has_ended.wait_for(lambda: len(ended) == len(requests))
    answers: list[bytes | BaseException] = []
    for index in range(len(requests)):
        reply = arrived.get(index)
        try:
            answers.append(link.unavailable() if reply is None else link.opened(reply, timeout))
        except SimdError as error:
            answers.append(error)
    return answers


def query_until_silent(
    link: Link, method: AnyMethod, payload: bytes, silent: float, alive: tuple[AnyMethod, bytes]
) -> bytes:
    """Like `query`, and waits for as long as the daemon answers `alive`, which it is asked each time that
    `silent` seconds end without the reply."""
    return next(replies(link, method, payload, LONGEST, silent, alive, is_stream=False))


def replies(
    link: Link,
    method: AnyMethod,
    payload: bytes,
    seconds: float,
    silent: float | None = None,
    alive: tuple[AnyMethod, bytes] | None = None,
    *,
    is_stream: bool = True,
) -> Iterator[bytes]:
    """Sends the request of a stream and waits for each of its replies. If more than 256 wait for the reader,
    the newest are kept. Raises `DeadlineExceeded` if no reply arrives for `silent` seconds, and `alive`, if
    it is given, has no answer either."""
    waiting: deque[Answer | None] = deque(maxlen=MAX_REPLIES)
    has_some = threading.Condition()

    def keep(reply: Answer | None) -> None:
        with has_some:
            waiting.append(reply)
            has_some.notify()

    link.start(method, payload, seconds, keep, lambda: keep(None), is_stream=is_stream)
    while True:
        with has_some:
            has_some.wait_for(lambda: len(waiting) > 0, silent)
        if not waiting:
            is_alive = alive is not None and silent is not None and _answers(link, alive, silent)
            if is_alive or waiting:
                continue
            raise DeadlineExceeded(f"the daemon `{link.name}` said nothing for {silent:g} s")
        reply = waiting.popleft()
        if reply is None:
            raise link.unavailable()
        yield link.opened(reply, seconds)


def _answers(link: Link, asked: tuple[AnyMethod, bytes], seconds: float) -> bool:
    """Returns whether the daemon answers a question within `seconds` seconds."""
    method, payload = asked
    try:
        query(link, method, payload, seconds)
    except (DeadlineExceeded, Unavailable):
        return False
    return True


def in_thread(do: Callable[[], Result]) -> Result:
    """Does slow work on this machine's disk."""
    return do()


class LatestSample:
    """Slot for one publication: a newer one replaces one that was not taken."""

    def __init__(self) -> None:
        self._payload: bytes | None = None
        self._is_closed = False
        self._arrived = threading.Condition()

    def put(self, key: str, payload: bytes) -> None:
        """Stores a publication; called on a thread of the link."""
        with self._arrived:
            self._payload = payload
            self._arrived.notify()

    def take(self) -> bytes | None:
        """Returns the publication's bytes, if one has arrived."""
        with self._arrived:
            payload, self._payload = self._payload, None
        return payload

    def wait(self, seconds: float) -> bool:
        """Waits for a publication, or until `close`. Returns whether one arrived."""
        with self._arrived:
            self._arrived.wait_for(lambda: self._payload is not None or self._is_closed, seconds)
            return self._payload is not None

    def close(self) -> None:
        """Ends the slot: nothing more arrives."""
        with self._arrived:
            self._is_closed = True
            self._arrived.notify()


class Background:
    """Work in the background: a thread that does not keep the program from ending."""

    def __init__(self, link: Link, work: Callable[[], None], end: Callable[[], None]) -> None:
        """`end` makes the work end soon, from another thread."""
        self.is_stopped = False
        self._end = end
        # Held during a call: so that none begins once `stop` has returned, and a call may stop the work
        # itself.
        self._calling = threading.RLock()
        self._thread = threading.Thread(target=work, name="simd_client callbacks", daemon=True)
        # A thread that is within Zenoh while the interpreter ends would keep it from ending.
        link.threads.add(self)

    def start(self) -> None:
        """Begins it."""
        self._thread.start()

    def end(self) -> None:
        """Ends the work without waiting for a running call, since the program ends."""
        self.is_stopped = True
        self._end()

    @property
    def is_done(self) -> bool:
        """Whether it has ended, or was asked to end."""
        return self.is_stopped or not self._thread.is_alive()

    def call(self, function: Callable[[Item], object], item: Item) -> None:
        """Calls a function of the caller as a part of this work."""
        with self._calling:
            if not self.is_stopped:
                function(item)

    def stop(self) -> None:
        """Ends the work. The work may call this on itself."""
        with self._calling:
            self.is_stopped = True

    def wait(self, timeout: float | None) -> bool:
        """Waits until it has ended. Returns whether it ended within `timeout` seconds."""
        if self._thread.ident is not None:
            self._thread.join(timeout)
        return not self._thread.is_alive()
