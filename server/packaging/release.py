"""Contents of packages: the built binaries, their version, and their places."""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGING = REPOSITORY / "server" / "packaging"
PROGRAMS = ("simd", "simctl", "simd-camera")

# Libraries that every system with glibc has: manylinux's list, without those that nothing here needs.
_SYSTEM_LIBRARIES = {"libc.so.6", "libm.so.6", "libgcc_s.so.1", "libdl.so.2", "libpthread.so.0", "librt.so.1"}


@dataclass(frozen=True)
class Release:
    """Contents of all packages."""

    version: str
    # The output of `uname -m`.
    machine: str
    # The binaries without their symbols, in `bin`; the symbols beside it.
    programs: Path
    # The time of all files, so that the same commit packs to the same bytes.
    time: int
    # The newest glibc whose symbols a binary needs.
    glibc: tuple[int, int]
    # Folder for packages.
    to: Path

    @property
    def name(self) -> str:
        """Name of the archive and of the folder in it."""
        return f"simd-{self.version}-{self.machine}-linux"


def run(*command: str | Path, **options: object) -> str:
    """Returns the output of a command. If it fails, prints its output and exits."""
    line = [str(part) for part in command]
    done: subprocess.CompletedProcess[str] = subprocess.run(line, stdout=subprocess.PIPE, text=True, **options)  # type: ignore[call-overload]
    if done.returncode != 0:
        raise SystemExit(f"{done.stdout}{line} failed with {done.returncode}")
    return done.stdout


def target_folder() -> Path:
    """Returns cargo's target folder."""
    return Path(os.environ.get("CARGO_TARGET_DIR") or REPOSITORY / "target")


def prepare() -> Release:
    """Takes the binaries that `cargo build --profile dist` made, and separates their symbols."""
    metadata = json.loads(run("cargo", "metadata", "--format-version=1", "--locked", "--no-deps", cwd=REPOSITORY))
    version = next(package["version"] for package in metadata["packages"] if package["name"] == "simd-server")
    time = os.environ.get("SOURCE_DATE_EPOCH") or run("git", "log", "-1", "--format=%ct", cwd=REPOSITORY)
    programs = target_folder() / "packages" / "programs"
    shutil.rmtree(programs, ignore_errors=True)
    programs.mkdir(parents=True)
    for name in PROGRAMS:
        _part(target_folder() / "dist" / name, programs)
    to = REPOSITORY / "dist"
    to.mkdir(exist_ok=True)
    glibc = max(_glibc(programs / name) for name in PROGRAMS)
    return Release(version, platform.machine(), programs, int(time), glibc, to)


def _part(built: Path, folder: Path) -> None:
    """Writes a binary without its symbols, and the symbols into a file that debuggers and backtraces find
    beside it."""
    program, symbols = folder / built.name, folder / f"{built.name}.debug"
    run("objcopy", "--only-keep-debug", "--compress-debug-sections", built, symbols)
    symbols.chmod(0o644)
    # The link has the file's name, without its folder, and its checksum.
    run("objcopy", "--strip-all", f"--add-gnu-debuglink={symbols.name}", built, program, cwd=folder)


def shared_library(built: Path, to: Path) -> tuple[int, int]:
    """Writes a shared library without its symbols. Returns the newest glibc whose symbols it needs."""
    run("objcopy", "--strip-unneeded", built, to)
    to.chmod(0o755)
    return _glibc(to)


def _glibc(program: Path) -> tuple[int, int]:
    """Returns the newest glibc whose symbols a file needs. Exits if it needs other libraries than the
    system's."""
    needed = set(re.findall(r"NEEDED\s+(\S+)", run("objdump", "-p", program)))
    others = {library for library in needed - _SYSTEM_LIBRARIES if not library.startswith("ld-linux")}
    if others:
        raise SystemExit(f"{program} needs {sorted(others)}, which not every system has")
    versions = re.findall(r"\(?GLIBC_(\d+)\.(\d+)", run("objdump", "-T", program))
    return max((int(major), int(minor)) for major, minor in versions)
