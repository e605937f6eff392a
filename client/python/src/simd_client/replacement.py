"""Files that take the place of others once they are whole."""

from __future__ import annotations

import errno
import itertools
import os
from pathlib import Path

_numbers = itertools.count()


def replace_file(path: Path, content: bytes) -> None:
    """Writes a file beside the one at the path, and puts it in its place once all of it is on the disk: a program that is
    killed meanwhile, and a disk that is full, leave the one before. It has the owner and the permissions of that one, and a link
    goes on leading to it. Written in place is what is no file, such as a pipe; what a standard stream goes to; and a file that may
    be written where another one of its owner may not be put beside it."""
    if path.exists() and (not path.is_file() or _is_stream(path)):
        path.write_bytes(content)
        return
    place = path.resolve()
    before = place.stat() if place.exists() else None
    if before is not None:
        # A file that may not be written may not be replaced either, though its folder would allow it.
        os.close(os.open(place, os.O_WRONLY))
    try:
        beside = _beside(place, before)
    except OSError as error:
        if before is None or error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise
        place.write_bytes(content)
        return
    try:
        with beside.open("r+b") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if before is not None:
            beside.chmod(before.st_mode & 0o7777)
        try:
            beside.replace(place)
        except OSError as error:
            # A file that is mounted by itself, as into a container.
            if error.errno != errno.EBUSY:
                raise
            place.write_bytes(content)
            beside.unlink()
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def _is_stream(path: Path) -> bool:
    """Whether standard input, output or error is this file: then it is another program's to replace."""
    for stream in range(3):
        try:
            if os.path.samestat(path.stat(), os.fstat(stream)):
                return True
        except OSError:  # It is closed.
            continue
    return False


def _beside(place: Path, before: os.stat_result | None) -> Path:
    """A new file in the same folder, of the owner of the one before, that allows no more than that one does."""
    mode = 0o666 if before is None else before.st_mode & 0o600
    while True:
        # Without the file's own name, to which nothing may fit. A program of the same number may have left one when it was killed.
        beside = place.with_name(f".simd-{os.getpid()}-{next(_numbers)}.new")
        try:
            made = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode | 0o600)
        except FileExistsError:
            continue
        try:
            own = os.fstat(made)
            if before is not None and (own.st_uid, own.st_gid) != (before.st_uid, before.st_gid):
                os.fchown(made, before.st_uid, before.st_gid)
        except BaseException:
            beside.unlink(missing_ok=True)
            raise
        finally:
            os.close(made)
        return beside
