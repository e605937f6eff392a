"""Scenes with contact as data: objects, motors, and times of views.

Every simulator runs the same scenes, with equal masses, friction, time step, gains, limits of effort and
targets over time. `make_scenes.py` writes them into scenes.json with MuJoCo's results.
tests/physics/scenes.rs holds simd to these results; tests/reference/truth/scenes.py draws them.
"""

from dataclasses import asdict, dataclass, field
from math import acos, atan2, cos, hypot, pi, sin

from robots import OTHERS

OWN = "../reference/robots/"
"""This folder of robots, relative to the folder of test robots."""


@dataclass
class Thing:
    """A body of one shape, or a grid of them; fixed without mass."""

    name: str
    shape: str
    """box, sphere, cylinder about z, plane whose normal is z, mesh or heights."""
    size: list
    """Edges of a box; radius of a sphere, or radius and length of a cylinder; edges of the area below
    heights, m."""
    at: list
    """Its centre, m."""
    mass: float = 0.0
    friction: float = 1.0
    """Friction; between two bodies the smaller value counts."""
    restitution: float = 0.0
    linear: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Initial linear velocity, m/s."""
    grid: list = field(default_factory=lambda: [1, 1, 1])
    """Numbers along x, y and z."""
    pitch: float = 0.0
    """Distance from one to the next, m."""
    shift: list = field(default_factory=lambda: [0.0, 0.0])
    """Layer k is moved along x and y by k modulo 3 of these, so that no tower stands, m."""
    turn: list = field(default_factory=lambda: [0.0, 0.0, 0.0, 1.0])
    """x y z w."""
    angular: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Initial angular velocity in world axes, rad/s."""
    moment: list = field(default_factory=list)
    """Principal moments of a mesh with a mass, about its axes, kg m^2."""
    vertices: list = field(default_factory=list)
    """Corners of a mesh, m: a moving body uses their hull, a fixed one the triangles."""
    triangles: list = field(default_factory=list)
    rows: list = field(default_factory=list)
    """Heights, from the largest y to the smallest, each row along x. Beside a mesh they are the same ground
    for simulators without meshes, m."""

    def places(self):
        """Name and centre of each, x first."""
        nx, ny, nz = self.grid
        out = []
        for i, (x, y, z) in enumerate((x, y, z) for z in range(nz) for y in range(ny) for x in range(nx)):
            name = self.name if nx * ny * nz == 1 else f"{self.name}-{i}"
            moved = [self.shift[0] * (z % 3), self.shift[1] * (z % 3), 0.0]
            out.append((name, [a + self.pitch * n + m for a, n, m in zip(self.at, (x, y, z), moved)]))
        return out


@dataclass
class Robot:
    name: str
    urdf: str
    """URDF that `robots.read` takes; or an SDF, whose models stand still."""
    at: list
    """Position of its root link, m."""
    fixed: bool
    turn: list = field(default_factory=lambda: [0.0, 0.0, 0.0, 1.0])
    """x y z w."""
    friction: float = 1.0
    restitution: float = 0.0
    joints: dict = field(default_factory=dict)
    """Initial position by name of each moving joint, rad or m."""
    gains: dict = field(default_factory=dict)
    """Gains by joint: N m/rad and N m s/rad, or N/m and N s/m. A joint without gains is not driven."""
    effort: dict = field(default_factory=dict)
    """Maximum effort of a joint's actuator, N m or N."""
    path: dict = field(default_factory=dict)
    """Seconds and target in turn, by joint; linear in between."""
    cycle: list = field(default_factory=list)
    """Targets of all joints at equal intervals of a period, in the order of `joints`; linear in between."""
    period: float = 0.0
    """Period of the cycle, s."""
    begin: float = 0.0
    """Start of the cycle, s."""
    velocities: dict = field(default_factory=dict)
    """Initial velocity by joint, rad/s or m/s."""
    linear: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Initial linear velocity of a free robot, m/s."""
    angular: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Initial angular velocity of a free robot in world axes, rad/s."""
    speeds: dict = field(default_factory=dict)
    """By joint that is driven at a velocity: N m s/rad, and seconds and velocity in turn; linear in
    between."""


