"""A scene with contact in PyBullet, DIRECT: one `stepSimulation` a step, solver settings as by default.

These settings differ from the defaults: masses and moments as given, no damping, no threshold of
restitution. Friction and restitution of a pair are the products of its bodies' values. Each body gets the
square root, so that equal ones have the scene's value. Its motors are constraints without gains. A
position's gain is a part of the error. An implicit spring and damper of the scene's gains would remove
that part from a light link in a step. Its force is the joint's effort. Overlaps and forces are taken at
the views alone.
"""

import tempfile
import xml.etree.ElementTree as xml
from math import sqrt
from pathlib import Path

import numpy as np
import pybullet_data

import robots
from quiet import pybullet as p
from quiet import silence
from scenes_in_mujoco import View, interpolated, target

FAST = 1e9
UNLIMITED = 1e5
"""Effort without a limit, N m."""


class World:
    def __init__(self, scene):
        self.scene = scene
        self.client = p.connect(p.DIRECT)
        p.setGravity(0, 0, -scene.gravity)
        p.setTimeStep(scene.time_step)
        p.setPhysicsEngineParameter(restitutionVelocityThreshold=0.0, deterministicOverlappingPairs=1)
        self.owners, self.free, self.joints, self.motors = {}, [], [], []
        for thing in scene.things:
            self.add_thing(thing)
        for robot in scene.robots:
            self.add_robot(robot)
        self.held = [held for constraint in scene.constraints for held in self.add_constraint(constraint)]

    def close(self):
        p.disconnect(self.client)

    def add_thing(self, thing):
        shape, seen = shapes(thing)
        for name, at in thing.places():
            body = p.createMultiBody(thing.mass, shape, seen, at, thing.turn)
            self.owners[body] = name
            self.surface(body, thing)
            if not thing.mass:
                continue
            if thing.moment:
                p.changeDynamics(body, -1, localInertiaDiagonal=thing.moment)
            p.resetBaseVelocity(body, thing.linear, thing.angular)
            self.free.append(body)

    def surface(self, body, of):
        for link in range(-1, p.getNumJoints(body)):
            p.changeDynamics(body, link, lateralFriction=sqrt(of.friction), restitution=sqrt(of.restitution), linearDamping=0,
                             angularDamping=0, rollingFriction=0, spinningFriction=0)

    def add_robot(self, robot):
        if robot.urdf.endswith(".sdf"):
            with silence():
                bodies = p.loadSDF(str(Path(pybullet_data.getDataPath()) / robot.urdf.removeprefix(robots.OTHERS)))
            for body in bodies:
                self.owners[body] = robot.name
                self.surface(body, robot)
            return
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file, silence():
            file.write(text(robot.urdf, robot.fixed))
            file.flush()
            flags = p.URDF_USE_INERTIA_FROM_FILE | p.URDF_MERGE_FIXED_LINKS
            body = p.loadURDF(file.name, robot.at, robot.turn, useFixedBase=robot.fixed, flags=flags)
        self.owners[body] = robot.name
        self.surface(body, robot)
        names = {p.getJointInfo(body, joint)[1].decode(): joint for joint in range(p.getNumJoints(body))}
        for joint in names.values():
            p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
            p.changeDynamics(body, joint, jointDamping=0, maxJointVelocity=FAST)
        for name, at in robot.joints.items():
            p.resetJointState(body, names[name], at, robot.velocities.get(name, 0.0))
            self.joints.append((body, names[name]))
            if name in robot.gains or name in robot.speeds:
                self.motors.append((body, names[name], robot, name))
        if not robot.fixed:
            p.resetBaseVelocity(body, robot.linear, robot.angular)
            self.free.append(body)

    def add_constraint(self, constraint):
        """Returns bodies and points of a point or weld, which PyBullet measures from each link's centre of
        mass."""
        if constraint.kind == "gear":
            (robot, first), (_, second) = constraint.parent, constraint.child
            body = next(body for body, owner in self.owners.items() if owner == robot)
            first, second = self.link(body, first, 1), self.link(body, second, 1)
            held = p.createConstraint(body, first, body, second, p.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0])
            # The ratio of the velocities, inverted.
            p.changeConstraint(held, gearRatio=-1 / constraint.ratio, maxForce=1e4, erp=0.2, relativePositionTarget=0)
            return []
        ends = []
        for (owner, link), at in ((constraint.parent, constraint.parent_at), (constraint.child, constraint.child_at)):
            body = next((body for body, name in self.owners.items() if name == owner), -1)
            index = -1 if body < 0 or not link else self.link(body, link, 12)
            ends.append((body, index, at if body < 0 else self.from_mass(body, index, at)))
        (a, i, first), (b, j, second) = ends
        if a < 0:
            # The world cannot be a parent in PyBullet.
            (a, i, first), (b, j, second) = ends[::-1]
        kind = p.JOINT_FIXED if constraint.kind == "weld" else p.JOINT_POINT2POINT
        held = p.createConstraint(a, i, b, j, kind, [0, 0, 0], first, second)
        p.changeConstraint(held, maxForce=1e6)
        if b >= 0:
            p.setCollisionFilterPair(a, b, i, j, 0)
        return [ends]

    def link(self, body, name, column):
        """Returns the number of a link (12) or a joint (1) by its name; -1 for the root."""
        return next((n for n in range(p.getNumJoints(body)) if p.getJointInfo(body, n)[column].decode() == name), -1)

    def from_mass(self, body, link, at):
        info = p.getDynamicsInfo(body, link)
        return p.multiplyTransforms(*p.invertTransform(info[3], info[4]), at, [0, 0, 0, 1])[0]

    def error(self):
        worst = 0.0
        for ends in self.held:
            places = []
            for body, link, at in ends:
                if body < 0:
                    places.append(at)
                    continue
                pose = p.getBasePositionAndOrientation(body) if link < 0 else p.getLinkState(body, link, computeForwardKinematics=1)[:2]
                places.append(p.multiplyTransforms(*pose, at, [0, 0, 0, 1])[0])
            worst = max(worst, float(np.linalg.norm(np.subtract(*places))))
        return worst

    def step(self, now):
        h = self.scene.time_step
        for body, joint, robot, name in self.motors:
            effort = robot.effort.get(name, UNLIMITED)
            if name in robot.speeds:
                p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=effort,
                                        targetVelocity=interpolated(robot.speeds[name][1], now))
            else:
                stiffness, damping = robot.gains[name]
                p.setJointMotorControl2(body, joint, p.POSITION_CONTROL, targetPosition=target(robot, name, now), force=effort,
                                        positionGain=stiffness * h / (damping + stiffness * h))
        p.stepSimulation()

    def view(self, now):
        roots = np.array([self.root(body) for body in self.free]).reshape(-1, 13)
        joints = np.array([p.getJointState(body, joint)[0] for body, joint in self.joints])
        points = p.getContactPoints() or ()
        deepest = max([0.0, *(-point[8] for point in points)])
        forces = [sum(point[9] for point in points if robot in (self.owners[point[1]], self.owners[point[2]]))
                  for robot, _ in self.scene.watch]
        return View(now, roots, joints, deepest, forces, self.error())

    def root(self, body):
        place, turn = p.getBasePositionAndOrientation(body)
        local = p.getDynamicsInfo(body, -1)
        place, turn = p.multiplyTransforms(place, turn, *p.invertTransform(local[3], local[4]))
        return [*place, *turn, *(part for velocity in p.getBaseVelocity(body) for part in velocity)]

    def put(self, view):
        """Moves everything to a view's state."""
        for body, root in zip(self.free, view.roots):
            local = p.getDynamicsInfo(body, -1)
            p.resetBasePositionAndOrientation(body, *p.multiplyTransforms(root[:3], root[3:7], local[3], local[4]))
        for (body, joint), at in zip(self.joints, view.joints):
            p.resetJointState(body, joint, at)

    def picture(self, view, eye, at, size):
        """Returns a camera's red, green and blue, drawn by the processor."""
        self.put(view)
        width, height = size
        looks = p.computeViewMatrix(eye, at, [0, 0, 1])
        far = 4 * float(np.linalg.norm(np.subtract(eye, at))) + 1
        lens = p.computeProjectionMatrixFOV(40, width / height, far / 400, far)
        seen = p.getCameraImage(width, height, looks, lens, lightDirection=[1, -2, 3], shadow=1, renderer=p.ER_TINY_RENDERER)
        return np.reshape(seen[2], (height, width, 4))[:, :, :3].astype(np.uint8)


