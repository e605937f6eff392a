"""A daemon that is started for a script and ends with it."""

from __future__ import annotations

import sys
from pathlib import Path

from simd_client import daemon_process
from simd_client.daemon_process import DaemonProcess
from simd_client.errors import Unavailable

from .errors import error

__all__ = ["BODIES", "DaemonProcess", "binary", "start"]

# Maximum number of robots: scripts make some ten thousand bodies.
BODIES = 32_768
_FLAGS = ("--paused", "--log", "warn,zenoh=error")


def binary() -> Path:
    """Returns the daemon's program.

    Raises:
        error: if there is none, with what to do.
    """
    try:
        return daemon_process.binary()
    except Unavailable as problem:
        raise error(f"{problem}, or name a running daemon with SIMD_ENDPOINT") from None


def start(why: str = "no daemon was running") -> DaemonProcess:
    """Starts a daemon and waits until it is ready. `why` is for a line on stderr.

    Raises:
        error: if it does not start, with its last output.
    """
    program = binary()
    try:
        # A shared daemon has stricter defaults.
        running = DaemonProcess(program, "pybullet", _FLAGS, {"SIMD_SERVICE_ROBOTS": str(BODIES)})
    except Unavailable as problem:
        raise error(str(problem)) from None
    print(f"simd: {why}; started {program} as {running.endpoint}", file=sys.stderr)
    return running
