"""Scenes whose motion is known: sliding, held, floating and driving bodies, with checks for each."""

from functools import cache
from math import atan2, cos, pi, sin

import mujoco
import numpy as np

import robots
import scenes_in_mujoco
from scene_checks import Check, Shown, deepest, inside, roots, rotation, spread, tilt, worst
from scene_shapes import rows, sheet
from scenes import GROUND, OWN, Robot, Scene, Thing

ALL = ("MuJoCo", "PyBullet")


def tiles():
    """Tiles of every kind in a row, flush, with a gap of 2 mm in the middle."""
    def box(name, start, length):
        return Thing(name, "box", [length, 1.0, 0.2], [start + length / 2, 0.0, -0.1], friction=0.0)

    def surface(name, start, cells, is_mesh):
        size = (0.5, 1.0)
        vertices, triangles = sheet(cells, size, lambda x, y: 0.0) if is_mesh else ([], [])
        return Thing(name, "mesh" if is_mesh else "heights", list(size), [start + size[0] / 2, 0.0, 0.0], friction=0.0,
                     vertices=vertices, triangles=triangles, rows=rows(cells, size, lambda x, y: 0.0))

    floor = [box("first", -1.0, 0.5), box("second", -0.5, 0.5), surface("mesh", 0.0, (7, 5), True),
             surface("heights", 0.5, (7, 5), False), box("third", 1.0, 0.5), box("after_a_gap", 1.502, 0.5)]
    things = [Thing("box", "box", [0.1, 0.1, 0.1], [-0.8, -0.2, 0.05 - 1e-5], 1.0, 0.0, linear=[1.0, 0.0, 0.0]),
              Thing("cylinder", "cylinder", [0.05, 0.1], [-0.8, 0.0, 0.05 - 1e-5], 1.0, 0.0, linear=[1.0, 0.0, 0.0]),
              Thing("ball", "sphere", [0.05], [-0.8, 0.2, 0.05 - 1e-5], 1.0, 0.0, linear=[1.0, 0.0, 0.0])]
    scene = Scene("what slides over tiles of every kind", 2.5, [0.1, 2.5], [*floor, *things])
    checks = []
    for index, thing in enumerate(things):
        checks += [
            Check(f"the speed of the {thing.name} changes by {{}} of it",
                  lambda v, i=index: worst(roots(v, [7], i) - 1.0), 1e-3),
            Check(f"the {thing.name} gets {{}} m off its line",
                  lambda v, i=index: spread(roots(v, [1], i)), 1e-3),
        ]
    return Shown(scene, checks, ALL, eye=[0.5, -3.5, 2.0], at=[0.5, 0.0, 0.0], instants=(0.0, 1.2, 2.5))


def turntable():
    """2 rad/s at 0.5 m need a fifth of the weight, and friction offers half of it."""
    speed = 2.0
    table = Robot("table", OWN + "turntable.urdf", [0.0, 0.0, 0.0], True, friction=0.5, joints={"turn": 0.0},
                  speeds={"turn": [200.0, [[0.0, 0.0], [2.0, speed], [1e3, speed]]]})
    box = Thing("box", "box", [0.1, 0.1, 0.1], [0.5, 0.0, 0.05 - 1e-5], 1.0, 0.5)
    scene = Scene("a box on a turntable for a minute", 62.0, [2.0, 62.0], [box], [table])
    return Shown(scene, [
        Check("it creeps by {} m over the table", lambda v: creep(inside(v, 2.0), 0), 1e-4),
        Check("it goes {} m into the table", deepest(2.0), 1e-3),
    ], ALL, eye=[0.6, -1.6, 1.2], at=[0.0, 0.0, 0.0], instants=(0.0, 30.0, 62.0), look=0.05)


