#!/usr/bin/env python3
"""Makes scenes.json: the scenes with contact of scenes.py, and MuJoCo's results for each.

tests/physics/scenes.rs runs the same scenes in simd and takes its bounds from these figures. `make scenes`
draws both.
"""

import sys
import time
from pathlib import Path

import mujoco
import numpy as np

import json_lines
import scenes_in_mujoco
from scenes import scenes

HERE = Path(__file__).resolve().parent
LOOK = 0.01
"""Seconds between views."""
MANY = 20
"""Scenes with more bodies are described by figures of all bodies together."""


def main():
    only = sys.argv[1] if len(sys.argv) > 1 else ""
    out = []
    for scene in scenes():
        if only not in scene.name:
            continue
        made = {"scene": scene.request()}
        for setting in scene.settings():
            started = time.time()
            views = scenes_in_mujoco.run(scene, setting, round(LOOK / scene.time_step))
            made[setting] = figures(scene, views)
            print(f"{scene.name}, {setting}: {time.time() - started:.1f} s", flush=True)
        out.append(made)
    made_by = f"make_scenes.py with MuJoCo {mujoco.__version__}"
    path = HERE / "scenes.json"
    if only:
        print(json_lines.text([made | {"scene": made["scene"]["name"]} for made in out]))
    else:
        path.write_text(json_lines.text({"made_by": made_by, "scenes": out}))


def figures(scene, views):
    """Figures of a run from any simulator: tests/support/contact_figures.rs computes the same in simd."""
    inside = [view for view in views if scene.window[0] - 1e-9 <= view.time <= scene.window[1] + 1e-9]
    start, end = inside[0], inside[-1]
    out = {
        "deepest": max(view.deepest for view in views),
        # The first view also covers the time before it.
        "resting": max(view.deepest for view in inside[1:]),
        "forces": np.mean([view.forces for view in inside], axis=0).tolist(),
        "least_force": min((view.forces[0] for view in inside), default=0.0),
        "speed": max((np.linalg.norm(root[7:10]) for root in end.roots), default=0.0),
        "drift": max((np.linalg.norm(view.roots[:, :3] - start.roots[:, :3], axis=1).max() for view in inside
                      if len(view.roots)), default=0.0),
        "turn": max((turn(view.roots, start.roots) for view in inside if len(view.roots)), default=0.0),
        "joints": [start.joints.tolist(), end.joints.tolist()],
    }
    if len(end.roots) > MANY:
        heights = end.roots[:, 2]
        masses = np.array([mass for _, mass in scene.free()])
        out |= {"mean_height": heights.mean(), "top": heights.max(), "spread": np.abs(end.roots[:, :2]).max(),
                "kinetic": float((0.5 * masses * (end.roots[:, 7:10] ** 2).sum(axis=1)).sum()), "roots": []}
    else:
        out["roots"] = [start.roots[:, :7].tolist(), end.roots[:, :7].tolist()]
    return rounded(out)


def turn(now, then):
    """Returns the largest angle between the quaternions of two views."""
    dot = np.abs((now[:, 3:7] * then[:, 3:7]).sum(axis=1))
    return float(2 * np.arccos(np.minimum(dot, 1.0)).max())


def rounded(value):
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [rounded(part) for part in value]
    return float(f"{value:.7g}")


if __name__ == "__main__":
    main()
