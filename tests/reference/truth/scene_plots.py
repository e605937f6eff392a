"""A picture of each scene with contact: its main quantities over time, and some instants of simd's run from
the side."""

import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from frames import Drawing

STYLES = {
    "MuJoCo, default": {"color": "#74c0fc", "lw": 2.5},
    "MuJoCo, stiff": {"color": "#1864ab", "lw": 1.5},
    "PyBullet": {"color": "#2b8a3e", "lw": 1.5},
    "rapier": {"color": "#868e96", "lw": 1.5},
    "simd": {"color": "#d9480f", "lw": 1.5, "ls": "--"},
    "simd, leapfrog": {"color": "#862e9c", "lw": 1.5, "ls": ":"},
}
LEAST = 1e-8
"""Minimum overlap on the logarithmic axis, m."""

G = 9.81


def draw(results, folder):
    """Name and title of each picture."""
    walks = [(scene, runs) for scene, runs in results if scene.name.startswith("A1 walks")]
    walls = [(scene, runs) for scene, runs in results if scene.name.startswith("5 m/s")]
    out = []
    for scene, runs in results:
        if scene not in [other for other, _ in walks + walls]:
            out.append(picture(scene, runs, folder))
    if walks:
        out.append(side_by_side(walks, folder, "A1 walks", "the way of the root along x, m", 0))
    if walls:
        out.append(side_by_side(walls, folder, "5 m/s against a wall of 2 mm", "the ball's centre along x, m", 0))
    for scene, runs in walks[:1] + walks[5:6]:
        out.append(picture(scene, runs, folder))
    return out


def times(views):
    return np.array([view.time for view in views])


def root(index, column, scale=1.0):
    return lambda views: scale * np.array([view.roots[index, column] for view in views])


def joint(index, scale=1.0):
    return lambda views: scale * np.array([view.joints[index] for view in views])


def force(index):
    return lambda views: np.array([view.forces[index] for view in views])


def overlap(views):
    return np.maximum(LEAST, [view.deepest for view in views]) * 1e3


def slip(views):
    """Returns the slip of the cube in the hand, mm, while it is held: the cube's height against the rail's."""
    return np.array([1e3 * (view.roots[0, 2] - view.joints[0]) - 30 if view.time < 14 else np.nan for view in views])


