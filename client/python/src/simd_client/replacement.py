"""Files that replace others once they are complete."""

from __future__ import annotations

import errno
import itertools
import os
from pathlib import Path

_numbers = itertools.count()


def replace_file(path: Path, content: bytes) -> None:
    """Writes a temporary file in the same folder, and renames it to the path once all of it is on the disk. If the
    program is killed meanwhile, or the disk is full, the old file remains. The new file keeps the owner and
    the permissions, and a link keeps its target. Some paths are written in place: special files such as
    pipes, and targets of standard streams. So are writable files in folders that refuse a file with the same
    owner."""
    if path.exists() and (not path.is_file() or _is_stream(path)):
        path.write_bytes(content)
        return
    place = path.resolve()
    before = place.stat() if place.exists() else None
    if before is not None:
        # A read-only file must not be replaced, even if its folder would allow it.
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
            # A file may be mounted separately, for instance into a container.
            if error.errno != errno.EBUSY:
                raise
            place.write_bytes(content)
            beside.unlink()
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def _is_stream(path: Path) -> bool:
    """Whether standard input, output or error is this file: then another program replaces it."""
    for stream in range(3):
        try:
            if os.path.samestat(path.stat(), os.fstat(stream)):
                return True
        except OSError:  # It is closed.
            continue
    return False


def _beside(place: Path, before: os.stat_result | None) -> Path:
    """Creates a new file in the same folder, with the same owner and at most the permissions of the old
    one."""
    mode = 0o666 if before is None else before.st_mode & 0o600
    while True:
        # The name omits the file's name, which may be too long to extend. A killed program with the same
        # number may have left one.
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