@dataclass
class Constraint:
    """A constraint between two links, a link and the world, or two joints."""

    kind: str
    """weld, point, rod, rope (a rod that may be shorter) or gear."""
    parent: list
    """Thing, or robot and link; for a gear, robot and joint; two empty strings stand for the world."""
    child: list
    parent_at: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Anchor in the axes of its link, m."""
    child_at: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    length: float = 0.0
    """Length of a rod or a rope, m."""
    ratio: float = 0.0
    """Ratio of a gear: child = ratio * parent."""
    max_force: float = 0.0
    """Force at which it breaks, N; 0 never."""


@dataclass
class Scene:
    name: str
    seconds: float
    window: list
    """Period, seconds, in which it should be at rest, or in which figures are taken."""
    things: list = field(default_factory=list)
    robots: list = field(default_factory=list)
    time_step: float = 1e-3
    watch: list = field(default_factory=list)
    """Robot and link whose normal forces are summed; all links if the link is empty."""
    constraints: list = field(default_factory=list)
    gravity: float = 9.81
    """Gravity downwards, m/s^2."""

    def request(self):
        """Returns the form that simd reads."""
        request = asdict(self)
        for robot in request["robots"]:
            robot["order"] = list(robot["joints"])
        return request

    def settings(self):
        """Modes of MuJoCo that hold it: the stiff contacts of a heap fly apart, by conjugate gradients and by
        Newton."""
        return ("default",) if len(self.free()) > 100 else ("default", "stiff")

    def free(self):
        """Returns name and mass of the bodies that can move as a whole, in the order of views."""
        out = [(name, thing.mass) for thing in self.things if thing.mass for name, _ in thing.places()]
        return out + [(robot.name, 0.0) for robot in self.robots if not robot.fixed]


GROUND = Thing("ground", "plane", [], [0.0, 0.0, 0.0])

LEGS = ("FR", "FL", "RR", "RL")
PARTS = ("hip", "upper", "lower")
A1_EFFORT = dict(zip(PARTS, (20.0, 55.0, 55.0)))
"""Effort limits from its file, N m."""
SEGMENT = 0.2
"""Length of an A1's upper and lower leg, m."""
FOOT = 0.02
"""Radius of its foot, m."""
HEIGHT = 0.28
"""Height of its hips above the ground as it walks, m."""


def leg(x, z):
    """Returns the upper and lower joint's angle for a foot at x ahead of the hip and z above it: two segments
    in a plane."""
    reach = hypot(x, z)
    knee = -acos(reach**2 / (2 * SEGMENT**2) - 1)
    return atan2(-x, -z) - knee / 2, knee


def a1(gains, joints, friction, **more):
    names = [f"{leg}_{part}_joint" for leg in LEGS for part in PARTS]
    return Robot("a1", OTHERS + "a1/a1.urdf", [0.0, 0.0, HEIGHT + 0.002], False, friction=friction,
                 joints=dict(zip(names, joints)), gains=dict.fromkeys(names, gains),
                 effort={name: A1_EFFORT[name.split("_")[1]] for name in names}, **more)


def stance():
    return [0.0, *leg(0.0, FOOT - HEIGHT)] * 4


def trot(speed, start, period=0.4, duty=0.6, lift=0.05, samples=40):
    """Returns targets of a walking trot. A foot moves back with the ground while it is down, and ahead along
    a cycloid while it is up; opposite legs move together. `start` is the initial phase, as a part of the
    cycle."""
    stride = speed * period * duty
    out = []
    for i in range(samples):
        row = []
        for name in LEGS:
            phase = (i / samples + start + (0.0 if name in ("FR", "RL") else 0.5)) % 1.0
            if phase < duty:
                x, z = stride * (0.5 - phase / duty), 0.0
            else:
                s = (phase - duty) / (1 - duty)
                x, z = stride * (s - sin(2 * pi * s) / (2 * pi) - 0.5), lift * (1 - cos(2 * pi * s)) / 2
            row += [0.0, *leg(x, z + FOOT - HEIGHT)]
        out.append([round(angle, 6) for angle in row])
    return out


WALKS = [(0.1, 0.0), (0.2, 0.0), (0.2, 0.25), (0.2, 0.5), (0.2, 0.75), (0.3, 0.0), (0.4, 0.0), (-0.2, 0.0)]
"""Speed in m/s, and initial phase in the cycle."""


def walk(speed, start):
    robot = a1([400.0, 10.0], stance(), 0.8, cycle=trot(speed, start), period=0.4, begin=1.0)
    return Scene(f"A1 walks at {speed:g} m/s from {start:g} of its cycle", 9.0, [1.0, 9.0], [GROUND], [robot],
                 watch=[["a1", ""]])


def gripper(at, turn, path, friction):
    joints = {"lift": path["lift"][0][1], "left": path["left"][0][1], "right": path["right"][0][1]}
    return Robot("gripper", OWN + "gripper.urdf", at, True, turn, friction, 0.0, joints,
                 {"lift": [2e4, 400.0], "left": [1e4, 60.0], "right": [1e4, 60.0]},
                 {"lift": 200.0, "left": 20.0, "right": 20.0}, path)


