"""Two robots at once on one event loop: calls overlap, and a callback is a coroutine."""

import asyncio
from contextlib import AsyncExitStack
from pathlib import Path

from simd_client import RobotState, aio

ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "Two Link.v2"


async def wave(arm: aio.Robot) -> None:
    """Moves there and back."""
    for elbow in (0.5, -0.5, 0.0):
        state = await arm.move_to({"elbow joint": elbow}, timeout=10.0, tolerance=0.02)
        print(f"{arm.name} is at {state['elbow joint'].position:+.1f} rad")


async def main() -> None:
    """Waves with both, and counts the states of one."""
    seen = 0

    async def count(state: RobotState) -> None:
        nonlocal seen
        seen += 1

    async with aio.connect() as sim, AsyncExitStack() as cleanup:
        # The robots stand next to everything that is in the world already.
        poses = [await robot.pose for robot in (await sim.robots).values()]
        y = 2 + max((pose.position[1] for pose in poses), default=0.0)
        left, right = await asyncio.gather(
            sim.load(ROBOT, "left_arm", fixed=True, position=(0, y, 1), allow_renaming=True),
            sim.load(ROBOT, "right_arm", fixed=True, position=(0, y + 2, 1), allow_renaming=True),
        )
        for arm in (left, right):
            cleanup.push_async_callback(arm.delete)
        cleanup.push_async_callback(sim.pause)
        await sim.play()
        async with left.on_state(count):
            await asyncio.gather(wave(left), wave(right))
        print(f"saw states of the left arm: {seen > 0}")


if __name__ == "__main__":
    asyncio.run(main())
