"""The folder of what is kept: a folder for each test, and one for what is being recorded."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
from functools import cached_property
from pathlib import Path

from .recorded_states import ENDING

try:
    import fcntl
except ImportError:
    # Without locks nothing of other sessions is removed.
    fcntl = None

_BEGUN = "unfinished-"
_LOCK = "lock"
_LONGEST = 120


class Results:
    """The folder. It is made when the first test needs a world, and removed if nothing is kept."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._lock: int | None = None

    @cached_property
    def scratch(self) -> Path:
        """The folder of what is being recorded. It belongs to this process, and stays if the process is
        killed."""
        self.folder.mkdir(parents=True, exist_ok=True)
        # Others see it only with its lock held.
        hidden = Path(tempfile.mkdtemp(prefix=".", dir=self.folder))
        self._lock = os.open(hidden / _LOCK, os.O_CREAT | os.O_RDWR)
        if fcntl is not None:
            fcntl.flock(self._lock, fcntl.LOCK_EX)
        return hidden.rename(self.folder / f"{_BEGUN}{hidden.name.removeprefix('.')}")

    def of(self, test: str) -> Path:
        """Returns the folder for a test, by its id in pytest."""
        plain = re.sub(r"[^\w.-]+", "-", test.replace("::", ".").replace(".py", "").replace("/", "."))
        if len(plain) > _LONGEST or not re.fullmatch(r"[\w./:]+", test):
            # Other tests may have the same letters.
            plain = f"{plain[:_LONGEST]}-{hashlib.sha256(test.encode()).hexdigest()[:6]}"
        return self.folder / plain

    def put(self, test: str, made: Path) -> Path:
        """Moves a folder of files to its place. It replaces the folder of an earlier run."""
        place = self.of(test)
        for _ in range(3):
            shutil.rmtree(place, ignore_errors=True)
            try:
                return made.rename(place)
            except OSError:
                # Another session has put one there since.
                continue
        return made

    def remove(self, test: str) -> None:
        """Removes the files of an earlier run of a test."""
        shutil.rmtree(self.of(test), ignore_errors=True)

    def left(self) -> list[Path]:
        """Returns recordings of processes that ended during a test."""
        return sorted(file for folder in self._ended() for file in folder.glob(f"*{ENDING}"))

    def remove_left(self) -> None:
        """Removes the folders of killed processes."""
        for folder in self._ended():
            shutil.rmtree(folder, ignore_errors=True)

    def close(self) -> None:
        """Removes all files that are not kept."""
        if self._lock is not None:
            shutil.rmtree(self.scratch, ignore_errors=True)
            os.close(self._lock)
            self._lock = None
            try:
                self.folder.rmdir()
            except OSError:
                # Something is kept there.
                pass

    def _ended(self) -> list[Path]:
        """Returns folders whose process has ended without removing them."""
        return [folder for folder in self.folder.glob(f"{_BEGUN}*") if _is_free(folder / _LOCK)]


def _is_free(lock: Path) -> bool:
    if fcntl is None:
        return False
    try:
        opened = os.open(lock, os.O_RDWR)
    except OSError:
        return False
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(opened)
    return True
