"""A robot of the daemon as PyBullet represents it: a base and joints, by number."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from simd_client.proto import Base, EntityInfo, JointInfo, JointLayout, JointLimits, JointType
from simd_client.surface import Surface

from . import constants
from .arguments import ORIGIN, UPRIGHT, Pose, Quaternion, Vector
from .ball_motors import BallMotor
from .motors import Motor, MotorLoop
from .rotations import compose, conjugate, inverse, product, rotate

JointInfoTuple = tuple[
    int,
    bytes,
    int,
    int,
    int,
    int,
    float,
    float,
    float,
    float,
    float,
    float,
    bytes,
    Vector,
    Vector,
    Quaternion,
    int,
]

Reader = Callable[[list[float], list[float], list[float]], tuple[tuple[float, float, tuple[float, ...], float], ...]]
"""Maps positions, velocities and efforts of a robot to the getJointStates values of some joints."""

JointBounds = tuple[float | None, float | None, float | None, float | None]
"""Lower and upper position, effort and velocity of a joint; `None` for none."""

_TYPES = {
    JointType.JOINT_TYPE_REVOLUTE: constants.JOINT_REVOLUTE,
    JointType.JOINT_TYPE_CONTINUOUS: constants.JOINT_REVOLUTE,
    JointType.JOINT_TYPE_PRISMATIC: constants.JOINT_PRISMATIC,
    JointType.JOINT_TYPE_PLANAR: constants.JOINT_PLANAR,
    JointType.JOINT_TYPE_FIXED: constants.JOINT_FIXED,
    JointType.JOINT_TYPE_FLOATING: constants.JOINT_FIXED,
    JointType.JOINT_TYPE_SPHERICAL: constants.JOINT_SPHERICAL,
}
# Default for a joint if its inertia cannot be computed from its gains.
_UNKNOWN_INERTIA = 1.0


@dataclass(slots=True)
class BodyJoint:
    """A joint, which PyBullet numbers like its child link."""

    name: str
    link: str
    kind: int
    info: JointInfoTuple
    # Index of its first value in a state's positions and velocities.
    position_index: int
    velocity_index: int
    # Number of its velocities: 1 if it rotates or slides.
    width: int
    # Number of its positions: 4 for a spherical joint.
    count: int
    # The daemon's number of it: parents come before their children.
    index: int
    # Whether it rotates or slides, and nothing else drives it.
    driven: bool
    # Inertia that its actuator sees, kg m^2 or kg.
    inertia: float
    limits: JointBounds
    damping: float
    friction: float
    motor: Motor = field(default_factory=Motor)
    # Motor of a spherical joint, which has no other.
    ball: BallMotor | None = None
    # Dry friction of the daemon, which changes with a motor's force; None after a restored state that brought
    # its own.
    friction_sent: float | None = 0.0
    # TORQUE_CONTROL over the last step, N m or N, as far as the joint's own limit lets it act. A spherical
    # joint's motor has it.
    torque_sent: float = 0.0
    sensor: bool = False
    # Pose at position 0, in the parent link's frame, and its axis in that frame.
    parent_from_joint: Pose = (ORIGIN, UPRIGHT)
    axis: Vector = ORIGIN

    @property
    def has_motor(self) -> bool:
        """Whether it takes targets."""
        return self.driven or self.ball is not None

    def add_torque(self, torque: Sequence[float]) -> None:
        """Adds a torque for the next step, N m or N: one number, or three for a spherical joint. As in
        PyBullet, those of one step add up."""
        if self.ball is not None:
            (a, b, c), (x, y, z) = self.ball.torque or ORIGIN, torque
            self.ball.torque = (a + x, b + y, c + z)
        else:
            self.motor.torque = torque[0] + (self.motor.torque or 0.0)

    def take_torque(self) -> tuple[float, ...] | None:
        """Returns that sum and clears it; `None` without torques."""
        if self.ball is not None:
            of_ball, self.ball.torque = self.ball.torque, None
            return of_ball
        torque, self.motor.torque = self.motor.torque, None
        return None if torque is None else (torque,)

    def torque_acted(self, torque: Sequence[float]) -> None:
        """Records the torque over the last step; zeros without torques."""
        if self.ball is not None:
            x, y, z = torque
            self.ball.torque_sent = (x, y, z)
        else:
            most = self.limits[2]
            self.torque_sent = torque[0] if most is None else min(max(torque[0], -most), most)


@dataclass(slots=True)
class Body:
    """A robot."""

    unique_id: int
    robot: str
    model: str
    # Whether the script loaded it.
    own: bool
    fixed: bool
    layout_version: int
    base_link: str
    joints: list[BodyJoint]
    by_joint: dict[str, int]
    # Names of the links in the order of the daemon's poses, with the index of each.
    link_indices: dict[str, int]
    links: list[Any]
    # link_from_inertia, by link.
    frames: dict[str, Pose]
    # Order of links by which its joints are numbered; empty: the daemon's order.
    link_order: Sequence[str] = ()
    # Links without a number: sites of an MJCF, which PyBullet does not have.
    sites: Collection[str] = ()
    # Description of robots of this script.
    urdf: bytes | None = None
    # Hashes of referenced files, by URI.
    files: dict[str, str] = field(default_factory=dict[str, str])
    # Paths of those files on this disk, by URI.
    paths: dict[str, str] = field(default_factory=dict[str, str])
    # URIs of the meshes from which createMultiBody made it.
    made_of: frozenset[str] = frozenset()
    # File that the script loaded, with its given name.
    file: str = ""
    # Hash of the daemon's description; empty if the daemon does not report it.
    description: str = ""
    # Bullet's collision margin of its shapes, metres, if its inertias come from those shapes; `None` if
    # unknown.
    shape_margin: float | None = None
    # Whether its cylinders are round, and not hulls.
    has_round_cylinders: bool = False
    scale: float = 1.0
    # Whether its links collide with each other.
    self_collision: bool = False
    # Sleep setting of `changeDynamics`.
    stays_awake: bool | None = None
    # Flags of self-collision at its load: which links touch their parents.
    parent_flags: int = 0
    # Whether its collision meshes are convex parts, and not their hulls.
    divided: bool = False
    # Friction and restitution that the script set or that are PyBullet's default, by link.
    surfaces: dict[str, Surface] = field(default_factory=dict[str, Surface])
    # Colours of changeVisualShape, by PyBullet's number of the link.
    colors: dict[int, tuple[float, float, float, float]] = field(
        default_factory=dict[int, tuple[float, float, float, float]]
    )
    # Settings of `changeDynamics` that the daemon does not have.
    kept: dict[int, dict[str, Any]] = field(default_factory=dict[int, dict[str, Any]])
    # For getJointStates: how the states of several joints are extracted from those of all, by their indices.
    readers: dict[tuple[int, ...], Reader] = field(default_factory=dict[tuple[int, ...], "Reader"])
    # For calculateInverseKinematics: the joints between the base and a link, by its number.
    chains: dict[int, Any] = field(default_factory=dict[int, Any])
    # Motors that the script last set together.
    loop: MotorLoop | None = None

    def frame(self, link: str) -> Pose:
        """link_from_inertia."""
        return self.frames.get(link, (ORIGIN, UPRIGHT))

    def from_base(self) -> list[int]:
        """Numbers of the joints, parents before their children."""
        return sorted(range(len(self.joints)), key=lambda index: self.joints[index].index)

    def link_name(self, index: int) -> str | None:
        """Returns the name for PyBullet's link number: -1 is the base."""
        if index == -1:
            return self.base_link
        return self.joints[index].link if 0 <= index < len(self.joints) else None


