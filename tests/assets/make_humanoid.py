#!/usr/bin/env python3
"""Writes humanoid/urdf/humanoid.urdf: a humanoid of 30 revolute joints, 1.75 m and 75 kg, of boxes and cylinders.

Run it after a change and commit what it writes. It needs nothing but Python, and writes the same bytes each time.
Parts have the masses of a person's, each spread over the links between its motors; a link's inertia is that of
its own shape, solid and of even density. x is forward, y left, z up; at zero it stands with its arms hanging.
"""

from pathlib import Path

OUT = Path(__file__).resolve().parent / "humanoid" / "urdf" / "humanoid.urdf"

X, Y, Z = "1 0 0", "0 1 0", "0 0 1"


def box(mass, size, at=(0, 0, 0)):
    x, y, z = size
    moments = [mass / 12 * (y * y + z * z), mass / 12 * (x * x + z * z), mass / 12 * (x * x + y * y)]
    return mass, at, moments, f'<box size="{numbers(size)}"/>', "0 0 0"


def cylinder(mass, radius, length, at=(0, 0, 0), along=Z):
    across, own = mass / 12 * (3 * radius * radius + length * length), mass / 2 * radius * radius
    shape = f'<cylinder radius="{radius:g}" length="{length:g}"/>'
    if along == Y:
        return mass, at, [across, own, across], shape, "1.5707963267949 0 0"
    if along == X:
        return mass, at, [own, across, across], shape, "0 1.5707963267949 0"
    return mass, at, [across, across, own], shape, "0 0 0"


def numbers(values):
    return " ".join(f"{value:g}" for value in values)


def trunk():
    """Name, parent, where, axis, (lower, upper), effort, velocity, link's name, its shape."""
    return [
        ("waist_yaw", "pelvis", (0, 0, 0.09), Z, (-1.2, 1.2), 150, 8, "waist", cylinder(2.5, 0.07, 0.05)),
        ("waist_roll", "waist", (0, 0, 0.05), X, (-0.5, 0.5), 200, 8, "lumbar", cylinder(2.5, 0.06, 0.12, along=X)),
        ("waist_pitch", "lumbar", (0, 0, 0.02), Y, (-0.5, 1.3), 200, 8, "torso",
         box(20, (0.2, 0.3, 0.32), (0, 0, 0.16))),
        ("neck_yaw", "torso", (0, 0, 0.32), Z, (-1.3, 1.3), 20, 6, "neck", cylinder(0.8, 0.05, 0.05, (0, 0, 0.025))),
        ("neck_roll", "neck", (0, 0, 0.05), X, (-0.6, 0.6), 20, 6, "nape", cylinder(0.4, 0.03, 0.06, along=X)),
        ("neck_pitch", "nape", (0, 0, 0.02), Y, (-0.7, 0.9), 20, 6, "head",
         box(3.8, (0.19, 0.15, 0.22), (0.02, 0, 0.11))),
    ]


def arm(side, s):
    """`s` is 1 on the left, -1 on the right; joints about x and z are mirrored with it."""
    roll = (-0.3, 2.6) if s > 0 else (-2.6, 0.3)
    return [
        (f"{side}_shoulder_pitch", "torso", (0, s * 0.17, 0.27), Y, (-2.9, 1.5), 100, 8, f"{side}_shoulder",
         cylinder(1.1, 0.05, 0.07, (0, s * 0.02, 0), along=Y)),
        (f"{side}_shoulder_roll", f"{side}_shoulder", (0, s * 0.05, 0), X, roll, 100, 8, f"{side}_clavicle",
         cylinder(0.6, 0.045, 0.09, along=X)),
        (f"{side}_shoulder_yaw", f"{side}_clavicle", (0, 0, -0.07), Z, (-1.8, 1.8), 60, 8, f"{side}_upper_arm",
         cylinder(1.4, 0.045, 0.2, (0, 0, -0.1))),
        (f"{side}_elbow", f"{side}_upper_arm", (0, 0, -0.22), Y, (-2.4, 0.05), 60, 10, f"{side}_elbow_link",
         cylinder(0.4, 0.04, 0.08, along=Y)),
        (f"{side}_wrist_yaw", f"{side}_elbow_link", (0, 0, -0.05), Z, (-1.9, 1.9), 20, 10, f"{side}_forearm",
         cylinder(0.9, 0.035, 0.19, (0, 0, -0.1))),
        (f"{side}_wrist_pitch", f"{side}_forearm", (0, 0, -0.21), Y, (-1.2, 1.2), 20, 10, f"{side}_hand",
         box(0.5, (0.04, 0.08, 0.17), (0, 0, -0.09))),
    ]


