"""Grasps a crate and lifts it: contacts, friction, and motions that wait for their end."""

from pathlib import Path

import simd_client
from simd_client import Surface, Target

GRIPPER = Path(__file__).parent / "robots" / "gripper.urdf"
CRATE = 0.06  # metres, each side
SQUEEZE = 25.0  # newtons


def main() -> None:
    """Down, close, up; then open, and it falls."""
    with simd_client.connect() as sim:
        sim.pause()
        ground = sim.add_plane(name="grasp_ground", position=(10, 0, 0))
        gripper = sim.load(
            GRIPPER,
            "gripper",
            fixed=True,
            allow_renaming=True,
            position=(10, 0, 0.5),
            surfaces=Surface(friction=1.0),
            joint_positions={"left": 0.06, "right": 0.06},
        )
        crate = sim.add_box((CRATE, CRATE, CRATE), 0.4, (10, 0, CRATE / 2), name="crate", friction=1.0)

        gripper.move_to({"lift": -0.34}, steps=10)
        # A finger cannot reach its target, and pushes with no more than it may.
        closed = Target.position(0.0, max_effort=SQUEEZE)
        gripper.set_targets({"left": closed, "right": closed})
        gripper.wait_until(lambda state: state["left"].effort <= -0.9 * SQUEEZE, steps=10)
        fingers = [contact for contact in crate.contacts() if "finger" in contact.link_a + contact.link_b]
        print(f"{len(fingers)} points of the crate touch fingers")

        gripper.move_to({"lift": -0.1}, steps=10)
        sim.step(1000)
        print(f"the crate hangs at {crate.pose.position[2]:.2f} m")

        gripper.move_to({"left": 0.06, "right": 0.06}, steps=10)
        sim.step(1000)
        print(f"and lies at {crate.pose.position[2]:.2f} m")
        for robot in (gripper, crate, ground):
            robot.delete()


if __name__ == "__main__":
    main()
