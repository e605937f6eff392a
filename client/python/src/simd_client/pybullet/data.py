"""Replaces `pybullet_data`: an installed one's folder, else a folder with a few shapes and an arm of simd."""

from __future__ import annotations

import os
import site
import sys
import sysconfig
from pathlib import Path

# Preferred folder; it contains plane.urdf.
_VARIABLE = "PYBULLET_DATA"
# Planes, cubes, spheres and an arm, under the names that scripts use.
OWN = Path(__file__).with_name("robots")
WHAT_TO_DO = (
    "PyBullet's own robots come with the package `pybullet` (pip install pybullet, on Python 3.11 or older), or as a copy "
    f"of its folder pybullet_data: name that with the variable {_VARIABLE}"
)


def getDataPath() -> str:
    """Returns the folder of the robots that come with PyBullet, else a folder of simd's robots with the same
    names.

    Raises:
        FileNotFoundError: if the variable PYBULLET_DATA names no folder.
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
    return str(OWN)
