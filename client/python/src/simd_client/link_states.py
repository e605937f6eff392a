"""Poses and velocities of links."""

from __future__ import annotations

from dataclasses import dataclass

from simd_client import proto
from simd_client.geometry import FloatArray, rows
from simd_client.world import Stamp


@dataclass(frozen=True, eq=False)
class LinkStates:
    """Poses and velocities of links, in the order of the robot's links."""

    stamp: Stamp
    poses: FloatArray
    """`world_from_link`, one row per link: x y z, then the quaternion x y z w."""
    twists: FloatArray
    """One row per link, world axes: m/s of the link frame's origin, then rad/s."""


def link_states_from_proto(message: proto.RobotLinkStates, stamp: Stamp) -> LinkStates:
    """Converts one robot's states from their message."""
    return LinkStates(stamp, rows(message.poses, 7), rows(message.twists, 6))
