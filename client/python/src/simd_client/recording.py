"""Recordings, which the daemon makes on its disk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, cast

from simd_client import proto

RecordingState = Literal["recording", "complete", "unfinished"]


@dataclass(frozen=True)
class RecordingInfo:
    """A recording on the daemon's disk."""

    name: str
    state: RecordingState
    """State; `unfinished`: its last file was not completed, for instance because the daemon was killed."""
    files: Mapping[str, int]
    """The bytes of each of its files, in their order."""

    @property
    def bytes(self) -> int:
        """Total bytes of its files."""
        return sum(self.files.values())


def recording_from_proto(message: proto.Recording) -> RecordingInfo:
    """Converts a recording from its message."""
    state = proto.RecordingState.Name(message.state).removeprefix("RECORDING_STATE_").lower()
    return RecordingInfo(
        name=message.name,
        state=cast(RecordingState, state),
        files={file.name: file.bytes for file in message.files},
    )
