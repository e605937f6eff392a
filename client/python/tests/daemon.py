"""A separate daemon for tests: it runs on free ports of loopback, and always ends."""

from __future__ import annotations

import os
import re
import selectors
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from types import TracebackType

REPOSITORY = Path(__file__).parents[3]
ASSETS = REPOSITORY / "tests" / "assets"
BINARY = Path(os.environ.get("SIMD_BINARY") or REPOSITORY / "target" / "debug" / "simd")
START_SECONDS = 30.0
IS_WIDE = bool(os.environ.get("SIMD_WIDE"))
"""Whether `make wide` runs: also cases that take long and rarely find anything."""


class Daemon:
    """A process of `simd`."""

    def __init__(self, *arguments: str, name: str = "pytest", locator: str = "tcp/127.0.0.1:0") -> None:
        if not BINARY.is_file():
            raise FileNotFoundError(
                f"no daemon at {BINARY}: run `make build`, or say where it is in SIMD_BINARY"
            )
        self.name = name
        command = [str(BINARY), "--name", name, "--listen", "127.0.0.1:0", "--zenoh", locator]
        self._home = tempfile.mkdtemp(prefix="simd-")
        # Recordings go to the folder where the test ends them.
        environment = {**os.environ, "STATE_DIRECTORY": self._home}
        self.process = subprocess.Popen(
            [*command, "--log", "error", *arguments], stdout=subprocess.PIPE, text=True, env=environment
        )
        self.endpoint = self._ready()

    def _ready(self) -> str:
        """Returns the locator in the line that reports the ready daemon."""
        assert self.process.stdout is not None
        with selectors.DefaultSelector() as selector:
            selector.register(self.process.stdout, selectors.EVENT_READ)
            line = self.process.stdout.readline() if selector.select(START_SECONDS) else ""
        locator = re.search(r"\b((?:tcp|tls)/\S+:\d+)", line)
        page = re.search(r"\bhttps?://\S+:\d+", line)
        self.page = page.group(0) if page else ""
        if locator is None:
            self.kill()
            raise RuntimeError(f"the daemon did not say where it listens for Zenoh: {line!r}")
        return locator.group(1)

    def kill(self) -> None:
        """Kills it."""
        self.process.kill()
        self._wait()

    def stop(self) -> int:
        """Lets it drain; returns its exit code."""
        self.process.terminate()
        return self._wait()

    def _wait(self) -> int:
        try:
            return self.process.wait(timeout=START_SECONDS)
        finally:
            if self.process.stdout is not None:
                self.process.stdout.close()
            shutil.rmtree(self._home, ignore_errors=True)

    def __enter__(self) -> Daemon:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process.poll() is None:
            self.kill()


def within(seconds: float = 20.0) -> float:
    """Returns a deadline of a test, late enough for any busy machine."""
    return time.monotonic() + seconds
