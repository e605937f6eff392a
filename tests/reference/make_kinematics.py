#!/usr/bin/env python3
"""Makes kinematics.json: Jacobians, mass matrices and inverse dynamics by Pinocchio.

A free root's six values are in simd's form: the linear velocity of the root link's origin and its angular
velocity, both in world axes. Pinocchio has them in the link's axes, and its accelerations and forces are
spatial.
"""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin

HERE = Path(__file__).resolve().parent
ASSETS = HERE.parent / "assets"
GRAVITY = np.array([0.3, -0.2, -9.81])


def case(name, urdf, link, free):
    rng = np.random.default_rng(7)
    root = [pin.JointModelFreeFlyer()] if free else []
    model = pin.buildModelFromUrdf(str(ASSETS / urdf), *root)
    model.gravity.linear = GRAVITY
    data = model.createData()
    joints = model.nv - (6 if free else 0)
    positions = rng.uniform(-1, 1, joints)
    velocities = rng.uniform(-2, 2, joints)
    accelerations = rng.uniform(-5, 5, joints)
    twist, push = rng.uniform(-1, 1, 6), rng.uniform(-3, 3, 6)
    pose = pin.SE3(pin.exp3(np.array([0.4, -1.1, 0.7])), np.array([0.5, -0.3, 1.2]))

    # A continuous joint is (cos, sin) in Pinocchio: integrate from its zero.
    tangent = np.concatenate([np.zeros(6), positions]) if free else positions
    q = pin.integrate(model, pin.neutral(model), tangent)
    to_own = np.eye(model.nv)
    v, a = velocities, accelerations
    if free:
        own = pose.rotation.T
        q[:7] = pin.SE3ToXYZQUAT(pose)
        to_own[:3, :3] = to_own[3:6, 3:6] = own
        v = np.concatenate([own @ twist[:3], own @ twist[3:], velocities])
        # A frame's spatial acceleration is the acceleration of its origin less w x v.
        linear = own @ push[:3] - np.cross(v[3:6], v[:3])
        a = np.concatenate([linear, own @ push[3:], accelerations])

    matrix = pin.crba(model, data, q)
    matrix = np.triu(matrix) + np.triu(matrix, 1).T
    efforts = pin.rnea(model, data, q, v, a)
    frame = model.getFrameId(link)
    jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
    twists = jacobian @ v
    return {
        "name": name,
        "urdf": urdf,
        "link": link,
        "free": free,
        # Pinocchio's order of the joints.
        "joints": [n for n in model.names if n not in ("universe", "root_joint")],
        "root": [*pose.translation, *pin.Quaternion(pose.rotation).coeffs()] if free else [],
        "root_twist": list(twist) if free else [],
        "gravity": list(GRAVITY),
        "positions": list(positions),
        "velocities": list(velocities),
        "accelerations": [*(push if free else []), *accelerations],
        "link_twist": list(twists),
        "jacobian": (jacobian @ to_own).ravel().tolist(),
        "mass_matrix": (to_own.T @ matrix @ to_own).ravel().tolist(),
        "efforts": (to_own.T @ efforts).tolist(),
    }


def main():
    cases = [
        case("seven_arm", "seven_arm/urdf/seven_arm.urdf", "link_7", False),
        case("seven_arm, free", "seven_arm/urdf/seven_arm.urdf", "link_7", True),
        case("branching", "branching/urdf/branching.urdf", "finger", False),
        case("humanoid, free", "humanoid/urdf/humanoid.urdf", "right_foot", True),
    ]
    made = {"made_by": f"make_kinematics.py with Pinocchio {pin.__version__}", "cases": cases}
    (HERE / "kinematics.json").write_text(json.dumps(made, indent=1) + "\n")


main()
