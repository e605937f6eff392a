"""A daemon that is started for a script and ends with it."""

from __future__ import annotations

import os
import re
import sys
import threading
import uuid
from pathlib import Path

from simd_client import extras

from . import programs
from .child_process import ChildProcess
from .errors import error

# Maximum wall seconds until a daemon reports that it is ready.
_START = 20.0
# Maximum number of robots: scripts make some ten thousand bodies.
BODIES = 32_768
# Variable that names the daemon's program.
VARIABLE = "SIMD_BINARY"


class DaemonProcess(ChildProcess):
    """A daemon process that this script started."""

    def __init__(self, program: Path) -> None:
        """Starts a daemon on free ports of this machine, and waits until it is ready.

        Raises:
            error: if it does not start, with its last output.
        """
        name = f"pybullet-{os.getpid()}-{uuid.uuid4().hex[:6]}"
        command = [str(program), "--name", name, "--listen", "127.0.0.1:0", "--zenoh", "tcp/127.0.0.1:0"]
        command += ["--until-stdin-closes", "--paused", "--log", "warn,zenoh=error"]
        # A shared daemon has stricter defaults.
        super().__init__(command, {"SIMD_SERVICE_ROBOTS": str(BODIES)})
        said = self._first_lines()
        locator = re.search(r"\btcp/[^\s,;]+", said)
        page = re.search(r"http://[^\s,;]+", said)
        if locator is None:
            self.end()
            why = said.strip() or self.last_words() or "it said nothing"
            raise error(f"{program} did not start as a daemon with Zenoh: {why}")
        # Its Zenoh locator and name.
        self.endpoint = f"{locator[0]}#{name}"
        # The address of its page, if it printed one.
        self.viewer = page[0] if page else None

    def _first_lines(self) -> str:
        """Reads the output of the daemon until it prints its Zenoh locator, ends, or takes too long."""
        said: list[str] = []
        done = threading.Event()

        def read() -> None:
            for line in self.stdout:
                said.append(line)
                if "tcp/" in line:
                    break
            done.set()

        threading.Thread(target=read, daemon=True).start()
        done.wait(_START)
        return "".join(said)


def binary() -> Path:
    """Returns the daemon's program.

    Raises:
        error: if there is none, with what to do.
    """
    found = programs.find("simd", VARIABLE)
    if found is None:
        raise error(
            f"no daemon answers, and none can be started: `simd` is not on the PATH; {extras.DAEMON}, "
            f"name the program with {VARIABLE}, or name a running daemon with SIMD_ENDPOINT"
        )
    return found


def start(why: str = "no daemon was running") -> DaemonProcess:
    """Starts a daemon and waits until it is ready. `why` is for a line on stderr.

    Raises:
        error: if it does not start, with its last output.
    """
    program = binary()
    running = DaemonProcess(program)
    print(f"simd: {why}; started {program} as {running.endpoint}", file=sys.stderr)
    return running
