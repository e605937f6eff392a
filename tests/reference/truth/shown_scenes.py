"""Scenes with checks: run in simd and its peers, judged, and drawn as by a camera."""

import re
from importlib.metadata import version

import matplotlib

matplotlib.use("Agg")
import constraint_scenes
import matplotlib.pyplot as plt
import motion_scenes
import numpy as np
import scene_plots
import scenes_in_mujoco
import scenes_in_pybullet
import solver_scenes
import terrain_scenes

SIZE = (480, 360)
"""Size of a picture, pixels."""

ABOVE = """
## {title}

{text} simd {simd}, rapier 0.36.1 with its rigid bodies and multibody joints, MuJoCo {mujoco} and PyBullet {pybullet} have equal masses, friction, time step, gains and targets; settings
of their solvers are those that each has by default, and `stiff` is MuJoCo as rigid as its time step lets it be.

| scene | by | what is seen | at most | |
|---|---|---|---|---|
"""

INTEGRATORS = ["Euler", "Leapfrog"]
"""Integrators that a world can have."""

PARTS = [
    ("Terrain", terrain_scenes.shown,
     "Meshes that do not move are triangles, height fields are ground. `simd, leapfrog` is the same with the other integrator."),
    ("Held together", constraint_scenes.shown, "Constraints between links: MuJoCo's equalities and tendons, PyBullet's `createConstraint`. rapier is not given them. `simd, leapfrog` is the same with the other integrator."),
    ("Motion that is known", motion_scenes.shown, "Seams, held points, slow motion, momentum and wheels. `simd, leapfrog` is the same with the other integrator."),
    ("Hard on a solver", solver_scenes.shown, "`simd, leapfrog` is the same with the other integrator."),
]


def chosen(only):
    """Title, text and scenes of each part, for scenes whose name or part contains this."""
    for title, shown, text in PARTS:
        scenes = [each for each in shown() if only in title or only in each.scene.name]
        if scenes:
            yield title, text, scenes


def every(shown):
    return round(shown.look / shown.scene.time_step)


def requests(shown, integrators, in_rapier=False):
    return [{"scene": shown.scene.request(), "every": every(shown), "integrator": integrator, "in_rapier": in_rapier}
            for integrator in integrators]


def peers(shown):
    """Returns views of each peer that supports it, by name."""
    runs = {}
    if "MuJoCo" in shown.peers:
        for setting in shown.scene.settings():
            runs[f"MuJoCo, {setting}"] = scenes_in_mujoco.run(shown.scene, setting, every(shown), may_diverge=True)
    if "PyBullet" in shown.peers:
        runs["PyBullet"] = scenes_in_pybullet.run(shown.scene, every(shown))
    return runs


def above(title, text):
    return ABOVE.format(title=title, text=text, simd="as it is here", mujoco=version("mujoco"), pybullet=version("pybullet"))


def lines(shown, runs):
    """Returns a line for each figure of each run."""
    out, name = "", shown.scene.name
    for engine, views in runs.items():
        for check in shown.checks:
            with np.errstate(all="ignore"):
                found = check.figure(views)
            verdict = "yes" if found <= check.most else "**no**"
            out += f"| {name} | {engine} | {check.says.format(f'{found:.3g}')} | {check.most:g} | {verdict} |\n"
            name, engine = "", ""
    if shown.without:
        out += f"| | | not in MuJoCo: {shown.without} | | |\n"
    return out


def draw(shown, runs, folder):
    """Returns name and title of the picture: three figures over time, simd at some instants, and the end of
    each run."""
    instants = shown.instants or (0.0, shown.scene.seconds)
    columns = max(len(instants), len(runs), 3)
    figure, grid = plt.subplots(3, columns, figsize=(4 * columns, 10), layout="constrained")
    for axes, (label, value, scale) in zip(grid[0], panels(shown)):
        for engine, views in runs.items():
            with np.errstate(all="ignore"):
                axes.plot(scene_plots.times(views), value(views), label=engine, **scene_plots.STYLES[engine])
        axes.set(xlabel="time, s", ylabel=label, yscale=scale)
        axes.grid(alpha=0.3)
    grid[0][0].legend(fontsize=8)
    world = scenes_in_pybullet.World(shown.scene)
    ends = [(engine, views[-1]) for engine, views in runs.items()]
    seen = [min(runs["simd"], key=lambda view: abs(view.time - instant)) for instant in instants]
    rows = [[(f"simd, {view.time:.2f} s", view) for view in seen],
            [(f"{engine}, {view.time:.2f} s", view) for engine, view in ends]]
    for row, views in zip(grid[1:], rows):
        for axes, (title, view) in zip(row, views):
            axes.set_title(title, fontsize=9)
            if np.isfinite(view.roots).all() and np.isfinite(view.joints).all():
                about = view.roots[0, :3] if shown.follows else np.zeros(3)
                axes.imshow(world.picture(view, about + shown.eye, about + shown.at, SIZE))
    world.close()
    for axes in grid.ravel():
        if not axes.has_data() or axes in grid[1:]:
            axes.axis("off")
    figure.suptitle(shown.scene.name)
    name = re.sub(r"[^a-z0-9]+", "_", shown.scene.name.lower()).strip("_") + ".png"
    figure.savefig(folder / name, dpi=70)
    plt.close(figure)
    return name, shown.scene.name


def panels(shown):
    """Label, values of a run, and scale of the quantity drawn over time."""
    overlap = ("largest overlap, mm", scene_plots.overlap, "log")
    if shown.scene.free():
        count = len(shown.scene.free())
        height = ("mean height, m" if count > 1 else "height, m", scene_plots.mean_height, "linear")
        return [height, ("the fastest, m/s", fastest, "log"), overlap]
    last = sum(len(robot.joints) for robot in shown.scene.robots) - 1
    return [("first joint, rad", scene_plots.joint(0), "linear"), ("last joint, rad", scene_plots.joint(last), "linear"), overlap]


def fastest(views):
    return np.maximum(1e-9, [np.linalg.norm(view.roots[:, 7:10], axis=1).max() for view in views])
