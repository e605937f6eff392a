"""Grasps a crate and lifts it, using contacts, friction, and motions that wait for their end."""

from contextlib import ExitStack
from pathlib import Path

import simd_client
from simd_client import Surface, Target

GRIPPER = Path(__file__).parent / "robots" / "gripper.urdf"
CRATE = 0.06  # metres, each side
SQUEEZE = 25.0  # newtons


def main() -> None:
    """Moves down, closes, lifts; then opens, and the crate falls."""
    with simd_client.connect() as sim, ExitStack() as cleanup:
        sim.pause()
        cleanup.callback(sim.set_physics, time_step=sim.physics.time_step)
        sim.set_physics(time_step=0.001)
        # The robot stands next to everything that is in the world already.
        x = 10 + max((robot.pose.position[0] for robot in sim.robots.values()), default=0.0)
        ground = sim.add_plane()
        cleanup.callback(ground.delete)
        gripper = sim.load(
            GRIPPER,
            "gripper",
            fixed=True,
            allow_renaming=True,
            position=(x, 0, 0.5),
            surfaces=Surface(friction=1.0),
            joint_positions={"left": 0.06, "right": 0.06},
        )
        cleanup.callback(gripper.delete)
        crate = sim.add_box((CRATE, CRATE, CRATE), 0.4, (x, 0, CRATE / 2), friction=1.0)
        cleanup.callback(crate.delete)

        gripper.move_to({"lift": -0.34}, steps=10)
        # A finger cannot reach its target, and pushes with its maximum force.
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


if __name__ == "__main__":
    main()
