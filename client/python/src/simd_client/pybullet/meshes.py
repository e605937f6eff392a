"""Meshes for the shapes of scripts: files, and arrays of vertices."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arguments import indices as whole_numbers
from .arguments import vector
from .errors import error, unsupported

Vertices = NDArray[np.float64]

_FORMATS = (".obj", ".stl", ".dae")
# The end of a line of an OBJ file that continues in the next one.
_CONTINUED = re.compile(rb"\\[ \t]*\r?\n")
_MAX_BYTES = 256 * 1024 * 1024
# Maximum number of triangles of a mesh that is divided into convex parts; larger ones take too long.
MAX_DECOMPOSED_TRIANGLES = 20_000


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh that the daemon receives with its first body."""

    data: bytes
    # URI in the description of a body.
    uri: str
    sha256: str
    # Path on this disk; empty for arrays.
    file: str
    # Smallest and largest coordinates of its vertices.
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    # Whether it keeps its triangles, and does not become its convex hull.
    is_concave: bool = False
    # For a height field: number of heights along x and along y, and the height at its origin.
    samples: tuple[int, int] = (0, 0)
    middle: float = 0.0


def read(function: str, path: Path, is_concave: bool) -> Mesh:
    """Reads a mesh from a file.

    Raises:
        error: if it cannot be read, or is of no format that the daemon reads.
    """
    if path.suffix.lower() not in _FORMATS:
        raise error(f"{function}: {path.name} is not one of {', '.join(_FORMATS)}")
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise error(f"{function}: {path.name} has more than 256 MiB")
        data = path.read_bytes()
    except OSError as problem:
        raise error(f"{function}: {problem}") from None
    found = vertices(data, path.name)
    if found is None:
        raise unsupported(function, f"the size of {path.name} is not known: .obj and .stl are read here")
    return _mesh(function, data, path.suffix.lower(), str(path), found, is_concave)


def of_arrays(function: str, given: Any, triangles: Any) -> Mesh:
    """Builds a mesh from vertices, and three indices for each triangle; without triangles it is the convex
    hull."""
    points = np.array([vector(each, f"{function}: a vertex has 3 numbers") for each in given], dtype=np.float64)
    faces = whole_numbers(triangles if triangles is not None else (), f"{function}: indices must be whole numbers")
    if len(faces) % 3 or any(not 0 <= index < len(points) for index in faces):
        raise error(f"{function}: indices are of vertices, three for each triangle")
    if not faces:
        # Any triangles with all vertices: the hull is theirs.
        last = len(points) - 1
        faces = [index for i in range(0, last, 2) for index in (i, min(i + 1, last), min(i + 2, last))]
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += [f"f {faces[i] + 1} {faces[i + 1] + 1} {faces[i + 2] + 1}" for i in range(0, len(faces), 3)]
    data = ("\n".join(lines) + "\n").encode()
    is_concave = triangles is not None and 0 < len(faces) <= 3 * MAX_DECOMPOSED_TRIANGLES
    return _mesh(function, data, ".obj", "", points, is_concave)


def of_heights(function: str, given: Any, rows: int, columns: int, middle: float | None = None) -> Mesh:
    """Builds a height field one by one metre in size. `rows` heights lie along x, and `columns` of such rows
    along y, one after the other. As in PyBullet it is as far above its origin as below, unless `middle` is
    the height there."""
    try:
        heights = np.asarray(() if given is None else given, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise error(f"{function}: heightfieldData must be numbers") from None
    if rows < 2 or columns < 2 or len(heights) != rows * columns:
        raise error(
            f"{function}: heightfieldData has {len(heights)} numbers, and numHeightfieldRows by numHeightfieldColumns "
            f"is {rows} by {columns}: it must be as many, and at least 2 by 2"
        )
    if not np.isfinite(heights).all():
        raise error(f"{function}: heightfieldData has a value that is not a number")
    origin = float(heights.min() + heights.max()) / 2.0 if middle is None else middle
    table = heights.reshape(columns, rows) - origin
    # The file has the greatest y first, like an image.
    lines = [",".join(map(repr, row)) for row in table[::-1].tolist()]
    corners = np.array([[-0.5, -0.5, table.min()], [0.5, 0.5, table.max()]])
    made = _mesh(function, ("\n".join(lines) + "\n").encode(), ".csv", "", corners, True)
    return replace(made, samples=(rows, columns), middle=origin)


def vertices(data: bytes, name: str) -> Vertices | None:
    """Returns the vertices of an OBJ or STL file; `None` for others and for unreadable ones."""
    try:
        if name.lower().endswith(".obj"):
            lines = (line.split() for line in _CONTINUED.sub(b" ", data).splitlines())
            rows = [line[1:4] for line in lines if line and line[0] == b"v"]
            return np.array([[float(each) for each in row] for row in rows], dtype=np.float64).reshape(-1, 3)
        if name.lower().endswith(".stl"):
            return _of_stl(data)
    except ValueError:
        return None
    return None


def _of_stl(data: bytes) -> Vertices:
    count = int.from_bytes(data[80:84], "little")
    if len(data) == 84 + 50 * count:
        records = np.frombuffer(data, dtype=np.dtype([("f", "<f4", (4, 3)), ("a", "<u2")]), offset=84)
        return records["f"][:, 1:].reshape(-1, 3).astype(np.float64)
    rows = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", data)
    return np.array([[float(each) for each in row] for row in rows], dtype=np.float64).reshape(-1, 3)


def _mesh(function: str, data: bytes, suffix: str, file: str, points: Vertices, is_concave: bool) -> Mesh:
    if not len(points) or not np.isfinite(points).all():
        raise error(f"{function}: a mesh has vertices, and those are numbers")
    lower, upper = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    sha256 = hashlib.sha256(data).hexdigest()
    return Mesh(data, sha256 + suffix, sha256, file, tuple(lower), tuple(upper), is_concave)
