"""Meshes from arrays, as files that the daemon reads."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Union

import numpy as np
import numpy.typing as npt

MAX_TRIANGLES = 1_000_000
"""Maximum number of triangles of a mesh from arrays. The daemon limits files separately."""


class Triangles(Protocol):
    """A mesh of trimesh, or a similar object."""

    @property
    def vertices(self) -> npt.ArrayLike:
        """One row each, metres."""
        ...

    @property
    def faces(self) -> npt.ArrayLike:
        """One row of three indices each."""
        ...


AnyMesh = Union[tuple[npt.ArrayLike, npt.ArrayLike], Triangles, str, "os.PathLike[str]"]
"""Arrays `(vertices, triangles)`, an object that has `vertices` and `faces`, or the path of a file."""


@dataclass(frozen=True)
class MeshFile:
    """A mesh as a file."""

    data: bytes
    name: str
    """File name; its extension names the format, for instance `.obj`."""


def mesh_file(mesh: AnyMesh) -> MeshFile:
    """Returns a file's content, or arrays as OBJ with all digits of their numbers. Raises `ValueError` for
    arrays that are not a mesh, and `OSError` for an unreadable file."""
    if isinstance(mesh, (str, os.PathLike)):
        path = Path(mesh).expanduser()
        return MeshFile(path.read_bytes(), path.name)
    given = mesh if isinstance(mesh, tuple) else (mesh.vertices, mesh.faces)
    vertices, triangles = np.asarray(given[0], dtype=np.float64), np.asarray(given[1])
    if vertices.ndim != 2 or vertices.shape[1] != 3 or len(vertices) < 3:
        raise ValueError(f"vertices are rows of 3 numbers, not of the shape {vertices.shape}")
    if not np.isfinite(vertices).all():
        raise ValueError("a vertex is not finite")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not 0 < len(triangles) <= MAX_TRIANGLES:
        raise ValueError(
            f"triangles are rows of 3 indices, at most {MAX_TRIANGLES:,}, not of the shape {triangles.shape}"
        )
    if not np.issubdtype(triangles.dtype, np.integer):
        raise ValueError(f"indices of vertices are whole numbers, not {triangles.dtype}")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise ValueError(f"a triangle has a vertex that is not one of the {len(vertices)}, counted from 0")
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    return MeshFile(("\n".join(lines) + "\n").encode(), "arrays.obj")
