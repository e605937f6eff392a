"""Scenes of `sensors.py`: MJCF that both programs read, initial states, and the steps after which sensors are
read."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Scene:
    name: str
    mjcf: str
    steps: tuple[int, ...]
    """Steps after which the sensors are read."""
    time_step: float = 1e-3
    joints: tuple[tuple[str, str, float, float], ...] = ()
    """Robot, joint, initial position and velocity."""
    twists: tuple[tuple[str, tuple[float, ...], tuple[float, ...]], ...] = ()
    """Robot, and initial linear and angular velocity of its root, which is not turned."""
    rests: bool = False
    """Whether bodies touch: only the final state is compared, since the ways to it differ."""


ARM = """<mujoco model="arm"><compiler angle="radian"/><option timestep="0.001"/><worldbody>
<geom name="floor" type="plane" size="5 5 1"/>
<body name="upper" pos="0 0 1.2"><joint name="shoulder" axis="0.2 1 0.1" damping="0.02" armature="0.01"/>
<inertial pos="0.15 0.01 0.02" mass="1.2" diaginertia="0.004 0.012 0.011"/>
<site name="upper_site" pos="0.05 0.02 0.01" euler="0.3 -0.2 0.5"/>
<body name="fore" pos="0.3 0 0"><joint name="elbow" axis="0 1 0.3" pos="0.01 0 0.02"/>
<inertial pos="0.12 -0.01 0" mass="0.8" diaginertia="0.002 0.006 0.005"/>
<site name="fore_site" pos="0.1 0 0.03" euler="0.7 0.1 -0.4"/>
<body name="hand" pos="0.25 0.02 0" euler="0.2 0 0.1"><joint name="wrist" axis="1 0 0" damping="0.01"/>
<inertial pos="0.03 0 0.01" mass="0.3" diaginertia="0.0004 0.0006 0.0005"/>
<site name="hand_site" pos="0.02 0.01 -0.01" euler="-0.3 0.9 0.2"/>
<body name="tool" pos="0.08 0 0" euler="0 0.4 0"><inertial pos="0.02 0.01 0" mass="0.2" diaginertia="0.0002 0.0003 0.0002"/>
<site name="tool_site" pos="0.01 0 0.02" euler="0.1 0.2 0.3"/></body></body></body></body>
</worldbody><sensor>
<accelerometer name="upper_imu" site="upper_site"/><gyro name="upper_gyro" site="upper_site"/>
<accelerometer name="hand_imu" site="hand_site"/><gyro name="hand_gyro" site="hand_site"/>
<force name="fore_force" site="fore_site"/><torque name="fore_torque" site="fore_site"/>
<force name="hand_force" site="hand_site"/><torque name="hand_torque" site="hand_site"/>
<force name="weld_force" site="tool_site"/><torque name="weld_torque" site="tool_site"/>
<framepos name="tool_pose" objtype="site" objname="tool_site"/><framequat name="tool_turn" objtype="site" objname="tool_site"/>
<framelinvel name="tool_way" objtype="site" objname="tool_site"/><frameangvel name="tool_spin" objtype="site" objname="tool_site"/>
<jointpos name="elbow_encoder" joint="elbow"/><jointvel name="elbow_rate" joint="elbow"/>
</sensor></mujoco>"""
"""Three joints off the axes, a tool welded to the hand, damping and armature."""

CART = """<mujoco model="cart"><compiler angle="radian"/><option timestep="0.001"/><worldbody>
<body name="cart"><joint name="rail" type="slide" axis="1 0 0.2" damping="0.5"/><inertial pos="0 0 0.02" mass="1" diaginertia="0.01 0.01 0.01"/>
<site name="cart_site" pos="0.02 0 0.01" euler="0 0.3 0"/>
<body name="pole" pos="0 0 0.1"><joint name="pin" axis="0 1 0"/><inertial pos="0 0.01 0.3" mass="0.4" diaginertia="0.012 0.012 0.0004"/>
<site name="pole_site" pos="0 0 0.5"/></body></body>
</worldbody><sensor>
<accelerometer name="cart_imu" site="cart_site"/><gyro name="cart_gyro" site="cart_site"/>
<accelerometer name="pole_imu" site="pole_site"/><gyro name="pole_gyro" site="pole_site"/>
<force name="pole_force" site="pole_site"/><torque name="pole_torque" site="pole_site"/>
<jointpos name="rail_encoder" joint="rail"/><jointvel name="rail_rate" joint="rail"/>
<framepos name="pole_pose" objtype="xbody" objname="pole"/><framelinvel name="pole_way" objtype="xbody" objname="pole"/>
</sensor></mujoco>"""
"""A slide and a hinge."""

FLYER = """<mujoco model="flyer"><compiler angle="radian"/><option timestep="0.001"/><worldbody>
<body name="flyer" pos="0 0 3"><freejoint/><inertial pos="0.02 0.01 0" mass="2" diaginertia="0.02 0.03 0.04"/>
<site name="flyer_site" pos="0.1 0.05 0.02" euler="0.2 0.1 0.4"/>
<body name="tail" pos="-0.3 0 0"><joint name="hinge" axis="0 1 0" damping="0.01"/>
<inertial pos="-0.1 0 0.01" mass="0.5" diaginertia="0.001 0.004 0.004"/><site name="tail_site" pos="-0.2 0 0" euler="0 0.5 0"/></body></body>
</worldbody><sensor>
<accelerometer name="flyer_imu" site="flyer_site"/><gyro name="flyer_gyro" site="flyer_site"/>
<accelerometer name="tail_imu" site="tail_site"/><gyro name="tail_gyro" site="tail_site"/>
<force name="tail_force" site="tail_site"/><torque name="tail_torque" site="tail_site"/>
<framepos name="tail_pose" objtype="site" objname="tail_site"/><framequat name="tail_turn" objtype="site" objname="tail_site"/>
<framelinvel name="tail_way" objtype="site" objname="tail_site"/><frameangvel name="tail_spin" objtype="site" objname="tail_site"/>
<jointpos name="hinge_encoder" joint="hinge"/><jointvel name="hinge_rate" joint="hinge"/>
</sensor></mujoco>"""
"""A body that flies and turns, with a tail."""

LOOKER = """<mujoco model="looker"><compiler angle="radian"/><option timestep="0.001"/><worldbody>
<geom name="floor" type="plane" size="9 9 1"/>
<geom name="ball" type="sphere" size="0.4" pos="2 0.1 0.9"/><geom name="wall" type="box" size="0.1 3 3" pos="4 0 1" euler="0 0 0.3"/>
<geom name="post" type="cylinder" size="0.2 1.5" pos="-2 0.2 1.5"/><geom name="rope" type="capsule" size="0.15 0.8" pos="0 -2 1.1" euler="0.4 0 0"/>
<body name="head" pos="0 0 1"><joint name="pan" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
<site name="ahead" pos="0.05 0 0.02" euler="0 1.5707963267948966 0"/><site name="behind" pos="-0.05 0 0.02" euler="0 -1.5707963267948966 0.1"/>
<site name="aside" pos="0 -0.05 0" euler="1.5 0 0"/><site name="down" euler="2.6 0.1 0"/><site name="up" pos="0 0 0.1"/></body>
</worldbody><sensor>
<rangefinder name="range_ahead" site="ahead" cutoff="20"/><rangefinder name="range_behind" site="behind" cutoff="20"/>
<rangefinder name="range_aside" site="aside" cutoff="20"/><rangefinder name="range_down" site="down" cutoff="20"/>
<rangefinder name="range_up" site="up" cutoff="20"/><gyro name="pan_gyro" site="up"/>
</sensor></mujoco>"""
"""Rays of a turning head: a ball, a turned box, a cylinder, a capsule, the floor, and nothing."""

STANDING = """<mujoco model="standing"><compiler angle="radian"/><option timestep="0.001"/><worldbody>
<geom name="floor" type="plane" size="5 5 1"/>
<body name="crate" pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.15 0.1" mass="3"/><site name="crate_site" type="box" size="0.3 0.3 0.3"/>
<site name="crate_unit" pos="0.05 0.03 0.02" euler="0.4 -0.3 0.2"/>
<body name="lid" pos="0 0 0.12"><inertial pos="0 0 0.01" mass="0.7" diaginertia="0.002 0.002 0.003"/>
<site name="lid_site" pos="0.03 0 0.01" euler="0.2 0.1 0"/></body></body>
</worldbody><sensor>
<touch name="crate_touch" site="crate_site"/>
<accelerometer name="crate_imu" site="crate_unit"/><gyro name="crate_gyro" site="crate_unit"/>
<force name="lid_force" site="lid_site"/><torque name="lid_torque" site="lid_site"/>
</sensor></mujoco>"""
"""A box that rests on the floor, with a lid welded to it above its middle: MuJoCo's floor is soft, and would
let it lean."""

SCENES = (
    Scene(
        "arm that swings",
        ARM,
        (1, 2, 10, 100, 400, 800),
        joints=(("arm", "shoulder", 0.3, 1.0), ("arm", "elbow", -0.5, -2.0), ("arm", "wrist", 0.8, 5.0)),
    ),
    Scene("arm that swings, 0.1 ms", ARM, (1, 100, 2000), time_step=1e-4, joints=(("arm", "elbow", 1.1, -2.0),)),
    Scene("cart and pole", CART, (1, 10, 200, 900), joints=(("cart", "pin", 0.4, 0.0), ("cart", "rail", 0.1, 0.5))),
    Scene(
        "body that flies",
        FLYER,
        (1, 10, 200, 500),
        joints=(("flyer", "hinge", 0.2, 1.0),),
        twists=(("flyer", (0.3, -0.2, 1.0), (0.5, 2.0, -0.7)),),
    ),
    Scene("head that looks around", LOOKER, (1, 250, 700, 1200, 2500), joints=(("looker", "pan", 0.0, 2.0),)),
    Scene("box that rests", STANDING, (4000,), rests=True),
)
