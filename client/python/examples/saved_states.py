"""Saves the world, changes it, and restores it: bit for bit, and through a file."""

import tempfile
from contextlib import ExitStack
from pathlib import Path

import numpy as np

import simd_client
from simd_client import RobotState

ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "Two Link.v2"


def main() -> None:
    """Tries two wrenches from one moment, and then the first of them again."""
    with simd_client.connect() as sim, ExitStack() as cleanup:
        sim.pause()
        arm = sim.load(ROBOT, "saved_arm", fixed=True, allow_renaming=True, passive=True)
        cleanup.callback(lambda: arm.name in sim.robots and arm.delete())
        sim.step(100)
        # Without a name the daemon chooses a free one.
        start = sim.save_state()
        cleanup.callback(sim.delete_saved_state, start)

        def pushed(force: float) -> RobotState:
            sim.restore_state(start)
            arm.apply_wrench(arm.links[-1], force=(force, 0, 0))
            return sim.step(500, states=arm)[arm]

        first, second, again = pushed(50.0), pushed(-50.0), pushed(50.0)
        print(f"pushed one way {first.position.round(3)}, the other way {second.position.round(3)}")
        print(f"the same push again ends at the same bits: {np.array_equal(first.position, again.position)}")

        with tempfile.TemporaryDirectory() as folder:
            file = sim.export_saved_state(start, Path(folder) / "start.simdstate")
            arm.delete()
            # This daemon or another one can import it: the file has the robots too.
            imported = sim.import_saved_state(file, f"{start.name}-imported")
            cleanup.callback(sim.delete_saved_state, imported)
            sim.restore_state(imported)
        print(f"back from {file.name}: {list(sim.robots)}")


if __name__ == "__main__":
    main()
