"""Whether a path stays inside a folder, by its text and by the disk."""

from __future__ import annotations

import os
from collections import deque
from enum import Enum
from pathlib import Path

MOST_LINKS = 64
"""More than the operating system itself follows."""


class Outcome(Enum):
    """Why a path in a folder does not lead to a file."""

    NOTHING = "there is nothing"
    LEADS_OUT = "a symbolic link leads out of the folder, be there anything at its end or not"


def inside(folder: Path, rest: Path) -> Path | Outcome:
    """Follows `rest` from `folder`, a real path, link by link, and looks at nothing outside of it:
    so that the caller cannot find out which paths exist outside. `..` goes where links have led."""
    links = 0
    at = folder
    ahead = deque(rest.parts)
    while ahead:
        step = ahead.popleft()
        if os.path.isabs(step):
            at = Path(step)
        elif step == "..":
            at = at.parent
        elif not at.is_relative_to(folder):
            # Outside: a link may lead back in, but nothing is looked at here.
            at = at / step
        else:
            following = at / step
            try:
                if not following.is_symlink():
                    following.lstat()
                    at = following
                    continue
                target = Path(os.readlink(following))
            except OSError:
                return Outcome.NOTHING
            links += 1
            if links > MOST_LINKS:
                return Outcome.NOTHING
            ahead.extendleft(reversed(target.parts))
    if not at.is_relative_to(folder):
        return Outcome.LEADS_OUT
    return at if os.path.lexists(at) else Outcome.NOTHING


def join_within(folder: Path, boundary: Path, rest: str) -> Path | None:
    """Joins without asking the disk, so that a path that climbs out is refused before the disk
    is asked. `None` if it does."""
    joined = folder
    for step in Path(rest).parts:
        if os.path.isabs(step):
            return None
        joined = joined.parent if step == ".." else joined / step
        if step == ".." and not joined.is_relative_to(boundary):
            return None
    return joined if joined.is_relative_to(boundary) else None


def real_path(path: Path) -> Path | None:
    """With all symbolic links resolved; `None` if it does not exist."""
    try:
        return path.resolve(strict=True)
    except (OSError, RuntimeError):
        return None
