"""Scenes that are hard on a solver or an integrator, with checks for each."""

from math import cos, hypot, pi, radians, sin, sqrt

import numpy as np

import robots
from scene_checks import Check, Shown, deepest, inside, moved, roots, rotation, spin_energy, worst
from scene_shapes import turn_about, wedge
from scenes import GROUND, OWN, Robot, Scene, Thing

G = 9.81
ALL = ("MuJoCo", "PyBullet")


def tower(name, masses, seconds, sway):
    """Cubes of 20 cm on each other."""
    size = 0.2
    cubes = [Thing(f"cube-{i}", "box", [size] * 3, [0.0, 0.0, size * (i + 0.5)], mass) for i, mass in enumerate(masses)]
    scene = Scene(name, seconds, [seconds / 2, seconds], [GROUND, *cubes], watch=[["ground", ""]])
    top, weight = len(masses) - 1, sum(masses) * G
    return Shown(scene, [
        Check("the top one is {} m from its height", lambda v: worst(v[-1].roots[top, 2] - size * (top + 0.5)), 1e-3),
        Check("any moves by {} m in the second half", lambda v: moved(inside(v, seconds / 2)), sway),
        Check("the ground's force differs by {} of the weight",
              lambda v: worst(np.array([view.forces[0] for view in inside(v, seconds / 2)]) / weight - 1), 1e-3),
    ], ALL, eye=[2.0, -4.0 - 0.15 * top, 0.1 * top + 0.5], at=[0.0, 0.0, 0.1 * top], instants=(0.0, seconds))


def disc():
    """It falls freely, and wobbles by three degrees."""
    radius, high, spin, wobble = 0.13, 0.02, 60.0, radians(3)
    moment = [(3 * radius**2 + high**2) / 12] * 2 + [radius**2 / 2]
    body = Thing("disc", "cylinder", [radius, high], [0.0, 0.0, 0.0], 1.0, angular=[spin * sin(wobble), 0.0, spin * cos(wobble)])
    start = 0.5 * (moment[0] * (spin * sin(wobble))**2 + moment[2] * (spin * cos(wobble))**2)
    scene = Scene("a disc of 60 rad/s wobbles", 5.0, [4.0, 5.0], [body])
    return Shown(scene, [
        Check("its energy differs by {} of what it was",
              lambda v: worst([spin_energy(view, moment) / start - 1 for view in v]), 1e-2),
    ], ALL, eye=[0.3, -0.5, 0.35], at=[0.0, 0.0, 0.0], follows=True, instants=(0.0, 2.5, 5.0))


def flywheel():
    """The base turns at 0.5 rad/s across the shaft, so that the two nutate; the test measures how fast the
    base turns."""
    robot = Robot("flywheel", OWN + "flywheel.urdf", [0.0, 0.0, 0.0], False, joints={"shaft": 0.0},
                  velocities={"shaft": 600.0}, angular=[0.0, 0.5, 0.0])
    scene = Scene("a flywheel of 600 rad/s in a free body", 5.0, [4.0, 5.0], [], [robot])
    return Shown(scene, [
        Check("the base turns across the shaft at up to {} rad/s", lambda v: worst([across(view) for view in v]), 0.55),
    ], ALL, eye=[0.4, -0.6, 0.4], at=[0.0, 0.0, 0.0], follows=True, instants=(0.0, 2.5, 5.0))


def across(view):
    _, y, z = rotation(view.roots[0, 3:7]).T @ view.roots[0, 10:13]
    return hypot(y, z)


def top():
    """Slow precession: m g l / (I3 w), from the velocity at which it neither falls nor rises."""
    mass, length, third, first, spin, lean = 1.0, 0.1, 0.003, 0.002 + 1.0 * 0.1**2, 1000.0, 0.4
    # (I1 cos lean) p^2 - I3 (w + p cos lean) p + m g l = 0; w is the joint's own velocity.
    a, b, c = (first - third) * cos(lean), -third * spin, mass * G * length
    velocity = (-b - sqrt(b * b - 4 * a * c)) / (2 * a)
    robot = Robot("top", OWN + "heavy_top.urdf", [0.0, 0.0, 0.3], True,
                  joints={"precession": 0.0, "nutation": lean, "spin": 0.0},
                  velocities={"precession": velocity, "nutation": 0.0, "spin": spin})
    scene = Scene("a top of 1,000 rad/s precesses", 5.0, [4.0, 5.0], [], [robot])
    return Shown(scene, [
        Check("it precesses {} of its way more or less",
              lambda v: worst(v[-1].joints[0] / (5 * velocity) - 1), 1e-2),
        Check("its lean changes by {} rad", lambda v: worst([view.joints[1] - lean for view in v]), 1e-2),
    ], ALL)