def sideways(views):
    start = views[len(views) // 6].roots[0, :2]
    return np.array([1e3 * np.hypot(*(view.roots[0, :2] - start)) for view in views])


def swing_energy(views):
    """Returns the energy of the rod about its end, J; zero if it hangs still."""
    q = joint(0)(views)
    velocity = np.gradient(q, times(views))
    return 0.5 / 3 * velocity**2 + G / 2 * (1 - np.cos(q))


def kinetic(views):
    return np.maximum(1e-6, [0.05 * (view.roots[:, 7:10] ** 2).sum() for view in views])


def mean_height(views):
    return np.array([view.roots[:, 2].mean() for view in views])


OVERLAP = ("largest overlap, mm", overlap, "log")

PANELS = {
    "an A1 stands": [("height of the root, mm", root(0, 2, 1e3), None), ("way from its place at 2 s, mm", sideways, "log"),
                     ("normal forces on its feet, N", force(0), None), OVERLAP],
    "A1 walks": [("x of the root, m", root(0, 0), None), ("y of the root, m", root(0, 1), None),
                 ("height of the root, mm", root(0, 2, 1e3), None), OVERLAP],
    "a gripper": [("slip of the cube in the hand, mm", slip, None), ("height of the cube, m", root(0, 2), None),
                  ("normal force of the left finger, N", force(0), None), OVERLAP],
    "a robot pushes": [("x of the box, m", root(0, 0), None), ("normal force of the fingers, N", force(0), None), OVERLAP],
    "a stack": [("height of the top box, mm below 1.9 m", lambda views: 1900 - root(9, 2, 1e3)(views), None),
                ("x of the top box, mm", root(9, 0, 1e3), None), OVERLAP],
    "a pendulum": [("angle, rad", joint(0), None), ("energy above rest at the bottom, J", swing_energy, None),
                   ("normal force of the wall, N", force(0), None), OVERLAP],
    "two arms": [("left arm, rad", joint(0), None), ("right arm, rad", joint(1), None),
                 ("normal force between them, N", force(0), None), OVERLAP],
    "a thousand": [("mean height, m", mean_height, None), ("kinetic energy, J", kinetic, "log"),
                   ("weight that the ground carries, N", force(0), None), OVERLAP],
}

FRAMES = {
    "an A1 stands": ((0.0, 2.0, 12.0), (-0.45, 0.45, -0.05, 0.45), 0),
    "A1 walks": ((1.0, 1.1, 1.2, 1.3, 9.0), (-0.5, 0.5, -0.05, 0.5), 0),
    "a gripper": ((0.0, 1.0, 3.0, 14.0, 14.6), (-0.25, 0.25, -0.05, 0.85), 1),
    "a robot pushes": ((0.0, 1.2, 2.5, 5.0), (-0.2, 1.2, -0.1, 0.4), 0),
    "a stack": ((0.0, 60.0), (-0.5, 0.5, -0.1, 2.2), 0),
    "a pendulum": ((0.0, 0.3, 0.5, 0.7, 6.0), (-0.2, 1.1, -1.15, 0.1), 0),
    "two arms": ((0.0, 0.4, 1.0, 4.0), (-0.9, 0.9, 0.6, 2.1), 0),
    "a thousand": ((0.0, 0.3, 0.6, 2.0), (-0.8, 0.8, -0.1, 1.3), 0),
}


def kind(table, scene):
    return next(value for key, value in table.items() if scene.name.startswith(key))


def picture(scene, runs, folder):
    panels, (instants, box, across) = kind(PANELS, scene), kind(FRAMES, scene)
    figure = plt.figure(figsize=(4.1 * len(panels), 6.6), layout="constrained")
    above, below = figure.subfigures(2, 1)
    for axes, (label, value, scale) in zip(np.atleast_1d(above.subplots(1, len(panels))), panels):
        for engine in [engine for engine in STYLES if engine in runs]:
            axes.plot(times(runs[engine]), value(runs[engine]), label=engine, **STYLES[engine])
        axes.axvspan(*scene.window, color="#f1f3f5", zorder=0)
        axes.set(xlabel="time, s", ylabel=label)
        if scale:
            axes.set_yscale(scale)
        axes.grid(alpha=0.3)
    above.axes[0].legend(fontsize=8)
    drawing = Drawing(scene, across)
    for axes, instant in zip(np.atleast_1d(below.subplots(1, len(instants))), instants):
        nearest = min(runs["simd"], key=lambda view: abs(view.time - instant))
        left, right, bottom, top = box
        shift = nearest.roots[0, 0] if scene.name.startswith("A1") else 0.0
        drawing.draw(axes, nearest, (left + shift, right + shift, bottom, top), f"simd, {nearest.time:.2f} s")
    figure.suptitle(scene.name)
    name = re.sub(r"[^a-z0-9]+", "_", scene.name.lower()).strip("_") + ".png"
    figure.savefig(folder / name, dpi=80)
    plt.close(figure)
    return name, scene.name


def side_by_side(results, folder, title, label, column):
    """One panel a scene."""
    rows = -(-len(results) // 4)
    figure, grid = plt.subplots(rows, min(4, len(results)), figsize=(4 * min(4, len(results)), 3.3 * rows),
                                layout="constrained")
    for axes, (scene, runs) in zip(np.ravel(grid), results):
        for engine in [engine for engine in STYLES if engine in runs]:
            axes.plot(times(runs[engine]), root(0, column)(runs[engine]), label=engine, **STYLES[engine])
        axes.set_title(scene.name, fontsize=9)
        axes.set(xlabel="time, s", ylabel=label)
        axes.grid(alpha=0.3)
    np.ravel(grid)[0].legend(fontsize=8)
    name = re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_") + ".png"
    figure.savefig(folder / name, dpi=80)
    plt.close(figure)
    return name, title
