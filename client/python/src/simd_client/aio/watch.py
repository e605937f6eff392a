"""Things over time, for asyncio: an iterator whose next item is the newest there is."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import AsyncIterator
from types import TracebackType
from typing import Generic, TypeVar, cast

import zenoh

from simd_client.aio.runner import run, soon
from simd_client.errors import DeadlineExceeded
from simd_client.event import Event
from simd_client.link import Link
from simd_client.plans import simulation
from simd_client.watch import SILENCE, Pacer, Source

Item = TypeVar("Item")


class _Slot:
    """Room for one publication: a newer one takes the place of one that nobody fetched."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._payload: bytes | None = None
        self.arrived = asyncio.Event()

    def put(self, sample: zenoh.Sample) -> None:
        """On a thread of Zenoh's. Wakes the loop once, however many come before it looks."""
        with self._lock:
            was_empty = self._payload is None
            self._payload = sample.payload.to_bytes()
        if was_empty:
            soon(self._loop, self.arrived.set)

    def take(self) -> bytes | None:
        """What is there, if anything."""
        self.arrived.clear()
        with self._lock:
            payload, self._payload = self._payload, None
        return payload


class Watch(AsyncIterator[Item], Generic[Item]):
    """Items as they change, newest-wins; see `simd_client.Watch`. Belongs to the loop that it was made on.

    Use it with `async with`, or `close` it.
    """

    def __init__(self, link: Link, source: Source[Item], rate: float | None, timeout: float) -> None:
        self._link = link
        self._source = source
        self._pacer = Pacer(rate)
        self._timeout = timeout
        self._last: Item | None = None
        self._heard = 0.0
        self._is_open = True
        self._slot = _Slot()
        handler = cast(
            "zenoh.handlers.Callback[zenoh.Sample]", zenoh.handlers.Callback(self._slot.put, indirect=False)
        )
        try:
            self._subscriber = link.session.declare_subscriber(source.key, handler)
        except zenoh.ZError:
            raise link.nobody() from None

    def __aiter__(self) -> Watch[Item]:
        return self

    async def __anext__(self) -> Item:
        """The newest item, once it is newer than the one before; not sooner than the rate says."""
        if not self._is_open:
            raise StopAsyncIteration
        return await self.wait(None)

    async def wait(self, timeout: float | None) -> Item:
        """The next item. Raises `DeadlineExceeded` where none comes within so many seconds."""
        begin = asyncio.get_running_loop().time()
        await asyncio.sleep(self._pacer.left())
        return await self._first() if self._last is None else await self._following(begin, timeout)

    async def newest(self) -> Item:
        """The newest item that has arrived. Asks the daemon where none has yet, and where nothing was heard for
        a second: what it sent last may have been lost."""
        if not await self._received() and time.monotonic() - self._heard >= SILENCE:
            self._last = await self._asked()
        return await self._first() if self._last is None else self._last

    def close(self) -> None:
        """Ends it."""
        if self._is_open:
            self._is_open = False
            self._subscriber.undeclare()  # pyright: ignore[reportUnknownMemberType]

    async def __aenter__(self) -> Watch[Item]:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __del__(self) -> None:
        # Zenoh keeps a subscriber with a callback for as long as the session lives.
        if hasattr(self, "_subscriber"):
            self.close()

    async def _first(self) -> Item:
        self._last = await self._asked()
        return self._last

    async def _asked(self) -> Item:
        item = await run(self._link, self._source.ask(), self._timeout)
        self._heard = time.monotonic()
        return item

    async def _received(self) -> bool:
        payload = self._slot.take()
        if payload is None:
            return False
        item = await run(self._link, self._source.read(payload), self._timeout)
        if item is None or (self._last is not None and self._order(item) <= self._order(self._last)):
            return False
        self._last = item
        self._heard = time.monotonic()
        return True

    def _order(self, item: Item) -> int:
        return self._source.order(item)

    async def _following(self, begin: float, timeout: float | None) -> Item:
        loop = asyncio.get_running_loop()
        while not await self._received():
            left = SILENCE if timeout is None else min(SILENCE, begin + timeout - loop.time())
            if left <= 0:
                raise DeadlineExceeded(f"nothing new was published within {timeout:g} s")
            try:
                await asyncio.wait_for(self._slot.arrived.wait(), left)
            except asyncio.TimeoutError:
                item = await self._asked()
                # A smaller number is not older, but of a daemon that was started again.
                if self._last is None or self._order(item) != self._order(self._last):
                    self._last = item
                    break
        return await self._first() if self._last is None else self._last


class EventWatch(AsyncIterator[Event]):
    """Events as they happen; see `simd_client.EventWatch`."""

    def __init__(self, link: Link, after: int, timeout: float) -> None:
        self._link = link
        self._timeout = timeout
        self._ahead: deque[Event] = deque()
        self._after = after

    def __aiter__(self) -> EventWatch:
        return self

    async def __anext__(self) -> Event:
        """The next event, once there is one."""
        return await self.wait(None)

    async def wait(self, timeout: float | None) -> Event:
        """The next event. Raises `DeadlineExceeded` where none comes within so many seconds."""
        loop = asyncio.get_running_loop()
        begin = loop.time()
        while not self._ahead:
            left = SILENCE if timeout is None else begin + timeout - loop.time()
            if left <= 0:
                raise DeadlineExceeded(f"no event came within {timeout:g} s")
            plan = simulation.events(self._after, min(left, SILENCE))
            self._ahead.extend((await run(self._link, plan, self._timeout))[0])
        event = self._ahead.popleft()
        self._after = event.sequence
        return event