def shapes(thing):
    """Collision shape and visual shape."""
    colour = {"rgbaColor": [0.75, 0.72, 0.65, 1.0] if not thing.mass else [0.85, 0.45, 0.2, 1.0]}
    match thing.shape:
        case "box":
            half = [edge / 2 for edge in thing.size]
            return (p.createCollisionShape(p.GEOM_BOX, halfExtents=half),
                    p.createVisualShape(p.GEOM_BOX, halfExtents=half, **colour))
        case "sphere":
            return (p.createCollisionShape(p.GEOM_SPHERE, radius=thing.size[0]),
                    p.createVisualShape(p.GEOM_SPHERE, radius=thing.size[0], **colour))
        case "cylinder":
            radius, length = thing.size
            return (p.createCollisionShape(p.GEOM_CYLINDER, radius=radius, height=length),
                    p.createVisualShape(p.GEOM_CYLINDER, radius=radius, length=length, **colour))
        case "plane":
            return (p.createCollisionShape(p.GEOM_PLANE, planeNormal=[0, 0, 1]),
                    p.createVisualShape(p.GEOM_BOX, halfExtents=[20, 20, 0.005], visualFramePosition=[0, 0, -0.006], **colour))
    if thing.mass:
        hull = [thing.vertices[i] for i in HULL.ravel()]
        seen = p.createVisualShape(p.GEOM_MESH, vertices=hull, indices=list(range(len(hull))), **colour)
        return p.createCollisionShape(p.GEOM_MESH, vertices=thing.vertices), seen
    vertices, triangles = (thing.vertices, thing.triangles) if thing.vertices else mesh_of_rows(thing)
    indices = [corner for triangle in triangles for corner in triangle]
    touched = p.createCollisionShape(p.GEOM_MESH, vertices=vertices, indices=indices, flags=p.GEOM_FORCE_CONCAVE_TRIMESH)
    both = [corner for a, b, c in triangles for corner in (a, b, c, a, c, b)]
    corners = [vertices[corner] for corner in both]
    return touched, p.createVisualShape(p.GEOM_MESH, vertices=corners, indices=list(range(len(corners))), **colour)