def euler_disc():
    """In steady rolling on the spot (thin disc): the velocity of precession is sqrt(4 g / (r sin lean))."""
    radius, high, mass, lean = 0.1, 0.01, 0.4, radians(20)
    moment = mass * np.array([(3 * radius**2 + high**2) / 12] * 2 + [radius**2 / 2])
    velocity = sqrt(4 * G / (radius * sin(lean)))
    # The contact is at -x, below; the spin is along the diameter that leads up from there.
    spin = [velocity * sin(lean) * part for part in (cos(lean), 0.0, sin(lean))]
    height = radius * sin(lean) + high / 2 * cos(lean)
    body = Thing("disc", "cylinder", [radius, high], [0.0, 0.0, height], mass, friction=1.0,
                 turn=turn_about([0.0, -1.0, 0.0], lean), angular=spin)
    scene = Scene("Euler's disc", 2.0, [1.5, 2.0], [GROUND, body])

    def energy(view):
        moving = 0.5 * mass * np.dot(view.roots[0, 7:10], view.roots[0, 7:10])
        return moving + spin_energy(view, moment) + mass * G * (view.roots[0, 2] - high / 2)
    return Shown(scene, [
        Check("its energy changes by {} in 2 s", lambda v: worst(energy(v[-1]) / energy(v[0]) - 1), 0.1),
        Check("its energy never grows by more than {}", lambda v: worst(max(energy(view) / energy(v[0]) for view in v) - 1), 1e-2),
    ], ALL, eye=[0.2, -0.5, 0.25], at=[0.0, 0.0, 0.03], instants=(0.0, 1.0, 2.0))


def card_house():
    """Two storeys: three pairs of cards that lean on each other, and one that lies between."""
    long, thick, wide, lean = 0.09, 0.001, 0.06, radians(20)
    card = {"shape": "box", "size": [thick, wide, long], "mass": 0.002, "friction": 0.6}
    low = long / 2 * cos(lean) + thick / 2 * sin(lean)
    out = long / 2 * sin(lean) + thick / 2 * cos(lean)
    apart = 2 * (long * sin(lean) + thick * cos(lean)) + 0.004
    cards = []

    def pair(x, z):
        for side in (-1.0, 1.0):
            cards.append(Thing(f"card-{len(cards)}", at=[x + side * out, 0.0, z + low],
                               turn=turn_about([0.0, -side, 0.0], lean), **card))
    pair(-apart / 2, 0.0)
    pair(apart / 2, 0.0)
    flat = {**card, "size": [long, wide, thick]}
    cards.append(Thing("lid", at=[0.0, 0.0, 2 * low + thick / 2], **flat))
    pair(0.0, 2 * low + thick)
    ground = Thing("ground", "plane", [], [0.0, 0.0, 0.0], friction=0.6)
    scene = Scene("a house of cards", 10.0, [5.0, 10.0], [ground, *cards])
    return Shown(scene, [
        Check("any card moves by {} m from where it was built", moved, 1e-3),
        Check("it creeps by {} m in the last 5 s", lambda v: moved(inside(v, 5.0)), 1e-6),
    ], ALL, eye=[0.05, -0.35, 0.15], at=[0.0, 0.0, 0.08], instants=(0.0, 1.0, 10.0))


def arch():
    """Nine stones over half a circle, on two that are fixed."""
    inner, outer, deep, count = 0.8, 1.0, 0.3, 9
    angle = pi / count
    corners, middle, moment = wedge(inner, outer, angle, deep)
    mass = 10.0
    stones = []
    for i in range(count):
        at = (i + 0.5) * angle - pi / 2
        stones.append(Thing(f"stone-{i}", "mesh", [], [middle * sin(at), 0.0, 0.2 + middle * cos(at)], mass, friction=0.7,
                            turn=turn_about([0.0, 1.0, 0.0], at), vertices=corners, moment=[mass * m for m in moment]))
    feet = [Thing(f"foot-{name}", "box", [0.4, 0.4, 0.2], [side * (inner + outer) / 2, 0.0, 0.1], friction=0.7)
            for name, side in (("left", -1.0), ("right", 1.0))]
    scene = Scene("an arch of nine wedges", 10.0, [5.0, 10.0], [*feet, *stones], watch=[["foot-left", ""], ["foot-right", ""]])
    return Shown(scene, [
        Check("any stone moves by {} m from where it was built", moved, 2e-3),
        Check("it creeps by {} m in the last 5 s", lambda v: moved(inside(v, 5.0)), 1e-6),
        Check("the feet carry {} of half its weight more or less",
              lambda v: worst([np.mean([view.forces[i] for view in inside(v, 5.0)]) / (count * mass * G / 2) - 1
                               for i in (0, 1)]), 1e-2),
    ], ALL, eye=[0.6, -3.0, 1.2], at=[0.0, 0.0, 0.6], instants=(0.0, 10.0))


