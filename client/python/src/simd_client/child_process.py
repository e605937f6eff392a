"""A program that is started for another one and ends with it."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO

# Maximum wall seconds until it ends, and until its last lines are read.
_END = 5.0
# Number of its last lines on stderr that are kept.
_LINES = 5


class ChildProcess:
    """A process that ends when its stdin closes, however this process ends."""

    def __init__(
        self, command: Sequence[str], defaults: Mapping[str, str], prints: bool = True, log: Path | None = None
    ) -> None:
        """Starts it. Variables of this process take precedence over `defaults`. Its stderr is appended to the
        file `log`, if there is one."""
        # Whether its stderr is printed.
        self.prints = prints
        self._log = log
        self._process = subprocess.Popen(
            [*command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**defaults, **os.environ},
            # Ctrl-C is for the script, which then ends the process.
            start_new_session=os.name == "posix",
        )
        self._last: deque[str] = deque(maxlen=_LINES)
        self._relay = threading.Thread(target=self._print, daemon=True)
        self._relay.start()

    @property
    def pid(self) -> int:
        """Id of the started process."""
        return self._process.pid

    @property
    def stdout(self) -> IO[str]:
        """Its output."""
        assert self._process.stdout is not None
        return self._process.stdout

    def forked(self) -> None:
        """Called in a forked process, which does not keep the program alive."""
        if self._process.stdin is not None:
            self._process.stdin.close()

    def running(self) -> bool:
        """Whether it is running."""
        return self._process.poll() is None

    def last_words(self) -> str:
        """Returns its last lines on stderr as one, once it has ended."""
        self._relay.join(_END)
        return " ".join(line.strip() for line in self._last)

    def end(self) -> None:
        """Ends the program and waits for its end."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            self._process.wait(_END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _print(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr, open(self._log or os.devnull, "a", encoding="utf-8") as log:
            for line in self._process.stderr:
                self._last.append(line)
                log.write(line)
                log.flush()
                if self.prints:
                    sys.stderr.write(line)
