"""Scenes on meshes, height fields and third-party models, with checks for each."""

from math import cos, pi, sin

import numpy as np

from scene_checks import Check, Shown, deepest, inside, moved, roots, spread, tilt, worst
from scene_shapes import bowl, boxes, rows, sheet, stairs, turn_about
from scenes import FOOT, HEIGHT, LEGS, OTHERS, Robot, Scene, Thing, a1, leg, stance, trot

ONLY_HULLS = "MuJoCo has only hulls of meshes"


def terrain(height, cells, size, shift=0.0, friction=1.0, mesh=True):
    """Ground from a mesh; MuJoCo uses the heights."""
    vertices, triangles = sheet(cells, size, height, shift) if mesh else ([], [])
    return Thing("terrain", "mesh" if mesh else "heights", list(size), [0.0, 0.0, 0.0], friction=friction,
                 vertices=vertices, triangles=triangles, rows=rows(cells, size, height))


def flat(friction=1.0):
    """1,058 triangles, no two alike."""
    return terrain(lambda x, y: 0.0, (23, 23), (4.0, 4.0), 0.6, friction)


def ball_rolls():
    radius, vx, vy = 0.1, 1.4, 0.5
    ball = Thing("ball", "sphere", [radius], [-1.5, -0.7, radius - 1e-5], 1.0, linear=[vx, vy, 0.0],
                 angular=[-vy / radius, vx / radius, 0.0])
    scene = Scene("a ball rolls over the seams of a flat mesh", 2.0, [0.3, 2.0], [flat(), ball])
    return Shown(scene, [
        Check("the ball's height varies by {} m", lambda v: spread(roots(inside(v, 0.3), [2])), 1e-6),
        Check("its velocity varies by {} m/s", lambda v: spread(roots(inside(v, 0.3), [7, 8, 9])), 1e-9),
    ], ("MuJoCo", "PyBullet"), eye=[0.0, -3.5, 2.0], instants=(0.0, 1.0, 2.0))


def box_slides():
    mu, speed, size = 0.4, 3.0, [0.3, 0.2, 0.1]
    box = Thing("box", "box", size, [-1.5, 0.1, size[2] / 2], 2.0, mu, linear=[speed, 0.0, 0.0])
    scene = Scene("a box slides over the seams of a flat mesh", 1.5, [1.2, 1.5], [flat(mu), box])
    way = speed**2 / (2 * mu * 9.81)
    return Shown(scene, [
        Check("the box stops {} of its way from v^2 / (2 mu g)",
              lambda v: worst(abs(v[-1].roots[0, 0] + 1.5 - way) / way), 2e-3),
        Check("it gets {} m off its line", lambda v: worst(roots(v, [1]) - 0.1), 1e-3),
        Check("it tilts by {} rad", lambda v: worst([tilt(view) for view in v]), 1e-3),
    ], ("MuJoCo", "PyBullet"), eye=[0.0, -3.5, 2.0], instants=(0.0, 0.5, 1.5))


def a1_over_hills():
    def height(x, y):
        return 0.025 * sin(3.1 * x) * cos(2.3 * y) + 0.01 * sin(9.0 * x + 4.0 * y)
    robot = a1([400.0, 10.0], stance(), 0.8, cycle=trot(0.3, 0.0, lift=0.08), period=0.4, begin=1.0)
    robot.at = [-1.5, 0.0, HEIGHT + 0.05]
    hills = terrain(height, (80, 40), (8.0, 4.0), friction=0.8, mesh=False)
    scene = Scene("an A1 walks over a height field", 9.0, [1.0, 9.0], [hills], [robot])
    return Shown(scene, [
        Check("it lacks {} of 2.4 m on its way", lambda v: worst(max(0.0, 1 - (v[-1].roots[0, 0] + 1.5) / 2.4)), 0.3),
        Check("its trunk tilts by {} rad", lambda v: worst([tilt(view) for view in v]), 0.35),
        Check("its feet go {} m into the ground", deepest(1.0), 3e-3),
    ], ("MuJoCo", "PyBullet"), eye=[0.2, -1.3, 0.5], at=[0.0, 0.0, -0.1], follows=True, instants=(1.0, 4.0, 9.0))


STEP, TREAD, STEPS = 0.08, 0.35, 4
"""Height and depth of a step, m, and the number of steps."""


