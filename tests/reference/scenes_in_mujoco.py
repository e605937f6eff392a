"""A scene with contact in MuJoCo, and its views over time.

It has two modes. `default`: MuJoCo's soft contacts and pyramids of friction. `stiff`: as near to rigid as
this time step allows, with the cone of Coulomb's law. Both use `implicitfast`, which has implicit dampers
of actuators, and clamps the whole effort, as simd does.
"""

import xml.etree.ElementTree as xml
from bisect import bisect_right
from dataclasses import dataclass
from operator import itemgetter

import mujoco
import numpy as np

import robots

STIFF = "stiff"


@dataclass
class View:
    """View of a scene at an instant."""

    time: float
    roots: np.ndarray
    """Position, quaternion x y z w, linear and angular velocity of each body that can move as a whole."""
    joints: np.ndarray
    """Positions of all robots' joints."""
    deepest: float
    """The largest overlap since the last view, m."""
    forces: list
    """Sums of normal forces for the scene's `watch`, N."""
    error: float = 0.0
    """Largest distance between the ends of constraints, m."""


def model(scene, setting):
    spec = mujoco.MjSpec()
    spec.option.timestep = scene.time_step
    spec.option.gravity = [0.0, 0.0, -scene.gravity]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.compiler.fusestatic = True
    if setting == STIFF:
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = 10
    if len(scene.free()) > 100:
        # Newton's method takes up to 0.8 s a step while a thousand fall.
        spec.option.solver = mujoco.mjtSolver.mjSOL_CG
    for thing in scene.things:
        for name, at in thing.places():
            add_thing(spec, thing, name, at, setting, scene.time_step)
    for index, robot in enumerate(scene.robots):
        add_robot(spec, robot, index, setting, scene.time_step)
    for index, constraint in enumerate(scene.constraints):
        add_constraint(spec, constraint, index, setting, scene.time_step)
    return rods(spec.compile(), scene)


def surface(geom, friction, setting, kinds, time_step):
    """The smaller friction applies, since its body has priority."""
    geom.friction[0] = max(friction, 1e-5)
    geom.priority = round(-1000 * friction)
    geom.contype, geom.conaffinity = kinds
    if setting == STIFF:
        # A time constant of two steps is the shortest that MuJoCo accepts.
        geom.solref = [2 * time_step, 1.0]
        geom.solimp = [0.99, 0.999, 0.0001, 0.5, 2]


def add_thing(spec, thing, name, at, setting, time_step):
    kinds = mujoco.mjtGeom
    x, y, z, w = thing.turn
    body = spec.worldbody.add_body(name=name, pos=at, quat=[w, x, y, z])
    if thing.mass:
        body.add_freejoint()
    match thing.shape:
        case "box":
            shape = {"type": kinds.mjGEOM_BOX, "size": [edge / 2 for edge in thing.size]}
        case "sphere":
            shape = {"type": kinds.mjGEOM_SPHERE, "size": [thing.size[0], 0, 0]}
        case "cylinder":
            shape = {"type": kinds.mjGEOM_CYLINDER, "size": [thing.size[0], thing.size[1] / 2, 0]}
        case "plane":
            shape = {"type": kinds.mjGEOM_PLANE, "size": [50, 50, 1]}
        case _ if thing.mass:
            spec.add_mesh(name=name, uservert=np.ravel(thing.vertices))
            shape = {"type": kinds.mjGEOM_MESH, "meshname": name}
        case _:
            shape = heights(spec, thing, name)
    geom = body.add_geom(name=name, mass=thing.mass, **shape)
    surface(geom, thing.friction, setting, (1 << 20, (1 << 21) - 1), time_step)
    if thing.moment:
        body.explicitinertial = True
        body.mass, body.ipos, body.inertia = thing.mass, [0, 0, 0], thing.moment


def heights(spec, thing, name):
    """A field, whose rows MuJoCo orders from the smallest y up, between 0 and 1."""
    rows = np.array(thing.rows)[::-1]
    least, most = rows.min(), rows.max()
    long, wide = thing.size
    high = max(most - least, 1e-3)
    spec.add_hfield(name=name, nrow=rows.shape[0], ncol=rows.shape[1], size=[long / 2, wide / 2, high, 1.0],
                    userdata=np.ravel((rows - least) / high))
    return {"type": mujoco.mjtGeom.mjGEOM_HFIELD, "hfieldname": name, "pos": [0, 0, least]}


