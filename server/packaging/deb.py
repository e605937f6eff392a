"""The Debian package, by dpkg-deb."""

from __future__ import annotations

import os
import shutil
from email.utils import formatdate
from pathlib import Path

from release import PACKAGING, Release, run
from tree import compress, install, settle

_ARCHITECTURES = {"x86_64": "amd64", "aarch64": "arm64"}
# The maintainer, from the variables that Debian's tools read.
_MAINTAINER = f"{os.environ.get('DEBFULLNAME', 'simd developers')} <{os.environ.get('DEBEMAIL', 'simd@localhost.localdomain')}>"


def make(release: Release, licences: str, scratch: Path) -> Path:
    """The package."""
    root = scratch / "deb"
    install(release, root / "usr", licences, zsh="zsh/vendor-completions")
    units = root / "lib" / "systemd" / "system"
    units.mkdir(parents=True)
    for unit in ("simd.service", "simd@.service"):
        shutil.copy(PACKAGING / "systemd" / unit, units)
    users = root / "usr" / "lib" / "sysusers.d"
    users.mkdir(parents=True)
    shutil.copy(PACKAGING / "systemd" / "sysusers.conf", users / "simd.conf")
    settings = root / "etc" / "simd"
    settings.mkdir(parents=True)
    (settings / "simd.toml").write_text(run(release.programs / "simd", "config", "default"))
    _documents(root / "usr" / "share" / "doc" / "simd", release)

    control = root / "DEBIAN"
    control.mkdir()
    for name in ("conffiles", "postinst", "prerm", "postrm"):
        shutil.copy(PACKAGING / "debian" / name, control)
    architecture = _ARCHITECTURES[release.machine]
    files = [path for path in root.rglob("*") if path.is_file() and control not in path.parents]
    values = {
        "VERSION": release.version,
        "MAINTAINER": _MAINTAINER,
        "ARCHITECTURE": architecture,
        "GLIBC": ".".join(map(str, release.glibc)),
        # Policy counts in KiB, and rounds each file up.
        "INSTALLED_SIZE": str(sum(-(-path.stat().st_size // 1024) for path in files)),
    }
    text = (PACKAGING / "debian" / "control.in").read_text()
    for key, value in values.items():
        text = text.replace(f"@{key}@", value)
    (control / "control").write_text(text)
    settle(root, release.time)
    (control / "md5sums").write_text(_sums(root, files))
    (control / "md5sums").chmod(0o644)

    package = release.to / f"simd_{release.version}_{architecture}.deb"
    environment = {**os.environ, "SOURCE_DATE_EPOCH": str(release.time)}
    run("dpkg-deb", "--root-owner-group", "-Zxz", "--build", root, package, env=environment)
    return package


def _documents(folder: Path, release: Release) -> None:
    """Permissions that policy requires."""
    shutil.copy(PACKAGING / "debian" / "copyright", folder)
    for name in ("THIRD-PARTY-LICENSES.txt", "CHANGELOG.md"):
        compress(folder / name)
    entry = f"""simd ({release.version}) unstable; urgency=medium

  * See /usr/share/doc/simd/CHANGELOG.md.gz.

 -- {_MAINTAINER}  {formatdate(release.time)}
"""
    (folder / "changelog").write_text(entry)
    compress(folder / "changelog")


def _sums(root: Path, files: list[Path]) -> str:
    paths = [str(path.relative_to(root)) for path in sorted(files)]
    return run("md5sum", "--", *paths, cwd=root)
