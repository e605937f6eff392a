#!/usr/bin/env python3
"""Writes the test robots of this folder; run it after a change and commit what it writes.

It needs nothing but Python, and writes the same bytes each time. The first two robots look as the
SolidWorks exporter writes them (its line breaks, its capitals, its numbers); the third is of primitives.
"""

import math
import struct
from pathlib import Path

HERE = Path(__file__).resolve().parent


# --- Meshes: lists of triangles, each three corners in metres, outward by the right hand. ---


def lathe(profile, segments=20):
    """A solid of revolution about z; `profile` is (radius, z) from the bottom up."""
    def ring(radius, z):
        turns = (2 * math.pi * k / segments for k in range(segments))
        return [(radius * math.cos(a), radius * math.sin(a), z) for a in turns]
    return loft([ring(radius, z) for radius, z in profile])


def loft(rings):
    """A solid between closed rings of equal length, with flat ends."""
    triangles = []
    count = len(rings[0])
    for low, high in zip(rings, rings[1:]):
        for k in range(count):
            m = (k + 1) % count
            triangles += [(low[k], low[m], high[m]), (low[k], high[m], high[k])]
    for k in range(1, count - 1):
        triangles.append((rings[0][0], rings[0][k + 1], rings[0][k]))
        triangles.append((rings[-1][0], rings[-1][k], rings[-1][k + 1]))
    return triangles


def box(low, high):
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = lambda z: [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]
    return loft([corners(z0), corners(z1)])


def bar(x0, x1, radius, end_radius, y0, y1, bevel, arc=8):
    """A bar along x with round ends, bevelled, its flat sides across y."""
    def outline(inset, y):
        points = []
        for centre, r, start in ((x1, end_radius, -90), (x0, radius, 90)):
            for k in range(arc + 1):
                a = math.radians(start + 180 * k / arc)
                points.append((centre + (r - inset) * math.cos(a), y, (r - inset) * math.sin(a)))
        return points[::-1]
    return loft([outline(bevel, y0), outline(0, y0 + bevel), outline(0, y1 - bevel), outline(bevel, y1)])


def along_y(triangles, offset=(0, 0, 0)):
    """Turns what stands along z to stand along y, then moves it."""
    turn = lambda p: (p[0] + offset[0], p[2] + offset[1], -p[1] + offset[2])
    return [tuple(turn(p) for p in triangle) for triangle in triangles]


def pin(radius, y0, y1, offset=(0, 0, 0)):
    """A bevelled cylinder about y."""
    b = radius * 0.12
    return along_y(lathe([(radius - b, y0), (radius, y0 + b), (radius, y1 - b), (radius - b, y1)]), offset)


def write_stl(path, triangles, header):
    out = bytearray(header.encode("ascii").ljust(80, b"\0"))
    out += struct.pack("<I", len(triangles))
    for a, b, c in triangles:
        u = [q - p for p, q in zip(a, b)]
        v = [q - p for p, q in zip(a, c)]
        n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        size = math.sqrt(sum(x * x for x in n)) or 1.0
        numbers = [x / size for x in n] + [*a, *b, *c]
        # Rounded first, so that the last bit of a platform's cosine does not show.
        out += struct.pack("<12fH", *[round(x, 7) + 0.0 for x in numbers], 0)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(out)


# --- URDF as the SolidWorks exporter writes it. ---

HEADER = """<?xml version="1.0" encoding="utf-8"?>
<!-- This URDF looks as the SolidWorks to URDF exporter writes it, but was made by hand for the tests of simd.
     Made by tests/assets/make_assets.py; change that, not this. -->
"""


def element(tag, attributes, indent, children=""):
    pad = " " * indent
    head = f"{pad}<{tag}" + "".join(f'\n{pad}  {name}="{value}"' for name, value in attributes)
    return f"{head}>\n{children}{pad}</{tag}>\n" if children else f"{head} />\n"


def wrap(tag, indent, children):
    pad = " " * indent
    return f"{pad}<{tag}>\n{children}{pad}</{tag}>\n"


def origin(xyz, rpy, indent):
    return element("origin", [("xyz", xyz), ("rpy", rpy)], indent)


