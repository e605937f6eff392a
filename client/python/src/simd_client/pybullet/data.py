"""Replaces `pybullet_data`: finds the robots of an installed one."""

from __future__ import annotations

import os
import site
import sys
import sysconfig
from pathlib import Path

# Where to look first; a folder that holds plane.urdf.
_VARIABLE = "PYBULLET_DATA"
_WHAT_TO_DO = (
    "pybullet_data is not installed. Its robots come with the package `pybullet` (pip install pybullet, on "
    "Python 3.11 or older), or as a copy of its folder pybullet_data: name that with the variable "
    f"{_VARIABLE}"
)


def getDataPath() -> str:
    """The folder of the robots that come with PyBullet.

    Raises:
        FileNotFoundError: if there is none, with what to install.
    """
    named = os.environ.get(_VARIABLE)
    if named:
        if not Path(named).is_dir():
            raise FileNotFoundError(f"{_VARIABLE} names {named}, which is not a folder")
        return named
    paths = sysconfig.get_paths()
    places = [*sys.path, paths["purelib"], paths["platlib"], site.getusersitepackages()]
    for place in places:
        folder = Path(place) / "pybullet_data"
        if (folder / "plane.urdf").is_file():
            return str(folder)
    raise FileNotFoundError(_WHAT_TO_DO)
