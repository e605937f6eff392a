"""Options of robots at their spawn, and single shapes that can be spawned without a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.description import Disposition, Finding, Severity
from simd_client.description_files import AnyPath
from simd_client.geometry import Pose, pose_to_proto, vector
from simd_client.layout import Layout
from simd_client.quantity import number
from simd_client.reset import JointValue, JointValues, resets_to_proto
from simd_client.state import Clamped
from simd_client.surface import Surface, Surfaces, surfaces_to_proto
from simd_client.target import BeyondLimit

UPRIGHT = (0, 0, 0, 1)
"""No rotation: a quaternion x y z w."""

Collision = Literal["mesh", "hull", "parts"]
"""Use of collision meshes. `"mesh"`: triangles for links that can never move, and hulls for others. `"hull"`:
hulls for all. `"parts"`: convex parts for all."""

JointPositions = JointValues
"""Initial joint positions: by joint name, in radians or metres or with a unit, or as an array in joint order.
Spherical joints take a quaternion x y z w."""

_MESH_SHAPES = {
    "mesh": proto.MeshShapes.MESH_SHAPES_MESH,
    "hull": proto.MeshShapes.MESH_SHAPES_HULL,
    "parts": proto.MeshShapes.MESH_SHAPES_DECOMPOSITION,
}

_BASES = {None: proto.Base.BASE_UNSPECIFIED, True: proto.Base.BASE_FIXED, False: proto.Base.BASE_FREE}


@dataclass(frozen=True)
class SpawnOptions:
    """Options of a robot at its spawn."""

    name: str = ""
    allow_renaming: bool = False
    pose: Pose = field(default_factory=Pose)
    fixed: bool | None = None
    passive: bool = False
    joint_positions: JointPositions | None = None
    scale: float | None = None
    strict: bool = False
    surfaces: Surfaces | None = None
    self_collision: bool = False
    srdf: bytes = b""
    collision: Collision = "mesh"
    model: str = ""
    beyond_limit: BeyondLimit | Literal["keep"] = "clamp"
    beside: bool = False

    def to_proto(self, source: proto.DescriptionSource) -> proto.SpawnEntityRequest:
        """Builds the request that spawns a description. Raises `ValueError` for another word for `collision`,
        and for a joint's position that is neither one number nor a quaternion."""
        mesh_shapes = _MESH_SHAPES.get(self.collision)
        if mesh_shapes is None:
            raise ValueError(f"collision is 'mesh', 'hull' or 'parts', and not {self.collision!r}")
        positions: dict[str, float] = {}
        orientations: dict[str, proto.Quaternion] = {}
        by_name: Mapping[str, JointValue] = self.joint_positions if isinstance(self.joint_positions, Mapping) else {}
        for joint, at in by_name.items():
            values = np.asarray(number(at, "position") if isinstance(at, str) else at, dtype=np.float64)
            if values.ndim == 0:
                positions[joint] = float(values)
            else:
                x, y, z, w = vector(values, 4, f"the orientation of joint {joint!r}").tolist()
                orientations[joint] = proto.Quaternion(x=x, y=y, z=z, w=w)
        passive, holding = proto.InitialMode.INITIAL_MODE_PASSIVE, proto.InitialMode.INITIAL_MODE_HOLDING
        return proto.SpawnEntityRequest(
            source=source,
            name=self.name,
            allow_renaming=self.allow_renaming,
            pose=pose_to_proto(self.pose),
            base=_BASES[self.fixed],
            initial_mode=passive if self.passive else holding,
            joint_positions=positions,
            joint_orientations=orientations,
            scale=self.scale,
            strict=self.strict,
            link_properties=surfaces_to_proto(self.surfaces),
            self_collision=self.self_collision,
            srdf=self.srdf,
            mesh_shapes=mesh_shapes,
            model=self.model,
            beside_others=self.beside,
            on_ground=self.beside,
        )


def starts_to_proto(layout: Layout, positions: JointPositions | None) -> list[proto.JointReset]:
    """Converts initial positions of a new robot's joints to messages; names from other robots of the same
    file are left out."""
    if isinstance(positions, Mapping):
        positions = {name: at for name, at in positions.items() if name in layout.by_name}
    return list(resets_to_proto(layout, positions, None))


def starts_clamped(clamped: Sequence[Clamped]) -> tuple[Finding, ...]:
    """Formats the findings of a report on initial positions beyond a limit."""
    return tuple(
        Finding(
            Severity.WARNING,
            Disposition.REPAIRED,
            f'joint "{each.joint}" limit',
            0,
            f"joint_positions has {each.requested:g}, which is beyond the limit; the joint starts at {each.applied:g}",
        )
        for each in clamped
    )


def srdf_bytes(path: AnyPath | None) -> bytes:
    """Returns the file's bytes, or none."""
    return b"" if path is None else Path(path).read_bytes()


def shape_options(
    shape: str,
    name: str,
    position: npt.ArrayLike,
    orientation: npt.ArrayLike,
    fixed: bool,
    friction: float | None,
    restitution: float | None,
) -> SpawnOptions:
    """Returns options for a single shape. A caller's name is used or refused; the shape's default may be
    changed."""
    pose, surface = Pose.of(position, orientation), Surface(friction, restitution)
    return SpawnOptions(name or shape, allow_renaming=not name, pose=pose, fixed=fixed, surfaces=surface)


def shape_source(
    shape: proto.Primitive, mass: float | None, color: Sequence[float] | None
) -> proto.DescriptionSource:
    """Returns the description of a single shape. Raises `ValueError` unless the mass is above 0."""
    if mass is not None:
        if not mass > 0.0:
            raise ValueError("a mass is above 0 kg; by default it is that of water")
        shape.mass = mass
    if color is not None:
        red, green, blue, alpha = vector([*color, 1.0][:4], 4, "a color").tolist()
        shape.color.CopyFrom(proto.Color(red=red, green=green, blue=blue, alpha=alpha))
    return proto.DescriptionSource(primitive=shape)


def height_field_file(
    heights: npt.ArrayLike, size: npt.ArrayLike
) -> tuple[bytes, tuple[float, float, float]]:
    """Returns the file of a height field of one by one metre, and the scale to its real size. Raises
    `ValueError` for an invalid height field."""
    table = np.asarray(heights, dtype=np.float64)
    if table.ndim != 2 or min(table.shape) < 2 or not np.isfinite(table).all():
        raise ValueError(f"heights are numbers in at least 2 rows and 2 columns; these have the shape {table.shape}")
    x, y = vector(size, 2, "the size of a height field").tolist()
    if not (x > 0.0 and y > 0.0):
        raise ValueError("the size of a height field is above 0 m along x and y")
    # The file has the greatest y first, like an image.
    lines = [",".join(map(repr, row)) for row in table[::-1].tolist()]
    return ("\n".join(lines) + "\n").encode(), (x, y, 1.0)
