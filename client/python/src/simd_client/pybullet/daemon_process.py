"""A daemon that is started for a script and ends with it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import threading
import uuid
from collections import deque
from importlib import metadata
from pathlib import Path

from simd_client import extras

from .errors import error

# Maximum wall seconds until a daemon reports that it is ready.
_START = 20.0
# Maximum wall seconds until it ends.
_END = 5.0
# Maximum number of robots: scripts make some ten thousand bodies.
BODIES = 32_768


class DaemonProcess:
    """A daemon process that this script started."""

    def __init__(self, process: subprocess.Popen[str], endpoint: str, viewer: str | None) -> None:
        self._process = process
        # Its Zenoh locator and name.
        self.endpoint = endpoint
        # The address of its page, if it printed one.
        self.viewer = viewer

    @property
    def pid(self) -> int:
        """Id of the started process."""
        return self._process.pid

    def forked(self) -> None:
        """Called in a forked process, which does not keep the daemon alive."""
        if self._process.stdin is not None:
            self._process.stdin.close()

    def running(self) -> bool:
        """Whether it is running."""
        return self._process.poll() is None

    def end(self) -> None:
        """Ends the daemon and waits for its end."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            self._process.wait(_END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()


def binary() -> Path:
    """Returns the daemon's program: $SIMD_BINARY, the program of the package `simd-daemon`, or `simd` on the
    PATH.

    Raises:
        error: if there is none, with what to do.
    """
    named = os.environ.get("SIMD_BINARY")
    if named:
        if not Path(named).is_file():
            raise error(f"SIMD_BINARY names {named}, which does not exist")
        return Path(named)
    installed = _installed()
    if installed is not None:
        return installed
    found = shutil.which("simd")
    if found is None:
        raise error(
            f"no daemon answers, and none can be started: `simd` is not on the PATH; {extras.DAEMON}, "
            "name the program with SIMD_BINARY, or name a running daemon with SIMD_ENDPOINT"
        )
    return Path(found)


def _installed() -> Path | None:
    """Returns the program of the package `simd-daemon`, if this interpreter has it.

    An environment's program folder is on the PATH only while the environment is active.
    """
    try:
        files = metadata.files("simd-daemon")
    except metadata.PackageNotFoundError:
        return None
    programs = (Path(str(file.locate())) for file in files or [] if file.name in ("simd", "simd.exe"))
    return next((program.resolve() for program in programs if program.is_file()), None)


def start(why: str = "no daemon was running") -> DaemonProcess:
    """Starts a daemon on free ports of this machine, and waits until it is ready. `why` is for a line on stderr.

    Raises:
        error: if it does not start, with its last output.
    """
    program = binary()
    name = f"pybullet-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    command = [str(program), "--name", name, "--listen", "127.0.0.1:0", "--zenoh", "tcp/127.0.0.1:0"]
    # The pipe to the daemon closes however this process ends.
    command += ["--until-stdin-closes", "--paused", "--log", "warn,zenoh=error"]
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shared daemon has stricter defaults; the environment takes precedence.
        env={"SIMD_SERVICE_ROBOTS": str(BODIES), **os.environ},
        # Ctrl-C is for the script, which then ends its daemon.
        start_new_session=os.name == "posix",
    )
    last: deque[str] = deque(maxlen=5)
    threading.Thread(target=_relay, args=(process, last), daemon=True).start()
    said = _first_lines(process)
    locator = re.search(r"\btcp/[^\s,;]+", said)
    page = re.search(r"http://[^\s,;]+", said)
    running = DaemonProcess(process, f"{locator[0]}#{name}" if locator else "", page[0] if page else None)
    if locator is None:
        running.end()
        why = said.strip() or " ".join(line.strip() for line in last) or "it said nothing"
        raise error(f"{program} did not start as a daemon with Zenoh: {why}")
    print(f"simd: {why}; started {program} as {running.endpoint}", file=sys.stderr)
    return running


def _first_lines(process: subprocess.Popen[str]) -> str:
    """Reads the output of the daemon until it prints its Zenoh locator, ends, or takes too long."""
    said: list[str] = []
    done = threading.Event()

    def read() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            said.append(line)
            if "tcp/" in line:
                break
        done.set()

    threading.Thread(target=read, daemon=True).start()
    done.wait(_START)
    return "".join(said)


def _relay(process: subprocess.Popen[str], last: deque[str]) -> None:
    """Prints the warnings of the daemon."""
    assert process.stderr is not None
    with process.stderr:
        for line in process.stderr:
            last.append(line)
            sys.stderr.write(line)
