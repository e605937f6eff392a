"""The tar archives: an installation to be unpacked anywhere, and the symbols of its programs."""

from __future__ import annotations

import shutil
import tarfile
from pathlib import Path

from release import PACKAGING, PROGRAMS, REPOSITORY, Release, run
from tree import install, settle


def make(release: Release, licences: str, scratch: Path) -> list[Path]:
    """Writes both archives."""
    root = scratch / release.name
    install(release, root, licences)
    shutil.copy(REPOSITORY / "LICENSE", root)
    shutil.copy(REPOSITORY / "README.md", root)
    units = root / "lib" / "systemd" / "system"
    units.mkdir(parents=True)
    for unit in ("simd.service", "simd@.service"):
        # An archive for the whole machine is unpacked below /usr/local.
        text = (PACKAGING / "systemd" / unit).read_text().replace("/usr/bin/simd", "/usr/local/bin/simd")
        (units / unit).write_text(text)
    users = root / "lib" / "sysusers.d"
    users.mkdir()
    shutil.copy(PACKAGING / "systemd" / "sysusers.conf", users / "simd.conf")
    settings = root / "etc" / "simd"
    settings.mkdir(parents=True)
    (settings / "simd.toml").write_text(run(release.programs / "simd", "config", "default"))
    symbols = scratch / f"{release.name}-debug"
    symbols.mkdir()
    for name in PROGRAMS:
        shutil.copy(release.programs / f"{name}.debug", symbols)
    return [_pack(tree, release) for tree in (root, symbols)]


def _pack(root: Path, release: Release) -> Path:
    """Writes the tree as an archive, ordered by name and owned by root."""
    settle(root, release.time)

    def owned(member: tarfile.TarInfo) -> tarfile.TarInfo:
        member.uid = member.gid = 0
        member.uname = member.gname = "root"
        return member

    path = release.to / f"{root.name}.tar.xz"
    with tarfile.open(path, "w:xz") as archive:
        for member in [root, *sorted(root.rglob("*"))]:
            archive.add(member, member.relative_to(root.parent), recursive=False, filter=owned)
    return path
