#!/usr/bin/env python3
"""Accuracy of contacts over time on scenes that are hard on a solver: simd's Gauss-Seidel and its automatic
choice, and MuJoCo's Newton.

    target/bench-venv/bin/python tests/reference/residual_peers.py [--only WORDS] [--budget SECONDS]

`make bench` starts it. It builds the bench binary `truth`, and writes residuals.json and residuals.png
into target/bench.

The residual of a step is the largest of all contacts, m/s. A contact's residual is the change of its
velocity by its impulse if only the contact were solved once more. As a formula it is |p - P(p - w / D)|
D. P is the projection on the possible impulses of the contact. w is the error of its velocities under all
impulses, and D its part of J M^-1 J'. It is 0 if the laws of all contacts hold. Each simulator is held to
its laws. simd has rigid contacts and circular cones. MuJoCo has soft contacts (gap = J a - aref + R f) and
pyramids, whose edges count as contacts each. Each continues from its results, so that the runs of a scene
differ in motion.
"""

import argparse
import json
import sys
import time
from importlib.metadata import version
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
sys.path.insert(0, str(HERE / "truth"))

import matplotlib  # noqa: E402

matplotlib.use("Agg")
import in_simd  # noqa: E402
import matplotlib.pyplot as plt  # noqa: E402
import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import scenes_in_mujoco  # noqa: E402
from scenes import GROUND, Scene, Thing  # noqa: E402
from solver_scenes import tower  # noqa: E402

SECONDS = 3.0
"""Simulated time of the towers, s."""
LEAST = 1e-18
"""Minimum of the logarithmic axis, m/s."""
NEWTON = "MuJoCo's Newton"
NAMES = {"Sweeps": "simd, Gauss-Seidel alone", "Automatic": "simd", "Direct": "simd, direct whatever it costs"}
"""Names of simd's `SolverChoice`."""
STYLES = {
    NAMES["Sweeps"]: {"color": "#2f9e44", "lw": 1.2},
    NEWTON: {"color": "#1971c2", "lw": 1.2},
    NAMES["Direct"]: {"color": "#862e9c", "lw": 1.0},
    NAMES["Automatic"]: {"color": "#d9480f", "lw": 1.0, "ls": "--"},
}


def hard_scenes():
    """Scenes with simd's solvers that differ there: a thousand robots are too many for the direct solver."""
    towers = [
        ("a stack of thirty boxes", [1.0] * 30),
        ("1,000 kg on 1 kg", [1.0, 1000.0]),
        ("1 kg on 1,000 kg", [1000.0, 1.0]),
        ("1, 1,000, 1 and 1,000 kg on each other", [1.0, 1000.0, 1.0, 1000.0]),
    ]
    scenes = [(tower(name, masses, SECONDS, 1e-5).scene, ("Sweeps", "Automatic")) for name, masses in towers]
    return [*scenes, (heap(4, 1.0), ("Sweeps", "Automatic", "Direct")), (heap(10, 2.0), ("Sweeps", "Automatic"))]


def heap(edge, seconds):
    """Returns spheres of 5 cm and 0.1 kg that fall into a box; ten along each edge as in `scenes.heap`."""
    inside, wall, high = 0.12 * edge, 0.1, 2.0
    middle = (inside + wall) / 2
    sides = [Thing(f"side-{i}", "box", size, [x, y, high / 2]) for i, (x, y, size) in enumerate([
        (middle, 0.0, [wall, inside + 2 * wall, high]), (-middle, 0.0, [wall, inside + 2 * wall, high]),
        (0.0, middle, [inside, wall, high]), (0.0, -middle, [inside, wall, high])])]
    first = -0.115 * (edge - 1) / 2 - 0.01
    balls = Thing("ball", "sphere", [0.05], [first, first, 0.1], 0.1, grid=[edge] * 3, pitch=0.115, shift=[0.01, 0.005])
    return Scene(f"a heap of {edge**3:,} spheres", seconds, [0.0, seconds], [GROUND, *sides, balls], time_step=2e-3)


def in_mujoco(scene, budget):
    """Returns the residual of each step, None without contact, for as many steps as fit into these seconds on
    this machine."""
    world = scenes_in_mujoco.World(scene, "default")
    options = world.model.opt
    options.solver, options.cone = mujoco.mjtSolver.mjSOL_NEWTON, mujoco.mjtCone.mjCONE_PYRAMIDAL
    options.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    found, end = [], time.monotonic() + budget
    for _ in range(round(scene.seconds / scene.time_step)):
        world.step()
        found.append(residual(world.model, world.data))
        if time.monotonic() > end:
            break
    return found


