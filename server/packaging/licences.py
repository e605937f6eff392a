"""Licences of all code in the binaries: crates, Rust's standard library, and the packages of the page."""

from __future__ import annotations

import itertools
import json
import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

from release import REPOSITORY, run

# Accepted licences: one must be here for a crate with a choice, all for a crate with several.
_ACCEPTED = {
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CDLA-Permissive-2.0",
    "ISC",
    "MIT",
    # Used unchanged, and named with the address of its source.
    "MPL-2.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
}
_FILE = re.compile(r"(un)?licen[cs]e|copying|copyright|notice", re.IGNORECASE)
_WEB = REPOSITORY / "client" / "web"

# Packages that state their second licence only at the head of one of their sources.
_HEADS = {"@bufbuild/protobuf": "dist/esm/wire/varint.js"}

# Features of packages in addition to the default ones, as the Makefile builds them.
_FEATURES = "--features=simd-server/jemalloc"

# Crates that contain third-party sources, and the place of their licence.
_INSIDE = {"tikv-jemalloc-sys": "jemalloc/COPYING"}

# Text for crates without a licence file, from SPDX.
_MIT = """Copyright (c) {holders}

Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
documentation files (the "Software"), to deal in the Software without restriction, including without limitation the
rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and to permit
persons to whom the Software is furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial portions of the
Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE
WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR
COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR
OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
"""


@dataclass(frozen=True)
class Package:
    """A package that the binaries contain."""

    # The type of its package URL: `cargo` or `npm`; empty for Rust's standard library.
    kind: str
    name: str
    version: str
    licence: str
    source: str
    texts: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.name} {self.version}"


def packages() -> list[Package]:
    """Returns the packages of others in the binaries. Exits if one has no licence, or one that is not reviewed."""
    found = [*_crates(), *_page(), _standard_library()]
    for package in found:
        _accept(package)
    return found


def collect() -> str:
    """Returns the document: a line for each package, then each text with its packages."""
    found = packages()
    lines = ["Packages of others in simd, simctl and simd-camera, their licences, and where they come from.", ""]
    lines += [f"{package}: {package.licence} ({package.source})" for package in found]
    users: dict[str, list[str]] = defaultdict(list)
    for package in found:
        for text in package.texts:
            users[text].append(str(package))
    for text, names in users.items():
        lines += ["", "=" * 100, ", ".join(dict.fromkeys(names)), "=" * 100, "", text]
    return "\n".join(lines) + "\n"


def _crates() -> list[Package]:
    """Packages that `cargo tree` lists as linked. Macros run at compile time, and are not linked."""
    packages = ["--package=simd-server", "--package=simd-cli", "--package=simd-camera", "--package=simd-embedded"]
    edges = ["--edges=normal,no-proc-macro", "--prefix=none", "--format={p}"]
    linked = run("cargo", "tree", "--locked", _FEATURES, *packages, *edges, cwd=REPOSITORY)
    # `name v1.2.3`, and `(*)` if it was listed before.
    wanted = {tuple(line.split()[:2]) for line in linked.splitlines() if line}
    metadata = json.loads(run("cargo", "metadata", "--format-version=1", "--locked", _FEATURES, cwd=REPOSITORY))
    found: list[Package] = []
    for crate in sorted(metadata["packages"], key=lambda crate: (crate["name"], crate["version"])):
        # Crates without a source are ours.
        if crate["source"] is None or (crate["name"], f"v{crate['version']}") not in wanted:
            continue
        name = f"{crate['name']} {crate['version']}"
        licence = (crate["license"] or "").strip()
        texts = _files(Path(crate["manifest_path"]).parent) or [_standard_text(name, licence, crate["authors"])]
        if crate["name"] in _INSIDE:
            texts.append((Path(crate["manifest_path"]).parent / _INSIDE[crate["name"]]).read_text().strip())
        source = crate["repository"] or f"https://crates.io/crates/{crate['name']}"
        found.append(Package("cargo", crate["name"], crate["version"], licence, source, tuple(texts)))
    return found


def _page() -> list[Package]:
    """Packages of the page in the browser."""
    lock = json.loads((_WEB / "package-lock.json").read_text())
    found: list[Package] = []
    for place, package in lock["packages"].items():
        if not place or package.get("dev"):
            continue
        name = place.removeprefix("node_modules/")
        if not (_WEB / place).is_dir():
            raise SystemExit(f"{_WEB / place} is not there: `make web` installs it")
        texts = _files(_WEB / place) or [_standard_text(name, package["license"], [])]
        if name in _HEADS:
            source = (_WEB / place / _HEADS[name]).read_text()
            head = itertools.takewhile(lambda line: line.startswith("//"), source.splitlines())
            texts.append("\n".join(line.removeprefix("//").removeprefix(" ") for line in head))
        source = f"https://www.npmjs.com/package/{name}"
        found.append(Package("npm", name, package["version"], package["license"], source, tuple(texts)))
    return found


def _standard_library() -> Package:
    version = run("rustc", "--version", cwd=REPOSITORY).split()[1]
    apache = (REPOSITORY / "LICENSE").read_text().strip()
    return Package("", "Rust's standard library", version, "MIT OR Apache-2.0", "https://github.com/rust-lang/rust", (apache,))


def _files(folder: Path) -> list[str]:
    """Returns the licence files of a package."""
    files = [path for path in sorted(folder.glob("*")) if path.is_file() and _FILE.match(path.name)]
    return [path.read_text(errors="replace").strip() for path in files]


def _standard_text(name: str, licence: str, authors: list[str]) -> str:
    """Returns the text of a licence for a package without one."""
    choices = set(re.split(r"\s+OR\s+|\s*/\s*", licence))
    # The head of a source has the other half.
    choices |= {part for part in licence.strip("()").split(" AND ") if name in _HEADS}
    if "Apache-2.0" in choices:
        return (REPOSITORY / "LICENSE").read_text().strip()
    if "MIT" in choices:
        return _MIT.format(holders=", ".join(authors) or f"the authors of {name}")
    raise SystemExit(f"{name} is under {licence!r} and brings no text of it: look at it, and add what it needs here")


def _accept(package: Package) -> None:
    """Exits if the licence is not reviewed."""
    for clause in re.split(r"\s+AND\s+", package.licence.strip()):
        choices = {choice.strip() for choice in re.split(r"\s+OR\s+|\s*/\s*", clause.strip("()"))}
        if not choices & _ACCEPTED:
            raise SystemExit(f"{package} is under {package.licence!r}: look at it, and add it here if it may be in simd")