def exported_link(name, com, mass, inertia, mesh, rgba):
    moments = list(zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), inertia))
    inertial = origin(com, "0 0 0", 6) + element("mass", [("value", mass)], 6) + element("inertia", moments, 6)
    shape = origin("0 0 0", "0 0 0", 6)
    shape += wrap("geometry", 6, element("mesh", [("filename", mesh)], 8))
    material = element("material", [("name", "")], 6, element("color", [("rgba", rgba)], 8))
    body = wrap("inertial", 4, inertial) + wrap("visual", 4, shape + material) + wrap("collision", 4, shape)
    return element("link", [("name", name)], 2, body)


def exported_joint(name, kind, xyz, rpy, parent, child, axis, rest):
    body = origin(xyz, rpy, 4) + element("parent", [("link", parent)], 4) + element("child", [("link", child)], 4)
    body += element("axis", [("xyz", axis)], 4)
    body += "".join(element(tag, attributes, 4) for tag, attributes in rest)
    return element("joint", [("name", name), ("type", kind)], 2, body)


def robot(name, body):
    return f'{HEADER}<robot\n  name="{name}">\n{body}</robot>\n'


def write_package(package, description, urdf, joints, crlf_and_bom):
    """The folders beside the meshes."""
    root = HERE / package
    end = "\r\n" if crlf_and_bom else "\n"

    def write(path, text, mark=b""):
        target = root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(mark + text.replace("\n", end).encode("utf-8"))

    write(f"urdf/{package}.urdf", urdf, b"\xef\xbb\xbf" if crlf_and_bom else b"")
    write("package.xml", f"""<package format="2">
  <name>{package}</name>
  <version>1.0.0</version>
  <description>{description}</description>
  <maintainer email="nobody@example.com">simd</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>catkin</buildtool_depend>
  <export>
    <architecture_independent />
  </export>
</package>
""")
    names = ", ".join(f"'{joint}'" for joint in ["", *joints])
    write(f"config/joint_names_{package}.yaml", f"controller_joint_names: [{names}, ]\n")
    write("launch/display.launch", f"""<launch>
  <param
    name="robot_description"
    textfile="$(find {package})/urdf/{package}.urdf" />
  <node
    name="robot_state_publisher"
    pkg="robot_state_publisher"
    type="robot_state_publisher" />
</launch>
""")


# --- The robots. ---


def bench_arm():
    """One arm on one continuous joint. The arm's numbers are those of docs and closed forms: keep them."""
    package = "Bench_Arm-1.2 rev B"
    foot = [(0.058, 0.0), (0.062, 0.004), (0.062, 0.014), (0.056, 0.02), (0.026, 0.026)]
    column = [(0.018, 0.04), (0.015, 0.08), (0.015, 0.15), (0.02, 0.158), (0.02, 0.166), (0.018, 0.168)]
    base = lathe(foot + column)
    base += box((-0.018, -0.052, 0.156), (0.018, 0.016, 0.166))
    base += box((-0.018, -0.052, 0.16), (0.018, -0.03, 0.19765))
    base += pin(0.022, -0.053, -0.0246, (0, 0, 0.19765))
    arm = pin(0.022, 0.0, 0.042)
    arm += bar(0.0, 0.362, 0.026, 0.018, 0.04, 0.067, 0.004)
    arm += pin(0.010, 0.062, 0.078, (0.362, 0, 0))
    write_stl(HERE / package / "meshes" / "base_link.STL", base, "base_link of bench_arm, metres")
    write_stl(HERE / package / "meshes" / "arm.STL", arm, "solid arm of bench_arm, binary all the same")

    mesh = f"package://{package}/meshes/"
    body = exported_link(
        "base_link", "3.4E-19 0.00012071 0.071884", "0.9517",
        ("0.0043812", "-3.7E-21", "-1.6804E-20", "0.0044003", "-1.1208E-05", "0.0011027"),
        mesh + "base_link.STL", "0.29804 0.32549 0.36078 1")
    body += exported_link(
        "arm", "0.16597 0.053505 -1.9429E-16", "0.19992",
        ("4.6655E-05", "-0.00013781", "4.4037E-18", "0.0032199", "1.9297E-19", "0.0032364"),
        mesh + "arm.STL", "0.96078 0.52157 0.12157 1")
    body += exported_joint(
        "shoulder", "continuous", "0 -0.022595 0.19765", "0 -0.039919 0", "base_link", "arm", "0 1 0",
        [("safety_controller", [("k_velocity", "0")])])
    write_package(package, "An arm on one continuous joint.", robot("bench_arm", body), ["shoulder"], False)


