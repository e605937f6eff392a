"""Files where PyBullet looks for them.

A file that a script names is looked for in the working folder, in folders `data` there and above, and in the search paths. One that a
description names (`UrdfFindMeshFile.h`) is looked for in the folder of the description and in every folder above, and then as a script's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from simd_client.assets import Locator, Missing

_DATA = ("", "data", "../data", "../../data", "../../../data", "../../../../data")
_SCHEMES = ("package://", "model://", "file://")


def places(name: str, search_paths: Sequence[str]) -> list[Path]:
    """Where a file of that name may be, in PyBullet's order: as it is named, then below each folder, where `/` leads nowhere else."""
    below = name.lstrip("/")
    return list(dict.fromkeys([Path(name), *(Path(folder) / below for folder in (*_DATA, *search_paths))]))


class BulletLocator(Locator):
    """Finds the files of a description where PyBullet does, else where simd's clients do. What may be sent is bounded by the names of
    meshes and pictures, and not by folders: the script reads the same files."""

    def __init__(self, description: Path, search_paths: Sequence[str]) -> None:
        super().__init__(description)
        self._search_paths = list(search_paths)
        # Why there is none, by URI.
        self.missing: dict[str, Missing] = {}

    def find(self, uri: str) -> Path:
        """The real path of the file that `uri` names. Raises `Missing`."""
        for place in self._places(uri):
            if place.suffix.lower().removeprefix(".") in self._extensions and place.is_file():
                return place.resolve()
        try:
            return super().find(uri)
        except Missing as missing:
            self.missing[uri] = missing
            raise

    def _places(self, uri: str) -> Iterator[Path]:
        name = next((uri.removeprefix(scheme) for scheme in _SCHEMES if uri.startswith(scheme)), uri)
        if not name or "\0" in name:
            return
        folder = self._folder.absolute()
        for above in (folder, *folder.parents):
            yield above / name
        yield from (Path("..") / name, Path("../..") / name)
        yield from places(name, self._search_paths)


def said(locator: BulletLocator, uri: str) -> str:
    """That a file is not found, and where it was looked for."""
    reason = locator.missing[uri].reason
    return f"{reason}: looked in the folder of the description and in every folder above it, in the working folder and in the search paths"
