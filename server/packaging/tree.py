"""Files of an installation below a prefix such as /usr, shared by the archive and the Debian package."""

from __future__ import annotations

import gzip
import os
import shutil
from pathlib import Path

from release import PACKAGING, PROGRAMS, REPOSITORY, Release, run

_DOCUMENTS = ("README.md", "CHANGELOG.md", "SECURITY.md", "docs/operations.md", "docs/daemon.md", "docs/configuration.md",
              "docs/simctl.md")
# Folder where each shell looks for a completion of simctl.
_COMPLETIONS = {
    "bash": "share/bash-completion/completions/simctl",
    "zsh": "share/{zsh}/_simctl",
    "fish": "share/fish/vendor_completions.d/simctl.fish",
}


def install(release: Release, prefix: Path, licences: str, zsh: str = "zsh/site-functions") -> None:
    """Writes programs, manual pages, completions and documents below a prefix."""
    programs = prefix / "bin"
    programs.mkdir(parents=True)
    for name in PROGRAMS:
        shutil.copy(release.programs / name, programs / name)
    manual = prefix / "share" / "man" / "man1"
    manual.mkdir(parents=True)
    for name in ("simd", "simd-camera"):
        (manual / f"{name}.1").write_text(run(programs / name, "--man"))
    run(programs / "simctl", "man", manual)
    for page in sorted(manual.glob("*.1")):
        compress(page)
    for shell, place in _COMPLETIONS.items():
        path = prefix / place.format(zsh=zsh)
        path.parent.mkdir(parents=True)
        path.write_text(run(programs / "simctl", "completions", shell))
    documents = prefix / "share" / "doc" / "simd"
    documents.mkdir(parents=True)
    for document in _DOCUMENTS:
        shutil.copy(REPOSITORY / document, documents)
    shutil.copy(PACKAGING / "systemd" / "realtime.conf", documents)
    (documents / "THIRD-PARTY-LICENSES.txt").write_text(licences)


def compress(path: Path) -> None:
    """Replaces a file by its gzip, without a name and a time in it."""
    with gzip.GzipFile(f"{path}.gz", "wb", compresslevel=9, mtime=0) as out:
        out.write(path.read_bytes())
    path.unlink()


def settle(root: Path, time: int) -> None:
    """Gives all files of a tree the same time, and their modes."""
    for path in [root, *root.rglob("*")]:
        is_program = path.is_dir() or path.parent.name == "bin" or path.parent.name == "DEBIAN" and path.name[:1] == "p"
        path.chmod(0o755 if is_program else 0o644)
        os.utime(path, (time, time))