def two_link():
    """Two moving joints; names with spaces; CRLF and a byte order mark."""
    package = "Two Link.v2"
    base = lathe([(0.07, 0.0), (0.075, 0.005), (0.075, 0.02), (0.04, 0.03), (0.03, 0.05), (0.03, 0.09)])
    base += pin(0.03, -0.028, 0.028, (0, 0, 0.1))
    upper = pin(0.024, 0.03, 0.05) + bar(0.0, 0.25, 0.03, 0.024, 0.034, 0.058, 0.004)
    fore = pin(0.02, 0.0, 0.018) + bar(0.0, 0.2, 0.024, 0.014, 0.006, 0.026, 0.003)
    meshes = HERE / package / "meshes"
    write_stl(meshes / "base_link.STL", base, "base_link of two_link, metres")
    write_stl(meshes / "upper arm.STL", upper, "solid upper arm of two_link, binary")
    write_stl(meshes / "forearm.STL", fore, "forearm of two_link, metres")

    mesh = f"package://{package}/meshes/"
    grey, blue = "0.75294 0.75294 0.75294 1", "0.23137 0.50980 0.96471 1"
    body = exported_link(
        "base_link", "0 0 0.035", "1.2",
        ("0.0026", "0", "0", "0.0026", "-2.1E-20", "0.0029"), mesh + "base_link.STL", grey)
    body += exported_link(
        "upper arm", "0.12 0.046 -3.1E-17", "0.45",
        ("0.00014", "-1.2E-05", "6.4E-19", "0.0033", "0", "0.0034"), mesh + "upper arm.STL", blue)
    body += exported_link(
        "forearm", "0.095 0.016 0", "0.21",
        ("4.4E-05", "3.9E-20", "-0", "0.00098", "0", "0.001"), mesh + "forearm.STL", grey)
    unset = [("lower", "0"), ("upper", "0"), ("effort", "0"), ("velocity", "0")]
    limit = [("lower", "-2.1"), ("upper", "2.4"), ("effort", "12"), ("velocity", "3.5")]
    body += exported_joint(
        "shoulder joint", "revolute", "0 0 0.1", "0 0 0", "base_link", "upper arm", "0 1 0",
        [("limit", unset)])
    body += exported_joint(
        "elbow joint", "revolute", "0.25 0.06 0", "0 0.35 0", "upper arm", "forearm", "0 2 0",
        [("limit", limit), ("dynamics", [("damping", "0.02"), ("friction", "0.01")])])
    joints = ["shoulder joint", "elbow joint"]
    write_package(package, "Two links that names with spaces hold.", robot("two_link", body), joints, True)


QUARTER = "1.5707963267949"
HALF = "3.1415926535898"

# xyz, rpy, limit, effort, velocity of each joint.
SEVEN_JOINTS = [
    ("0 0 0.155", "0 0 0", 2.9, 300, 1.7),
    ("0 0.008 0.195", f"{QUARTER} 0 {HALF}", 2.05, 300, 1.7),
    ("0.004 0.21 -0.008", f"{QUARTER} 0 {HALF}", 2.9, 180, 1.8),
    ("0 -0.006 0.205", f"{QUARTER} 0 0", 2.05, 180, 2.2),
    ("-0.004 0.19 0.006", f"-{QUARTER} {HALF} 0", 2.9, 110, 2.4),
    ("0 0.062 0.21", f"{QUARTER} 0 0", 2.05, 40, 3.1),
    ("0.002 0.08 0.061", f"-{QUARTER} {HALF} 0", 3.0, 40, 3.1),
]

