"""The drawings of one script: markers of the daemon, by PyBullet's item number.

A script that draws a line for each of a thousand rays would wait for the daemon each time. So drawings are
collected for some milliseconds, and a thread sends them. A drawing that replaces a waiting one takes its
place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import islice
from typing import TYPE_CHECKING

from simd_client.proto import AddMarkersRequest, DeleteMarkersRequest, Marker, methods

from .errors import error
from .command_batch import CommandBatch

if TYPE_CHECKING:
    from .wire import Wire

# Number of the oldest drawings to delete when the daemon is full.
_ROOM = 512
# Maximum number of waiting drawings, and their bytes: beyond it the script itself sends them.
_MAX_DRAWINGS = 512
_MAX_BYTES = 1 << 20


class Drawings(CommandBatch):
    """Existing drawings, as far as the script knows: some expire."""

    def __init__(self, wire: Wire, say: Callable[[str], None]) -> None:
        super().__init__()
        self._wire = wire
        # Prints a sentence to the script's user, once.
        self._say = say
        # The daemon's ids, the oldest first.
        self._ids: dict[int, int] = {}
        # Unsent drawings, the oldest first.
        self._waiting: dict[int, Marker] = {}
        self._bytes = 0

    def draw(self, number: int, marker: Marker) -> None:
        """Draws an item soon, replacing the item with that number if it exists. If the daemon is full, the
        script's oldest are deleted."""
        with self._lock:
            old = self._waiting.pop(number, None)
            if old is not None:
                self._bytes -= old.ByteSize()
            self._waiting[number] = marker
            self._bytes += marker.ByteSize()
            if len(self._waiting) > _MAX_DRAWINGS or self._bytes > _MAX_BYTES:
                self._send()
            else:
                self._send_soon()

    def remove(self, number: int) -> None:
        """Removes a drawing, if it exists."""
        with self._lock:
            self._forget(number)
            if number in self._ids:
                self._delete([number])

    def remove_all(self) -> None:
        """Removes the drawings of this script."""
        with self._lock:
            for number in list(self._waiting):
                self._forget(number)
            if self._ids:
                self._delete(list(self._ids))

    def _forget(self, number: int) -> None:
        marker = self._waiting.pop(number, None)
        if marker is not None:
            self._bytes -= marker.ByteSize()

    def _send(self) -> None:
        items = list(self._waiting.items())
        self._waiting, self._bytes = {}, 0
        if items:
            self._put(items)

    def _put(self, items: list[tuple[int, Marker]]) -> None:
        """Draws all, or as many as the daemon accepts. A thread has no script to raise to, so refusals are
        printed."""
        while True:
            try:
                self._add(items)
                return
            except error as refusal:
                if refusal.reason == "LIMIT_EXCEEDED" and self._ids:
                    self._say("the daemon takes no more drawings of this script: its oldest ones go")
                    self._make_room()
                elif refusal.reason and len(items) > 1:
                    # One of them is invalid, and the daemon draws all or none.
                    for item in items:
                        self._put([item])
                    return
                else:
                    self._say(f"a drawing is left out: {refusal}")
                    return

    def _add(self, items: list[tuple[int, Marker]]) -> None:
        for number, marker in items:
            marker.id = self._ids.get(number, 0)
        # They are deleted with the script, however it ends.
        request = AddMarkersRequest(markers=[marker for _, marker in items], until_disconnect=True)
        given = self._wire.call_aside(methods.AddMarkers, request).ids
        for (number, _), marker_id in zip(items, given, strict=True):
            self._ids.pop(number, None)
            self._ids[number] = marker_id

    def _make_room(self) -> None:
        oldest = list(islice(self._ids, _ROOM))
        try:
            self._delete(oldest)
        except error as refusal:
            self._say(f"old drawings stay: {refusal}")

    def _delete(self, numbers: Iterable[int]) -> None:
        ids = [self._ids.pop(number) for number in numbers]
        self._wire.call_aside(methods.DeleteMarkers, DeleteMarkersRequest(ids=ids))
