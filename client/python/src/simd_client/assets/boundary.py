"""Whether a path stays inside a folder, by its text and on the disk."""

from __future__ import annotations

import os
from collections import deque
from enum import Enum
from pathlib import Path

MAX_LINKS = 64
"""Maximum number of links, more than the operating system follows."""


class Outcome(Enum):
    """Reason why a path in a folder does not lead to a file."""

    NOTHING = "there is nothing"
    LEADS_OUT = "a symbolic link leads out of the folder, be there anything at its end or not"


def inside(folder: Path, rest: Path) -> Path | Outcome:
    """Follows `rest` from `folder`, a real path, link by link, and examines nothing outside of it. So the
    caller cannot find out which paths exist outside. `..` is resolved after the links."""
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
            # The path is outside: a link may lead back in, but nothing is examined here.
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
            if links > MAX_LINKS:
                return Outcome.NOTHING
            ahead.extendleft(reversed(target.parts))
    if not at.is_relative_to(folder):
        return Outcome.LEADS_OUT
    return at if os.path.lexists(at) else Outcome.NOTHING


def join_within(folder: Path, boundary: Path, rest: str) -> Path | None:
    """Joins without disk access, so that a path that leaves the folder is refused before the disk is read.
    `None` if it leaves."""
    joined = folder
    for step in Path(rest).parts:
        if os.path.isabs(step):
            return None
        joined = joined.parent if step == ".." else joined / step
        if step == ".." and not joined.is_relative_to(boundary):
            return None
    return joined if joined.is_relative_to(boundary) else None


def real_path(path: Path) -> Path | None:
    """Returns the path with all symbolic links resolved; `None` if it does not exist."""
    try:
        return path.resolve(strict=True)
    except (OSError, RuntimeError):
        return None