def climb(speed, period=0.4, duty=0.6, lift=0.09, begin=1.0, seconds=16.0, start=-0.6):
    """Returns paths of all joints: a trot whose feet step on the treads. The body is level at the mean height
    of the ground below its hips."""
    swing = (1 - duty) * period
    paths = {f"{leg}_{part}_joint": [] for leg in LEGS for part in ("hip", "upper", "lower")}
    for name in LEGS:
        hip = 0.18 if name[0] == "F" else -0.18
        late = 0.0 if name in ("FR", "RL") else period / 2
        old = foothold(start + hip)
        new, lifted = old, None
        for step in range(round(seconds / 0.01)):
            now = step * 0.01
            x = start + max(0.0, now - begin) * speed
            phase = (now - begin - late) % period - (period - swing) if now > begin + late else -1.0
            if phase < 0 and lifted is not None:
                old, lifted = new, None
            if phase >= 0 and lifted is None:
                # Position of the hip at the middle of the foot's time on the ground.
                lifted, new = now, foothold(x + hip + speed * (swing + duty * period / 2))
            part = min(1.0, max(0.0, phase / swing))
            # Up, ahead, down: the foot is above the next tread before it is over it.
            ahead = min(1.0, max(0.0, (part - 0.25) / 0.5))
            ahead = ahead * ahead * (3 - 2 * ahead)
            rise = (1 - cos(2 * pi * part)) / 2
            top = max(old[1], new[1])
            low = old[1] + (new[1] - old[1]) * ahead
            foot = [old[0] + (new[0] - old[0]) * ahead, low + (top + lift - low) * rise]
            body = HEIGHT + sum(mean_height(x + end) for end in (0.18, -0.18)) / 2
            for joint, angle in zip(("hip", "upper", "lower"), (0.0, *leg(foot[0] - x - hip, foot[1] + FOOT - body))):
                paths[f"{name}_{joint}_joint"].append([round(now, 3), round(angle, 5)])
    return paths


EDGES = (0.05, 0.07)
"""Distance of a foot from the riser behind it and the edge before it, m."""


def tread(x):
    """Height of the stairs."""
    return 0.0 if x < 0 else STEP * min(STEPS, 1 + int(x / TREAD))


def mean_height(x):
    return STEP * min(STEPS, max(0.0, x / TREAD + 0.5))


def foothold(x):
    """Returns a place near x that is well on a tread, and its height. Feet slip: a place planned ahead of an
    edge may be nearer to it."""
    inside = x % TREAD
    if -TREAD < x < STEPS * TREAD:
        near = min(max(inside, EDGES[0]), TREAD - EDGES[1])
        x += near - inside
    return x, tread(x)


def a1_up_stairs():
    seconds, speed, start = 14.0, 0.2, -0.6
    robot = a1([600.0, 12.0], stance(), 0.8, path=climb(speed, seconds=seconds, start=start))
    robot.at = [start, 0.0, HEIGHT + 0.005]
    vertices, triangles = stairs(STEPS, STEP, TREAD, 2.0, 2.0)
    ground = Thing("stairs", "mesh", [], [0.0, 0.0, 0.0], friction=0.8, vertices=vertices, triangles=triangles)
    scene = Scene("an A1 climbs stairs of 8 cm that are one mesh", seconds, [1.0, seconds], [ground], [robot])
    return Shown(scene, [
        Check("its trunk lacks {} m of four steps",
              lambda v: worst(max(0.0, STEPS * STEP + HEIGHT - v[-1].roots[0, 2])), 0.05),
        Check("its trunk tilts by {} rad", lambda v: worst([tilt(view) for view in v]), 0.7),
        Check("its feet go {} m into the stairs", deepest(1.0), 5e-3),
    ], ("PyBullet",), ONLY_HULLS, eye=[0.3, -1.7, 0.6], at=[0.1, 0.0, 0.0], follows=True,
        instants=(1.0, 4.0, 6.0, 9.0, seconds))


WHEELS = [f"{end}_{side}_wheel" for end in ("front", "rear") for side in ("left", "right")]
LONG, WIDE = 8.0, 6.0
"""Inner size of the room, m."""


