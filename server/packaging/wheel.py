"""The Python wheel `simd-daemon`: the programs, for a machine with pip and without a package manager.

A wheel is a zip file whose folder `data/scripts` goes where an environment has its programs. maturin would build the
programs once more to write the same, and takes the binaries of one crate only.
"""

from __future__ import annotations

import base64
import hashlib
import io
import time
import zipfile
from pathlib import Path

from release import PROGRAMS, REPOSITORY, Release

# What goes into METADATA, in the form of core metadata 2.4.
_METADATA = """Metadata-Version: 2.4
Name: simd-daemon
Version: {version}
Summary: The robot physics daemon simd, simctl to control it, and simd-camera to draw its cameras
License-Expression: Apache-2.0
License-File: LICENSE
License-File: THIRD-PARTY-LICENSES.txt
Requires-Python: >=3.8
Description-Content-Type: text/markdown

The programs `simd`, a headless robot physics daemon, `simctl`, and `simd-camera`, which draws its cameras. The package `simd-client` is its Python client; its module
`simd_client.pybullet` starts this daemon for a script that finds none.
"""


def make(release: Release, licences: str) -> Path:
    """The wheel, with a tag that is true for the glibc that the programs need (PEP 600)."""
    major, minor = release.glibc
    tag = f"py3-none-manylinux_{major}_{minor}_{release.machine}"
    stem = f"simd_daemon-{release.version}"
    about = f"{stem}.dist-info"
    files: dict[str, tuple[bytes, int]] = {
        f"{stem}.data/scripts/{name}": ((release.programs / name).read_bytes(), 0o755) for name in PROGRAMS
    }
    texts = {
        "METADATA": _METADATA.format(version=release.version),
        "WHEEL": f"Wheel-Version: 1.0\nGenerator: simd\nRoot-Is-Purelib: false\nTag: {tag}\n",
        "licenses/LICENSE": (REPOSITORY / "LICENSE").read_text(),
        "licenses/THIRD-PARTY-LICENSES.txt": licences,
    }
    files |= {f"{about}/{name}": (text.encode(), 0o644) for name, text in texts.items()}
    record = "".join(f"{name},sha256={_hash(data)},{len(data)}\n" for name, (data, _) in files.items())
    files[f"{about}/RECORD"] = (f"{record}{about}/RECORD,,\n".encode(), 0o644)

    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, (data, mode) in files.items():
            entry = zipfile.ZipInfo(name, time.gmtime(release.time)[:6])
            entry.external_attr = (0o100000 | mode) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    path = release.to / f"{stem}-{tag}.whl"
    path.write_bytes(packed.getvalue())
    return path


def _hash(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