def dominoes():
    count, size, apart = 20, [0.008, 0.025, 0.05], 0.025
    tiles = [Thing(f"tile-{i}", "box", size, [apart * i, 0.0, size[2] / 2], 0.01, friction=0.5) for i in range(count)]
    tiles[0].linear, tiles[0].angular = [0.15, 0.0, 0.0], [0.0, 6.0, 0.0]
    ground = Thing("ground", "plane", [], [0.0, 0.0, 0.0], friction=0.5)
    scene = Scene("twenty dominoes", 3.0, [2.5, 3.0], [ground, *tiles])

    def standing(views):
        return worst([np.count_nonzero(~(views[-1].roots[:, 2] < 0.8 * size[2] / 2))])
    return Shown(scene, [
        Check("{} of 20 stand at the end", standing, 0),
        Check("they overlap by up to {} m", deepest(0.0), 1e-3),
        Check("at the end the fastest moves at {} m/s",
              lambda v: worst(np.linalg.norm(v[-1].roots[:, 7:10], axis=1)), 1e-3),
    ], ALL, eye=[0.2, -0.5, 0.25], at=[0.24, 0.0, 0.02], instants=(0.0, 0.3, 0.6, 3.0))


def cradle():
    """Five balls with gaps of 1 mm; the first falls from 0.5 rad. Without loss one ball swings at a time."""
    balls = [Robot(f"ball-{i}", OWN + "cradle.urdf", [i * 0.101, 0.0, 1.2], True, friction=0.0, restitution=1.0,
                   joints={"hinge": 0.0}) for i in range(5)]
    balls[0].joints = {"hinge": 0.5}
    scene = Scene("Newton's cradle", 3.0, [2.0, 3.0], [], balls)
    length, mass, moment = 1.0, 0.5, 5e-4 + 0.5

    def energy(views):
        angles = np.array([view.joints for view in views])
        # Velocities as differences of angles, which also serve engines that report none.
        velocities = np.gradient(angles, views[1].time - views[0].time, axis=0)
        return (0.5 * moment * velocities**2 + mass * G * length * (1 - np.cos(angles))).sum(axis=1)

    def highest(views, end):
        start = mass * G * length * (1 - cos(0.5))
        late = inside(views, 3.0 - 2.1)
        return mass * G * length * (1 - cos(worst([view.joints[end] for view in late]))) / start
    return Shown(scene, [
        Check("the last ball rises to a height that lacks {}", lambda v: worst(1 - highest(v, 4)), 0.05),
        Check("after 3 s {} of the energy is gone or gained", lambda v: worst(np.median(energy(v)[-20:]) / energy(v)[0] - 1), 0.05),
    ], ALL, "", eye=[0.2, -2.2, 0.6], at=[0.2, 0.0, 0.5], instants=(0.0, 0.9, 1.6, 3.0), look=0.005)


def humanoid(joints):
    """Passive, from a height of a metre."""
    robot = Robot("humanoid", "humanoid/urdf/humanoid.urdf", [0.0, 0.0, 1.3], False, joints=dict.fromkeys(joints, 0.0),
                  friction=0.8)
    ground = Thing("ground", "plane", [], [0.0, 0.0, 0.0], friction=0.8)
    scene = Scene("a humanoid falls", 8.0, [7.0, 8.0], [ground], [robot], watch=[["humanoid", ""]])
    return Shown(scene, [
        Check("at the end its trunk moves at {} m/s", lambda v: worst(roots(v[-1:], [7, 8, 9])), 1e-2),
        Check("it overlaps by {} m at the end", deepest(7.0), 1e-3),
        Check("any joint moves by {} rad in the last second",
              lambda v: worst(np.ptp([view.joints for view in inside(v, 7.0)], axis=0)), 1e-2),
    ], ALL, eye=[1.5, -2.5, 1.2], at=[0.0, 0.0, 0.4], instants=(0.0, 0.5, 1.0, 8.0))


def shown():
    moving = [joint.get("name") for joint in robots.read("humanoid/urdf/humanoid.urdf").findall("joint")
              if joint.get("type") != "fixed"]
    return [
        tower("a stack of thirty boxes", [1.0] * 30, 12.0, 1e-5),
        tower("1,000 kg on 1 kg", [1.0, 1000.0], 5.0, 1e-5),
        tower("1 kg on 1,000 kg", [1000.0, 1.0], 5.0, 1e-5),
        tower("1, 1,000, 1 and 1,000 kg on each other", [1.0, 1000.0, 1.0, 1000.0], 5.0, 1e-5),
        disc(), flywheel(), top(), euler_disc(), card_house(), arch(), dominoes(), cradle(), humanoid(moving),
    ]