def residual(model, data):
    """Residual of the last step, whose equations are still in memory: all of its rows are edges of pyramids."""
    if data.nefc == 0:
        return None
    if (data.efc_type[:data.nefc] != int(mujoco.mjtConstraint.mjCNSTR_CONTACT_PYRAMIDAL)).any():
        raise RuntimeError("a row that is not an edge of a pyramid")
    if data.efm_active:
        raise RuntimeError("the mass matrix is not that of the solver")
    force = data.efc_force.copy()
    effort, change, gap = np.zeros(model.nv), np.zeros((1, model.nv)), np.zeros(data.nefc)
    mujoco.mj_mulJacTVec(model, data, effort, force)
    mujoco.mj_solveM(model, data, change, effort[np.newaxis])
    mujoco.mj_mulJacVec(model, data, gap, data.qacc_smooth + change[0])
    gap += data.efc_R * force - data.efc_aref
    own = (data.efc_diagA + data.efc_R) * force
    return float(np.abs(np.minimum(gap, own)).max() * model.opt.timestep)


def numbers(found):
    """NaN leaves a gap in the lines."""
    return np.array([np.nan if each is None else each for each in found], dtype=float)


def show(scene, runs):
    print(f"\n{scene.name}: residual of a step, m/s, {scene.time_step * 1e3:g} ms")
    print(f"  {'':32} {'median':>9} {'95 %':>9} {'largest':>9}  in the second half")
    steps = round(scene.seconds / scene.time_step)
    for name, found in runs.items():
        late = numbers(found)[steps // 2:]
        late = late[np.isfinite(late)]
        cells = [f"{value:9.1e}" for value in np.percentile(late, [50, 95, 100])] if len(late) else ["-"]
        print(f"  {name:32} {' '.join(cells)}" + ("" if len(found) == steps else f"  after {len(found)} of {steps} steps"))


def plot(results, path):
    columns = 3
    rows = -(-len(results) // columns)
    figure, grid = plt.subplots(rows, columns, figsize=(5.2 * columns, 3.8 * rows), layout="constrained", squeeze=False)
    for axes, (scene, runs) in zip(grid.ravel(), results):
        for name in (name for name in STYLES if name in runs):
            lines = np.maximum(numbers(runs[name]), LEAST)
            axes.plot(scene.time_step * np.arange(1, len(lines) + 1), lines, label=name, **STYLES[name])
        axes.set(title=scene.name, xlabel="simulated time, s", ylabel="residual, m/s", yscale="log")
        axes.grid(alpha=0.3)
    for axes in grid.ravel()[len(results):]:
        axes.axis("off")
    handles = {label: handle for axes in grid.ravel() for handle, label in zip(*axes.get_legend_handles_labels())}
    figure.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=4)
    figure.suptitle("How exactly contacts are solved: by how much a contact's velocity would change if only it were solved once more")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--out", type=Path, default=REPOSITORY / "target" / "bench")
    arguments.add_argument("--only", default="", help="run only scenes whose names contain this")
    arguments.add_argument("--budget", type=float, default=300.0, help="maximum seconds of MuJoCo for a scene")
    options = arguments.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = []
    for scene, ways in hard_scenes():
        if options.only not in scene.name:
            continue
        requests = [{"scene": scene.request(), "solver": way} for way in ways]
        answers = in_simd.ask(REPOSITORY, options.out, requests)
        runs = {NAMES[way]: answer for way, answer in zip(ways, answers, strict=True)}
        runs[NEWTON] = in_mujoco(scene, options.budget)
        show(scene, runs)
        results.append((scene, runs))
    if not results:
        sys.exit(f"no scene has {options.only!r} in its name")
    made = {"mujoco": version("mujoco"), "unit": "m/s",
            "scenes": [{"name": scene.name, "time_step": scene.time_step, "residuals": runs} for scene, runs in results]}
    (options.out / "residuals.json").write_text(json.dumps(made) + "\n")
    plot(results, options.out / "residuals.png")
    print(f"\nwritten: {options.out / 'residuals.json'}, {options.out / 'residuals.png'}")


if __name__ == "__main__":
    main()
