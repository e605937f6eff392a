#!/usr/bin/env python3
"""Packs what `cargo build --profile dist` built into dist/: archives, a Debian package, Python wheels. `make dist` runs it."""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import archive
import deb
import licences
import release
import wheel


def main() -> None:
    """Makes all packages, and prints their sizes."""
    shutil.rmtree(release.REPOSITORY / "dist", ignore_errors=True)
    made = release.prepare()
    texts = licences.collect()
    with tempfile.TemporaryDirectory() as scratch:
        packages = archive.make(made, texts, Path(scratch))
        packages += [deb.make(made, texts, Path(scratch)), wheel.make(made, texts)]
        packages += [wheel.make_embedded(made, texts), _client(made)]
    for package in packages:
        print(f"{package.stat().st_size / 1e6:8.2f} MB  {package.relative_to(release.REPOSITORY)}")


def _client(made: release.Release) -> Path:
    """Builds the Python client's wheel with its build system."""
    source = release.REPOSITORY / "client" / "python"
    quiet = ["--quiet", "--disable-pip-version-check"]
    release.run(sys.executable, "-m", "pip", "wheel", *quiet, "--no-deps", "--wheel-dir", made.to, source)
    (path,) = made.to.glob("simd_client-*.whl")
    return path


if __name__ == "__main__":
    main()
