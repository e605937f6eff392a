"""Stepped robots: robots of files, and chains written for the plot."""

import re
from dataclasses import dataclass
from pathlib import Path

import pybullet_data

ASSETS = Path(__file__).resolve().parents[2] / "assets"
PYBULLET = Path(pybullet_data.getDataPath())


@dataclass
class Scene:
    """Copies of a robot in one world, each holding a bent pose."""

    name: str
    urdf: Path
    """The URDF that simd reads."""
    bare: Path
    """The URDF without shapes: nothing collides, and no mesh is read."""
    free: bool = False
    copies: int = 1

    def request(self):
        return {"urdf": str(self.urdf), "free": self.free, "copies": self.copies}


def robots(folder):
    """The robots of the table."""
    iiwa, panda, a1 = (PYBULLET / path for path in ("kuka_iiwa/model.urdf", "franka_panda/panda.urdf", "a1/a1.urdf"))
    humanoid = ASSETS / "humanoid/urdf/humanoid.urdf"
    arm = ASSETS / "seven_arm/urdf/seven_arm.urdf"
    rows = [("iiwa", iiwa), ("panda", panda), ("A1, fixed", a1), ("A1, free", a1, True),
            ("humanoid, fixed", humanoid), ("humanoid, free", humanoid, True),
            ("seven_arm", arm), ("10 x seven_arm", arm, False, 10), ("100 x seven_arm", arm, False, 100)]
    return [Scene(name, urdf, bare(urdf, folder), *rest) for name, urdf, *rest in rows]


def crowds(folder):
    """Many arms that hold a pose, and one."""
    arm = ASSETS / "seven_arm/urdf/seven_arm.urdf"
    return [Scene(f"{count} x arm held", arm, bare(arm, folder), False, count) for count in (1, 100, 500)]


def chains(folder, lengths):
    """A chain for each of these numbers of joints."""
    scenes = []
    for joints in lengths:
        urdf = folder / f"chain_{joints}.urdf"
        urdf.write_text(chain(joints))
        scenes.append(Scene(f"chain of {joints}", urdf, urdf))
    return scenes


def bare(urdf, folder):
    text = re.sub(r"<(visual|collision)\b.*?</\1>", "", urdf.read_text(), flags=re.S)
    out = folder / f"{urdf.parent.name}_{urdf.name}"
    out.write_text(text)
    return out


def chain(joints):
    """Links of 5 cm and 200 g; axes across, across and along in turn; limits and efforts that are never
    reached."""
    inertial = ('<inertial><origin xyz="0 0 0.025"/><mass value="0.2"/>'
                '<inertia ixx="6e-5" ixy="0" ixz="0" iyy="7e-5" iyz="0" izz="4e-5"/></inertial>')
    parts = ['<robot name="chain">', '<link name="link_0"/>']
    for i in range(1, joints + 1):
        axis = ("0 1 0", "1 0 0", "0 0 1")[i % 3]
        parts += [f'<link name="link_{i}">{inertial}</link>',
                  f'<joint name="joint_{i}" type="revolute"><origin xyz="0 0 {0.05 if i > 1 else 0}"/>',
                  f'<parent link="link_{i - 1}"/><child link="link_{i}"/><axis xyz="{axis}"/>',
                  '<limit lower="-2.5" upper="2.5" effort="2000" velocity="20"/></joint>']
    return "\n".join([*parts, "</robot>"]) + "\n"
