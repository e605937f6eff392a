#!/usr/bin/env python3
"""Makes ball_joints.json: trajectories of MuJoCo's Euler integrator for robots with ball joints.

Needs requirements.txt; run from anywhere. MuJoCo reads the URDF, and knows its type `spherical` as Bullet
does. Quaternions are x y z w here. Angular velocities are in the child's axes, as in MuJoCo.
"""

from pathlib import Path

import mujoco
import numpy as np

import json_lines

HERE = Path(__file__).resolve().parent
ROOT_VELOCITY = [0.1, -0.2, 0.3, 0.5, -0.4, 0.6]


def model(urdf, free, damping, armature, time_step):
    spec = mujoco.MjSpec.from_string((HERE / "robots" / urdf).read_text())
    spec.compiler.fusestatic = True
    if free:
        spec.worldbody.first_body().add_freejoint()
    compiled = spec.compile()
    compiled.opt.timestep = time_step
    compiled.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    disable = mujoco.mjtDisableBit
    compiled.opt.disableflags |= disable.mjDSBL_CONTACT | disable.mjDSBL_LIMIT | disable.mjDSBL_EQUALITY
    offset = 6 if free else 0
    compiled.dof_damping[offset:] = damping
    compiled.dof_armature[offset:] = armature
    compiled.dof_frictionloss[:] = 0
    return compiled


def quaternion(turn):
    """w x y z of a rotation vector."""
    out = np.zeros(4)
    angle = np.linalg.norm(turn)
    mujoco.mju_axisAngle2Quat(out, np.array(turn, float) / (angle or 1.0), angle)
    return out


def xyzw(wxyz):
    w, x, y, z = (float(part) for part in wxyz)
    return [x, y, z, w]


def swing(name, urdf, joints, *, free=False, damping=0.0, armature=0.0, time_step=1e-3, seconds=1.0):
    """`joints` are names with rotation vector and angular velocity, or position and velocity."""
    compiled = model(urdf, free, damping, armature, time_step)
    data = mujoco.MjData(compiled)
    if free:
        data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
        data.qvel[:6] = ROOT_VELOCITY
    start = []
    for joint, place, velocity in joints:
        at = compiled.joint(joint)
        q, v = at.qposadr[0], at.dofadr[0]
        if at.type[0] == mujoco.mjtJoint.mjJNT_BALL:
            data.qpos[q:q + 4] = quaternion(place)
            data.qvel[v:v + 3] = velocity
            start.append({"joint": joint, "orientation": xyzw(data.qpos[q:q + 4]), "velocity": list(velocity)})
        else:
            data.qpos[q], data.qvel[v] = place, velocity
            start.append({"joint": joint, "position": place, "velocity": [velocity]})
    for _ in range(round(seconds / time_step)):
        mujoco.mj_step(compiled, data)
    mujoco.mj_kinematics(compiled, data)
    bodies = {}
    for body in range(1, compiled.nbody):
        bodies[compiled.body(body).name] = [*data.xpos[body].tolist(), *xyzw(data.xquat[body])]
    velocities = {joint: data.qvel[compiled.joint(joint).dofadr[0]:][:3 if isinstance(place, list) else 1].tolist()
                  for joint, place, _ in joints}
    return {"name": name, "urdf": urdf, "free": free, "damping": damping, "armature": armature, "time_step": time_step,
            "seconds": seconds, "start": start, "links": [{"link": link, "pose": pose} for link, pose in bodies.items()],
            "velocities": [{"joint": joint, "velocity": velocity} for joint, velocity in velocities.items()]}


def main():
    pendulum = [("ball", [0.4, -1.1, 0.5], [1.0, -0.5, 3.0])]
    tree = [("left_hip", [0.3, 0.8, -0.4], [1.0, -2.0, 0.5]), ("left_knee", 0.7, 1.5),
            ("left_ankle", [-0.5, 0.2, 2.5], [0.3, 4.0, -1.0]), ("right_hip", [1.2, 0.0, 0.4], [-1.0, 0.5, 2.0]),
            ("right_knee", 0.05, 0.3)]
    cases = []
    for time_step in (1e-4, 1e-3, 4e-3):
        ms = f"{time_step * 1e3:g} ms"
        extra = {"damping": 0.05, "armature": 0.01}
        cases.append(swing(f"pendulum, {ms}", "ball_pendulum.urdf", pendulum, time_step=time_step))
        cases.append(swing(f"pendulum, damping and armature, {ms}", "ball_pendulum.urdf", pendulum, time_step=time_step, **extra))
        for free in (False, True):
            base = "free" if free else "fixed"
            cases.append(swing(f"tree, {base}, {ms}", "ball_tree.urdf", tree, free=free, time_step=time_step, seconds=0.5))
            cases.append(swing(f"tree, {base}, damping and armature, {ms}", "ball_tree.urdf", tree, free=free,
                               time_step=time_step, seconds=0.5, **extra))
    out = {"made_by": f"make_ball_joints.py with MuJoCo {mujoco.__version__}", "cases": cases}
    (HERE / "ball_joints.json").write_text(json_lines.text(out))
    print(f"{len(cases)} cases")


main()
