"""Rollouts: commands for copies of the world that start from one state. `rollout_answer` has their
results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.enum_word import count_within, enum_name
from simd_client.geometry import Pose, pose_to_proto, vector_to_proto
from simd_client.state import Named, name_of

Mode = Literal["position", "velocity", "effort"]
"""Unit of the numbers of a `Control`: rad or m, rad/s or m/s, N m or N."""

Interpolation = Literal["hold", "linear", "cubic"]
"""Interpolation between knots: the previous knot, a straight line, or a smooth curve through the knots."""

_MAX_UINT32 = 2**32 - 1
"""Largest count that a message can hold. The daemon's limit is lower, and its error says so."""


def _packed(values: npt.ArrayLike | None) -> bytes:
    return b"" if values is None else np.ascontiguousarray(values, dtype="<f8").tobytes()


def _first(values: npt.ArrayLike | None, dimensions: int) -> int | None:
    """Returns the number of copies that an array of this rank is for; `None` if it is for all."""
    if values is None:
        return None
    array = np.asarray(values)
    return len(array) if array.ndim == dimensions else None


@dataclass(frozen=True, eq=False)
class Feedback:
    """Adds -K (x - x0) to the values of a `Control`; x is the positions of `joints`, then their velocities."""

    gains: npt.ArrayLike
    """K: (driven joints, x), or one such matrix per knot, or (copies, knots, driven joints, x)."""
    references: npt.ArrayLike | None = None
    """x0: (x), (knots, x) or (copies, knots, x). Zero by default."""
    joints: Sequence[str] = ()
    """Joints with one axis each. Default: all of the robot's that follow no other."""


@dataclass(frozen=True, eq=False)
class Control:
    """Commands for joints of a robot."""

    robot: str | Named
    values: npt.ArrayLike | None = None
    """(knots, joints) for all copies, or (copies, knots, joints). A target beyond a limit is clamped.
    Optional with feedback."""
    joints: Sequence[str] = ()
    """Joints with one axis each. Default: all of the robot's that take targets."""
    mode: Mode = "position"
    knot_steps: int = 1
    """Steps between knots. After the last knot its numbers hold."""
    interpolation: Interpolation = "hold"
    stiffness: Sequence[float] = ()
    """Stiffness of position targets, one per joint; default: the joints' gains."""
    damping: Sequence[float] = ()
    """Damping of position and velocity targets, one per joint; default: the joints' gains."""
    feedback: Feedback | None = None

    @property
    def copies(self) -> int | None:
        """Number of copies that the values are for; `None` if they are for all."""
        return _first(self.values, 3)

    def to_proto(self) -> proto.RolloutControl:
        """Converts to a message."""
        values = None if self.values is None else np.asarray(self.values, dtype=np.float64)
        if values is not None and values.ndim not in (2, 3):
            expected = "(knots, joints) or (copies, knots, joints)"
            raise ValueError(f"values have the shape {expected}, not {values.shape}")
        feedback = self.feedback
        knots = 1 if values is None else values.shape[-2]
        if values is None and feedback is not None:
            references = None if feedback.references is None else np.asarray(feedback.references)
            if references is not None and references.ndim > 1:
                knots = references.shape[-2]
            elif np.ndim(feedback.gains) > 2:
                knots = np.shape(feedback.gains)[-3]
        return proto.RolloutControl(
            robot=name_of(self.robot),
            joints=self.joints,
            mode=enum_name("ROLLOUT_CONTROL_MODE", self.mode, Mode, "mode of a control"),
            values=_packed(values),
            knots=knots,
            knot_steps=count_within("knot_steps", self.knot_steps, _MAX_UINT32),
            interpolation=enum_name("ROLLOUT_INTERPOLATION", self.interpolation, Interpolation, "interpolation"),
            stiffness=self.stiffness,
            damping=self.damping,
            feedback=None
            if feedback is None
            else proto.RolloutFeedback(
                joints=feedback.joints, gains=_packed(feedback.gains), references=_packed(feedback.references)
            ),
        )


@dataclass(frozen=True, eq=False)
class Start:
    """Initial state of a robot's joints and root. Each array has a row for each copy, or is one row for
    all."""

    robot: str | Named
    positions: npt.ArrayLike | None = None
    """(copies, joints), rad or m; default: their current positions."""
    velocities: npt.ArrayLike | None = None
    """(copies, joints); default: at rest if positions are given."""
    joints: Sequence[str] = ()
    """Joints with one axis each. Default: all of the robot's that follow no other."""
    roots: npt.ArrayLike | None = None
    """(copies, 7): world_from_root, x y z and a quaternion x y z w."""
    root_twists: npt.ArrayLike | None = None
    """(copies, 6), for a free root, world axes: linear velocity of its origin, then angular velocity."""

    @property
    def copies(self) -> int | None:
        """Number of copies that the arrays are for; `None` if they are for all."""
        arrays = (self.positions, self.velocities, self.roots, self.root_twists)
        return next((count for count in (_first(each, 2) for each in arrays) if count is not None), None)

    def to_proto(self) -> proto.RolloutStart:
        """Converts to a message."""
        return proto.RolloutStart(
            robot=name_of(self.robot),
            joints=self.joints,
            positions=_packed(self.positions),
            velocities=_packed(self.velocities),
            roots=_packed(self.roots),
            root_twists=_packed(self.root_twists),
        )