def add_robot(spec, robot, index, setting, time_step):
    own = mujoco.MjSpec.from_string(text(robot.urdf))
    if not robot.fixed:
        own.worldbody.first_body().add_freejoint()
    for geom in own.geoms:
        # Links touch everything but each other.
        surface(geom, robot.friction, setting, (1 << index, ((1 << 21) - 1) ^ (1 << index)), time_step)
    for joint in own.joints:
        joint.actfrclimited = False
        joint.damping[0], joint.frictionloss = 0.0, 0.0
    x, y, z, w = robot.turn
    frame = spec.worldbody.add_frame(pos=robot.at, quat=[w, x, y, z])
    spec.attach(own, prefix=f"{robot.name}/", frame=frame)
    for joint, (stiffness, damping) in robot.gains.items():
        name = f"{robot.name}/{joint}"
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=stiffness, kv=damping)
        if joint in robot.effort:
            actuator.forcelimited, actuator.forcerange = True, [-robot.effort[joint], robot.effort[joint]]
    for joint, (damping, _) in robot.speeds.items():
        name = f"{robot.name}/{joint}"
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_velocity(kv=damping)


def add_constraint(spec, constraint, index, setting, time_step):
    """Points and welds are between sites, rods are tendons of constant length, ropes are tendons with a
    limit. Parts shared by two bodies do not touch."""
    kinds = mujoco.mjtEq
    if constraint.kind == "gear":
        parent, child = ("/".join(end) for end in (constraint.parent, constraint.child))
        held = spec.add_equality(name=f"held-{index}", type=kinds.mjEQ_JOINT, name1=child, name2=parent,
                                data=[0.0, constraint.ratio] + [0.0] * 10)
    else:
        ends = []
        for side, (owner, link), at in (("parent", constraint.parent, constraint.parent_at), ("child", constraint.child, constraint.child_at)):
            body = spec.worldbody if not owner else spec.body(f"{owner}/{link}" if link else owner)
            site = body.add_site(name=f"{side}-{index}", pos=at)
            ends.append((site.name, body.name))
        (first, parent), (second, child) = ends
        if "world" not in (parent, child):
            spec.add_exclude(bodyname1=parent, bodyname2=child)
        if constraint.kind in ("rod", "rope"):
            tendon = spec.add_tendon(name=f"tendon-{index}")
            tendon.wrap_site(first)
            tendon.wrap_site(second)
            if constraint.kind == "rope":
                tendon.limited, tendon.range = True, [0.0, constraint.length]
                return
            held = spec.add_equality(name=f"held-{index}", type=kinds.mjEQ_TENDON, name1=tendon.name)
        else:
            kind = kinds.mjEQ_WELD if constraint.kind == "weld" else kinds.mjEQ_CONNECT
            held = spec.add_equality(name=f"held-{index}", type=kind, name1=first, name2=second, objtype=mujoco.mjtObj.mjOBJ_SITE)
    if setting == STIFF:
        held.solref = [2 * time_step, 1.0]
        held.solimp = [0.99, 0.999, 0.0001, 0.5, 2]


def rods(compiled, scene):
    """A tendon's equality counts from its length with all joints at 0."""
    for index, constraint in enumerate(scene.constraints):
        if constraint.kind == "rod":
            tendon = compiled.tendon(f"tendon-{index}").id
            compiled.equality(f"held-{index}").data[0] = constraint.length - compiled.tendon_length0[tendon]
    return compiled


def text(urdf):
    root = robots.read(urdf)
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    for other in [child for child in root if child.tag not in ("link", "joint")]:
        root.remove(other)
    return xml.tostring(root, encoding="unicode")


