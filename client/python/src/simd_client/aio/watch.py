"""Iterators over states, statistics, parameters and events."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import AsyncIterator
from types import TracebackType
from typing import Generic, TypeVar

from simd_client import proto
from simd_client.aio.connection import Connection
from simd_client.aio.runtime import LatestSample, sleep
from simd_client.attributes import FixedAttributes
from simd_client.errors import DeadlineExceeded
from simd_client.event import Event, event_from_proto
from simd_client.pacer import Pacer
from simd_client.proto import methods
from simd_client.selection import Selection, SensorSelection
from simd_client.state import States

Item = TypeVar("Item")

SILENCE = 1.0
"""Seconds without a publication after which the daemon is asked: it may have ended, or a publication was
lost."""


class Watch(FixedAttributes, AsyncIterator[Item], Generic[Item]):
    """Iterates over published items. The newest wins: a slow reader gets the newest item and skips the others.

    The first item is the current one. `newest` returns without waiting. Use it with `async with`, or `close` it.
    Belongs to the event loop that it was made on. Raises `Unavailable` once the daemon is gone.
    """

    def __init__(self, connection: Connection, key: str, rate: float | None) -> None:
        self._connection = connection
        self._pacer = Pacer(rate)
        self._last: Item | None = None
        self._heard = 0.0
        self._is_open = True
        self._sample = LatestSample()
        self._subscriber = connection.link.subscribe(key, self._sample.put)

    async def _read(self, payload: bytes) -> Item | None:
        """Returns the item of a publication, or `None` to ignore it."""
        raise NotImplementedError

    async def _ask(self) -> Item:
        """Fetches the current item from the daemon."""
        raise NotImplementedError

    def _order(self, item: Item) -> int:
        """Returns the item's number; newer items have larger ones."""
        raise NotImplementedError

    def __aiter__(self) -> Watch[Item]:
        return self

    async def __anext__(self) -> Item:
        """Returns the newest item, once it is newer than the previous one, and not sooner than the rate
        allows."""
        if not self._is_open:
            raise StopAsyncIteration
        return await self.wait(None)

    async def wait(self, timeout: float | None) -> Item:
        """Returns the next item. Raises `DeadlineExceeded` if none arrives within `timeout` seconds."""
        begin = time.monotonic()
        await sleep(self._pacer.left())
        return await self._first() if self._last is None else await self._following(begin, timeout)

    async def newest(self) -> Item:
        """Returns the newest item that has arrived, without waiting. Asks the daemon if none has arrived yet,
        or if no publication came for a second: the last one may have been lost."""
        if not await self._received() and time.monotonic() - self._heard >= SILENCE:
            self._last = await self._asked()
        return await self._first() if self._last is None else self._last

    def close(self) -> None:
        """Ends the subscription."""
        if self._is_open:
            self._is_open = False
            self._sample.close()
            self._subscriber.undeclare()  # pyright: ignore[reportUnknownMemberType]

    async def __aenter__(self) -> Watch[Item]:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __del__(self) -> None:
        # Zenoh keeps a subscriber with a callback for as long as the session is open.
        if hasattr(self, "_subscriber"):
            self.close()

    async def _first(self) -> Item:
        self._last = await self._asked()
        return self._last

    async def _asked(self) -> Item:
        item = await self._ask()
        self._heard = time.monotonic()
        return item

    async def _received(self) -> bool:
        """Takes the arrived publication, if it is newer than the last item."""
        payload = self._sample.take()
        item = None if payload is None else await self._read(payload)
        if item is None or (self._last is not None and self._order(item) <= self._order(self._last)):
            return False
        self._last = item
        self._heard = time.monotonic()
        return True

    async def _following(self, begin: float, timeout: float | None) -> Item:
        while not await self._received():
            if not self._is_open:
                raise StopAsyncIteration
            now = time.monotonic()
            if timeout is not None and now - begin >= timeout:
                raise DeadlineExceeded(f"nothing new was published within {timeout:g} s")
            silence = self._heard + SILENCE - now
            if silence > 0:
                await self._sample.wait(silence if timeout is None else min(silence, begin + timeout - now))
                continue
            item = await self._asked()
            # A smaller number is not an older item: the daemon was restarted.
            if self._last is None or self._order(item) != self._order(self._last):
                self._last = item
                break
        return await self._first() if self._last is None else self._last


class WorldWatch(FixedAttributes, AsyncIterator[States]):
    """Iterates over states of several robots, all of one moment; the newest wins. The first is the current one.

    It needs no `close`: the daemon keeps nothing for it. Belongs to one event loop.
    """

    def __init__(
        self, connection: Connection, rate: float | None, selection: Selection, sensors: SensorSelection = False
    ) -> None:
        self._connection = connection
        self._pacer = Pacer(rate)
        self._selection = selection
        self._sensors: SensorSelection = sensors
        self._last: int | None = None
        self._is_open = True

    def __aiter__(self) -> WorldWatch:
        return self

    async def __anext__(self) -> States:
        """Returns the newest states, once they are newer than the previous ones, and not sooner than the rate
        allows."""
        while self._is_open:
            await sleep(self._pacer.left())
            if self._last is None and not self._sensors:
                states = await self._connection.states(self._selection)
            else:
                states = await self._connection.next_states(
                    self._last or 0, SILENCE, self._selection, sensors=self._sensors
                )
            if states.stamp.sequence != self._last:
                self._last = states.stamp.sequence
                return states
        raise StopAsyncIteration

    def close(self) -> None:
        """Ends the iteration."""
        self._is_open = False

    async def __aenter__(self) -> WorldWatch:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class EventWatch(FixedAttributes, AsyncIterator[Event]):
    """Iterates over events in order. `missed` of an event counts events lost because this reader was too
    slow.

    It needs no `close`: the daemon keeps nothing for it. Belongs to one event loop.
    """

    def __init__(self, connection: Connection, after: int) -> None:
        self._connection = connection
        self._ahead: deque[Event] = deque()
        self._after = after
        self._is_open = True

    def __aiter__(self) -> EventWatch:
        return self

    async def __anext__(self) -> Event:
        """Returns the next event."""
        if not self._is_open:
            raise StopAsyncIteration
        return await self.wait(None)

    async def wait(self, timeout: float | None) -> Event:
        """Returns the next event. Raises `DeadlineExceeded` if none arrives within `timeout` seconds."""
        begin = time.monotonic()
        while not self._ahead:
            if not self._is_open:
                raise StopAsyncIteration
            left = SILENCE if timeout is None else begin + timeout - time.monotonic()
            if left <= 0:
                raise DeadlineExceeded(f"no event came within {timeout:g} s")
            found, _ = await next_events(self._connection, self._after, min(left, SILENCE))
            self._ahead.extend(found)
        event = self._ahead.popleft()
        self._after = event.sequence
        return event

    def close(self) -> None:
        """Ends the iteration."""
        self._is_open = False
        self._ahead.clear()

    async def __aenter__(self) -> EventWatch:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


async def next_events(connection: Connection, after: int, wait: float) -> tuple[list[Event], int]:
    """Returns the events after a sequence, waiting for the first one, and the sequence of the newest
    event."""
    request = proto.NextEventsRequest(after_sequence=after, timeout=wait)
    answer = await connection.call(methods.NextEvents, request, wait=wait)
    missed = [answer.missed] + [0] * len(answer.events)
    return [event_from_proto(event, gone) for event, gone in zip(answer.events, missed)], answer.last_sequence
