"""Single shapes: the ground, a box to push."""

from __future__ import annotations

from collections.abc import Sequence

import numpy.typing as npt

from simd_client import proto
from simd_client.geometry import Pose, vector, vector_to_proto
from simd_client.loading import Loading, Made
from simd_client.plans import robots
from simd_client.plans.robots import Options
from simd_client.surface import Surface

UPRIGHT = (0, 0, 0, 1)


class Primitives(Loading[Made]):
    """Brings robots of one link, `link`, into a world: lengths in metres, masses in kilograms.

    Without a mass they weigh what water does, 1,000 kg/m^3; their inertia is that of the shape filled
    evenly. `position` and `orientation` (x y z w) are of the shape's centre. `fixed` bolts them to the world.
    An empty name is that of the shape, with `_1`, `_2`, ... where it is taken.
    """

    def _spawned(self, source: proto.DescriptionSource, options: Options) -> Made:
        return self._loaded(robots.spawn(self._memory, source, options))

    def add_box(
        self,
        size: npt.ArrayLike,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Made:
        """A box with sides of the full lengths `size`. `color` is red, green, blue and perhaps alpha, 0 to 1."""
        shape = proto.Primitive(box=proto.BoxGeometry(size=vector_to_proto(size, "a box's size")))
        options = _options(name or "box", name, position, orientation, fixed, friction, restitution)
        return self._spawned(_source(shape, mass, color), options)

    def add_sphere(
        self,
        radius: float,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Made:
        """A ball."""
        shape = proto.Primitive(sphere=proto.SphereGeometry(radius=radius))
        options = _options(name or "sphere", name, position, UPRIGHT, fixed, friction, restitution)
        return self._spawned(_source(shape, mass, color), options)

    def add_cylinder(
        self,
        radius: float,
        length: float,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Made:
        """A cylinder about its z axis."""
        shape = proto.Primitive(cylinder=proto.CylinderGeometry(radius=radius, length=length))
        options = _options(name or "cylinder", name, position, orientation, fixed, friction, restitution)
        return self._spawned(_source(shape, mass, color), options)

    def add_capsule(
        self,
        radius: float,
        length: float,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Made:
        """A capsule about its z axis; `length` is without the caps."""
        shape = proto.Primitive(capsule=proto.CapsuleGeometry(radius=radius, length=length))
        options = _options(name or "capsule", name, position, orientation, fixed, friction, restitution)
        return self._spawned(_source(shape, mass, color), options)

    def add_plane(
        self,
        normal: npt.ArrayLike = (0, 0, 1),
        position: npt.ArrayLike = (0, 0, 0),
        *,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Made:
        """A floor or a wall without an end, bolted to the world: all behind `position`, as `normal` shows."""
        shape = proto.Primitive(plane=proto.PlaneGeometry(normal=vector_to_proto(normal, "a normal")))
        options = _options(name or "plane", name, position, UPRIGHT, True, friction, restitution)
        return self._spawned(_source(shape, None, color), options)


def _options(
    name: str,
    asked: str,
    position: npt.ArrayLike,
    orientation: npt.ArrayLike,
    fixed: bool,
    friction: float | None,
    restitution: float | None,
) -> Options:
    return Options(
        name,
        # A name that somebody chose is theirs, or refused.
        allow_renaming=not asked,
        pose=Pose.of(position, orientation),
        fixed=fixed,
        surfaces=Surface(friction, restitution),
    )


def _source(
    shape: proto.Primitive, mass: float | None, color: Sequence[float] | None
) -> proto.DescriptionSource:
    if mass is not None:
        if not mass > 0.0:
            raise ValueError("a mass is above 0 kg; left out, it is that of water")
        shape.mass = mass
    if color is not None:
        red, green, blue, alpha = vector([*color, 1.0][:4], 4, "a color").tolist()
        shape.color.CopyFrom(proto.Color(red=red, green=green, blue=blue, alpha=alpha))
    return proto.DescriptionSource(primitive=shape)
