"""A case in PyBullet, DIRECT: multibodies, one `stepSimulation` a step, solver settings as by default.

These settings differ from the defaults: inertia from the file, no cap of 100 rad/s on joint velocities, no
initial velocity motors of joints. Linear, angular and joint damping are zero unless the case has some
(0.04 by default). Dry friction is a velocity motor with target 0 and the friction as its force, according
to its manual. Mimic is a gear constraint. Actuators are torques that are computed before each step, since
its motors are constraints without gains. It has no armature. It does not normalise axes of joints: here
they have length 1.
"""

import xml.etree.ElementTree as xml

import numpy as np

import robots
from quiet import pybullet as p
from quiet import silence

FAST = 1e9


def can(case):
    return case.armature == 0


def text(case):
    """Links without inertia weigh a kilogram in PyBullet unless the file says 0."""
    root = xml.fromstring(robots.plain(case.urdf, case.limits, planar_as_chain=True))
    for link in root.findall("link"):
        if link.find("inertial") is None:
            inertial = xml.SubElement(link, "inertial")
            xml.SubElement(inertial, "mass", {"value": "0"})
            xml.SubElement(inertial, "inertia", {part: "0" for part in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")})
    for joint in root.findall("joint"):
        if joint.get("type") != "fixed":
            axis = joint.find("axis")
            x = np.array([float(part) for part in axis.get("xyz").split()])
            axis.set("xyz", " ".join(str(part) for part in x / np.linalg.norm(x)))
            xml.SubElement(joint, "dynamics", {"damping": str(case.damping), "friction": "0"})
    return xml.tostring(root, encoding="unicode")


class World:
    def __init__(self, case, time_step, folder):
        self.case = case
        path = folder / "pybullet.urdf"
        path.write_text(text(case))
        p.resetSimulation()
        p.setGravity(0, 0, -9.81)
        p.setTimeStep(time_step)
        with silence():
            self.body = p.loadURDF(str(path), useFixedBase=not case.free, flags=p.URDF_USE_INERTIA_FROM_FILE)
        names = [name for name, *_ in robots.axes(case.urdf)]
        by_name = {}
        for index in range(-1, p.getNumJoints(self.body)):
            p.changeDynamics(self.body, index, linearDamping=0, angularDamping=0)
            if index < 0:
                continue
            info = p.getJointInfo(self.body, index)
            if info[2] != p.JOINT_FIXED:
                by_name[info[1].decode()] = index
                p.changeDynamics(self.body, index, jointDamping=case.damping, maxJointVelocity=FAST)
                p.setJointMotorControl2(self.body, index, p.VELOCITY_CONTROL, targetVelocity=0, force=case.friction)
        self.joints = [by_name[name] for name in names]
        for name, joint in by_name.items():
            p.resetJointState(self.body, joint, case.positions.get(name, 0.0), case.velocities.get(name, 0.0))
        if case.free:
            self.center = np.array(p.getDynamicsInfo(self.body, -1)[3])
            linear, angular = np.array(case.root_velocity[:3]), np.array(case.root_velocity[3:])
            p.resetBasePositionAndOrientation(self.body, self.center, p.getDynamicsInfo(self.body, -1)[4])
            p.resetBaseVelocity(self.body, linear + np.cross(angular, self.center), angular)
        for follower, (leader, multiplier, offset) in case.mimic.items():
            gear = p.createConstraint(self.body, by_name[leader], self.body, by_name[follower], p.JOINT_GEAR,
                                      [1, 0, 0], [0, 0, 0], [0, 0, 0])
            p.changeConstraint(gear, gearRatio=-1 / multiplier, maxForce=1e6, relativePositionTarget=-offset)
        self.targets = np.array([case.drive.get("targets", {}).get(name, 0.0) for name in names])

    def push(self):
        drive = self.case.drive
        if not drive:
            return
        states = p.getJointStates(self.body, self.joints)
        q, v = (np.array([state[i] for state in states]) for i in (0, 1))
        match drive["kind"]:
            case "position":
                effort = drive["stiffness"] * (self.targets - q) - drive["damping"] * v
            case "velocity":
                effort = drive["damping"] * (self.targets - v)
            case "effort":
                effort = self.targets
        if self.case.effort is not None:
            effort = np.clip(effort, -self.case.effort, self.case.effort)
        p.setJointMotorControlArray(self.body, self.joints, p.TORQUE_CONTROL, forces=effort)

    def view(self):
        states = p.getJointStates(self.body, self.joints) if self.joints else []
        joints = np.array([state[0] for state in states])
        if not self.case.free:
            return joints, None
        place, turn = p.getBasePositionAndOrientation(self.body)
        local = p.getDynamicsInfo(self.body, -1)
        place, turn = p.multiplyTransforms(place, turn, *p.invertTransform(local[3], local[4]))
        return joints, np.array([*place, *turn])


def run(case, time_step, instants, folder):
    client = p.connect(p.DIRECT)
    try:
        world = World(case, time_step, folder)
        seen, done = [], 0
        for instant in instants:
            steps = round(instant / time_step)
            for _ in range(steps - done):
                world.push()
                p.stepSimulation()
            done = steps
            seen.append(world.view())
        return seen
    finally:
        p.disconnect(client)