def turning_gripper():
    """Fingers press with 15 N each; friction of 0.8 must hold 2 N of weight and 0.54 N outwards."""
    speed = 3.0
    joints = {"turn": 0.0, "left": 0.07, "right": 0.07}
    held = [[0.0, 0.0715], [1e3, 0.0715]]
    robot = Robot("gripper", OWN + "turning_gripper.urdf", [0.0, 0.0, 0.5], True, friction=0.8, joints=joints,
                  gains={"left": [1e4, 60.0], "right": [1e4, 60.0]}, path={"left": held, "right": held},
                  speeds={"turn": [100.0, [[0.0, 0.0], [2.0, speed], [1e3, speed]]]})
    cube = Thing("cube", "box", [0.06, 0.06, 0.06], [0.3, 0.0, 0.5], 0.2, 0.8)
    scene = Scene("a gripper turns with a cube", 22.0, [2.0, 22.0], [cube], [robot])
    return Shown(scene, [
        Check("the cube slips by {} m from the hand", lambda v: creep(inside(v, 2.0), 0), 1e-4),
        Check("it sinks by {} m", lambda v: spread(roots(inside(v, 2.0), [2])), 1e-4),
        Check("it tilts by {} rad", lambda v: worst([tilt(view) for view in v]), 1e-2),
    ], ALL, eye=[0.5, -1.0, 1.1], at=[0.0, 0.0, 0.5], instants=(0.0, 10.0, 22.0), look=0.02)


def creep(views, joint):
    """Returns how far the first body moves on the body that a joint turns about z, m."""
    def seen(view):
        angle = view.joints[joint]
        x, y, _ = view.roots[0, :3]
        return np.array([cos(angle) * x + sin(angle) * y, cos(angle) * y - sin(angle) * x])
    places = np.array([seen(view) for view in views])
    return worst(np.linalg.norm(places - places[0], axis=1))


def low_gravity():
    """A slope of 0.3 rad without friction: g sin(0.3) t^2 / 2 after t seconds, however small g is."""
    gravity, angle, seconds = 1e-3, 0.3, 60.0
    turn = [0.0, sin(angle / 2), 0.0, cos(angle / 2)]
    normal = np.array([sin(angle), 0.0, cos(angle)])
    slope = Thing("slope", "plane", [], [0.0, 0.0, 0.0], friction=0.0, turn=turn)
    box = Thing("box", "box", [0.1, 0.1, 0.1], list(normal * 0.05), 1.0, 0.0, turn=turn)
    scene = Scene("a slope without friction at a ten-thousandth of gravity", seconds, [0.0, seconds], [slope, box], gravity=gravity)
    way = 0.5 * gravity * sin(angle) * seconds**2
    along = np.array([cos(angle), 0.0, -sin(angle)])
    return Shown(scene, [
        Check("its way differs by {} of g sin(a) t^2 / 2",
              lambda v: worst((v[-1].roots[0, :3] - v[0].roots[0, :3]) @ along / way - 1), 1e-3),
    ], ALL, eye=[0.4, -2.5, 0.8], at=[0.2, 0.0, -0.1], instants=(0.0, 30.0, 60.0), look=0.05)


def waving():
    """Nothing but its motors acts on it, so its centre of mass stays, even if targets jump."""
    urdf = "humanoid/urdf/humanoid.urdf"
    moving = [joint.get("name") for joint in robots.read(urdf).findall("joint") if joint.get("type") != "fixed"]
    wave = [[0.0, 0.0]]
    for beat in range(20):
        # A jump within a millisecond, each quarter of a second.
        wave += [[0.25 * (beat + 1) - 1e-3, wave[-1][1]], [0.25 * (beat + 1), -0.5 if beat % 2 else 0.5]]
    still = [[0.0, 0.0], [1e3, 0.0]]
    arms = [name for name in moving if "shoulder" in name or "elbow" in name]
    robot = Robot("humanoid", urdf, [0.0, 0.0, 1.5], False, joints=dict.fromkeys(moving, 0.0),
                  gains=dict.fromkeys(moving, [500.0, 20.0]),
                  path={name: wave if name in arms else still for name in moving})
    scene = Scene("a floating humanoid waves", 5.0, [0.0, 5.0], [], [robot], gravity=0.0)
    return Shown(scene, [
        Check("its centre of mass drifts by {} m", lambda v: worst([centre(scene, view) - centre(scene, v[0]) for view in v]), 1e-5),
        Check("its trunk turns by {} rad, as its arms make it", lambda v: worst([tilt(view) for view in v]), 1.0),
    ], ALL, eye=[2.0, -2.0, 0.6], at=[0.0, 0.0, 0.0], follows=True, instants=(0.0, 1.4, 3.1, 5.0))


