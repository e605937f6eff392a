"""Maps a URI in a URDF to a file on this disk."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simd_client.assets import package
from simd_client.assets.boundary import Outcome, inside, join_within, real_path
from simd_client.assets.missing import Missing, Why
from simd_client.assets.package import RosPaths
from simd_client.assets.uri import Absolute, InPackage, Relative, Unreadable, readings

EXTENSIONS = frozenset(
    (
        "stl obj dae ply off gltf glb bin mtl 3ds 3mf fbx wrl x3d msh usd usda usdc usdz step stp iges igs "
        "png jpg jpeg bmp tga tif tiff gif webp dds hdr"
    ).split()
)
"""File extensions that a URDF may name. Without this list, `package://.ssh/id_rsa` in an untrusted URDF would
make a client upload a private key."""

DESCRIPTIONS = frozenset(("sdf", "world", "xml", "mjcf", "config"))
"""File extensions that an SDF or MJCF may include: such text becomes a part of a robot that is sent."""


def includes(description: str | os.PathLike[str]) -> bool:
    """Whether a file, by its name, may include others."""
    return Path(description).suffix.lower().removeprefix(".") in DESCRIPTIONS


class Locator:
    """Finds the files that one URDF refers to."""

    def __init__(
        self,
        urdf: str | os.PathLike[str],
        packages: Mapping[str, str | os.PathLike[str]] | None = None,
        ros: RosPaths | None = None,
    ) -> None:
        """Prepares the search for a URDF file. Packages are searched in `packages`, then in ROS's folders (by
        default from this process's environment), then in the folders above the file."""
        self._folder = Path(urdf).parent
        self._extensions = EXTENSIONS | DESCRIPTIONS | {"urdf"} if includes(urdf) else EXTENSIONS
        self._packages = {name: Path(folder) for name, folder in (packages or {}).items()}
        self._ros = RosPaths.of_environment() if ros is None else ros

    def find(self, uri: str) -> Path:
        """Returns the real path of the file that `uri` names.

        Raises `Missing` if the file does not exist, is outside of its package, or is neither a mesh nor an
        image by its name.
        """
        try:
            wanted = readings(uri)
        except Unreadable as unreadable:
            raise Missing(uri, unreadable.why) from None
        above = package.ancestors(self._folder)
        search = _Search(self._extensions)
        # Files in other case are used only if none has the written case.
        for search.any_case in (False, True):
            for reading in wanted:
                if isinstance(reading, InPackage):
                    found = self._in_package(search, above, reading)
                elif isinstance(reading, Absolute):
                    found = self._absolute(search, above, Path(reading.path))
                else:
                    found = self._relative(search, reading.path)
                found = found or self._in_roots(search, above, reading)
                if found is not None:
                    return found
        raise Missing(uri, search.why or Why.MISSING, search.places)

    def _in_roots(self, search: _Search, above: Sequence[Path], uri: InPackage | Absolute | Relative) -> Path | None:
        """Exports name files relative to the folder of their package, even if the URDF lies deeper."""
        if isinstance(uri, Absolute) or (isinstance(uri, InPackage) and uri.name):
            return None
        rest = uri.rest if isinstance(uri, InPackage) else uri.path
        folders = [folder for folder in above if package.looks_like_one(folder)]
        home = package.home(above)
        if home is not None and home not in folders:
            folders.append(home)
        for folder in folders:
            # A path that leaves a package is not relative to its folder.
            if join_within(folder, folder, rest) is None:
                continue
            found = search.look(folder, folder, rest, None)
            if found is not None:
                return found
        return None

    def _in_package(self, search: _Search, above: Sequence[Path], uri: InPackage) -> Path | None:
        """Returns folders in order of likelihood. The files of an installed package may be links into its
        source."""
        folders: list[tuple[Path, str | None]] = []
        if uri.name in self._packages:
            folders.append((self._packages[uri.name], None))
        if uri.name:
            folders.extend((folder, uri.name) for folder in self._ros.folders(uri.name))
            for folder in above:
                if package.is_named(folder, uri.name):
                    folders.append((folder, None))
                folders.append((folder / uri.name, None))
                # Folder of models beside the folder of worlds: `models/NAME` for `worlds/w.sdf`.
                folders.append((folder / "models" / uri.name, None))
        # Users often rename the folder of an export, but not the URDF in it.
        folders.extend((folder, None) for folder in above if package.looks_like_one(folder))
        for folder, installed in folders:
            found = search.look(folder, folder, uri.rest, installed)
            if found is not None:
                return found
        return None

    def _relative(self, search: _Search, path: str) -> Path | None:
        folder = self._folder.absolute()
        # Followed like any other program of this machine's user follows it.
        boundary = Path(folder.anchor)
        found = search.look(folder, boundary, path, None)
        # Again from the real folder, in which `..` may mean something else.
        real, real_boundary = real_path(folder), real_path(boundary)
        if found is not None or real is None or real_boundary is None or real == folder:
            return found
        return search.look(real, real_boundary, path, None)

    def _absolute(self, search: _Search, above: Sequence[Path], path: Path) -> Path | None:
        folders = list(self._packages.values())
        home, installed = package.home(above), self._ros.package_of(path)
        folders.extend(folder for folder in (home, installed) if folder is not None)
        for folder in above:
            if path.is_relative_to(folder) and path != folder:
                beside = folder / path.relative_to(folder).parts[0]
                if (beside / "package.xml").is_file():
                    folders.append(beside)
        is_known = False
        for given in folders:
            folder = given.absolute()
            for start in (folder, real_path(folder) or folder):
                if path.is_relative_to(start):
                    is_known = True
                    found = search.look(start, start, str(path.relative_to(start)), start.name)
                    if found is not None:
                        return found
        if not is_known:
            search.pass_by(Why.ABSOLUTE_OUTSIDE)
        return None


