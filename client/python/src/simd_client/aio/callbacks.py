"""Calls functions with published items, in the background."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from types import TracebackType
from typing import Generic, Protocol, TypeVar

from simd_client import proto
from simd_client.aio.runtime import Background
from simd_client.aio.watch import EventWatch
from simd_client.attributes import FixedAttributes
from simd_client.errors import SimdError
from simd_client.event import Event
from simd_client.link import Link

Item = TypeVar("Item")
Given = TypeVar("Given", covariant=True)


class Items(Protocol[Given]):
    """Source of items over time."""

    def __aiter__(self) -> AsyncIterator[Given]:
        """Returns the iterator."""
        ...

    def close(self) -> None:
        """Ends the iteration."""
        ...


class Callbacks(FixedAttributes, Generic[Item]):
    """Calls a function with each item, one after the other, until `close`. Use it with `async with`, or `close` it; it
    also ends with the connection.

    The function is called on a task of the event loop, and may be a coroutine function. A slow function skips
    states and sees every event. The calls end if it raises or if nothing more can be read, for instance
    because the robot was deleted. Then `error` has the exception, which is reported like any uncaught
    exception.
    """

    def __init__(self, link: Link, items: Items[Item], function: Callable[[Item], object]) -> None:
        if not callable(function):
            raise TypeError(f"a function is called with each item, and {function!r} is none")
        self._link = link
        self._items = items
        self._function = function
        self._error: Exception | None = None
        self._background = Background(link, self._run, items.close)
        self._background.start()

    @property
    def error(self) -> Exception | None:
        """The exception that ended the calls; `None` after `close`."""
        return self._error

    @property
    def is_open(self) -> bool:
        """Whether the function is still called."""
        return not self._background.is_done

    def close(self) -> None:
        """Ends the calls. The function is not called after this returns."""
        self._background.stop()
        self._items.close()

    async def wait(self, timeout: float | None = None) -> bool:
        """Waits until the calls have ended. Returns whether they ended within `timeout` seconds; `None` waits
        without a limit. Raises nothing: see `error`."""
        return await self._background.wait(timeout)

    async def __aenter__(self) -> Callbacks[Item]:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    async def _run(self) -> None:
        try:
            async for item in self._items:
                await self._background.call(self._function, item)
                if self._background.is_stopped:
                    return
        except Exception as error:
            if self._background.is_stopped or (isinstance(error, SimdError) and self._link.is_closed):
                return
            self._error = error
            raise
        finally:
            self._items.close()


class SomeEvents(AsyncIterator[Event]):
    """Events of some kinds, or of all."""

    def __init__(self, events: EventWatch, kinds: tuple[str, ...]) -> None:
        known = tuple(field.name for field in proto.Event.DESCRIPTOR.oneofs_by_name["kind"].fields)
        for kind in kinds:
            if kind not in known:
                raise ValueError(f"there is no kind of event `{kind}`; there are {', '.join(known)}")
        self._events = events
        self._kinds = kinds

    def __aiter__(self) -> SomeEvents:
        return self

    async def __anext__(self) -> Event:
        """Returns the next event of these kinds; `missed` counts events of all kinds before it."""
        missed = 0
        async for event in self._events:
            missed += event.missed
            if not self._kinds or event.kind in self._kinds:
                return event if event.missed == missed else replace(event, missed=missed)
        raise StopAsyncIteration

    def close(self) -> None:
        """Ends the iteration."""
        self._events.close()