def body(
    unique_id: int,
    entity: EntityInfo,
    layout: JointLayout,
    frames: Mapping[str, Pose],
    own: bool,
    urdf: bytes | None = None,
    link_order: Sequence[str] = (),
    sites: Collection[str] = (),
) -> Body:
    """Builds a body from the daemon's answer; `frames` belong to the description. Joints are numbered like
    their child links in `link_order`, else as the daemon numbers them, without those of `sites`."""
    known: dict[str, Pose] = {}
    for link in entity.links:
        center = (link.center_of_mass.x, link.center_of_mass.y, link.center_of_mass.z)
        known[link.name] = frames.get(link.name, (center, UPRIGHT) if not frames else (ORIGIN, UPRIGHT))
    base = entity.links[0].name if entity.links else ""
    ranks = {link: rank for rank, link in enumerate(link_order)}
    # A sort keeps the daemon's order of unnamed links.
    numbered = (joint for joint in layout.joints if joint.child_link not in sites)
    ordered = sorted(numbered, key=lambda joint: ranks.get(joint.child_link, len(ranks)))
    numbers = {joint.child_link: number for number, joint in enumerate(ordered)}
    joints: list[BodyJoint] = []
    q, u = 7, 6
    for number, joint in enumerate(ordered):
        joints.append(_joint(joint, known, number, numbers.get(joint.parent_link, -1), q, u))
        q, u = q + joint.position_count, u + joint.velocity_count
    return Body(
        unique_id=unique_id,
        robot=entity.name,
        model=entity.model,
        own=own,
        fixed=entity.base == Base.BASE_FIXED,
        layout_version=layout.layout_version,
        base_link=base,
        joints=joints,
        by_joint={joint.name: index for index, joint in enumerate(joints)},
        link_indices={link.name: index for index, link in enumerate(entity.links)},
        links=list(entity.links),
        frames=known,
        link_order=tuple(link_order),
        sites=sites,
        urdf=urdf,
        description=entity.description,
    )