@dataclass
class _Search:
    """One search: the examined places, and reasons for rejected files."""

    extensions: frozenset[str]
    any_case: bool = False
    places: list[Path] = field(default_factory=list[Path])
    why: Why | None = None

    def look(self, folder: Path, boundary: Path, rest: str, installed: str | None) -> Path | None:
        """Returns the real path of `folder/rest`, if it is a file that may be sent. Links of an `installed`
        package may lead into the source of the package with that name."""
        candidate = join_within(folder, boundary, rest)
        if candidate is None:
            self.pass_by(Why.CLIMBS_OUT)
            return None
        if candidate not in self.places:
            self.places.append(candidate)
        top = real_path(boundary)
        if top is None:
            return None
        way = candidate.relative_to(boundary)
        found = inside(top, way)
        if found is Outcome.NOTHING and self.any_case:
            found = self._in_other_case(top, way)
        if found is Outcome.LEADS_OUT:
            real = real_path(candidate) if installed else None
            if real is None or all(
                package.manifest_name(above) != installed for above in [real, *real.parents]
            ):
                self.pass_by(Why.LINK_LEADS_OUT)
                return None
            found = real
        if not isinstance(found, Path) or not found.is_file():
            return None
        if found.suffix.lower().removeprefix(".") not in self.extensions:
            self.pass_by(Why.NOT_A_MESH)
            return None
        return found

    def _in_other_case(self, top: Path, rest: Path) -> Path | Outcome:
        """Returns the one path that differs from `rest` only in capital letters."""
        at = Path()
        for step in rest.parts:
            if isinstance(inside(top, at / step), Path):
                at = at / step
                continue
            folder = inside(top, at)
            if not isinstance(folder, Path):
                return Outcome.NOTHING
            try:
                alike = [name for name in os.listdir(folder) if name.lower() == step.lower()]
            except OSError:
                return Outcome.NOTHING
            if len(alike) > 1:
                self.pass_by(Why.AMBIGUOUS)
            if len(alike) != 1:
                return Outcome.NOTHING
            at = at / alike[0]
        found = inside(top, at)
        return found if isinstance(found, Path) else Outcome.NOTHING

    def pass_by(self, why: Why) -> None:
        """The first reason is kept: it belongs to the likeliest place."""
        self.why = self.why or why
