"""Things over time: an iterator whose next item is the newest there is."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Generic, TypeVar, cast

import zenoh

from simd_client.errors import DeadlineExceeded, Unavailable
from simd_client.event import Event
from simd_client.link import Link
from simd_client.plan import Plan
from simd_client.plans import simulation

Item = TypeVar("Item")

SILENCE = 1.0
"""Seconds without a publication after which the daemon is asked: it may be gone, or what it sent last was lost."""

POLL = 0.001
"""Seconds between looks at the channel while items are expected."""


@dataclass(frozen=True)
class Source(Generic[Item]):
    """What is watched."""

    key: str
    """Where it is published."""
    read: Callable[[bytes], Plan[Item | None]]
    """A publication's item; `None` where it is of no use."""
    ask: Callable[[], Plan[Item]]
    """The newest item, from the daemon itself."""
    order: Callable[[Item], int]
    """Newer items have larger numbers."""


class Pacer:
    """When the next item is due. Deadlines are absolute and do not drift, but what was missed is not made up for."""

    def __init__(self, rate: float | None) -> None:
        """At most `rate` items a wall second; as they come where it is left out."""
        if rate is not None and not rate > 0:
            raise ValueError(f"a rate is above 0, not {rate}")
        self._period = 0.0 if rate is None else 1.0 / rate
        self._due = time.monotonic()

    def left(self) -> float:
        """Seconds until the next item is due. The one after it is due a period later."""
        now = time.monotonic()
        left = max(0.0, self._due - now)
        self._due = max(self._due, now) + self._period
        return left


class Watch(Iterator[Item]):
    """Items as they change, newest-wins: whoever comes late gets the newest, and what was skipped is gone.

    The first item is what there is now. Iterate, or look without waiting by `newest`. Use it with `with`, or
    `close` it. It belongs to one thread. Ends with `Unavailable` once the daemon is gone.
    """

    def __init__(self, link: Link, source: Source[Item], rate: float | None, timeout: float) -> None:
        self._link = link
        self._source = source
        self._pacer = Pacer(rate)
        self._timeout = timeout
        self._last: Item | None = None
        self._heard = 0.0
        self._is_open = True
        try:
            ring = cast("zenoh.handlers.RingChannel[zenoh.Sample]", zenoh.handlers.RingChannel(1))
            self._subscriber = link.session.declare_subscriber(source.key, ring)
        except zenoh.ZError:
            raise link.nobody() from None

    def __iter__(self) -> Watch[Item]:
        return self

    def __next__(self) -> Item:
        """The newest item, once it is newer than the one before; not sooner than the rate says."""
        if not self._is_open:
            raise StopIteration
        return self.wait(None)

    def wait(self, timeout: float | None) -> Item:
        """The next item. Raises `DeadlineExceeded` where none comes within so many seconds."""
        begin = time.monotonic()
        time.sleep(self._pacer.left())
        return self._first() if self._last is None else self._following(begin, timeout)

    def newest(self) -> Item:
        """The newest item that has arrived, without waiting. Asks the daemon where none has yet, and where
        nothing was heard for a second: what it sent last may have been lost."""
        if not self._received() and time.monotonic() - self._heard >= SILENCE:
            self._last = self._asked()
        return self._last_item()

    def close(self) -> None:
        """Ends it."""
        self._is_open = False
        self._subscriber.undeclare()  # pyright: ignore[reportUnknownMemberType]

    def __enter__(self) -> Watch[Item]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _first(self) -> Item:
        self._last = self._asked()
        return self._last

    def _asked(self) -> Item:
        item = self._link.run(self._source.ask(), self._timeout)
        self._heard = time.monotonic()
        return item

    def _received(self) -> bool:
        """Takes in what has arrived, if it is newer than what there was."""
        try:
            sample = self._subscriber.handler.try_recv()
        except zenoh.ZError:
            raise Unavailable(
                f"the connection to the daemon at {self._link.endpoint.locator} is closed"
            ) from None
        if sample is None:
            return False
        item = self._link.run(self._source.read(sample.payload.to_bytes()), self._timeout)
        if item is None or (
            self._last is not None and self._source.order(item) <= self._source.order(self._last)
        ):
            return False
        self._last = item
        self._heard = time.monotonic()
        return True

    def _following(self, begin: float, timeout: float | None) -> Item:
        while not self._received():
            now = time.monotonic()
            if timeout is not None and now - begin >= timeout:
                raise DeadlineExceeded(f"nothing new was published within {timeout:g} s")
            if now - self._heard >= SILENCE:
                item = self._asked()
                # A smaller number is not older, but of a daemon that was started again.
                if self._source.order(item) != self._source.order(self._last_item()):
                    self._last = item
                    break
            # A world that stands still is looked at less often.
            time.sleep(POLL if now - begin < SILENCE else 10 * POLL)
        return self._last_item()

    def _last_item(self) -> Item:
        return self._first() if self._last is None else self._last


class EventWatch(Iterator[Event]):
    """Events as they happen, in order; what this reader was too slow for is counted in `missed`.

    Use it with `with`, or just stop reading: nothing is kept for it. It belongs to one thread.
    """

    def __init__(self, link: Link, after: int | None, timeout: float) -> None:
        self._link = link
        self._timeout = timeout
        self._ahead: deque[Event] = deque()
        self._after = link.run(simulation.events(0, 0.0), timeout)[1] if after is None else after

    def __iter__(self) -> EventWatch:
        return self

    def __next__(self) -> Event:
        """The next event, once there is one."""
        return self.wait(None)

    def wait(self, timeout: float | None) -> Event:
        """The next event. Raises `DeadlineExceeded` where none comes within so many seconds."""
        begin = time.monotonic()
        while not self._ahead:
            left = SILENCE if timeout is None else begin + timeout - time.monotonic()
            if left <= 0:
                raise DeadlineExceeded(f"no event came within {timeout:g} s")
            found, _ = self._link.run(simulation.events(self._after, min(left, SILENCE)), self._timeout)
            self._ahead.extend(found)
        event = self._ahead.popleft()
        self._after = event.sequence
        return event

    def __enter__(self) -> EventWatch:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ahead.clear()
