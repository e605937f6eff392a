"""Scenes with contact: standing robots, and things that lie on each other.

Each is data: objects, positions, masses, friction. The simulators' modules build their scenes from it.
"""

import random
import sys
import xml.etree.ElementTree as xml
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import mujoco
import numpy as np

from robots import ASSETS, PYBULLET

FRICTION = 0.8
"""Friction between any two things. Restitution is zero."""


OTHERS = "cmeel.prefix/share/example-robot-data/robots"
"""Folder of the robots, below a folder of Python's packages."""

SETTLED = 3.0
"""Seconds after which standing robots hardly move, in every simulator."""


@dataclass
class Thing:
    """A free body, or a fixed one without mass."""

    shape: str
    """box or sphere."""
    size: list
    """Edges of a box, or the radius of a sphere, m."""
    at: list
    """Its centre, m."""
    mass: float = 0.0


@dataclass
class ContactScene:
    """A scene on level ground: a robot that holds a pose, or things."""

    name: str
    settle: float
    """Seconds until it lies or stands still: timing starts then. A heap still settles: waiting for its rest
    takes minutes in each simulator."""
    drift: float
    """Maximum distance of any body from its start, or in a heap, from its place at rest. Beyond it the body
    has fallen, and the figure does not count as standing."""
    urdf: Path | None = None
    shaped: Path | None = None
    """The robot without visual shapes."""
    pose: dict = field(default_factory=dict)
    """Angle by joint; zero for the others."""
    height: float = 0.0
    """Height of the root link at which the lowest shape touches the ground."""
    things: list = field(default_factory=list)
    copies: int = 1
    """Number of robots, with 3 m between them."""
    heap: bool = False
    """Whether it is a heap of many things. MuJoCo solves it by conjugate gradients. Its default, Newton's
    method, takes up to 0.8 s a step while the spheres fall, some ten times as long."""
    joints: list = field(default_factory=list)
    """Targets of the joints, and how they are held, as simd's worker reports them."""

    def request(self):
        """Returns the scene in the form that the worker reads."""
        contact = {"height": self.height, "friction": FRICTION, "settle": self.settle, "heap": self.heap,
                   "things": [asdict(thing) for thing in self.things]}
        return {"urdf": str(self.urdf or ""), "free": True, "copies": self.copies, "pose": self.pose, "contact": contact}


def contact_scenes(folder):
    a1 = PYBULLET / "a1/a1.urdf"
    crouched = {f"{leg}_{part}_joint": angle for leg in ("FR", "FL", "RR", "RL")
                for part, angle in (("hip", 0.0), ("upper", 0.8), ("lower", -1.6))}
    return [
        standing("A1 standing", a1, crouched, folder),
        standing("humanoid standing", ASSETS / "humanoid/urdf/humanoid.urdf", {}, folder),
        *detailed(folder),
        ContactScene("stack of 10 boxes", SETTLED, 5e-3, things=stack(10)),
        ContactScene("1000 spheres in a box", 1.0, 2e-2, things=heap(10, 0.05), heap=True),
    ]


def crowds(scenes):
    """Many of some standing robots, and one of each, where threads must cost nothing."""
    known = {scene.name: scene for scene in scenes}
    return [replace(known[f"{name} standing"], name=f"{count} x {name} standing", copies=count)
            for count in (1, 100, 500) for name in ("A1", "Solo12")]


def standing(name, urdf, pose, folder):
    shaped = folder / f"shaped_{urdf.name}"
    root = xml.fromstring(urdf.read_text().replace("package://example-robot-data/robots", str(urdf.parents[2])))
    root.insert(0, xml.fromstring('<mujoco><compiler strippath="false" balanceinertia="true"/></mujoco>'))
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    for inertia in root.iter("inertia"):
        sensible(inertia)
    shaped.write_text(xml.tostring(root, encoding="unicode"))
    known = {joint.get("name") for joint in root.findall("joint") if joint.get("type") != "fixed"}
    pose = {joint: angle for joint, angle in pose.items() if joint in known}
    return ContactScene(name, SETTLED, 5e-3, urdf, shaped, pose, height(shaped, pose))


