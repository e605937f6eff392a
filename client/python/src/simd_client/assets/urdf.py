"""Finds the URDF file at the path of a robot."""

from __future__ import annotations

import os
from pathlib import Path

from simd_client.errors import NoUrdf


def find_urdf(path: str | os.PathLike[str]) -> Path:
    """Returns the description at a path. It is the file itself, the only `.urdf` of a folder, or else the
    only one of its folder `urdf`; then the same for `model.sdf`.

    A `.xacro` file must be named explicitly. Raises `NoUrdf` if no file or more than one is found.
    """
    given = Path(path).expanduser()
    try:
        given.stat()
        file = _only_urdf(given) if given.is_dir() else given
    except OSError as error:
        raise NoUrdf(f"cannot read {given}: {error.strerror}") from error
    if not file.is_file():
        raise NoUrdf(f"{given} is neither a file nor a folder")
    return file


def _only_urdf(folder: Path) -> Path:
    inner = folder / "urdf"
    for ending in (".urdf", "model.sdf"):
        found = _files_in(folder, ending) or (_files_in(inner, ending) if inner.is_dir() else [])
        if len(found) == 1:
            return found[0]
        if found:
            raise NoUrdf(f"{folder} holds several {ending} files; name one of {', '.join(map(str, found))}")
    raise NoUrdf(f"{folder} holds no .urdf file, and neither does a folder `urdf` in it")


def _files_in(folder: Path, ending: str) -> list[Path]:
    """Sorted, so that the sentence that lists them is always the same."""
    return sorted(path for path in folder.iterdir() if path.name.lower().endswith(ending) and path.is_file())
