"""A URDF on this disk, and the files that it refers to."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path

from simd_client import proto
from simd_client.assets import Locator, Missing, find_urdf, includes
from simd_client.errors import XacroError
from simd_client.expansion import Arguments, expanded, is_xacro

PART_BYTES = 1024 * 1024
"""Bytes in one message: far below the daemon's limit, and large enough that round trips do not matter."""

_MESHES_WITH_FILES = (".obj", ".mtl", ".dae", ".gltf", ".glb")

AnyPath = str | os.PathLike[str]
Packages = Mapping[str, AnyPath]
"""Folders of ROS packages by package name."""


class DescriptionFiles:
    """A URDF, and the files found for its URIs."""

    def __init__(
        self,
        path: AnyPath,
        packages: Packages | None,
        xacro_arguments: Arguments | None = None,
        locator: Locator | None = None,
    ) -> None:
        """Expands a xacro file; the optional `locator` finds files. Raises `NoUrdf` if no URDF exists at the
        path, and `XacroError`."""
        urdf = find_urdf(path)
        self.name = urdf.name
        if is_xacro(urdf):
            self.urdf = expanded(urdf, xacro_arguments, packages)
        elif xacro_arguments:
            raise XacroError(f"{urdf} is not a .xacro file, so it takes no xacro arguments")
        else:
            self.urdf = urdf.read_bytes()
        self._locator = Locator(urdf, packages) if locator is None else locator
        self.includes = includes(urdf)
        """Whether it is an SDF or MJCF; its included files may name further files."""
        self.hashes: dict[str, str] = {}
        """By URI."""
        self.paths: dict[str, Path] = {}
        """By hash."""
        self.missing: dict[str, proto.AssetSearch] = {}
        """By URI."""

    def knows(self, uri: str) -> bool:
        """Whether the URI was looked up."""
        return uri in self.hashes or uri in self.missing

    def find(self, uris: list[str]) -> None:
        """Finds and hashes files that were not looked up yet; a visual and its collision shape often share
        one."""
        known = {path: sha256 for sha256, path in self.paths.items()}
        for uri in uris:
            if self.knows(uri):
                continue
            try:
                path = self._locator.find(uri)
            except Missing as missing:
                self.missing[uri] = proto.AssetSearch(places=missing.places_for_report())
                continue
            if path not in known:
                known[path] = hash_of(path)
            self.hashes[uri] = known[path]
            self.paths[known[path]] = path


    def name_more(self, hashes: list[str]) -> bool:
        """Whether any of these files may name others: an included SDF or MJCF, or a mesh with pictures."""
        return any(self.includes or self.paths[each].suffix.lower() in _MESHES_WITH_FILES for each in hashes)


def part_of(path: Path, offset: int) -> bytes:
    """Returns the bytes of a file from an offset on, as many as fit into one message."""
    with path.open("rb") as file:
        file.seek(offset)
        return file.read(PART_BYTES)


def hash_of(path: Path) -> str:
    """Returns the SHA-256 of a file, in lower-case hexadecimal."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while part := file.read(PART_BYTES):
            digest.update(part)
    return digest.hexdigest()
