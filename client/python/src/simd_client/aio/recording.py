"""A recording in progress."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING

from simd_client import proto
from simd_client.attributes import FixedAttributes
from simd_client.proto import methods
from simd_client.recording import RecordingInfo, recording_from_proto

if TYPE_CHECKING:
    from simd_client.aio.connection import Connection


class Recording(FixedAttributes):
    """A recording that the daemon makes until it is stopped, for instance at the end of a `with` block."""

    def __init__(self, connection: Connection, info: RecordingInfo) -> None:
        self._connection = connection
        self._info = info

    @property
    def info(self) -> RecordingInfo:
        """Its state at the start; once stopped, its final state."""
        return self._info

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self._info.name

    async def stop(self) -> RecordingInfo:
        """Ends the recording, and returns when its file is complete. Raises `RecordingNotPossible` if it has
        ended already."""
        request = proto.StopRecordingRequest(name=self.name)
        answer = await self._connection.call(methods.StopRecording, request)
        self._info = recording_from_proto(answer.recording)
        return self._info

    async def __aenter__(self) -> Recording:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.stop()

    def __repr__(self) -> str:
        return f"<Recording '{self.name}'>"
