#!/usr/bin/env python3
"""Writes the boxes with pictures of `textured`; run it after a change and commit what it writes.

Each is a cube of 0.2 m with the same picture on each side: red at the upper left, green at the upper right, blue
at the lower left and yellow at the lower right, as one looks at the side from outside. They differ in the format of
the mesh. It needs nothing but Python, and writes the same bytes each time.
"""

import json
import struct
import zlib
from pathlib import Path

HERE = Path(__file__).resolve().parent / "textured"
PIXELS = 32
HALF = 0.1

# Sides: the direction out, to the right and up, as one looks at it.
SIDES = [
    ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
    ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
    ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
]
# Corners of a side: to the right and up, each -1 or 1, anticlockwise from the lower left.
CORNERS = [(-1, -1), (1, -1), (1, 1), (-1, 1)]


def picture():
    """A PNG of four squares."""
    colors = {(0, 0): (230, 30, 30), (0, 1): (30, 200, 30), (1, 0): (30, 30, 230), (1, 1): (230, 220, 30)}
    middle = PIXELS // 2
    rows = b""
    for row in range(PIXELS):
        rows += b"\0" + b"".join(bytes(colors[row // middle, column // middle]) for column in range(PIXELS))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", PIXELS, PIXELS, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def corner(side, at):
    """The corner of a side, metres."""
    out, right, up = side
    return tuple(HALF * (o + at[0] * r + at[1] * u) for o, r, u in zip(out, right, up))


def obj():
    """OBJ with a file of materials; the places in the picture are shared by all sides."""
    lines = ["mtllib box.mtl", "usemtl picture"]
    for side in SIDES:
        lines += ["v %g %g %g" % corner(side, at) for at in CORNERS]
    lines += ["vt %g %g" % ((x + 1) / 2, (y + 1) / 2) for x, y in CORNERS]
    for number in range(len(SIDES)):
        lines.append("f " + " ".join(f"{4 * number + k + 1}/{k + 1}" for k in range(4)))
    return "\n".join(lines) + "\n"


MTL = "newmtl picture\nKd 1 1 1\nd 1\nmap_Kd ../pictures/squares.png\n"


def collada():
    """COLLADA, whose image is named by way of a sampler and a surface."""
    points = " ".join("%g %g %g" % corner(side, at) for side in SIDES for at in CORNERS)
    places = " ".join("%g %g" % ((x + 1) / 2, (y + 1) / 2) for x, y in CORNERS)
    faces = " ".join(f"{4 * number + k} {k}" for number in range(len(SIDES)) for k in range(4))
    return f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
  <library_images><image id="squares"><init_from>../pictures/squares.png</init_from></image></library_images>
  <library_effects><effect id="effect"><profile_COMMON>
    <newparam sid="surface"><surface type="2D"><init_from>squares</init_from></surface></newparam>
    <newparam sid="sampler"><sampler2D><source>surface</source></sampler2D></newparam>
    <technique sid="common"><phong><diffuse><texture texture="sampler" texcoord="places"/></diffuse></phong></technique>
  </profile_COMMON></effect></library_effects>
  <library_materials><material id="material"><instance_effect url="#effect"/></material></library_materials>
  <library_geometries><geometry id="box"><mesh>
    <source id="points"><float_array id="points-array" count="72">{points}</float_array><technique_common>
      <accessor source="#points-array" count="24" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>
    </technique_common></source>
    <source id="places"><float_array id="places-array" count="8">{places}</float_array><technique_common>
      <accessor source="#places-array" count="4" stride="2"><param name="S" type="float"/><param name="T" type="float"/></accessor>
    </technique_common></source>
    <vertices id="vertices"><input semantic="POSITION" source="#points"/></vertices>
    <polylist material="picture" count="6">
      <input semantic="VERTEX" source="#vertices" offset="0"/><input semantic="TEXCOORD" source="#places" offset="1" set="0"/>
      <vcount>4 4 4 4 4 4</vcount><p>{faces}</p>
    </polylist>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="scene"><node><instance_geometry url="#box"><bind_material><technique_common>
    <instance_material symbol="picture" target="#material"/>
  </technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
"""


def gltf(uri):
    """The JSON and the buffer of a glTF, whose picture is in the buffer unless it has an address."""
    points = b"".join(struct.pack("<3f", *corner(side, at)) for side in SIDES for at in CORNERS)
    places = b"".join(struct.pack("<2f", (x + 1) / 2, (1 - y) / 2) for _ in SIDES for x, y in CORNERS)
    quads = [[0, 1, 2, 0, 2, 3]] * len(SIDES)
    indices = b"".join(struct.pack("<6H", *[4 * n + k for k in quad]) for n, quad in enumerate(quads))
    parts = [points, places, indices]
    if uri is None:
        parts.append(picture())
    views, buffer = [], b""
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(part)})
        buffer += part + b"\0" * (-len(part) % 4)
    image = {"bufferView": 3, "mimeType": "image/png"} if uri is None else {"uri": uri}
    low, high = [-HALF] * 3, [HALF] * 3
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}}],
        "textures": [{"source": 0}],
        "images": [image],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 24, "type": "VEC3", "min": low, "max": high},
            {"bufferView": 1, "componentType": 5126, "count": 24, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(buffer)}],
    }
    return document, buffer


def glb():
    """A GLB with the picture in it."""
    document, buffer = gltf(None)
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def urdf(geometry, material=""):
    """A robot of one link."""
    return f"""<?xml version="1.0"?>
<robot name="box">
  <link name="base">
    <inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
    <visual><geometry>{geometry}</geometry>{material}</visual>
    <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>
  </link>
</robot>
"""


def write(path, data):
    path = HERE / path
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


document, buffer = gltf("../pictures/squares.png")
document["buffers"][0]["uri"] = "box.bin"
write("pictures/squares.png", picture())
write("meshes/box.obj", obj())
write("meshes/box.mtl", MTL)
write("meshes/box.dae", collada())
write("meshes/box.glb", glb())
write("meshes/box.gltf", json.dumps(document, indent=1) + "\n")
write("meshes/box.bin", buffer)
for kind in ["obj", "dae", "glb", "gltf"]:
    write(f"urdf/{kind}.urdf", urdf(f'<mesh filename="../meshes/box.{kind}"/>'))
MATERIAL = '<material name="squares"><texture filename="../pictures/squares.png"/></material>'
write("urdf/shape.urdf", urdf('<box size="0.2 0.2 0.2"/>', MATERIAL))
# A box that says where a picture lies and names none: a material of the description has it.
PLAIN = "\n".join(line for line in obj().splitlines() if not line.startswith(("mtllib", "usemtl"))) + "\n"
write("meshes/plain.obj", PLAIN)


def mjcf(geom):
    return f"""<mujoco model="box">
  <compiler meshdir="../meshes" texturedir="../pictures"/>
  <asset>
    <texture name="squares" type="2d" file="squares.png"/>
    <material name="squares" texture="squares"/>
    <mesh name="plain" file="plain.obj"/>
  </asset>
  <worldbody>
    <body name="box">
      <geom {geom} material="squares"/>
    </body>
  </worldbody>
</mujoco>
"""


def sdf(geometry):
    return f"""<sdf version="1.9">
  <model name="box">
    <link name="box">
      <visual name="seen">
        <geometry>{geometry}</geometry>
        <material>
          <diffuse>1 1 1 1</diffuse>
          <pbr><metal><albedo_map>../pictures/squares.png</albedo_map></metal></pbr>
        </material>
      </visual>
    </link>
  </model>
</sdf>
"""


write("models/mesh.xml", mjcf('type="mesh" mesh="plain"'))
write("models/shape.xml", mjcf('type="box" size="0.1 0.1 0.1"'))
write("models/mesh.sdf", sdf("<mesh><uri>../meshes/plain.obj</uri></mesh>"))
write("models/shape.sdf", sdf("<box><size>0.2 0.2 0.2</size></box>"))

# Ground with a pattern that MuJoCo makes, repeated, as in most scenes of MuJoCo. An arm, and a box with its picture several times.
SCENE = """<mujoco model="scene">
  <compiler meshdir="../meshes" texturedir="../pictures"/>
  <visual><headlight diffuse="0.6 0.6 0.6" ambient="0.3 0.3 0.3" specular="0 0 0"/></visual>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.93 0.94 0.95" rgb2="0.93 0.94 0.95" width="64" height="384"/>
    <texture name="grid" type="2d" builtin="checker" mark="edge" rgb1="0.2 0.3 0.4" rgb2="0.1 0.2 0.3" markrgb="0.8 0.8 0.8" width="300" height="300"/>
    <texture name="squares" type="2d" file="squares.png"/>
    <texture name="dawn" type="2d" builtin="gradient" rgb1="1 0.9 0.5" rgb2="0.6 0.2 0.3" width="100" height="100"/>
    <material name="grid" texture="grid" texrepeat="5 5" texuniform="true"/>
    <material name="squares" texture="squares" texrepeat="3 2"/>
    <material name="dawn" texture="dawn"/>
    <material name="steel" rgba="0.22 0.26 0.32 1"/>
    <material name="orange" rgba="0.96 0.52 0.12 1"/>
  </asset>
  <worldbody>
    <light pos="1.2 0.5 2.4" dir="-1.2 -0.5 -2.4" directional="true" diffuse="0.5 0.5 0.5"/>
    <geom name="floor" type="plane" size="0 0 0.05" material="grid"/>
    <body name="crate" pos="0.25 -0.35 0.1">
      <geom type="box" size="0.15 0.1 0.1" material="squares"/>
    </body>
    <body name="tile" pos="0.3 0.35 0.02">
      <geom type="box" size="0.15 0.15 0.02" material="dawn"/>
    </body>
    <body name="turret" pos="0 0 0.05">
      <joint name="waist" axis="0 0 1" range="-180 180"/>
      <geom type="cylinder" size="0.1 0.05" material="steel"/>
      <body name="upper_arm" pos="0 0 0.08" euler="0 25 0">
        <joint name="shoulder" axis="0 1 0" range="-120 120"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.4" size="0.045" material="orange"/>
        <body name="forearm" pos="0 0 0.4" euler="0 70 0">
          <joint name="elbow" axis="0 1 0" range="-150 150"/>
          <geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.038" material="steel"/>
          <geom type="sphere" pos="0 0 0.33" size="0.05" material="orange"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
write("models/scene.xml", SCENE)
