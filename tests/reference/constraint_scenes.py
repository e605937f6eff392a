"""Scenes in which constraints between links hold robots and things together, with checks for each."""

from math import acos, cos, pi, sin, sqrt, tau

import numpy as np

from robots import OTHERS
from scene_checks import Check, Shown, inside, moved, tilt, worst
from scenes import GROUND, OWN, Constraint, Robot, Scene, Thing

G = 9.81
ALL = ("MuJoCo", "PyBullet")


def apart(most, start=0.0):
    return Check("what is held together is up to {} m apart", lambda v: worst([view.error for view in inside(v, start)]), most)


def four_bar():
    """The crank turns once a second for a minute."""
    crank, coupler, ground, rocker = 0.1, 0.3, 0.3, 0.25
    # Turns about y take x towards -z. The rocker's end is where two circles meet.
    distance = ground - crank
    at_coupler = acos((coupler**2 + distance**2 - rocker**2) / (2 * coupler * distance))
    at_rocker = acos((rocker**2 + distance**2 - coupler**2) / (2 * rocker * distance))
    robot = Robot("bars", OWN + "four_bar.urdf", [0.0, 0.0, 0.5], True, joints={"crank": 0.0, "coupler": -at_coupler, "rocker": at_rocker - pi},
                  speeds={"crank": (10.0, [[0.0, 0.0], [1.0, tau], [60.0, tau]])})
    closed = Constraint("point", ["bars", "coupler"], ["bars", "rocker"], [coupler, 0.0, 0.0], [rocker, 0.0, 0.0])
    scene = Scene("a four-bar linkage turns for a minute", 60.0, [1.0, 60.0], [], [robot], constraints=[closed])

    def turned(views):
        return worst(views[-1].joints[0] / (tau * 59.5) - 1)
    return Shown(scene, [apart(1e-6), Check("the crank lacks {} of its way", turned, 1e-3)], ALL,
                 eye=[0.3, -1.2, 0.7], at=[0.15, 0.0, 0.5], instants=(0.0, 1.2, 1.4, 1.6))


def delta():
    """Six rods keep a platform of half a kilogram level, which circles at up to half a metre a second."""
    base, arm, rod, platform, half, start = 0.2, 0.2, 0.4, 0.05, 0.06, 0.3
    across = base + arm * cos(start) - platform
    depth = arm * sin(start) + sqrt(rod**2 - across**2)
    names = [f"motor-{n}" for n in range(3)]
    period, samples = 2.0, 200
    cycle = [[round(start + 0.2 * sin(tau * (i / samples + n / 3)), 6) for n in range(3)] for i in range(samples)]
    # It first moves to the start of the cycle.
    path = [round(start + 0.2 * sin(tau * n / 3), 6) for n in range(3)]
    robot = Robot("delta", OWN + "delta.urdf", [0.0, 0.0, 1.0], True, joints=dict.fromkeys(names, start),
                  gains=dict.fromkeys(names, [2000.0, 40.0]),
                  path={name: [[0.0, start], [1.0, goal]] + [[1.0 + period * (k + i / samples), cycle[i][n]]
                                                             for k in range(29) for i in range(samples)]
                        for n, (name, goal) in enumerate(zip(names, path))})
    plate = Thing("platform", "box", [0.1, 0.1, 0.02], [0.0, 0.0, 1.0 - depth], 0.5)
    rods = []
    for n in range(3):
        for shift in (-half, half):
            c, s = cos(tau * n / 3), sin(tau * n / 3)
            on_plate = [platform * c - shift * s, platform * s + shift * c, 0.0]
            rods.append(Constraint("rod", ["delta", f"arm-{n}"], ["platform", ""], [arm, shift, 0.0], on_plate, rod))
    scene = Scene("a delta robot goes round for a minute", 59.0, [1.0, 59.0], [plate], [robot], constraints=rods)
    return Shown(scene, [
        apart(1e-6), Check("the platform leans by up to {} rad", lambda v: worst([tilt(view) for view in v]), 1e-5),
    ], ("MuJoCo",), "", eye=[0.6, -1.5, 1.1], at=[0.0, 0.0, 0.8], instants=(0.0, 2.0, 2.5, 3.0))


LEGS = ["front_left", "back_left", "front_right", "back_right"]


