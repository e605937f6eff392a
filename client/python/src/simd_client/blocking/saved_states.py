# Generated from simd_client/aio/saved_states.py by tools/make_blocking.py; do not edit.
"""Saved states of the world, and recordings of its motion."""

from __future__ import annotations

from pathlib import Path

from simd_client import proto
from simd_client.blocking.recording import Recording
from simd_client.blocking.rollouts import Rollouts
from simd_client.blocking.upload import send_saved_state, write_file
from simd_client.description_files import AnyPath
from simd_client.proto import methods
from simd_client.recording import RecordingInfo, recording_from_proto
from simd_client.world import SavedState, Stamp, saved_state_from_proto, stamp_from_proto


class SavedStates(Rollouts):
    """The part of a connection that saves states, restores them, and records."""

    def save_state(self, name: str = "", *, take_over: bool = False) -> SavedState:
        """Saves the state of the world in the daemon's memory. The daemon chooses a name if none is given.
        Raises `OwnedByAnother` if it would replace another client's, unless `take_over`: if the daemon
        requires tokens, that needs an admin's token."""
        answer = self.call(methods.SaveState, proto.SaveStateRequest(name=name, take_over=take_over))
        return saved_state_from_proto(answer.saved_state)

    def restore_state(self, saved_state: str | SavedState) -> Stamp:
        """Restores a saved state. Raises `SavedStateNotFound`."""
        request = proto.RestoreStateRequest(name=_name(saved_state))
        return stamp_from_proto(self.call(methods.RestoreState, request).stamp)

    def export_saved_state(self, saved_state: str | SavedState, path: AnyPath) -> Path:
        """Writes a saved state, with the descriptions and meshes of its robots, into a file on this disk; a file
        at the path is replaced. Raises `SavedStateNotFound`, and `LimitExceeded` for more than 128 MiB of meshes."""
        request = proto.ExportSavedStateRequest(name=_name(saved_state))
        answer = self.call_until_silent(methods.ExportSavedState, request)
        write_file(self, answer.sha256, Path(path))
        return Path(path)

    def import_saved_state(
        self, path: AnyPath, name: str = "", *, take_over: bool = False
    ) -> SavedState:
        """Reads such a file into the daemon's memory. After `restore_state` the world continues bit for bit
        as the exported one, on the same release and machine. By default the saved state keeps its name.
        Raises `InvalidSavedState`, and `OwnedByAnother` as `save_state` does."""
        sha256 = send_saved_state(self, Path(path))
        request = proto.ImportSavedStateRequest(sha256=sha256, name=name, take_over=take_over)
        answer = self.call_until_silent(methods.ImportSavedState, request)
        return saved_state_from_proto(answer.saved_state)

    def saved_states(self) -> list[SavedState]:
        """Returns the saved states, oldest first."""
        answer = self.call(methods.ListSavedStates, proto.ListSavedStatesRequest())
        return [saved_state_from_proto(each) for each in answer.saved_states]

    def delete_saved_state(self, saved_state: str | SavedState, *, take_over: bool = False) -> None:
        """Deletes a saved state. Raises `SavedStateNotFound`, and `OwnedByAnother` as `save_state` does."""
        request = proto.DeleteSavedStateRequest(name=_name(saved_state), take_over=take_over)
        self.call(methods.DeleteSavedState, request)

    def record(
        self,
        name: str = "",
        *,
        rate: float = 100.0,
        keep_last: float = 0.0,
        max_bytes: int = 0,
        max_duration: float = 0.0,
    ) -> Recording:
        """Begins a recording on the daemon's disk: every command from now on, and joint states and link poses
        at `rate` per simulated second (0: none). It can be used in a `with` block, which ends it.

        `keep_last` keeps only that many seconds, in several files. The recording ends at `max_bytes` or after
        `max_duration` seconds; 0 means no limit. Raises `RecordingNotPossible`, `RecordingExists`,
        `InvalidValue`.
        """
        request = proto.StartRecordingRequest(
            name=name, state_rate=rate, keep_last=keep_last, max_bytes=max_bytes, max_duration=max_duration
        )
        answer = self.call(methods.StartRecording, request)
        return Recording(self, recording_from_proto(answer.recording))

    def recordings(self) -> tuple[RecordingInfo, ...]:
        """Returns the recordings on the daemon's disk, by name."""
        answer = self.call(methods.ListRecordings, proto.ListRecordingsRequest())
        return tuple(recording_from_proto(each) for each in answer.recordings)

    def delete_recording(self, name: str) -> None:
        """Deletes the files of a recording. Raises `RecordingNotFound`."""
        self.call(methods.DeleteRecording, proto.DeleteRecordingRequest(name=name))


def _name(saved_state: str | SavedState) -> str:
    return saved_state if isinstance(saved_state, str) else saved_state.name
