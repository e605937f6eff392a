"""Plots of the truth report."""

import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

# simd's Euler is last but one and dashed, since it often lies on MuJoCo's line.
STYLES = {
    "PyBullet": {"color": "#2f9e44", "lw": 1.6, "marker": "s", "ms": 14, "mfc": "none"},
    "MuJoCo": {"color": "#74c0fc", "lw": 5, "marker": "o", "ms": 9},
    "MuJoCo implicitfast": {"color": "#1864ab", "lw": 1.2, "marker": "v", "ms": 6},
    "MuJoCo RK4, 4 h": {"color": "#7048e8", "lw": 1.2, "marker": "^", "ms": 6},
    "simd Euler": {"color": "#f08c00", "lw": 1.4, "ls": "--", "marker": "x", "ms": 6},
    "simd": {"color": "#d9480f", "lw": 1.6, "marker": "D", "ms": 5},
}
ROUNDING = 1e-11
"""Largest error that can be rounding and not the method's."""
FLOOR = 1e-14
"""Minimum of the logarithmic axis; smaller errors are rounding."""


def slug(name):
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def case(result, folder):
    """Plots the error over time at 1 ms, and over the time step."""
    figure, (over_time, over_step) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    instants = result["instants"]
    for engine, style in STYLES.items():
        errors = result["errors"].get(engine)
        if errors is None:
            continue
        line = {key: value for key, value in style.items() if key not in ("marker", "ms", "mfc")}
        if engine == "PyBullet":
            # Below MuJoCo's, where it often lies too.
            line |= {"lw": 9, "alpha": 0.4}
        over_time.plot(instants, drawn(errors[1e-3]), label=engine, **line)
        steps = [h for h in errors if worst(errors[h]) is not None]
        if steps:
            over_step.plot([h * 1e3 for h in steps], drawn([worst(errors[h]) for h in steps]), label=engine, **style)
    own = result["errors"]["simd"]
    steps = np.array(list(own))
    least = worst(own[steps[0]])
    if least is not None and least > FLOOR:
        guide = least * (steps / steps[0]) ** 2
        over_step.plot(steps * 1e3, guide / 2.5, color="grey", lw=0.8, ls=":", label="slope 2: second order")
    over_time.set(xlabel="time, s", ylabel=f"error at that time, {result['unit']}",
                  title="over time, at 1 ms")
    over_time.set_yscale("log")
    over_step.set(xlabel="time step, ms", ylabel=f"largest error, {result['unit']}", title="over the time step")
    over_step.set_xscale("log")
    over_step.set_yscale("log")
    over_step.set_xticks([0.1, 0.25, 1, 4], ["0.1", "0.25", "1", "4"])
    over_step.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    for axes in (over_time, over_step):
        axes.grid(True, which="major", alpha=0.3)
        axes.legend()
    figure.suptitle(f"{result['name']}: {result['message']}", fontsize=11)
    path = folder / f"{slug(result['name'])}.png"
    figure.savefig(path, dpi=100)
    plt.close(figure)
    return path.name


def drawn(errors):
    """Returns the errors as a line: gaps for missing and diverged values."""
    return [np.nan if error is None else max(error, FLOOR) for error in errors]


def worst(errors):
    return None if any(error is None for error in errors) else max(errors)


def overview(results, title, path):
    """Plots the largest error of each case at 1 ms."""
    figure, axes = plt.subplots(figsize=(9.5, 0.36 * len(results) + 1.7), layout="constrained")
    places = np.arange(len(results))[::-1]
    points = {engine: ([], []) for engine in STYLES}
    words = []
    for place, result in zip(places, results):
        said = []
        for engine in STYLES:
            if engine not in result["errors"]:
                if engine == "PyBullet":
                    said.append("PyBullet: no armature")
                continue
            error = worst(result["errors"][engine][1e-3])
            if error is None:
                said.append(f"{engine}: unstable")
            elif error < ROUNDING:
                said.append(f"{engine}: exact")
            else:
                points[engine][0].append(error)
                points[engine][1].append(place)
        words.append((place, ", ".join(said)))
    for engine, style in STYLES.items():
        if not points[engine][0]:
            continue
        face = style.get("mfc", style["color"])
        axes.scatter(*points[engine], s=style["ms"] ** 2, edgecolors=style["color"], facecolors=face,
                     marker=style["marker"], label=engine, zorder=3)
    for place, word in words:
        axes.annotate(word, (1, place), xycoords=("axes fraction", "data"), xytext=(6, 0),
                      textcoords="offset points", fontsize=8, color="#555555", va="center", annotation_clip=False)
    axes.set_yticks(places, [result["name"] for result in results], fontsize=9)
    axes.set_ylim(-0.7, len(results) - 0.3)
    axes.set_xscale("log")
    axes.set_xlabel("largest error of a joint or the root at a time step of 1 ms, rad or m")
    axes.grid(True, axis="x", alpha=0.3)
    axes.grid(True, axis="y", alpha=0.15)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=9)
    axes.set_title(title, fontsize=11)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def orders(results, path):
    """Plots leapfrog's error over the time step, all cases in one: lines of slope 2 where motion is smooth."""
    figure, axes = plt.subplots(figsize=(8, 6), layout="constrained")
    colours = {"smooth": "#1971c2", "kinked": "#d9480f", "driven": "#862e9c"}
    names = {"smooth": "passive, smooth", "kinked": "with dry friction, limits or mimic", "driven": "with actuators"}
    for result in results:
        errors = {h: worst(series) for h, series in result["errors"]["simd"].items()}
        if None in errors.values() or min(errors.values()) < ROUNDING:
            continue
        axes.plot([h * 1e3 for h in errors], list(errors.values()), color=colours[result["subject"]], lw=1,
                  marker=".", alpha=0.8, label=names.pop(result["subject"], None))
    steps = np.array([0.1, 4.0])
    axes.plot(steps, 3e-2 * steps, color="black", lw=1, ls=":", label="slope 1")
    axes.plot(steps, 1e-4 * steps**2, color="black", lw=1, ls="--", label="slope 2")
    axes.set(xlabel="time step, ms", ylabel="largest error against the reference, rad or m",
             title="Leapfrog: second order where motion is passive and smooth, first elsewhere")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks([0.1, 0.25, 1, 4], ["0.1", "0.25", "1", "4"])
    axes.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    axes.grid(True, which="major", alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=110)
    plt.close(figure)
