"""Finds simd's programs on this machine."""

from __future__ import annotations

import os
import shutil
from importlib import metadata
from pathlib import Path

from simd_client.errors import Unavailable

DAEMON = "SIMD_BINARY"
"""The environment variable that names the daemon's program."""

_PACKAGE = "simd-daemon"


def find(name: str, variable: str, beside: str | None = None) -> Path | None:
    """Returns the program that the variable names, else the one in the folder of a file. Without these it is the one of the
    package `simd-daemon`, else the one on the PATH.

    Raises `Unavailable` if the variable names a file that is not there.
    """
    named = os.environ.get(variable)
    if named:
        if not Path(named).is_file():
            raise Unavailable(f"{variable} names {named}, which is not there")
        return Path(named)
    if beside and Path(beside).with_name(name).is_file():
        return Path(beside).with_name(name)
    found = _installed(name) or shutil.which(name)
    return None if found is None else Path(found)


def _installed(name: str) -> Path | None:
    """Returns a program of the package `simd-daemon`, if this interpreter has it.

    An environment's program folder is on the PATH only while the environment is active.
    """
    try:
        files = metadata.files(_PACKAGE)
    except metadata.PackageNotFoundError:
        return None
    programs = (Path(str(file.locate())) for file in files or [] if file.name in (name, f"{name}.exe"))
    return next((program.resolve() for program in programs if program.is_file()), None)