def husky_in_a_room():
    """Straight through the door in the middle, a turn to the left, and ahead until a wall blocks it."""
    high, thick = 1.0, 0.1
    across, along = [thick, WIDE + 2 * thick, high], [LONG, thick, high]
    side = (WIDE - 1.4) / 2
    parts = [([x, 0.0, high / 2], across) for x in (-(LONG + thick) / 2, (LONG + thick) / 2)]
    parts += [([0.0, y, high / 2], along) for y in (-(WIDE + thick) / 2, (WIDE + thick) / 2)]
    parts += [([0.0, y * (0.7 + side / 2), high / 2], [thick, side, high]) for y in (-1, 1)]
    parts.append(([0.0, 0.0, -thick / 2], [LONG + 2, WIDE + 2, thick]))
    vertices, triangles = boxes(parts)
    room = Thing("room", "mesh", [], [0.0, 0.0, 0.0], friction=0.8, vertices=vertices, triangles=triangles)
    speed = 1.0 / 0.17775

    def path(turn):
        return [[0.0, 0.0], [0.5, speed], [4.5, speed], [4.6, turn * speed], [6.6, turn * speed], [6.7, speed], [12.0, speed]]
    speeds = {name: [20.0, path(-0.4 if "left" in name else 1.0)] for name in WHEELS}
    husky = Robot("husky", OTHERS + "husky/husky.urdf", [-2.5, 0.0, 0.14], False, friction=0.8,
                  joints=dict.fromkeys(WHEELS, 0.0), speeds=speeds)
    scene = Scene("a Husky drives through a room that is one mesh", 12.0, [10.0, 12.0], [room], [husky])

    def beyond(views):
        places = roots(inside(views, 0.0), [0, 1])
        return worst(max(0.0, abs(places[:, 0]).max() - LONG / 2 + 0.25, abs(places[:, 1]).max() - WIDE / 2 + 0.25))
    return Shown(scene, [
        Check("it lacks {} m on its way through the door", lambda v: worst(max(0.0, 0.5 - max(roots(v, [0])[:, 0]))), 0.0),
        Check("its middle comes {} m nearer to a wall than half its width", beyond, 0.0),
        Check("it tilts by {} rad", lambda v: worst([tilt(view) for view in inside(v, 1.0)]), 0.05),
        Check("it goes {} m into the room's walls and floor", deepest(1.0), 3e-3),
    ], ("PyBullet",), ONLY_HULLS, eye=[-1.0, -6.5, 6.5], at=[0.0, 0.0, 0.0], instants=(0.0, 3.0, 6.5, 9.0, 12.0))


BOWL, DEEP = 1.3, 1.0


def spheres_in_a_bowl():
    radius = 0.05
    vertices, triangles = bowl(BOWL, DEEP, 24, 48)

    def height(x, y):
        return DEEP * min((x * x + y * y) / BOWL**2, 1.3)
    edge = 2 * BOWL
    mesh = Thing("bowl", "mesh", [edge, edge], [0.0, 0.0, 0.0], vertices=vertices, triangles=triangles,
                 rows=rows((60, 60), (edge, edge), height))
    first = -0.115 * 4.5 - 0.01
    balls = Thing("ball", "sphere", [radius], [first, first, 0.75], 0.1, grid=[10, 10, 10], pitch=0.115, shift=[0.01, 0.005])
    scene = Scene("a thousand spheres fall into a bowl that is one mesh", 4.0, [3.5, 4.0], [mesh, balls], time_step=2e-3)

    def lost(views):
        x, y, z = views[-1].roots[:, :3].T
        return worst(np.count_nonzero(~(z > DEEP * (x * x + y * y) / BOWL**2)))
    return Shown(scene, [
        Check("{} of a thousand are below the bowl", lost, 0),
        Check("the largest overlap is {} m while they lie", deepest(3.5), 5e-3),
        Check("at the end the mean speed is {} m/s",
              lambda v: worst(np.linalg.norm(v[-1].roots[:, 7:10], axis=1).mean()), 0.1),
    ], ("MuJoCo", "PyBullet"), eye=[0.0, -3.4, 2.6], at=[0.0, 0.0, 0.5], instants=(0.0, 0.5, 1.0, 4.0), look=0.1)