HULL = np.array([[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
                 [1, 5, 7], [1, 7, 3]])
"""Faces of a wedge, whose corners are in the order of `scene_shapes.wedge`; visual only."""


def mesh_of_rows(thing):
    rows, (long, wide) = np.array(thing.rows), thing.size
    down, across = rows.shape
    vertices = [[(i / (across - 1) - 0.5) * long, (0.5 - j / (down - 1)) * wide, rows[j, i]]
                for j in range(down) for i in range(across)]
    triangles = []
    for j in range(down - 1):
        for i in range(across - 1):
            a = j * across + i
            triangles += [[a, a + across, a + 1], [a + 1, a + across, a + across + 1]]
    return vertices, triangles


def text(urdf, fixed):
    """Links without an inertial weigh a kilogram in PyBullet unless the file says 0, and a root of 0 is
    fixed. Full paths find the meshes."""
    root = robots.read(urdf)
    folder = Path(pybullet_data.getDataPath()) / urdf.removeprefix(robots.OTHERS)
    for mesh in root.iter("mesh"):
        mesh.set("filename", str(folder.parent / mesh.get("filename")))
    for i, link in enumerate(root.findall("link")):
        if link.find("inertial") is None:
            mass, moment = ("0", "0") if i or fixed else ("0.01", "1e-5")
            inertial = xml.SubElement(link, "inertial")
            xml.SubElement(inertial, "mass", {"value": mass})
            xml.SubElement(inertial, "inertia", {part: moment if part[1] == part[2] else "0"
                                                 for part in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")})
    return xml.tostring(root, encoding="unicode")


def run(scene, every):
    """Returns views from the start on, one each `every` steps."""
    world = World(scene)
    try:
        views = [world.view(0.0)]
        for step in range(1, round(scene.seconds / scene.time_step) + 1):
            world.step((step - 1) * scene.time_step)
            if step % every == 0:
                views.append(world.view(step * scene.time_step))
        return views
    finally:
        world.close()
