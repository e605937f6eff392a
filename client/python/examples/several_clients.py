"""Several programs in one world: one claims a robot, another is refused, and a third only watches.

Here they are three connections of one script; they could be three programs on three machines.
"""

import threading
from contextlib import ExitStack
from pathlib import Path

import simd_client
from simd_client import Event, RobotState

ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "Two Link.v2"


def main() -> None:
    """Shows a claim, and that every client sees the result."""
    with (
        simd_client.connect() as calibration,
        simd_client.connect() as operator,
        simd_client.connect() as display,
        ExitStack() as cleanup,
    ):
        calibration.pause()
        mine = calibration.load(ROBOT, "shared_arm", fixed=True, allow_renaming=True)
        cleanup.callback(mine.delete)
        same = operator.robot(mine.name)

        seen = threading.Event()
        released = threading.Event()

        def look(state: RobotState) -> None:
            if state["elbow joint"].target == 0.25:
                seen.set()

        def announce(event: Event) -> None:
            print(f"{event.kind} {event.detail.holder}")
            if event.kind == "joints_released":
                released.set()

        with (
            display.robot(mine.name).on_state(look),
            display.on_event(announce, "joints_claimed", "joints_released"),
        ):
            with mine.claim(holder="calibration"):
                mine.set_positions({"elbow joint": 0.25})
                try:
                    same.set_positions({"elbow joint": -1.0})
                except simd_client.JointClaimed as refused:
                    print(f"refused: {refused}")
                calibration.step(100)
                print(f"the display saw the target: {seen.wait(10.0)}")
            released.wait(10.0)
        same.set_positions({"elbow joint": 0.0})
        print(f"the operator's turn: {same.joints['elbow joint'].target}")


if __name__ == "__main__":
    main()