class World:
    def __init__(self, scene, setting):
        self.scene = scene
        self.model = compiled = model(scene, setting)
        self.data = data = mujoco.MjData(compiled)
        free = [name for name, _ in scene.free()]
        names = {robot.name: f"{robot.name}/" for robot in scene.robots}
        self.bodies = [body_of(compiled, names.get(name), name) for name in free]
        self.joints = [compiled.joint(f"{robot.name}/{joint}").qposadr[0]
                       for robot in scene.robots for joint in robot.joints]
        data.qpos[self.joints] = [at for robot in scene.robots for at in robot.joints.values()]
        self.velocities = np.array([compiled.body_dofadr[body] for body in self.bodies], dtype=int)
        things = {name: thing for thing in scene.things for name, _ in thing.places()}
        thrown = things | {robot.name: robot for robot in scene.robots}
        for name, first, body in zip(free, self.velocities, self.bodies):
            data.qvel[first:first + 3] = thrown[name].linear
            # MuJoCo has the angular velocity in the body's axes.
            data.qvel[first + 3:first + 6] = turned(thrown[name].angular, compiled.body_quat[body] * [1, -1, -1, -1])
        for robot in scene.robots:
            for joint, velocity in robot.velocities.items():
                data.qvel[compiled.joint(f"{robot.name}/{joint}").dofadr[0]] = velocity
        self.targets = [(compiled.actuator(f"{robot.name}/{joint}").id, robot, joint)
                        for robot in scene.robots for joint in [*robot.gains, *robot.speeds]]
        self.watched = [self.geoms(*watch) for watch in scene.watch]

    def geoms(self, owner, link):
        """Contacts of a robot's link, or of the whole robot."""
        compiled = self.model
        wanted = f"{owner}/{link}" if link else owner
        out = np.zeros(compiled.ngeom, dtype=bool)
        for geom in range(compiled.ngeom):
            # Fixed things have no separate body: they are known by their shapes.
            thing, body = compiled.geom(geom).name, compiled.body(compiled.geom_bodyid[geom]).name
            out[geom] = wanted in (thing, body) or (not link and body.startswith(f"{owner}/"))
        return out

    def step(self):
        for actuator, robot, joint in self.targets:
            self.data.ctrl[actuator] = target(robot, joint, self.data.time)
        mujoco.mj_step(self.model, self.data)

    def overlap(self):
        return max(0.0, -self.data.contact.dist.min()) if self.data.ncon else 0.0

    def view(self, deepest):
        data = self.data
        roots = np.zeros((len(self.bodies), 13))
        if self.bodies:
            first = self.model.jnt_qposadr[self.model.body_jntadr[self.bodies]]
            roots[:, :3] = data.qpos[first[:, None] + [0, 1, 2]]
            roots[:, 3:7] = data.qpos[first[:, None] + [4, 5, 6, 3]]
            roots[:, 7:] = data.qvel[self.velocities[:, None] + np.arange(6)]
            for root in roots:
                root[10:] = turned(root[10:], root[[6, 3, 4, 5]])
        forces, force = np.zeros(len(self.watched)), np.zeros(6)
        for i, contact in enumerate(data.contact):
            mujoco.mj_contactForce(self.model, data, i, force)
            forces += [force[0] * any(watched[list(contact.geom)]) for watched in self.watched]
        return View(data.time, roots, data.qpos[self.joints].copy(), deepest, forces.tolist(), self.error())

    def error(self):
        worst = 0.0
        for index, constraint in enumerate(self.scene.constraints):
            if constraint.kind != "gear":
                apart = np.linalg.norm(self.data.site(f"parent-{index}").xpos - self.data.site(f"child-{index}").xpos)
                worst = max(worst, apart - constraint.length if constraint.kind == "rope" else abs(apart - constraint.length))
        return worst


def turned(vector, quaternion):
    """Rotates by a quaternion w x y z."""
    out = np.zeros(3)
    mujoco.mju_rotVecQuat(out, np.array(vector, dtype=float), np.array(quaternion, dtype=float))
    return out


def body_of(compiled, prefix, name):
    """Returns the body of a thing, or the first one of a robot."""
    if prefix is None:
        return compiled.body(name).id
    return next(body for body in range(compiled.nbody) if compiled.body(body).name.startswith(prefix))


def interpolated(path, now):
    """Interpolates a path of pairs of seconds and values."""
    after = bisect_right(path, now, key=itemgetter(0))
    if after in (0, len(path)):
        return path[min(after, len(path) - 1)][1]
    (begin, first), (end, last) = path[after - 1:after + 1]
    return first + (last - first) * (now - begin) / (end - begin)


def target(robot, joint, now):
    if joint in robot.speeds:
        return interpolated(robot.speeds[joint][1], now)
    if joint in robot.path:
        return interpolated(robot.path[joint], now)
    names = list(robot.joints)
    if not robot.cycle or now < robot.begin:
        return robot.joints[joint]
    samples = len(robot.cycle)
    at = (now - robot.begin) / robot.period * samples
    before, part = int(at), at - int(at)
    column = names.index(joint)
    return (1 - part) * robot.cycle[before % samples][column] + part * robot.cycle[(before + 1) % samples][column]


def run(scene, setting, every, may_diverge=False):
    """Returns views from the start on, one each `every` steps. Divergence is an error, or continues with NaN."""
    world = World(scene, setting)
    if may_diverge:
        world.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    mujoco.mj_forward(world.model, world.data)
    views, deepest = [world.view(0.0)], 0.0
    for step in range(1, round(scene.seconds / scene.time_step) + 1):
        world.step()
        deepest = max(deepest, world.overlap())
        if step % every == 0:
            views.append(world.view(deepest))
            deepest = 0.0
    if not may_diverge and any(warning.number for warning in world.data.warning):
        raise RuntimeError(f"{scene.name}: MuJoCo warns of its state")
    return views