Varied = Literal[
    "joint_positions",
    "joint_velocities",
    "link_masses",
    "joint_friction",
    "joint_damping",
    "gains",
    "surface_friction",
    "wrench",
]
"""Quantity of a `Variation`. Positions and velocities get offsets. A wrench is a force x y z in newtons,
world axes, on one link. All others are factors."""


@dataclass(frozen=True, eq=False)
class Variation:
    """Numbers that differ from copy to copy: given, or drawn by the daemon. Give one of `values`, `uniform` and `normal`."""

    of: Varied
    robot: str | Named
    names: Sequence[str] = ()
    """Joints or links; default: all. A wrench takes one link."""
    values: npt.ArrayLike | None = None
    """(copies, joints), (copies, links), or for a wrench (copies, 3)."""
    uniform: tuple[float, float] | None = None
    """Minimum and maximum."""
    normal: tuple[float, float] | None = None
    """Mean and standard deviation."""
    wrench_step: int = 0
    """First step of a wrench."""
    wrench_steps: int = 1
    """Duration of a wrench in steps."""

    @property
    def copies(self) -> int | None:
        """Number of copies that the values are for; `None` if they are drawn."""
        return _first(self.values, 2)

    def to_proto(self) -> proto.RolloutVariation:
        """Converts to a message."""
        given = (self.values, self.uniform, self.normal)
        if sum(each is not None for each in given) != 1:
            raise ValueError("a variation has one of `values`, `uniform` and `normal`")
        low_high, normal = self.uniform, self.normal
        is_wrench = self.of == "wrench"
        return proto.RolloutVariation(
            of=enum_name("ROLLOUT_VARIED", self.of, Varied, "variation"),
            robot=name_of(self.robot),
            names=self.names,
            given=None if self.values is None else _packed(self.values),
            uniform=low_high and proto.RolloutUniform(low=low_high[0], high=low_high[1]),
            normal=normal and proto.RolloutNormal(mean=normal[0], deviation=normal[1]),
            wrench_step=count_within("wrench_step", self.wrench_step, _MAX_UINT32) if is_wrench else 0,
            wrench_steps=count_within("wrench_steps", self.wrench_steps, _MAX_UINT32) if is_wrench else 0,
        )


Observed = Literal[
    "joint_positions",
    "joint_velocities",
    "joint_efforts",
    "root_pose",
    "root_twist",
    "link_poses",
    "contact_count",
    "contact_force",
]
"""Quantity of an `Observation`."""


@dataclass(frozen=True)
class Observation:
    """Quantity read from each copy."""

    of: Observed
    robot: str | Named
    names: Sequence[str] = ()
    """Joints or links; default: all."""

    def to_proto(self) -> proto.RolloutQuantity:
        """Converts to a message."""
        kind = enum_name("ROLLOUT_QUANTITY_KIND", self.of, Observed, "observation")
        return proto.RolloutQuantity(kind=kind, robot=name_of(self.robot), names=self.names)


