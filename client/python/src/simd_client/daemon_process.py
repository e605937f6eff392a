"""A daemon that is started for a program and ends with it."""

from __future__ import annotations

import os
import re
import threading
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path

from simd_client import extras
from simd_client.child_process import ChildProcess
from simd_client.errors import Unavailable
from simd_client.programs import DAEMON, find

# Maximum wall seconds until a daemon reports that it is ready.
_START = 20.0
_NOTHING: Mapping[str, str] = {}


class DaemonProcess(ChildProcess):
    """A daemon process that this program started."""

    def __init__(
        self,
        program: Path,
        name: str,
        flags: Sequence[str],
        defaults: Mapping[str, str] = _NOTHING,
        log: Path | None = None,
    ) -> None:
        """Starts a daemon on free ports of this machine, and waits until it is ready. Its name begins with
        `name`. Variables of this process take precedence over `defaults`. Its log is appended to the file `log`,
        else printed.

        Raises `Unavailable` if it does not start, with its last output.
        """
        name = f"{name}-{os.getpid()}-{uuid.uuid4().hex[:6]}"
        command = [str(program), "--name", name, "--listen", "127.0.0.1:0", "--zenoh", "tcp/127.0.0.1:0"]
        super().__init__([*command, "--until-stdin-closes", *flags], defaults, prints=log is None, log=log)
        said = self._first_lines()
        locator = re.search(r"\btcp/[^\s,;]+", said)
        page = re.search(r"http://[^\s,;]+", said)
        if locator is None:
            self.end()
            why = said.strip() or self.last_words() or "it said nothing"
            raise Unavailable(f"{program} did not start as a daemon with Zenoh: {why}")
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
    """Returns the daemon's program. Raises `Unavailable` if there is none, with what to do."""
    found = find("simd", DAEMON)
    if found is None:
        raise Unavailable(
            f"no daemon can be started: `simd` is not on the PATH; {extras.DAEMON}, or name the program with {DAEMON}"
        )
    return found