def minitaur(name, seconds, speed):
    """Eight motors in pairs. Each pair drives the two halves of a leg, whose ends are one point."""
    half, knee = pi / 2, -2.1834
    signs = {f"{leg}{side}": -1.0 if "left" in leg else 1.0 for leg in LEGS for side in "LR"}
    motors = [f"motor_{leg}{side}_joint" for leg in LEGS for side in "LR"]
    knees = [f"knee_{leg}{side}_link" for leg in LEGS for side in "LR"]
    joints = {f"motor_{each}_joint": sign * half for each, sign in signs.items()}
    joints |= {f"knee_{each}_link": sign * knee for each, sign in signs.items()}
    samples, period, begin = 40, 0.8, 1.0
    path = {}
    for leg in LEGS:
        phase = 0.0 if leg in ("front_left", "back_right") else 0.5
        for side in "LR":
            points = [[0.0, half], [begin, half]]
            for i in range(1, round((seconds - begin) / period * samples)):
                at = tau * (i / samples + phase)
                # From standing it reaches its full stride over a second.
                size = min(1.0, i * period / samples)
                lift, swing = 0.4 * size * max(0.0, sin(at)), speed * size * cos(at)
                angle = half - lift + (swing if side == "L" else -swing) * signs[leg + side]
                points.append([round(begin + i * period / samples, 6), round(angle, 6)])
            path[f"motor_{leg}{side}_joint"] = [[time, round(signs[leg + side] * angle, 6)] for time, angle in points]
    robot = Robot("minitaur", OTHERS + "quadruped/minitaur.urdf", [0.0, 0.0, 0.21], False, friction=0.8, joints=joints,
                  gains=dict.fromkeys(motors, [300.0, 6.0]), effort=dict.fromkeys(motors, 100.0), path=path)
    held = [Constraint("point", ["minitaur", f"lower_leg_{leg}R_link"], ["minitaur", f"lower_leg_{leg}L_link"],
                       [0.0, 0.005, 0.2], [0.0, 0.01, 0.2]) for leg in LEGS]
    assert len(knees) == 8
    return Scene(name, seconds, [seconds / 2, seconds], [GROUND], [robot], constraints=held, watch=[["ground", ""]])


def minitaur_stands():
    scene = minitaur("Minitaur stands on its closed legs", 4.0, 0.0)
    for name in scene.robots[0].path:
        scene.robots[0].path[name] = scene.robots[0].path[name][:2]
    return Shown(scene, [
        apart(1e-5, 1.0), Check("it moves by {} m in the second half", lambda v: moved(inside(v, 2.0)), 1e-3),
        Check("its height is {} m", lambda v: worst(v[-1].roots[0, 2]), 0.25),
    ], ALL, eye=[0.7, -1.0, 0.5], at=[0.0, 0.0, 0.15], instants=(0.0, 4.0))


def minitaur_trots():
    scene = minitaur("Minitaur trots on its closed legs", 9.0, 0.3)
    return Shown(scene, [
        apart(1e-4), Check("it leans by up to {} rad", lambda v: worst([tilt(view) for view in inside(v, 2.0)]), 0.5),
        Check("after 8 s it lacks {} m of one metre", lambda v: max(0.0, 1.0 - float(v[-1].roots[0, 0])), 0.0),
    ], ALL, eye=[0.7, -1.3, 0.5], at=[0.0, 0.0, 0.1], follows=True, instants=(0.0, 3.0, 6.0, 9.0))


