"""The renderer of a connection. The first picture starts it if no other renderer draws the world; it ends with the
connection."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from simd_client import extras
from simd_client.child_process import ChildProcess
from simd_client.errors import Unavailable
from simd_client.programs import DAEMON, find
from simd_client.proto import ListCamerasRequest, methods

from .errors import error

if TYPE_CHECKING:
    from .wire import Wire

PROGRAM, VARIABLE = "simd-camera", "SIMD_CAMERA"
# Address at which a world in this process is served to it.
_ADDRESS = "127.0.0.1:0"
# Maximum wall seconds until it asks for work, and between two looks.
_START, _LOOK = 30.0, 0.02


class Renderer:
    """A renderer that is started on demand, at most once."""

    def __init__(self, wire: Wire, flags: Sequence[str] = ()) -> None:
        self._wire = wire
        # For its connection to the daemon.
        self._flags = flags
        # The started program, if any.
        self.process: ChildProcess | None = None
        # Reason why it cannot draw, for people.
        self._refusal: str | None = None

    def start(self) -> str | None:
        """Starts it, unless it runs, and waits until the world knows a renderer. Returns the reason if there is none, for people."""
        if self._refusal is None:
            try:
                self._refusal = self._wait(self._running())
            except (error, OSError) as problem:
                self._refusal = str(problem)
        return self._refusal

    def _running(self) -> ChildProcess:
        if self.process is None:
            path = program()
            endpoint = f"http://{self._wire.serve(_ADDRESS)}" if self._wire.is_embedded else self._wire.endpoint
            command = [str(path), "--endpoint", endpoint, *self._flags, "--until-stdin-closes"]
            self.process = ChildProcess(command, {"RUST_LOG": "warn"}, prints=False)
        return self.process

    def _wait(self, process: ChildProcess) -> str | None:
        until = time.monotonic() + _START
        while not self._wire.call(methods.ListCameras, ListCamerasRequest()).renderers:
            if not process.running():
                return process.last_words() or f"{PROGRAM} ended without a word"
            if time.monotonic() > until:
                return f"{PROGRAM} asked for no work within {_START:g} s"
            time.sleep(_LOOK)
        if not process.prints:
            process.prints = True
            print(f"simd: started {PROGRAM}, which draws the pictures", file=sys.stderr)
        return None

    def forked(self) -> None:
        """Called in a forked process, which does not keep the renderer alive."""
        if self.process is not None:
            self.process.forked()

    def end(self) -> None:
        """Ends it, if it was started."""
        if self.process is not None:
            self.process.end()


def program() -> Path:
    """Returns the renderer's program.

    Raises:
        error: if there is none, with what to do.
    """
    try:
        found = find(PROGRAM, VARIABLE, beside=os.environ.get(DAEMON))
    except Unavailable as problem:
        raise error(str(problem)) from None
    if found is None:
        raise error(f"`{PROGRAM}`, which draws them, is not on the PATH: {extras.DAEMON}, or name the program with {VARIABLE}")
    return found