def leg(side, s):
    yaw = (-0.5, 0.8) if s > 0 else (-0.8, 0.5)
    roll = (-0.4, 0.8) if s > 0 else (-0.8, 0.4)
    return [
        (f"{side}_hip_yaw", "pelvis", (0, s * 0.095, -0.05), Z, yaw, 150, 10, f"{side}_hip",
         cylinder(1.4, 0.06, 0.08, (0, 0, -0.04))),
        (f"{side}_hip_roll", f"{side}_hip", (0, 0, -0.08), X, roll, 200, 10, f"{side}_hip_fork",
         cylinder(1.2, 0.05, 0.1, along=X)),
        (f"{side}_hip_pitch", f"{side}_hip_fork", (0, 0, -0.02), Y, (-2.2, 0.6), 250, 12, f"{side}_thigh",
         cylinder(6.4, 0.07, 0.36, (0, 0, -0.19))),
        (f"{side}_knee", f"{side}_thigh", (0, 0, -0.39), Y, (-0.05, 2.4), 250, 12, f"{side}_shin",
         cylinder(3.0, 0.05, 0.34, (0, 0, -0.18))),
        (f"{side}_ankle_pitch", f"{side}_shin", (0, 0, -0.38), Y, (-0.9, 0.6), 120, 10, f"{side}_ankle",
         cylinder(0.4, 0.03, 0.06, along=Y)),
        (f"{side}_ankle_roll", f"{side}_ankle", (0, 0, -0.02), X, (-0.4, 0.4), 60, 10, f"{side}_foot",
         box(0.9, (0.25, 0.1, 0.05), (0.04, 0, -0.045))),
    ]


def link(name, shape):
    mass, at, moments, geometry, turn = shape
    place = f'<origin xyz="{numbers(at)}" rpy="{turn}"/>'
    ixx, iyy, izz = (f"{moment:.6g}" for moment in moments)
    return [f'  <link name="{name}">', "    <inertial>", f'      <origin xyz="{numbers(at)}"/>',
            f'      <mass value="{mass:g}"/>',
            f'      <inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/>', "    </inertial>",
            f"    <visual>{place}<geometry>{geometry}</geometry></visual>",
            f"    <collision>{place}<geometry>{geometry}</geometry></collision>", "  </link>"]


def joint(name, parent, at, axis, limits, effort, velocity, child):
    lower, upper = limits
    return [f'  <joint name="{name}" type="revolute">', f'    <origin xyz="{numbers(at)}"/>',
            f'    <parent link="{parent}"/>', f'    <child link="{child}"/>', f'    <axis xyz="{axis}"/>',
            f'    <limit lower="{lower:g}" upper="{upper:g}" effort="{effort:g}" velocity="{velocity:g}"/>',
            '    <dynamics damping="0.2"/>', "  </joint>"]


def main():
    parts = trunk() + arm("left", 1) + arm("right", -1) + leg("left", 1) + leg("right", -1)
    pelvis = box(8.6, (0.18, 0.26, 0.16))
    mass = pelvis[0] + sum(part[-1][0] for part in parts)
    assert len(parts) == 30 and abs(mass - 75) < 0.1, (len(parts), mass)
    out = ['<?xml version="1.0"?>', "<!-- Made by tests/assets/make_humanoid.py; change that, not this. -->",
           '<robot name="humanoid">', *link("pelvis", pelvis)]
    for *rest, child, shape in parts:
        out += link(child, shape) + joint(*rest, child)
    OUT.parent.mkdir(parents=True, exist_ok=True)
    OUT.write_bytes(("\n".join([*out, "</robot>"]) + "\n").encode())


if __name__ == "__main__":
    main()