@cache
def masses(name):
    scene = next(shown.scene for shown in (waving(),) if shown.scene.name == name)
    model = scenes_in_mujoco.model(scene, "default")
    return model, mujoco.MjData(model), scene.robots[0]


def centre(scene, view):
    """The centre of mass of the scene's one robot, by MuJoCo's kinematics, m."""
    model, data, robot = masses(scene.name)
    x, y, z, w = view.roots[0, 3:7]
    data.qpos[:7] = [*view.roots[0, :3], w, x, y, z]
    for name, position in zip(robot.joints, view.joints):
        data.qpos[model.joint(f"{robot.name}/{name}").qposadr[0]] = position
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data.subtree_com[0].copy()


RADIUS, TRACK = 0.05, 0.3
"""The radius of a wheel, and the distance between the two, m."""


def square():
    """Sides of 1 m, and turns of a right angle on the spot: by the wheels' turns it returns to its start."""
    side, corner, pause, ramp = 4.0, 3.0, 0.5, 0.5
    straight = 1.0 / (RADIUS * (side - ramp))
    turning = pi / 2 * TRACK / 2 / (RADIUS * (corner - ramp))
    left, right, now = [[0.0, 0.0]], [[0.0, 0.0]], 0.5
    for _ in range(4):
        for long, a, b in ((side, straight, straight), (corner, -turning, turning)):
            for path, speed in ((left, a), (right, b)):
                path += [[now, 0.0], [now + ramp, speed], [now + long - ramp, speed], [now + long, 0.0]]
            now += long + pause
    names = ["left", "right", "front_across", "front_along", "rear_across", "rear_along"]
    robot = Robot("drive", OWN + "drive.urdf", [-0.5, -0.5, RADIUS], False, friction=0.8, joints=dict.fromkeys(names, 0.0),
                  speeds={"left": [50.0, left + [[1e3, 0.0]]], "right": [50.0, right + [[1e3, 0.0]]]})
    scene = Scene("a drive goes a square", now + 0.5, [0.0, now], [GROUND], [robot])

    def heading(view):
        turn = rotation(view.roots[0, 3:7])
        return atan2(turn[1, 0], turn[0, 0])

    return Shown(scene, [
        Check("it ends {} m from where it began", lambda v: worst(np.linalg.norm(v[-1].roots[0, :2] - v[0].roots[0, :2])), 0.02),
        Check("it has turned {} rad more or less than a whole turn", lambda v: worst(heading(v[-1])), 0.02 * 2 * pi),
        Check("it comes {} m off the square", lambda v: worst([off_square(view.roots[0, :2]) for view in v]), 0.02),
    ], ALL, eye=[0.0, -2.2, 2.0], at=[0.0, 0.0, 0.0], instants=(4.0, 11.5, 19.0, now))


def off_square(place):
    """Distance from the outline of a square of 1 m about the origin."""
    x, y = np.abs(place)
    outside = np.hypot(max(x - 0.5, 0.0), max(y - 0.5, 0.0))
    return max(outside, min(0.5 - x, 0.5 - y, key=abs) if max(x, y) < 0.5 else 0.0)


def shown():
    return [tiles(), turntable(), turning_gripper(), low_gravity(), waving(), square()]
