"""Events in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

from simd_client import proto
from simd_client.world import Stamp, stamp_from_proto


@dataclass(frozen=True)
class Event:
    """An event."""

    sequence: int
    """From 1, without gaps."""
    stamp: Stamp
    kind: str
    """Name of its field in the schema, for instance `entity_spawned`; empty for an event that only a newer
    client knows."""
    detail: Any
    """The message of that field, for instance `proto.EntitySpawned`."""
    missed: int = 0
    """Number of events before this one that were lost because this reader was too slow."""

    def __repr__(self) -> str:
        said = str(self.detail).replace("\n", " ").strip() if self.detail is not None else ""
        return f"<Event {self.sequence} at {self.stamp.sim_time:.6g} s: {self.kind or 'unknown'} {said}>"


def event_from_proto(message: proto.Event, missed: int = 0) -> Event:
    """Converts an event from its message."""
    kind = cast("str | None", message.WhichOneof("kind"))
    return Event(
        sequence=message.sequence,
        stamp=stamp_from_proto(message.stamp),
        kind=kind or "",
        detail=getattr(message, kind) if kind else None,
        missed=missed,
    )
