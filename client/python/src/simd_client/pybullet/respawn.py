"""Fixes or frees the base of an existing robot by spawning it again, in place."""

from __future__ import annotations

from simd_client.proto import DeleteEntityRequest, DescriptionSource, ResetJointsRequest, methods
from simd_client.surface import Surface

from . import filters, spawning
from .arguments import Pose
from .bodies import Body
from .errors import unsupported
from .spawning import Spawn
from .world import World


def respawn(world: World, body: Body, function: str, fixed: bool, pose: Pose, urdf: bytes | None = None) -> None:
    """Spawns a robot again, since a base is fixed or free from the spawn on. Joints keep positions and
    velocities, and the base begins at rest. `pose` is world_from_root, `urdf` another description."""
    text = urdf or body.urdf
    if text is None:
        raise unsupported(function, "only robots that this script loaded can be fixed or freed")
    states = world.joint_states(body)
    moving = [joint for joint in body.joints if joint.driven]
    velocities = {joint.name: states.velocity[joint.velocity_index] for joint in moving}
    positions = {joint.name: states.position[joint.position_index] for joint in moving}
    balls = [joint for joint in body.joints if joint.ball is not None]
    orientations = {j.name: states.position[j.position_index : j.position_index + 4] for j in balls}
    spins = {j.name: states.velocity[j.velocity_index : j.velocity_index + 3] for j in balls}
    properties = world.link_properties(body).links
    world.wire.call(methods.DeleteEntity, DeleteEntityRequest(robot=body.robot))
    spawn = Spawn(
        *pose,
        fixed=fixed,
        scale=body.scale,
        name=body.robot,
        joints=positions,
        self_collision=body.self_collision,
        divided=body.divided,
        damped=any(link.linear_damping or link.angular_damping for link in properties),
    )
    entity = spawning.spawn(world.wire, DescriptionSource(urdf=text, assets=body.files), spawn)
    # As in PyBullet, regardless of the base's earlier groups.
    adapt = filters.of_the_world if fixed else filters.of_what_moves
    body.surfaces[body.base_link] = adapt(body.surfaces.get(body.base_link, Surface()))
    world.replaced(body, entity, body.frames, text)
    filters.put(world, body.unique_id)
    if balls or any(velocities.values()):
        request = ResetJointsRequest()
        robot = request.robots.add(robot=body.robot)
        for name, orientation in orientations.items():
            spherical = robot.joints.add(joint=name).spherical
            q, w = spherical.orientation, spherical.angular_velocity
            q.x, q.y, q.z, q.w = orientation
            w.x, w.y, w.z = spins[name]
        for name, velocity in velocities.items():
            robot.joints.add(joint=name, position=positions[name], velocity=velocity)
        world.wire.call(methods.ResetJoints, request)
    world.retune()
