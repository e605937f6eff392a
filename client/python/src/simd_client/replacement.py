"""Files that take the place of others once they are whole."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

_numbers = itertools.count()


def replace_file(path: Path, content: bytes) -> None:
    """Writes a file beside the one at the path, and puts it in its place once all of it is on the disk: a program that is
    killed meanwhile, and a disk that is full, leave the one before. It has the permissions of that one, and a link goes on
    leading to it. What is no file, such as a pipe, is written in place."""
    if path.exists() and not path.is_file():
        path.write_bytes(content)
        return
    place = path.resolve()
    mode = place.stat().st_mode & 0o777 if place.exists() else None
    if mode is not None:
        # A file that may not be written may not be replaced either, though its folder would allow it.
        place.open("r+b").close()
    beside = place.with_name(f"{place.name}.{os.getpid()}-{next(_numbers)}.new")

    def opened(name: str, flags: int) -> int:
        return os.open(name, flags, 0o666 if mode is None else mode)

    with open(beside, "xb", opener=opened) as file:
        try:
            if mode is not None:
                beside.chmod(mode)
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        except BaseException:
            beside.unlink(missing_ok=True)
            raise
    try:
        beside.replace(place)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
