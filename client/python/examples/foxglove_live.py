"""The world in Foxglove: shapes of robots, poses of their links, and states of their joints.

`pip install foxglove-sdk`, run this with a running daemon, and in Foxglove open the printed connection. The
daemon has no server for Foxglove: this program is an ordinary client, and may run anywhere.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import PurePosixPath

import foxglove
from foxglove import messages
from foxglove.channels import FrameTransformsChannel, JointStatesChannel, SceneUpdateChannel

import simd_client
from simd_client import Robot, Simulation, proto

MEDIA = {".stl": "model/stl", ".obj": "model/obj", ".dae": "model/vnd.collada+xml"}


def main() -> None:
    """Sends 30 times a second until Ctrl-C, or for a limited time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--port", type=int, default=8765, help="port for Foxglove; 0 takes a free one")
    parser.add_argument("--seconds", type=float, default=math.inf, help="duration")
    arguments = parser.parse_args()
    states, transforms = JointStatesChannel("/joint_states"), FrameTransformsChannel("/tf")
    scene = SceneUpdateChannel("/scene")
    server = foxglove.start_server(name="simd", port=arguments.port)
    print(f"Foxglove: open ws://127.0.0.1:{server.port}", flush=True)
    until, next_scene = time.monotonic() + arguments.seconds, 0.0
    try:
        with simd_client.connect() as sim:
            while time.monotonic() < until:
                # Repeated for apps that connect later.
                if time.monotonic() >= next_scene:
                    scene.log(look_of(sim))
                    next_scene = time.monotonic() + 5.0
                send(sim, states, transforms)
                time.sleep(1 / 30)
    except KeyboardInterrupt:
        pass
    finally:
        server.stop()


def send(sim: Simulation, states: JointStatesChannel, transforms: FrameTransformsChannel) -> None:
    """Sends joints as `ROBOT/JOINT`, and links as frames `ROBOT/LINK` in `world`."""
    joints: list[messages.JointState] = []
    frames: list[messages.FrameTransform] = []
    for robot in sim.robots.values():
        for joint in robot.read():
            if len(joint.positions) == 1:
                position, velocity, effort = joint.position, joint.velocity, joint.effort
                name = f"{robot.name}/{joint.name}"
                joints.append(messages.JointState(name=name, position=position, velocity=velocity, effort=effort))
        for link, pose in robot.link_poses().items():
            x, y, z = pose.position
            qx, qy, qz, qw = pose.orientation
            frame = messages.FrameTransform(
                parent_frame_id="world",
                child_frame_id=f"{robot.name}/{link}",
                translation=messages.Vector3(x=x, y=y, z=z),
                rotation=messages.Quaternion(x=qx, y=qy, z=qz, w=qw),
            )
            frames.append(frame)
    states.log(messages.JointStates(joints=joints))
    transforms.log(messages.FrameTransforms(transforms=frames))


def look_of(sim: Simulation) -> messages.SceneUpdate:
    """Sends the shapes of links, each in its own frame."""
    entities = [entity for robot in sim.robots.values() for entity in entities_of(sim, robot)]
    return messages.SceneUpdate(entities=entities)


def entities_of(sim: Simulation, robot: Robot) -> list[messages.SceneEntity]:
    """Returns one entity for each visual shape of a robot."""
    links = list(robot.link_poses())
    shapes = enumerate(robot.scene().visuals)
    return [drawn(sim, f"{robot.name}/{links[shape.link]}", f"{robot.name}/{number}", shape) for number, shape in shapes]


def drawn(sim: Simulation, frame: str, name: str, shape: proto.Shape) -> messages.SceneEntity:
    """Returns a shape in Foxglove's terms; an empty entity for an unsupported shape."""
    cubes: list[messages.CubePrimitive] = []
    spheres: list[messages.SpherePrimitive] = []
    cylinders: list[messages.CylinderPrimitive] = []
    models: list[messages.ModelPrimitive] = []
    given = shape.color
    color = messages.Color(r=0.6, g=0.65, b=0.7, a=1.0)
    if shape.HasField("color"):
        color = messages.Color(r=given.red, g=given.green, b=given.blue, a=given.alpha)
    at, turned = shape.pose.position, shape.pose.orientation
    pose = messages.Pose(
        position=messages.Vector3(x=at.x, y=at.y, z=at.z),
        orientation=messages.Quaternion(x=turned.x, y=turned.y, z=turned.z, w=turned.w),
    )
    kind = shape.WhichOneof("geometry")
    media = MEDIA.get(PurePosixPath(shape.mesh.uri).suffix.lower())
    if kind == "box":
        sides = shape.box.size
        size = messages.Vector3(x=sides.x, y=sides.y, z=sides.z)
        cubes.append(messages.CubePrimitive(pose=pose, size=size, color=color))
    elif kind == "sphere":
        wide = 2 * shape.sphere.radius
        size = messages.Vector3(x=wide, y=wide, z=wide)
        spheres.append(messages.SpherePrimitive(pose=pose, size=size, color=color))
    elif kind in ("cylinder", "capsule"):
        tube = shape.cylinder if kind == "cylinder" else shape.capsule
        size = messages.Vector3(x=2 * tube.radius, y=2 * tube.radius, z=tube.length)
        cylinders.append(messages.CylinderPrimitive(pose=pose, size=size, bottom_scale=1, top_scale=1, color=color))
    elif kind == "cone":
        size = messages.Vector3(x=2 * shape.cone.radius, y=2 * shape.cone.radius, z=shape.cone.length)
        cylinders.append(messages.CylinderPrimitive(pose=pose, size=size, bottom_scale=1, top_scale=0, color=color))
    elif kind == "mesh" and media is not None and shape.mesh.sha256:
        factors = shape.mesh.scale
        model = messages.ModelPrimitive(
            pose=pose,
            scale=messages.Vector3(x=factors.x, y=factors.y, z=factors.z),
            color=color,
            override_color=True,
            media_type=media,
            data=sim.asset(shape.mesh.sha256),
        )
        models.append(model)
    return messages.SceneEntity(
        frame_id=frame, id=name, frame_locked=True, cubes=cubes, spheres=spheres, cylinders=cylinders, models=models
    )


if __name__ == "__main__":
    main()
