"""The Python wheels `simd-daemon` and `simd-embedded`.

`simd-daemon` has the programs, for machines with pip and without a package manager. `simd-embedded` has
the extension module.

A wheel is a zip file whose folder `data/scripts` is installed among an environment's programs. maturin
would build the programs once more to write the same file, and takes the binaries of one crate only.
"""

from __future__ import annotations

import base64
import hashlib
import io
import time
import zipfile
from pathlib import Path

from release import PROGRAMS, REPOSITORY, Release, shared_library, target_folder

# Contents of METADATA, in the form of core metadata 2.4.
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


_EMBEDDED = """Metadata-Version: 2.4
Name: simd-embedded
Version: {version}
Summary: A world of simd within a Python program
License-Expression: Apache-2.0
License-File: LICENSE
License-File: THIRD-PARTY-LICENSES.txt
Requires-Python: >=3.10
Description-Content-Type: text/markdown

The extension module `simd_embedded`: the world and the services of the daemon `simd`, without a socket. With the package
`simd-client` it is `simd_client.connect("embedded")`, and what `simd_client.pybullet.connect(DIRECT)` opens.
"""


def make(release: Release, licences: str) -> Path:
    """Writes the programs' wheel, with a tag that fits the glibc that they need (PEP 600)."""
    major, minor = release.glibc
    stem = f"simd_daemon-{release.version}"
    files: dict[str, tuple[bytes, int]] = {
        f"{stem}.data/scripts/{name}": ((release.programs / name).read_bytes(), 0o755) for name in PROGRAMS
    }
    tag = f"py3-none-manylinux_{major}_{minor}_{release.machine}"
    return _write(release, stem, tag, _METADATA, licences, files)


def make_embedded(release: Release, licences: str) -> Path:
    """Writes the extension module's wheel, which is for the stable ABI of Python 3.10 and later."""
    module = release.programs / "simd_embedded.abi3.so"
    glibc = shared_library(target_folder() / "dist" / "libsimd_embedded.so", module)
    stem = f"simd_embedded-{release.version}"
    files = {module.name: (module.read_bytes(), 0o755)}
    tag = f"cp310-abi3-manylinux_{glibc[0]}_{glibc[1]}_{release.machine}"
    return _write(release, stem, tag, _EMBEDDED, licences, files)


def _write(
    release: Release, stem: str, tag: str, metadata: str, licences: str, content: dict[str, tuple[bytes, int]]
) -> Path:
    """Writes a wheel of these files, bytes and mode by name, with its metadata."""
    files = dict(content)
    about = f"{stem}.dist-info"
    texts = {
        "METADATA": metadata.format(version=release.version),
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
