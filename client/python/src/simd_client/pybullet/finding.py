"""Finds files in the places where PyBullet looks.

A script's file is searched in the working folder, in folders `data` there and above, and in the search paths.
A description's file (`UrdfFindMeshFile.h`) is searched in the folder of the description, in every folder
above, and then like a script's file.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from simd_client.assets import Locator, Missing

_DATA = ("", "data", "../data", "../../data", "../../../data", "../../../../data")
_SCHEMES = ("package://", "model://", "file://")


def places(name: str, search_paths: Sequence[str]) -> list[Path]:
    """Returns candidate paths of a file, in PyBullet's order: the given path, then below each folder, where
    `/` stays inside the folder."""
    below = name.lstrip("/")
    return list(dict.fromkeys([Path(name), *(Path(folder) / below for folder in (*_DATA, *search_paths))]))


class BulletLocator(Locator):
    """Finds a description's files like PyBullet, else like simd's clients. Names of meshes and pictures limit
    the files that may be sent; folders do not, since the script can read the same files."""

    def __init__(self, description: Path, search_paths: Sequence[str]) -> None:
        super().__init__(description)
        self._search_paths = list(search_paths)
        # Reasons for missing files, by URI.
        self.missing: dict[str, Missing] = {}

    def find(self, uri: str) -> Path:
        """Returns the real path of the file that `uri` names. Raises `Missing`."""
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
    """Returns the sentence for a missing file, with the searched places."""
    reason = locator.missing[uri].reason
    return f"{reason}: looked in the folder of the description and in every folder above it, in the working folder and in the search paths"