def thin_sheet():
    """Balls and a box at 5 m/s, from both sides, against an upright sheet of 200 triangles without a thickness."""
    vertices, triangles = sheet((10, 10), (2.0, 2.0), lambda x, y: 0.0)
    upright = Thing("sheet", "mesh", [], [0.0, 0.0, 1.0], turn=turn_about([0.0, 1.0, 0.0], pi / 2),
                    vertices=vertices, triangles=triangles)
    things = []
    for name, side in (("left", -1.0), ("right", 1.0)):
        for i, radius in enumerate((0.05, 0.01, 0.005)):
            things.append(Thing(f"ball-{name}-{i}", "sphere", [radius], [0.3 * side, 0.31 * i - 0.6, 1.0], 0.1,
                                linear=[-5.0 * side, 0.0, 0.0]))
        things.append(Thing(f"box-{name}", "box", [0.1, 0.1, 0.1], [0.4 * side, 0.57, 1.0], 0.1,
                            linear=[-5.0 * side, 0.0, 0.0], turn=turn_about([0.0, 0.6, 0.8], 0.5)))
    scene = Scene("5 m/s against a mesh without a thickness", 0.3, [0.2, 0.3], [upright, *things])
    sides = np.array([-1.0 if thing.at[0] < 0 else 1.0 for thing in things])
    return Shown(scene, [
        Check("{} of 8 go through", lambda v: worst(np.count_nonzero(~(v[-1].roots[:, 0] * sides > 0.0))), 0),
        Check("the largest overlap is {} m", deepest(0.0), 2e-3),
    ], ("PyBullet",), ONLY_HULLS, eye=[1.2, -2.4, 1.8], at=[0.0, 0.0, 1.0], instants=(0.0, 0.08, 0.3), look=0.005)


def dropped(radius, places):
    return [Thing(f"ball-{i}", "sphere", [radius], list(place), 1.0) for i, place in enumerate(places)]


def samurai():
    """Balls fall on the monastery's yards and roofs, each from 2 m above a ray's hit there."""
    places = [(x, y, 32.0) for x in (-30.0, -8.0, 0.0, 14.0) for y in (-30.0, -6.0, 4.0, 25.0)]
    house = Robot("samurai", OTHERS + "samurai.urdf", [0.0, 0.0, 0.0], True)
    scene = Scene("balls fall on samurai.urdf", 6.0, [5.0, 6.0], [], [house])
    scene.things = dropped(0.5, places)
    return Shown(scene, [
        Check("{} of 16 fall through it", lambda v: worst(np.count_nonzero(~(v[-1].roots[:, 2] > 0.3))), 0),
        Check("the largest overlap is {} m", deepest(0.0), 5e-3),
    ], ("PyBullet",), ONLY_HULLS, eye=[40.0, -70.0, 45.0], at=[-5.0, 0.0, 5.0], instants=(0.0, 1.5, 6.0), look=0.05)


def stadium():
    """Three models: a plane to touch, a stadium to see."""
    field = Robot("stadium", OTHERS + "stadium.sdf", [0.0, 0.0, 0.0], True, friction=0.8)
    robot = a1([400.0, 10.0], stance(), 0.8, cycle=trot(0.3, 0.0), period=0.4, begin=1.0)
    scene = Scene("an A1 walks in the stadium", 5.0, [1.0, 5.0], [], [field, robot])
    return Shown(scene, [
        Check("it lacks {} of 1.2 m on its way", lambda v: worst(max(0.0, 1 - v[-1].roots[0, 0] / 1.2)), 0.2),
        Check("its feet go {} m into the ground", deepest(1.0), 1e-3),
    ], ("PyBullet",), "MuJoCo reads no SDF", eye=[-3.0, -6.0, 3.0], at=[0.0, 0.0, 0.3],
        instants=(0.0, 5.0))


def transparent_plane():
    """Its mesh is a visual sheet; the collision shape is a box of 30 m whose upper side is the sheet."""
    plane = Robot("plane", OTHERS + "plane_transparent.urdf", [0.0, 0.0, 0.0], True)
    places = [(x, y, 1.5) for x in (-14.9, 0.0, 14.9) for y in (-14.9, 0.0, 14.9)]
    scene = Scene("balls fall on plane_transparent.urdf", 3.0, [2.0, 3.0], [], [plane])
    scene.things = dropped(0.5, places)
    return Shown(scene, [
        Check("the balls lie {} m from a radius above it", lambda v: worst(v[-1].roots[:, 2] - 0.5), 1e-3),
        Check("they roll {} m meanwhile", lambda v: moved(inside(v, 2.0)), 1e-3),
    ], ("MuJoCo", "PyBullet"), eye=[5.0, -30.0, 12.0], at=[0.0, 0.0, 0.0], instants=(0.0, 3.0), look=0.05)


def shown():
    return [ball_rolls(), box_slides(), a1_over_hills(), a1_up_stairs(), husky_in_a_room(), spheres_in_a_bowl(),
            thin_sheet(), samurai(), stadium(), transparent_plane()]