@dataclass(frozen=True, eq=False)
class Cost:
    """A term of the cost of a step; its methods create terms. `weight` applies to the state after each step,
    `final_weight` in addition to the state after the last one."""

    message: proto.RolloutCost = field(repr=False)

    @staticmethod
    def joint_positions(
        robot: str | Named,
        joints: Sequence[str] = (),
        targets: Sequence[float] = (),
        *,
        weight: float = 1.0,
        final_weight: float = 0.0,
        wrapped: bool = False,
    ) -> Cost:
        """Sum of the squared position errors of joints against their targets. With `wrapped`, whole turns do
        not count."""
        term = proto.RolloutJointTerm(robot=name_of(robot), joints=joints, targets=targets, wrapped=wrapped)
        return Cost(proto.RolloutCost(weight=weight, final_weight=final_weight, joint_positions=term))

    @staticmethod
    def joint_velocities(
        robot: str | Named,
        joints: Sequence[str] = (),
        targets: Sequence[float] = (),
        *,
        weight: float = 1.0,
        final_weight: float = 0.0,
    ) -> Cost:
        """Sum of the squared velocity errors of joints."""
        term = proto.RolloutJointTerm(robot=name_of(robot), joints=joints, targets=targets)
        return Cost(proto.RolloutCost(weight=weight, final_weight=final_weight, joint_velocities=term))

    @staticmethod
    def joint_efforts(
        robot: str | Named, joints: Sequence[str] = (), *, weight: float = 1.0, final_weight: float = 0.0
    ) -> Cost:
        """Sum of the squared efforts of actuators."""
        term = proto.RolloutJointTerm(robot=name_of(robot), joints=joints)
        return Cost(proto.RolloutCost(weight=weight, final_weight=final_weight, joint_efforts=term))

    @staticmethod
    def link_position(
        robot: str | Named,
        link: str,
        position: npt.ArrayLike,
        *,
        point: npt.ArrayLike = (0.0, 0.0, 0.0),
        weight: float = 1.0,
        final_weight: float = 0.0,
    ) -> Cost:
        """Squared distance of a point of a link from a position in the world, m^2."""
        term = proto.RolloutLinkTerm(
            robot=name_of(robot),
            link=link,
            position=vector_to_proto(position, "a position"),
            point=vector_to_proto(point, "a point"),
        )
        return Cost(proto.RolloutCost(weight=weight, final_weight=final_weight, link_position=term))

    @staticmethod
    def link_orientation(
        robot: str | Named,
        link: str,
        orientation: npt.ArrayLike,
        *,
        weight: float = 1.0,
        final_weight: float = 0.0,
    ) -> Cost:
        """Squared angle between a link's orientation and an orientation x y z w, rad^2."""
        turned = pose_to_proto(Pose.of((0.0, 0.0, 0.0), orientation)).orientation
        term = proto.RolloutLinkTerm(robot=name_of(robot), link=link, orientation=turned)
        return Cost(proto.RolloutCost(weight=weight, final_weight=final_weight, link_orientation=term))

    @staticmethod
    def contact_force(
        robot: str | Named, links: Sequence[str] = (), *, weight: float = 1.0, final_weight: float = 0.0
    ) -> Cost:
        """Sum of the normal forces on links, N."""
        term = proto.RolloutContactTerm(robot=name_of(robot), links=links)
        return Cost(proto.RolloutCost(weight=weight, final_weight=final_weight, contact_force=term))

    @staticmethod
    def nearness(
        robot: str | Named,
        distance: float,
        *,
        link: str = "",
        other: str | Named | None = None,
        other_link: str = "",
        weight: float = 1.0,
        final_weight: float = 0.0,
    ) -> Cost:
        """Squared shortfall from a distance between surfaces, m^2: of a robot or its link to another robot,
        or to all others. It costs the daemon as much as a step or more."""
        term = proto.RolloutDistanceTerm(
            robot=name_of(robot),
            link=link,
            other_robot="" if other is None else name_of(other),
            other_link=other_link,
            distance=distance,
        )
        return Cost(proto.RolloutCost(weight=weight, final_weight=final_weight, nearness=term))


def copies_of(copies: int | None, parts: Sequence[Control | Start | Variation]) -> int:
    """Returns the number of copies of a rollout: the given number, or the number in the arrays. Raises
    `ValueError` if they differ, or if it is not a count."""
    counts = {each.copies for each in parts} - {None}
    if copies is not None:
        counts.add(copies)
    if len(counts) > 1:
        numbers = ", ".join(str(count) for count in sorted(count for count in counts if count is not None))
        raise ValueError(f"arrays are for different numbers of copies: {numbers}")
    return count_within("copies", next(iter(counts), 1) or 0, _MAX_UINT32)


def rollout_to_proto(
    steps: int,
    copies: int | None,
    controls: Sequence[Control],
    starts: Sequence[Start],
    variations: Sequence[Variation],
    observations: Sequence[Observation],
    costs: Sequence[Cost],
    *,
    saved_state: str,
    record_steps: int,
    record_start: bool,
    step_costs: bool,
    seed: int,
) -> proto.RolloutRequest:
    """Converts to a message. Raises `ValueError` if arrays are for different numbers of copies, or a number
    is not a count."""
    return proto.RolloutRequest(
        saved_state=saved_state,
        copies=copies_of(copies, (*controls, *starts, *variations)),
        steps=count_within("steps", steps, _MAX_UINT32),
        controls=[control.to_proto() for control in controls],
        starts=[start.to_proto() for start in starts],
        variations=[variation.to_proto() for variation in variations],
        seed=count_within("seed", seed, 2**64 - 1),
        quantities=[observation.to_proto() for observation in observations],
        record_steps=count_within("record_steps", record_steps, _MAX_UINT32),
        record_start=record_start,
        costs=[cost.message for cost in costs],
        return_step_costs=step_costs,
    )
