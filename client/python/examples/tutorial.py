"""The first script: load a robot, read its joints, add a slider for people, and move.

Needs a daemon; `SIMD_ENDPOINT` has its address, if it is not on this machine.
"""

from contextlib import ExitStack
from pathlib import Path

import simd_client

ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "Two Link.v2"


def main() -> None:
    """Moves the elbow to the slider's value, and follows the slider."""
    with simd_client.connect() as sim, ExitStack() as cleanup:
        arm = sim.load(ROBOT, "tutorial_arm", fixed=True, allow_renaming=True, progress=True)
        cleanup.callback(arm.delete)
        print(arm)
        for joint in arm.joints.values():
            print(joint.name, joint.type.name.lower(), joint.limits.lower, joint.limits.upper)

        # Sliders belong to the daemon: the viewer shows them, and `simctl parameter set elbow=0.4` moves them
        # too.
        sim.parameters.add_slider("elbow", -1.0, 1.0, 0.3, if_taken="replace")
        cleanup.callback(sim.parameters.remove, "elbow")
        cleanup.callback(sim.pause)
        sim.play()
        for wanted in (sim.parameters["elbow"], 0.6):
            sim.parameters["elbow"] = wanted
            state = arm.move_to({"elbow joint": sim.parameters["elbow"]}, timeout=5.0)
            print(f"the elbow is at {state['elbow joint'].position:.2f} rad")


if __name__ == "__main__":
    main()
