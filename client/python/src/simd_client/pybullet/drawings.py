"""The drawings of one script: markers of the daemon, by PyBullet's item number."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice
from typing import TYPE_CHECKING

from simd_client.proto import AddMarkersRequest, DeleteMarkersRequest, Marker, methods

from .errors import error

if TYPE_CHECKING:
    from .wire import Wire

# How many of the oldest go where the daemon takes no more.
_ROOM = 512


class Drawings:
    """Those that are there, as far as the script knows: some go by themselves when their time is over."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        # The daemon's ids, the oldest first.
        self._ids: dict[int, int] = {}

    def draw(self, number: int, marker: Marker) -> bool:
        """Draws an item, in the place of the one of that number if there is one. Where the daemon takes no more, the script's
        oldest go. Returns whether some had to."""
        marker.id = self._ids.get(number, 0)
        try:
            self._send(number, marker)
            return False
        except error as refusal:
            if refusal.reason != "LIMIT_EXCEEDED" or not self._ids:
                raise
        self._delete(list(islice(self._ids, _ROOM)))
        marker.id = 0
        self._send(number, marker)
        return True

    def remove(self, number: int) -> None:
        """Removes one, if it is there."""
        if number in self._ids:
            self._delete([number])

    def remove_all(self) -> None:
        """Removes those of this script."""
        if self._ids:
            self._delete(list(self._ids))

    def _send(self, number: int, marker: Marker) -> None:
        # They go with the script, however it ends.
        request = AddMarkersRequest(markers=[marker], until_disconnect=True)
        self._ids.pop(number, None)
        self._ids[number] = self._wire.call(methods.AddMarkers, request).ids[0]

    def _delete(self, numbers: Iterable[int]) -> None:
        ids = [self._ids.pop(number) for number in numbers]
        self._wire.call(methods.DeleteMarkers, DeleteMarkersRequest(ids=ids))
