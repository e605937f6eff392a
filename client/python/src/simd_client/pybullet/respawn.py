"""Fixes or frees the base of a robot that is in the world: it is spawned again, in place."""

from __future__ import annotations

from simd_client.proto import DeleteEntityRequest, DescriptionSource, ResetJointsRequest, methods

from . import filters
from .arguments import Pose
from .bodies import Body
from .errors import unsupported
from .wire import Spawn
from .world import World


def respawn(world: World, body: Body, function: str, fixed: bool, pose: Pose, urdf: bytes | None = None) -> None:
    """A base is fixed or free from the spawn on. Joints keep positions and velocities, and the base begins at rest.
    `pose` is world_from_root, `urdf` another description."""
    text = urdf or body.urdf
    if text is None:
        raise unsupported(function, "only robots that this script loaded can be fixed or freed")
    states = world.joint_states(body)
    moving = [joint for joint in body.joints if joint.driven]
    velocities = {joint.name: states.velocity[joint.velocity_index] for joint in moving}
    positions = {joint.name: states.position[joint.position_index] for joint in moving}
    world.wire.call(methods.DeleteEntity, DeleteEntityRequest(robot=body.robot))
    spawn = Spawn(
        *pose,
        fixed=fixed,
        scale=body.scale,
        name=body.robot,
        joints=positions,
        self_collision=body.self_collision,
        divided=body.divided,
    )
    entity = world.wire.spawn(DescriptionSource(urdf=text, assets=body.files), spawn)
    world.replaced(body, entity, body.frames, text)
    filters.put(world, body.unique_id)
    if any(velocities.values()):
        request = ResetJointsRequest()
        robot = request.robots.add(robot=body.robot)
        for name, velocity in velocities.items():
            robot.joints.add(joint=name, position=positions[name], velocity=velocity)
        world.wire.call(methods.ResetJoints, request)
    world.retune()