def grip():
    """Cranks with 0.6 N m close pads on parallel links upon a cube of 0.2 kg, lift it, and release it."""
    sides = ("left", "right")
    joints = {"lift": 0.0}
    for side in sides:
        joints |= {f"{side}-crank": 0.4, f"{side}-pad": -0.4, f"{side}-follower": 0.4}
    closing = [[0.0, 0.4], [0.5, 0.4], [1.0, -0.3], [8.0, -0.3], [8.5, 0.4]]
    robot = Robot("gripper", OWN + "parallel_gripper.urdf", [0.0, 0.0, 0.02], True, friction=0.8, joints=joints,
                  gains={"lift": [2e4, 400.0]} | {f"{side}-crank": [10.0, 0.2] for side in sides},
                  effort={"lift": 200.0} | {f"{side}-crank": 0.6 for side in sides},
                  path={"lift": [[0.0, 0.0], [1.5, 0.0], [3.5, 0.3]]} | {f"{side}-crank": closing for side in sides})
    cube = Thing("cube", "box", [0.06] * 3, [0.0, 0.0, 0.03], 0.2, 0.8)
    held = [Constraint("point", ["gripper", f"{side}-pad"], ["gripper", f"{side}-follower"], [0.0, sign * 0.025, 0.0], [0.0, 0.0, -0.06])
            for side, sign in zip(sides, (1.0, -1.0))]
    scene = Scene("a gripper with parallel links lifts a cube", 9.5, [4.0, 8.0], [GROUND, cube], [robot], constraints=held)
    return Shown(scene, [
        apart(1e-6, 1.5), Check("the cube lacks {} m of its height", lambda v: worst([view.roots[0, 2] - 0.33 for view in inside(v, 4.0, 7.9)]), 2e-3),
        Check("the cube slips by {} m in 4 s", lambda v: moved(inside(v, 4.0, 7.9), 0), 1e-6),
        Check("let go, it lies {} m from the ground", lambda v: worst(v[-1].roots[0, 2] - 0.03), 1e-3),
    ], ALL, eye=[0.5, -0.6, 0.35], at=[0.0, 0.0, 0.2], instants=(0.0, 1.5, 5.0, 9.5))


def rope():
    """Fifty links of 4 cm and 10 g, from the horizontal, with a kilogram at the end."""
    count, long = 50, 0.04
    links = [Thing(f"link-{i}", "box", [0.03, 0.006, 0.006], [long * (i + 0.5), 0.0, 0.0], 0.01) for i in range(count)]
    load = Thing("load", "box", [0.05] * 3, [long * count + 0.025, 0.0, 0.0], 1.0)
    held = [Constraint("point", ["", ""], ["link-0", ""], [0.0, 0.0, 0.0], [-long / 2, 0.0, 0.0])]
    for i in range(1, count):
        held.append(Constraint("point", [f"link-{i - 1}", ""], [f"link-{i}", ""], [long / 2, 0.0, 0.0], [-long / 2, 0.0, 0.0]))
    held.append(Constraint("point", [f"link-{count - 1}", ""], ["load", ""], [long / 2, 0.0, 0.0], [-0.025, 0.0, 0.0]))
    scene = Scene("a rope of fifty links swings a kilogram", 5.0, [4.0, 5.0], [*links, load], constraints=held)

    def energy(views):
        masses = np.array([0.01] * count + [1.0])
        start = 1.01 * G * long * count
        worth = [float((0.5 * masses * (view.roots[:, 7:10]**2).sum(axis=1) + masses * G * view.roots[:, 2]).sum()) for view in views]
        return max(0.0, max(worth) - worth[0]) / start
    return Shown(scene, [
        apart(1e-4), Check("its energy grows by {} of what it swings with", energy, 1e-2),
        Check("the load gets {} m farther than the rope is long",
              lambda v: max(0.0, max(float(np.linalg.norm(view.roots[-1, :3])) for view in v) - long * count - 0.025), 1e-3),
    ], ALL, eye=[0.0, -6.0, -0.3], at=[0.0, 0.0, -1.0], instants=(0.0, 0.4, 0.7, 1.2), look=0.02)


def bridge():
    """Twenty planks hang between two banks, each by two points on the next, and a box lies on them."""
    count, long, lean = 20, 0.1, 0.03
    things, held, at = [], [], np.zeros(3)
    for i in range(count):
        angle = lean * (0.5 * (count - 1) - i)
        along = long * np.array([cos(angle), 0.0, -sin(angle)])
        things.append(Thing(f"plank-{i}", "box", [0.09, 0.4, 0.02], list(at + along / 2), 1.0, 0.6, turn=[0.0, sin(angle / 2), 0.0, cos(angle / 2)]))
        for y in (-0.2, 0.2):
            parent, parent_at = (["", ""], [0.0, y, 0.0]) if i == 0 else ([f"plank-{i - 1}", ""], [long / 2, y, 0.0])
            held.append(Constraint("point", parent, [f"plank-{i}", ""], parent_at, [-long / 2, y, 0.0]))
        at = at + along
    for y in (-0.2, 0.2):
        held.append(Constraint("point", ["", ""], [f"plank-{count - 1}", ""], list(at + [0.0, y, 0.0]), [long / 2, y, 0.0]))
    things.append(Thing("box", "box", [0.15] * 3, [1.0, 0.0, -0.02], 5.0, 0.6))
    scene = Scene("a bridge of twenty planks carries a box", 10.0, [8.0, 10.0], things, constraints=held)
    return Shown(scene, [
        apart(1e-4), Check("at the end the box is {} m from the middle", lambda v: worst(v[-1].roots[-1, 0] - 1.0), 0.1),
        Check("the box lies {} m farther from its plank than it touches it",
              lambda v: worst(v[-1].roots[-1, 2] - v[-1].roots[10, 2] - 0.085), 0.02),
    ], ALL, eye=[1.0, -3.0, 0.6], at=[1.0, 0.0, -0.2], instants=(0.0, 0.5, 1.0, 10.0))