def grip():
    """20 N on each side of a cube of 0.2 kg, whose weight is 2 N; released after ten seconds."""
    closing = [[0.0, 0.0], [0.5, 0.1], [14.0, 0.1], [14.5, 0.0]]
    path = {"lift": [[0.0, 0.0], [1.0, 0.0], [3.0, 0.5]], "left": closing, "right": closing}
    cube = Thing("cube", "box", [0.06] * 3, [0.0, 0.0, 0.03], 0.2, 0.8)
    hand = gripper([0.0, 0.0, 0.01], [0.0, 0.0, 0.0, 1.0], path, 0.8)
    return Scene("a gripper lifts a cube and holds it", 15.5, [4.0, 14.0], [GROUND, cube], [hand],
                 watch=[["gripper", "left"], ["cube", ""]])


def push():
    """The gripper's rail lies along x, and its closed fingers push at 0.25 m/s."""
    path = {"lift": [[0.0, 0.0], [0.5, 0.0], [3.7, 0.8]], "left": [[0.0, 0.06]], "right": [[0.0, 0.06]]}
    box = Thing("box", "box", [0.2] * 3, [0.3, 0.0, 0.1], 1.0, 0.5)
    hand = gripper([-0.2, 0.0, 0.1], [0.0, sin(pi / 4), 0.0, cos(pi / 4)], path, 0.5)
    return Scene("a robot pushes a box along", 5.0, [2.5, 3.5], [GROUND, box], [hand], watch=[["gripper", ""]])


def stack():
    boxes = Thing("box", "box", [0.2] * 3, [0.0, 0.0, 0.1], 1.0, grid=[1, 1, 10], pitch=0.2)
    return Scene("a stack of ten boxes", 60.0, [1.0, 60.0], [GROUND, boxes], watch=[["ground", ""]])


def wall_hit(restitution):
    """From 1.4 rad, against the upper edge of a wall, which it then leans on."""
    wall = Thing("wall", "box", [0.1, 1.0, 0.4], [0.17, 0.0, -0.9], friction=0.0, restitution=restitution)
    rod = Robot("rod", OWN + "rod.urdf", [0.0, 0.0, 0.0], True, joints={"hinge": -1.4})
    name = "a pendulum hits a wall" + (f", restitution {restitution:g}" if restitution else "")
    return Scene(name, 6.0, [5.0, 6.0], [wall], [rod], watch=[["rod", ""]])


def arms():
    """The left arm has 30 N m and the right one 10. The left pivot is 0.3 m lower: the left ball meets the
    right rod. About y a positive angle moves the lower end towards -x."""
    def arm(name, at, target, effort):
        path = {"hinge": [[0.0, 0.0], [1.0, target]]}
        return Robot(name, OWN + "arm.urdf", at, True, friction=0.0, joints={"hinge": 0.0},
                     gains={"hinge": [300.0, 30.0]}, effort={"hinge": effort}, path=path)
    both = [arm("left", [-0.3, 0.0, 2.0], -0.8, 30.0), arm("right", [0.3, 0.0, 1.7], 0.8, 10.0)]
    return Scene("two arms collide", 4.0, [3.0, 4.0], [], both, watch=[["left", ""]])


def thin_wall(radius):
    wall = Thing("wall", "box", [0.002, 1.0, 1.0], [0.0, 0.0, 0.0])
    ball = Thing("ball", "sphere", [radius], [-0.2, 0.0, 0.0], 0.1, linear=[5.0, 0.0, 0.0])
    return Scene(f"5 m/s against a wall of 2 mm, radius {radius * 1e3:g} mm", 0.2, [0.1, 0.2], [wall, ball],
                 watch=[["wall", ""]])


def heap():
    """A thousand spheres of 5 cm and 0.1 kg fall into a box of 1.2 m."""
    inside, wall, high = 1.2, 0.1, 2.0
    middle = (inside + wall) / 2
    sides = [Thing(f"side-{i}", "box", size, [x, y, high / 2]) for i, (x, y, size) in enumerate([
        (middle, 0.0, [wall, inside + 2 * wall, high]), (-middle, 0.0, [wall, inside + 2 * wall, high]),
        (0.0, middle, [inside, wall, high]), (0.0, -middle, [inside, wall, high])])]
    first = -0.115 * 4.5 - 0.01
    balls = Thing("ball", "sphere", [0.05], [first, first, 0.1], 0.1, grid=[10, 10, 10], pitch=0.115, shift=[0.01, 0.005])
    return Scene("a thousand spheres fall into a box", 2.0, [1.5, 2.0], [GROUND, *sides, balls], time_step=2e-3,
                 watch=[["ground", ""]])


def scenes():
    stands = a1([100.0, 4.0], stance(), 0.8)
    return [
        Scene("an A1 stands", 12.0, [2.0, 12.0], [GROUND], [stands], watch=[["a1", ""]]),
        *(walk(*how) for how in WALKS),
        grip(), push(), stack(), wall_hit(0.0), wall_hit(0.5), arms(),
        *(thin_wall(radius) for radius in (0.05, 0.01, 0.005)),
        heap(),
    ]
