"""State of a script after restoreState.

PyBullet restores poses, velocities and contacts. Motors, settings of the world, masses, surfaces, limits and
constraints keep their values of the moment before the call. The daemon restores all of it, so those are set
again where they differ; equal ones stay equal to the bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from simd_client import proto
from simd_client.proto import GetJointLayoutRequest, RestoreStateRequest, SetJointPropertiesRequest, methods

from . import outside_limits, constants, filters, initial_settings, spawning
from .bodies import Body, limits_of
from .constraints import gear_position
from .respawn import respawn

if TYPE_CHECKING:
    from simd_client.surface import Surface

    from .constraints import Constraint
    from .filters import Pair
    from .step_targets import Key
    from .world import World


@dataclass(frozen=True)
class Saved:
    """Commands of a script up to a saved state: after a restore only differences are sent."""

    # Surfaces by body, and then by link.
    surfaces: Mapping[int, Mapping[str, Surface]]
    # Pairs of links that were switched off or on.
    pairs: Mapping[Pair, bool]
    # TORQUE_CONTROL over the last step.
    torques: Mapping[Key, Sequence[float]]


_NOTHING = Saved({}, {}, {})


def remember(world: World) -> Saved:
    """Returns the script's commands so far."""
    surfaces = {number: dict(body.surfaces) for number, body in world.bodies.items() if body.own}
    return Saved(surfaces, dict(world.pairs), dict(world.torques))


def restore(world: World, name: str) -> None:
    """Restores the daemon's saved state with that name. Robots are those of the state.

    Raises:
        error: if there is none.
    """
    world.read_state()
    physics, substeps = world.physics, world.substeps
    bodies = [body for body in world.bodies.values() if body.own]
    constraints = _constraints(world)
    world.wire.call(methods.RestoreState, RestoreStateRequest(name=name))
    world.restored()
    saved = world.saved.get(name, _NOTHING)
    changed = initial_settings.differing(world.physics, physics)
    if changed:
        world.set_physics(initial_settings.settings(physics, changed))
    world.substeps = substeps
    for before in bodies:
        now = world.bodies.get(before.unique_id)
        if now is not None and now.own and now.robot == before.robot:
            now = _put_model(world, before, now)
            _put_surfaces(world, before, now, saved)
            _put_joints(world, before, now)
    world.torques_acted(saved.torques)
    switched = [pair for pair, on in world.pairs.items() if saved.pairs.get(pair) != on]
    for number in {pair[0][0] for pair in switched}:
        filters.put(world, number)
    _put_constraints(world, constraints)
    # A target that the daemon has already changes nothing.
    world.retune()


def _put_model(world: World, before: Body, now: Body) -> Body:
    """Loads a body again if the script has changed its masses or shapes since, or whether its base is
    fixed."""
    if before.urdf is None or (before.fixed == now.fixed and _is_same(before, now)):
        return now
    if before.fixed != now.fixed:
        pose = world.root(now)[0]
        respawn(world, now, "restoreState", fixed=before.fixed, pose=pose, urdf=before.urdf)
    else:
        entity = spawning.reload(world.wire, now.robot, before.urdf, before.files)
        world.replaced(now, entity, before.frames, before.urdf)
    return world.bodies[before.unique_id]


def _is_same(before: Body, now: Body) -> bool:
    if before.description and now.description:
        return before.description == now.description
    return before.links == now.links


def _put_surfaces(world: World, before: Body, now: Body, saved: Saved) -> None:
    # A reload sets them too.
    then = saved.surfaces.get(before.unique_id, {}) if now is before else now.surfaces
    world.set_surfaces(now, {link: each for link, each in before.surfaces.items() if then.get(link) != each})


def _put_joints(world: World, before: Body, now: Body) -> None:
    """Restores damping and limits. Afterwards the daemon's dry friction is known too."""
    if all(joint.width != 1 for joint in now.joints):
        return
    layout = world.wire.call(methods.GetJointLayout, GetJointLayoutRequest(robot=now.robot)).layout
    there = {joint.name: joint for joint in layout.joints}
    request = SetJointPropertiesRequest(robot=now.robot)
    for index, joint in enumerate(now.joints):
        known, old = there[joint.name], before.by_joint.get(joint.name)
        if joint.width != 1 or old is None:
            continue
        own = before.joints[old]
        joint.damping, joint.friction, joint.limits = own.damping, own.friction, own.limits
        if own.info[:6] == joint.info[:6]:
            joint.info = own.info
        joint.friction_sent = known.friction
        if known.damping != joint.damping:
            request.joints.add(joint=joint.name, damping=joint.damping)
        outside_limits.came_back(world, now, index, limits_of(known))
    if request.joints:
        world.wire.call(methods.SetJointProperties, request)


def _constraints(world: World) -> dict[str, proto.Constraint]:
    """Returns the daemon's constraints, by name."""
    answer = world.wire.call(methods.ListConstraints, proto.ListConstraintsRequest())
    return {each.name: each for each in answer.constraints}


def _put_constraints(world: World, before: Mapping[str, proto.Constraint]) -> None:
    """Deletes the constraints that the script had deleted since, and creates or changes the others again."""
    there = _constraints(world)
    own = {body.robot for body in world.bodies.values() if body.own}
    for name, each in there.items():
        robots = {each.parent.robot, each.child.robot} - {""}
        if name not in before and (robots <= own or name.startswith(world.names)):
            world.wire.call(methods.DeleteConstraint, proto.DeleteConstraintRequest(name=name))
    for made in world.constraints.values():
        wanted, present = before.get(made.name), there.get(made.name)
        if wanted is None:
            continue
        if present is None:
            _make_again(world, made, wanted)
        else:
            _change_again(world, made, wanted, present)


def _make_again(world: World, made: Constraint, wanted: proto.Constraint) -> None:
    request = proto.CreateConstraintRequest(
        name=wanted.name, kind=wanted.kind, parent=wanted.parent, child=wanted.child
    )
    if wanted.HasField("axis"):
        request.axis.CopyFrom(wanted.axis)
    for name in ("max_force", "max_torque"):
        setattr(request, name, _limit(wanted, name))
    if made.kind == constants.JOINT_GEAR:
        request.ratio = wanted.ratio
        # Bullet's gear keeps velocities: it continues from its joints' positions, unless the script asked for
        # a position.
        if made.offset:
            request.offset = wanted.offset
    world.wire.call(methods.CreateConstraint, request)


def _change_again(world: World, made: Constraint, wanted: proto.Constraint, present: proto.Constraint) -> None:
    request = proto.ChangeConstraintRequest(name=made.name)
    fields = [name for name in ("max_force", "max_torque") if _limit(present, name) != _limit(wanted, name)]
    for name in fields:
        setattr(request, name, _limit(wanted, name))
    is_moved = present.child.pose.SerializeToString() != wanted.child.pose.SerializeToString()
    if is_moved:
        request.child_pose.CopyFrom(wanted.child.pose)
    is_geared = present.ratio != wanted.ratio or (made.offset != 0.0 and present.offset != wanted.offset)
    if is_geared:
        request.ratio = wanted.ratio
        request.offset = wanted.offset if made.offset else gear_position(world, made)
    if fields or is_moved or is_geared:
        world.wire.call(methods.ChangeConstraint, request)


def _limit(constraint: proto.Constraint, name: str) -> float:
    value: float = getattr(constraint, name)
    return value if constraint.HasField(name) else math.inf