# mass; centre of mass; rpy of its axes; ixx ixy ixz iyy iyz izz; the shape.
SEVEN_LINKS = [
    ("base", 4.9, "-0.06 0 0.065", "0 0 0", "0.042 0 0.0021 0.051 0 0.034", ("cylinder", 0.1, 0.15, "0 0 0.075", "0 0 0")),
    ("link_1", 3.4, "0.002 -0.028 0.122", "0.31 -0.12 0.07", "0.031 0.0011 -0.0008 0.028 0.0023 0.0094",
     ("cylinder", 0.065, 0.21, "0 0 0.09", "0 0 0")),
    ("link_2", 3.7, "-0.001 0.061 0.039", "-0.22 0.05 0.4", "0.029 -0.0014 0.0006 0.0107 0.0019 0.027",
     ("capsule", 0.062, 0.15, "0 0.075 0.01", f"{QUARTER} 0 0")),
    ("link_3", 2.9, "0.003 0.027 0.131", "0.15 0.27 -0.33", "0.021 0.0007 0.0009 0.0196 -0.0016 0.0068",
     ("cylinder", 0.056, 0.19, "0 0 0.09", "0 0 0")),
    ("link_4", 2.6, "0.002 0.066 0.033", "0.09 -0.41 0.18", "0.0174 0.0006 -0.0005 0.0061 0.0011 0.0163",
     ("capsule", 0.054, 0.13, "0 0.07 0.008", f"{QUARTER} 0 0")),
    ("link_5", 1.7, "-0.002 0.021 0.074", "-0.17 0.08 0.52", "0.0092 -0.0003 0.0004 0.0084 0.0009 0.0037",
     ("cylinder", 0.048, 0.18, "0 0.01 0.085", "0 0 0")),
    ("link_6", 1.6, "0.001 0.004 -0.003", "0.24 0.19 -0.11", "0.0049 0.0002 0.0001 0.0044 -0.0003 0.0036",
     ("sphere", 0.058, None, "0 0 0", "0 0 0")),
    ("link_7", 0.35, "0.006 -0.004 0.018", "0.05 0.33 0.21", "0.00041 0.00002 -0.00003 0.00039 0.00001 0.0005",
     ("box", "0.09 0.07 0.05", None, "0 0 0.03", "0 0 0")),
]


def seven_arm():
    """A seven-joint arm of primitives: turned inertias, products of inertia, offset joints."""
    out = ['<?xml version="1.0"?>', "<!-- Made by tests/assets/make_assets.py; change that, not this. -->",
           '<robot name="seven_arm">', '  <material name="steel">', '    <color rgba="0.62 0.66 0.7 1"/>',
           "  </material>", '  <material name="amber">', '    <color rgba="0.95 0.6 0.15 1"/>', "  </material>"]
    for index, (name, mass, com, rpy, inertia, (kind, a, length, at, turn)) in enumerate(SEVEN_LINKS):
        moments = " ".join(f'{k}="{v}"' for k, v in zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), inertia.split()))
        size = {"box": f'size="{a}"', "sphere": f'radius="{a}"'}.get(kind, f'radius="{a}" length="{length}"')
        shape = [f'      <origin xyz="{at}" rpy="{turn}"/>', f"      <geometry><{kind} {size}/></geometry>"]
        material = "amber" if index % 2 else "steel"
        out += [f'  <link name="{name}">', "    <inertial>", f'      <origin xyz="{com}" rpy="{rpy}"/>',
                f'      <mass value="{mass}"/>', f"      <inertia {moments}/>", "    </inertial>",
                "    <visual>", *shape, f'      <material name="{material}"/>', "    </visual>",
                "    <collision>", *shape, "    </collision>", "  </link>"]
    for index, (xyz, rpy, limit, effort, velocity) in enumerate(SEVEN_JOINTS, 1):
        out += [f'  <joint name="joint_{index}" type="revolute">', f'    <origin xyz="{xyz}" rpy="{rpy}"/>',
                f'    <parent link="{SEVEN_LINKS[index - 1][0]}"/>', f'    <child link="{SEVEN_LINKS[index][0]}"/>',
                '    <axis xyz="0 0 1"/>',
                f'    <limit lower="-{limit}" upper="{limit}" effort="{effort}" velocity="{velocity}"/>',
                '    <dynamics damping="0" friction="0"/>', "  </joint>"]
    path = HERE / "seven_arm" / "urdf" / "seven_arm.urdf"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(("\n".join([*out, "</robot>"]) + "\n").encode("utf-8"))


if __name__ == "__main__":
    bench_arm()
    two_link()
    seven_arm()