def sensible(inertia):
    """A sensor's inertia, which no body can have: MuJoCo refuses it."""
    xx, xy, xz, yy, yz, zz = (float(inertia.get(part, 0)) for part in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    if np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).min() <= 0:
        for part in ("ixy", "ixz", "iyz"):
            inertia.set(part, "0")


def detailed(folder):
    """Robots of PyPI's `example-robot-data`, whose shapes are meshes of up to thousands of triangles, or many
    primitives."""
    package = next(path for path in (Path(place) / OTHERS for place in sys.path) if path.is_dir())
    bent = {f"{leg}_{part}": sign * angle for leg, sign in (("FL", 1), ("FR", 1), ("HL", -1), ("HR", -1))
            for part, angle in (("HFE", 0.7), ("KFE", -1.4))}
    solo, anymal, talos = (package / path for path in (
        "solo_description/robots/solo12.urdf", "anymal_c_simple_description/urdf/anymal.urdf",
        "talos_data/robots/talos_reduced.urdf"))
    return [
        standing("Solo12 standing", solo, bent, folder),
        standing("Anymal standing", anymal, posture(package / "anymal_c_simple_description/srdf/anymal.srdf"), folder),
        standing("Talos standing", talos, posture(package / "talos_data/srdf/talos.srdf"), folder),
    ]


def posture(srdf):
    """Returns the first one that the file names, of joints of one axis."""
    joints = xml.parse(srdf).getroot().find("group_state").findall("joint")
    return {joint.get("name"): float(joint.get("value")) for joint in joints if " " not in joint.get("value").strip()}


def stack(count):
    """Returns cubes of 10 cm and 1 kg, each on the one below."""
    return [Thing("box", [0.1, 0.1, 0.1], [0.0, 0.0, 0.05 + 0.1 * i], 1.0) for i in range(count)]


def heap(edge, radius):
    """Returns edge^3 spheres of density 1000 above the floor of a box that is 1.3 times as wide. They are out
    of line, so that they fall into a heap and no tower stands."""
    rng = random.Random(1)
    mass = 4 / 3 * np.pi * radius**3 * 1000
    places = [[(i - (edge - 1) / 2) * 2.1 * radius for i in place] for place in np.ndindex(edge, edge, edge)]
    lift = (edge - 1) / 2 * 2.1 * radius + 1.5 * radius
    spheres = [Thing("sphere", [radius], [x + rng.uniform(-1, 1) * radius / 20, y + rng.uniform(-1, 1) * radius / 20,
                                          z + lift], mass) for x, y, z in places]
    inside, wall = 1.3 * edge * radius, 0.1
    high = 2 * inside
    sides = [Thing("box", [wall, 2 * inside + 2 * wall, high], [sign * (inside + wall / 2), 0.0, high / 2])
             for sign in (-1, 1)]
    sides += [Thing("box", [2 * inside, wall, high], [0.0, sign * (inside + wall / 2), high / 2]) for sign in (-1, 1)]
    return sides + spheres


def height(shaped, pose):
    """Returns the height of the root link that puts the lowest point of the robot's shapes at zero."""
    spec = mujoco.MjSpec.from_file(str(shaped))
    spec.worldbody.first_body().add_freejoint()
    model = spec.compile()
    data = mujoco.MjData(model)
    for joint, angle in pose.items():
        data.qpos[model.joint(joint).qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    kinds, lowest = mujoco.mjtGeom, 0.0
    for geom in range(model.ngeom):
        down = data.geom_xmat[geom].reshape(3, 3)[2]
        size = model.geom_size[geom]
        match model.geom_type[geom]:
            case kinds.mjGEOM_SPHERE:
                reach = size[0]
            case kinds.mjGEOM_BOX:
                reach = abs(down) @ size
            case kinds.mjGEOM_CYLINDER:
                reach = abs(down[2]) * size[1] + np.sqrt(max(0.0, 1 - down[2] ** 2)) * size[0]
            case kinds.mjGEOM_MESH:
                mesh = model.geom_dataid[geom]
                first = model.mesh_vertadr[mesh]
                reach = -(model.mesh_vert[first:first + model.mesh_vertnum[mesh]] @ down).min()
            case kind:
                raise RuntimeError(f"{shaped.name} has a shape of kind {kind}")
        lowest = min(lowest, data.geom_xpos[geom][2] - reach)
    return float(-lowest)