def door():
    """Pushed with a spring that wants it wide open; the handle draws the latch by a gear after two seconds."""
    robot = Robot("door", OWN + "door.urdf", [0.0, 0.0, 1.1], True, friction=0.2, joints={"hinge": 0.0, "handle": 0.0, "latch": 0.0},
                  gains={"hinge": [10.0, 8.0], "handle": [20.0, 1.0]}, effort={"hinge": 5.0},
                  path={"hinge": [[0.0, 0.0], [0.5, 1.5]], "handle": [[0.0, 0.0], [2.0, 0.0], [2.2, 0.8]]})
    strike = Thing("strike", "box", [0.06, 0.04, 0.2], [0.84, 0.04, 1.1], friction=0.2)
    gear = Constraint("gear", ["door", "handle"], ["door", "latch"], ratio=-0.05)
    scene = Scene("a door opens when its handle draws the latch", 6.0, [5.0, 6.0], [strike], [robot], constraints=[gear])
    return Shown(scene, [
        Check("shut, it stands open by {} rad", lambda v: worst([view.joints[0] for view in inside(v, 1.0, 1.9)]), 0.02),
        Check("at the end it lacks {} rad of 1.5", lambda v: worst(v[-1].joints[0] - 1.5), 0.3),
        Check("the latch is {} m from where the gear has it", lambda v: worst([view.joints[2] + 0.05 * view.joints[1] for view in v]), 1e-5),
    ], ALL, eye=[1.5, -2.5, 1.8], at=[0.4, 0.0, 1.1], instants=(0.0, 1.5, 3.0, 6.0))


def weld():
    """A hook that lifts with growing acceleration: at 3 N the weld breaks. It carries 0.2 kg up to 5.19
    m/s^2."""
    jerk, mass, most = 8.0, 0.2, 3.0
    # The rail ends at 1 m.
    path = [[round(0.001 * i, 3), round(jerk * (0.001 * i)**3 / 6, 12)] for i in range(901)]
    robot = Robot("hook", OWN + "gripper.urdf", [0.0, 0.0, 1.0], True, joints={"lift": 0.0, "left": 0.0, "right": 0.0},
                  gains={"lift": [1e6, 5e3], "left": [1e4, 60.0], "right": [1e4, 60.0]}, effort={"lift": 1e4}, path={"lift": path})
    cube = Thing("cube", "box", [0.06] * 3, [0.0, 0.0, 1.0], mass)
    held = Constraint("weld", ["hook", "hand"], ["cube", ""], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], max_force=most)
    scene = Scene("a weld lets go at its maximal force", 0.9, [0.0, 0.9], [cube], [robot], constraints=[held])

    def when(views):
        """Time of the first view in which nothing is held."""
        falls = next((view.time for view in views if view.error == 0.0 and view.time > 0.1), np.nan)
        return worst(falls - (most / mass - G) / jerk)
    return Shown(scene, [Check("it lets go {} s early or late", when, 0.03)], (),
                 "a weld without a maximal force is all that MuJoCo has; PyBullet's bounds the force and stays", eye=[0.8, -1.5, 1.4],
                 at=[0.0, 0.0, 1.2], instants=(0.0, 0.6, 0.7, 0.9))


def shown():
    return [four_bar(), delta(), minitaur_stands(), minitaur_trots(), grip(), rope(), bridge(), door(), weld()]