def _joint(joint: JointInfo, frames: Mapping[str, Pose], number: int, parent: int, q: int, u: int) -> BodyJoint:
    kind = _TYPES.get(joint.type, constants.JOINT_FIXED)
    width = joint.velocity_count
    single = width == 1
    lower, upper, effort, velocity = limits = limits_of(joint)
    bounded = lower is not None and upper is not None
    position, turn = _parent_frame(joint, frames)
    moves = kind != constants.JOINT_FIXED
    gains = joint.default_gains
    # Default gains are critical: damping^2 = 4 stiffness inertia.
    inertia = gains.damping**2 / (4.0 * gains.stiffness) if gains.stiffness > 0.0 else _UNKNOWN_INERTIA
    mimic = joint.HasField("mimic")
    info: JointInfoTuple = (
        number,
        joint.name.encode(),
        kind,
        q if moves else -1,
        u if moves else -1,
        1 if single else 0,
        joint.damping,
        joint.friction,
        lower if bounded and lower is not None else 0.0,
        upper if bounded and upper is not None else -1.0,
        effort or 0.0,
        velocity or 0.0,
        joint.child_link.encode(),
        _axis(joint, frames) if single else ORIGIN,
        position,
        turn,
        parent,
    )
    return BodyJoint(
        name=joint.name,
        link=joint.child_link,
        kind=kind,
        info=info,
        position_index=joint.position_index,
        velocity_index=joint.velocity_index,
        width=width,
        count=joint.position_count,
        index=joint.index,
        driven=single and not mimic,
        inertia=inertia or _UNKNOWN_INERTIA,
        limits=limits,
        damping=joint.damping,
        friction=joint.friction,
        friction_sent=joint.friction,
        parent_from_joint=_wire_pose(joint),
        axis=(joint.axis.x, joint.axis.y, joint.axis.z),
        ball=BallMotor() if kind == constants.JOINT_SPHERICAL else None,
    )


def limits_of(joint: JointInfo) -> JointBounds:
    """Converts the daemon's limits."""
    limits = joint.limits
    return (
        limits.lower if limits.HasField("lower") else None,
        limits.upper if limits.HasField("upper") else None,
        limits.effort if limits.HasField("effort") else None,
        limits.velocity if limits.HasField("velocity") else None,
    )


def put_limits(message: JointLimits, limits: JointBounds) -> None:
    """Sets a message."""
    for name, value in zip(("lower", "upper", "effort", "velocity"), limits, strict=True):
        if value is not None:
            setattr(message, name, float(value))
    message.SetInParent()


def _wire_pose(joint: JointInfo) -> Pose:
    at, turn = joint.parent_from_joint.position, joint.parent_from_joint.orientation
    return (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)


def _parent_frame(joint: JointInfo, frames: Mapping[str, Pose]) -> Pose:
    """Returns Bullet's frame of a joint: its position in the parent's inertial frame, and the rotation from
    there into the child's inertial frame."""
    inertia = frames.get(joint.parent_link, (ORIGIN, UPRIGHT))
    position, rotation = compose(inverse(inertia), _wire_pose(joint))
    child = frames.get(joint.child_link, (ORIGIN, UPRIGHT))[1]
    return position, product(conjugate(child), conjugate(rotation))


def _axis(joint: JointInfo, frames: Mapping[str, Pose]) -> Vector:
    """Axis in the child's inertial frame."""
    child = frames.get(joint.child_link, (ORIGIN, UPRIGHT))[1]
    return rotate(conjugate(child), (joint.axis.x, joint.axis.y, joint.axis.z))
