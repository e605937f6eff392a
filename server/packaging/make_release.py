#!/usr/bin/env python3
"""Makes a release: sets the version, dates the changelog, builds all packages and lists what to upload.

`make release VERSION=0.2.0` runs it. A run that stopped after its commit continues with the packages.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
from datetime import UTC, datetime
from pathlib import Path

import release
from release import REPOSITORY, run

_VERSION = re.compile(r"(0|[1-9]\d*)\.(0|[1-9]\d*)\.(0|[1-9]\d*)")
_CHANGELOG = Path("CHANGELOG.md")
_WORKSPACE = Path("Cargo.toml")
_CLIENT = Path("client/python/src/simd_client/version.py")
# The schema of the last release, to which `make lint` compares the present one.
_SCHEMA = Path("proto/src/generated/simd.v1.bin")
_RELEASED_SCHEMA = Path("proto/released.binpb")


def main(version: str) -> None:
    """Commits the version if that is not done, and writes everything into `dist`."""
    import sbom  # It needs the packages of requirements.txt, and the rest does not.

    title = f"Release {version}"
    if run("git", "log", "-1", "--format=%s", cwd=REPOSITORY).strip() != title:
        _check(version)
        set_version(REPOSITORY, version, datetime.now(UTC).strftime("%Y-%m-%d"))
        run("cargo", "metadata", "--format-version=1", "--offline", cwd=REPOSITORY)  # It writes the lock file.
        run("git", "add", "--all", cwd=REPOSITORY)
        run("git", "commit", "--quiet", f"--message={title}", cwd=REPOSITORY)
    notes = section((REPOSITORY / _CHANGELOG).read_text(), version)
    commit = sbom.commit()
    run("make", "dist", cwd=REPOSITORY, env={**os.environ, "SIMD_COMMIT": commit})
    made = release.prepare()
    sbom.make(made, commit)
    (made.to / "RELEASE-NOTES.md").write_text(notes)
    sums = made.to / "SHA256SUMS"
    sums.unlink(missing_ok=True)
    files = sorted(made.to.iterdir())
    sums.write_text("".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files))
    print("\n".join(f"{path.stat().st_size / 1e6:8.2f} MB  {path.relative_to(REPOSITORY)}" for path in [*files, sums]))
    print(f"""
Tag the commit and publish it:

  git tag --annotate v{version} --file dist/RELEASE-NOTES.md --cleanup=verbatim
  git push origin main v{version}

Upload the files of dist/ to the page of the release v{version}, with RELEASE-NOTES.md as its text, and the wheels to the Python
index: python3 -m twine upload dist/*.whl""")


def _check(version: str) -> None:
    """Exits unless the version is the next one and the tree is clean."""
    numbers = _VERSION.fullmatch(version)
    if not numbers:
        raise SystemExit(f"{version!r} is not a version: write three numbers, such as VERSION=0.2.0")
    present = _present(REPOSITORY)
    if tuple(map(int, numbers.groups())) <= tuple(map(int, present.split("."))):
        raise SystemExit(f"the version is {present} already: the next one must be larger than it")
    if changed := run("git", "status", "--porcelain", cwd=REPOSITORY):
        raise SystemExit(f"commit or remove these changes first:\n{changed}")


def _present(root: Path) -> str:
    found = re.search(r'^version = "(.+)"$', (root / _WORKSPACE).read_text(), re.MULTILINE)
    if not found:
        raise SystemExit(f"{_WORKSPACE} has no version")
    return found[1]


def set_version(root: Path, version: str, date: str) -> None:
    """Writes the version into the Rust workspace, the Python client and the changelog, and keeps the schema."""
    if not section((root / _CHANGELOG).read_text(), "Unreleased").strip():
        raise SystemExit("the section Unreleased of CHANGELOG.md is empty: nothing has changed since the last release")
    present = _present(root)
    _replace(root / _WORKSPACE, f'version = "{present}"', f'version = "{version}"')
    _replace(root / _CLIENT, f'__version__ = "{present}"', f'__version__ = "{version}"')
    _replace(root / _CHANGELOG, "## Unreleased\n", f"## Unreleased\n\n## {version} ({date})\n")
    shutil.copy(root / _SCHEMA, root / _RELEASED_SCHEMA)


def _replace(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    if text.count(old) != 1:
        raise SystemExit(f"{path} has {text.count(old)} times {old!r}, and not once")
    path.write_text(text.replace(old, new))


def section(changelog: str, name: str) -> str:
    """Returns the text of a section of the changelog, without its heading."""
    found = re.search(rf"^## {re.escape(name)}\b[^\n]*\n(.*?)(?=^## |\Z)", changelog, re.MULTILINE | re.DOTALL)
    if not found:
        raise SystemExit(f"CHANGELOG.md has no section {name}")
    return found[1].strip() + "\n"


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("usage: make release VERSION=0.2.0")
    main(sys.argv[1])
