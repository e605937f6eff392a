#!/usr/bin/env python3
"""Scenes with contact, simd beside rapier, MuJoCo and PyBullet: started by `make scenes`.

Runs the scenes of tests/reference/scenes.py, terrain_scenes.py, solver_scenes.py, constraint_scenes.py and
motion_scenes.py. Writes a picture of each and a table, scenes.md, into target/scenes. The table also has
the loads on feet in the scenes of resting_scenes.py.
"""

import argparse
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[2]
sys.path.insert(0, str(HERE.parent))

import in_simd  # noqa: E402
import make_scenes  # noqa: E402
import resting_scenes  # noqa: E402
import scene_plots  # noqa: E402
import scenes_in_mujoco  # noqa: E402
import shown_scenes  # noqa: E402
from scenes import scenes  # noqa: E402

LOOK = 0.004
"""Seconds between views."""
LOOK_AT_MANY = 0.02
"""Seconds between views with many bodies."""

ABOVE = """\
# Scenes with contact

Made by `make scenes`: the scenes of `tests/reference/scenes.py` at equal masses, friction, time step, gains and targets
in simd, in rapier 0.36.1 with its rigid bodies, multibody joints and default settings, and in MuJoCo {mujoco}, which runs them in two ways: `default`, its soft contacts and pyramids of friction; and
`stiff`, cones and contacts as rigid as its time step lets them be. `tests/physics/scenes.rs` holds simd to them.

Lengths in mm. Deepest: the largest overlap of all. Resting: the largest in the window of the scene, in which things
rest or go on evenly. Drift: how far a free body got from where the window found it.

| scene | | deepest | resting | drift | force, N | fastest at the end, m/s |
|---|---|---|---|---|---|---|
"""


RESTING = """
## What feet carry

Normal forces on the feet of robots that hold a pose by springs, after a given number of seconds, N. simd uses the default integrator.

| robot | foot | {engines} |
|---|---|{columns}|
"""


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--out", type=Path, default=REPOSITORY / "target" / "scenes")
    arguments.add_argument("--only", default="", help="run only scenes whose names, or sections, contain this")
    options = arguments.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    chosen = [scene for scene in scenes() if options.only in scene.name]
    text = beside_mujoco(chosen, options.out) if chosen else ""
    text += beside_all(options.only, options.out) + at_rest(options.only, options.out)
    (options.out / "scenes.md").write_text(text)
    print(f"written: {options.out / 'scenes.md'}")


def beside_mujoco(chosen, folder):
    """The scenes to which tests/physics/scenes.rs holds simd."""
    every = [round((LOOK_AT_MANY if len(scene.free()) > 100 else LOOK) / scene.time_step) for scene in chosen]
    requests = [{"scene": scene.request(), "every": n} for scene, n in zip(chosen, every)]
    answers = in_simd.ask(REPOSITORY, folder, requests)
    others = in_simd.ask(REPOSITORY, folder, [request | {"in_rapier": True} for request in requests])
    results = []
    for scene, n, answer, other in zip(chosen, every, answers, others, strict=True):
        print(scene.name, flush=True)
        runs = {"simd": [view(scene, seen) for seen in answer]}
        if other is not None:
            runs["rapier"] = [view(scene, seen) for seen in other]
        for setting in scene.settings():
            runs[f"MuJoCo, {setting}"] = scenes_in_mujoco.run(scene, setting, n)
        results.append((scene, runs))

    text = ABOVE.format(mujoco=version("mujoco"))
    for scene, runs in results:
        for engine, views in runs.items():
            text += line(scene.name if engine == "simd" else "", engine, make_scenes.figures(scene, views))
    for name, title in scene_plots.draw(results, folder):
        text += f"\n![{title}]({name})\n"
    return text


def beside_all(only, folder):
    """The scenes with checks."""
    out = ""
    for title, text, scenes in shown_scenes.chosen(only):
        out += shown_scenes.above(title, text)
        pictures = ""
        for shown in scenes:
            print(shown.scene.name, flush=True)
            ways = shown_scenes.INTEGRATORS
            answers = in_simd.ask(REPOSITORY, folder, shown_scenes.requests(shown, ways))
            names = ["simd" if way == "Euler" else f"simd, {way.lower()}" for way in ways]
            runs = {name: [view(shown.scene, seen) for seen in answer] for name, answer in zip(names, answers)}
            (other,) = in_simd.ask(REPOSITORY, folder, shown_scenes.requests(shown, [None], in_rapier=True))
            if other is not None:
                runs["rapier"] = [view(shown.scene, seen) for seen in other]
            runs |= shown_scenes.peers(shown)
            out += shown_scenes.lines(shown, runs)
            name, title_of = shown_scenes.draw(shown, runs, folder)
            pictures += f"\n![{title_of}]({name})\n"
        out += pictures
    return out


def at_rest(only, folder):
    """Returns the load on each foot of a standing robot, and on all of them together."""
    out = ""
    for standing in resting_scenes.shown():
        scene = standing.scene
        if only not in scene.name:
            continue
        print(scene.name, flush=True)
        every = round(scene.seconds / scene.time_step)
        request = {"scene": scene.request(), "every": every}
        answer, other = in_simd.ask(REPOSITORY, folder, [request, request | {"in_rapier": True}])
        ends = {"simd": view(scene, answer[-1]), "rapier": view(scene, other[-1])}
        for setting in scene.settings():
            ends[f"MuJoCo, {setting}"] = scenes_in_mujoco.run(scene, setting, every)[-1]
        if not out:
            out = RESTING.format(engines=" | ".join(ends), columns="|".join(["---"] * len(ends)))
        found = [standing.forces(end) for end in ends.values()]
        weight = 9.81 * scenes_in_mujoco.model(scene, "default").body_mass.sum()
        rows = [*zip(standing.feet, *found), (f"all, of {weight:.4f}", *map(sum, found))]
        for name, *forces in rows:
            cells = [f"{scene.name}, {scene.seconds:g} s", name, *(f"{force:.4f}" for force in forces)]
            out += f"| {' | '.join(cells)} |\n"
    return out


def view(scene, seen):
    # NaN arrives as None.
    roots = np.array(seen["roots"], dtype=float).reshape(-1, 13)
    joints = np.array(seen["joints"], dtype=float)
    deepest = np.inf if seen["deepest"] is None else seen["deepest"]
    forces = [np.nan if force is None else force for force in seen["forces"]]
    return scenes_in_mujoco.View(seen["time"], roots, joints, deepest, forces, seen["error"])


def line(name, engine, found):
    lengths = [f"{found[key] * 1e3:.3g}" for key in ("deepest", "resting", "drift")]
    forces = ", ".join(f"{force:.4g}" for force in found["forces"])
    return f"| {name} | {engine} | {' | '.join(lengths)} | {forces} | {found['speed']:.1g} |\n"


if __name__ == "__main__":
    main()
