# Generated from simd_client/aio/callbacks.py by tools/make_blocking.py; do not edit.
"""Calls functions with published items, in the background."""

from __future__ import annotations

from collections.abc import Iterator, Callable
from dataclasses import replace
from types import TracebackType
from typing import Generic, Protocol, TypeVar

from simd_client import proto
from simd_client.blocking.runtime import Background
from simd_client.blocking.watch import EventWatch
from simd_client.attributes import FixedAttributes
from simd_client.errors import SimdError
from simd_client.event import Event
from simd_client.link import Link

Item = TypeVar("Item")
Given = TypeVar("Given", covariant=True)


class Items(Protocol[Given]):
    """Source of items over time."""

    def __iter__(self) -> Iterator[Given]:
        """Returns the iterator."""
        ...

    def close(self) -> None:
        """Ends the iteration."""
        ...


class Callbacks(FixedAttributes, Generic[Item]):
    """Calls a function with each item, one after the other, until `close`. Use it with `with`, or `close` it; it
    also ends with the connection.

    The function is called on a separate thread, which does not keep the program from ending. A slow function skips
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

    def wait(self, timeout: float | None = None) -> bool:
        """Waits until the calls have ended. Returns whether they ended within `timeout` seconds; `None` waits
        without a limit. Raises nothing: see `error`."""
        return self._background.wait(timeout)

    def __enter__(self) -> Callbacks[Item]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _run(self) -> None:
        try:
            for item in self._items:
                self._background.call(self._function, item)
                if self._background.is_stopped:
                    return
        except Exception as error:
            if self._background.is_stopped or (isinstance(error, SimdError) and self._link.is_closed):
                return
            self._error = error
            raise
        finally:
            self._items.close()


class SomeEvents(Iterator[Event]):
    """Events of some kinds, or of all."""

    def __init__(self, events: EventWatch, kinds: tuple[str, ...]) -> None:
        known = tuple(field.name for field in proto.Event.DESCRIPTOR.oneofs_by_name["kind"].fields)
        for kind in kinds:
            if kind not in known:
                raise ValueError(f"there is no kind of event `{kind}`; there are {', '.join(known)}")
        self._events = events
        self._kinds = kinds

    def __iter__(self) -> SomeEvents:
        return self

    def __next__(self) -> Event:
        """Returns the next event of these kinds; `missed` counts events of all kinds before it."""
        missed = 0
        for event in self._events:
            missed += event.missed
            if not self._kinds or event.kind in self._kinds:
                return event if event.missed == missed else replace(event, missed=missed)
        raise StopIteration

    def close(self) -> None:
        """Ends the iteration."""
        self._events.close()
