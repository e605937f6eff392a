"""Packages: their names, their `package.xml`, their contents, and ROS's folders of packages."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Sequence
from pathlib import Path

from simd_client.assets.boundary import real_path

MAX_ANCESTORS = 8
"""Maximum number of searched folders above the URDF."""

MAX_DEPTH = 4
"""Maximum depth of packages below an entry of `ROS_PACKAGE_PATH`."""

MAX_FOLDERS = 5_000
"""Maximum number of folders searched there."""


def ancestors(urdf_folder: Path) -> list[Path]:
    """Returns the folder of the URDF and those above it, nearest first. Both the given path and the real one
    count: either may hold the package if the URDF was reached through a symbolic link."""
    found: list[Path] = []
    for start in (urdf_folder.absolute(), real_path(urdf_folder)):
        if start is None:
            continue
        for folder in [start, *start.parents][:MAX_ANCESTORS]:
            # The root of the file system is not a package.
            if folder.parent == folder:
                break
            if folder not in found:
                found.append(folder)
    return found


def is_named(folder: Path, name: str) -> bool:
    """Whether the folder is the package of this name, by its folder name or by its manifest."""
    return folder.name == name or manifest_name(folder) == name


def looks_like_one(folder: Path) -> bool:
    """Whether the folder looks like some package."""
    return (folder / "package.xml").is_file() or (folder / "urdf").is_dir()


def home(above: Sequence[Path]) -> Path | None:
    """Returns the probable package of the URDF: relative and absolute paths can only refer to files in it."""
    for folder in above:
        if (folder / "package.xml").is_file():
            return folder
    # The limit is `NAME/urdf/arm/arm.urdf`: farther up, a folder with that name means little.
    for folder in above[:2]:
        if folder.name in ("urdf", "robots", "robot"):
            return folder.parent
    return above[0] if above else None


def manifest_name(folder: Path) -> str | None:
    """Returns `<name>` of the folder's `package.xml`, found by its text, since nothing else of it is
    needed."""
    path = folder / "package.xml"
    try:
        if not path.is_file():
            return None
        with path.open("rb") as file:
            text = file.read(64 * 1024).decode(errors="replace")
    except OSError:
        return None
    _, opened, after = text.partition("<name>")
    name, closed, _ = after.partition("</name>")
    return name.strip() if opened and closed else None


MODEL_PATHS = (
    "GZ_SIM_RESOURCE_PATH",
    "IGN_GAZEBO_RESOURCE_PATH",
    "GAZEBO_MODEL_PATH",
    "GAZEBO_RESOURCE_PATH",
    "SDF_PATH",
)
"""Variables of all Gazebo versions for their model folders."""


class RosPaths:
    """Package folders of ROS. They are searched once, on first use."""

    def __init__(
        self, package_path: Sequence[Path] = (), prefixes: Sequence[Path] = (), models: Sequence[Path] = ()
    ) -> None:
        self._package_path = tuple(package_path)
        self._prefixes = tuple(prefixes)
        self._models = tuple(models)
        self._crawled: dict[str, Path] | None = None

    @staticmethod
    def of_environment() -> RosPaths:
        """Reads `ROS_PACKAGE_PATH`, `AMENT_PREFIX_PATH` and Gazebo's variables for models."""

        def folders(name: str) -> list[Path]:
            listed = map(Path, filter(None, os.environ.get(name, "").split(os.pathsep)))
            return [folder for folder in listed if folder.is_absolute()]

        models = [folder for name in MODEL_PATHS for folder in folders(name)]
        return RosPaths(folders("ROS_PACKAGE_PATH"), folders("AMENT_PREFIX_PATH"), models)

    def folders(self, name: str) -> list[Path]:
        """Returns the folders of a package, the likeliest first."""
        crawled = self._packages().get(name)
        installed = (prefix / "share" / name for prefix in self._prefixes)
        models = (folder / name for folder in self._models)
        found = [folder for folder in (*installed, *models) if folder.is_dir()]
        return ([crawled] if crawled else []) + found

    def package_of(self, path: Path) -> Path | None:
        """Returns the folder of the package that contains a path."""
        for folder in self._packages().values():
            if path.is_relative_to(folder):
                return folder
        for prefix in self._prefixes:
            share = prefix / "share"
            if path.is_relative_to(share) and path != share:
                return share / path.relative_to(share).parts[0]
        return None

    def _packages(self) -> dict[str, Path]:
        """Searches like `rospack`: breadth first, not into packages, the first of a name counts."""
        if self._crawled is not None:
            return self._crawled
        found: dict[str, Path] = {}
        ahead = deque((folder, 0) for folder in self._package_path)
        for _ in range(MAX_FOLDERS):
            if not ahead:
                break
            folder, depth = ahead.popleft()
            name = manifest_name(folder)
            if name is not None:
                found.setdefault(name, folder)
            elif depth < MAX_DEPTH and not (folder / "CATKIN_IGNORE").exists():
                ahead.extend((inner, depth + 1) for inner in _folders_in(folder))
        self._crawled = found
        return found


def _folders_in(folder: Path) -> list[Path]:
    """Returns folders in the order of their names. Hidden ones and links are left out: links may lead in
    circles."""
    try:
        with os.scandir(folder) as entries:
            names = [
                e.name for e in entries if e.is_dir(follow_symlinks=False) and not e.name.startswith(".")
            ]
    except OSError:
        return []
    return [folder / name for name in sorted(names)]
