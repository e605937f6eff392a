"""Medians, spreads and ratios of the rounds, with their tables and plot."""

import os
import platform

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

BASE = "MuJoCo"
"""Engine to which ratios refer."""


def spread(values):
    """Returns the median, and the range that holds nine tenths."""
    low, median, high = np.percentile(values, [5, 50, 95])
    return {"median": median, "low": low, "high": high}


def summary(rounds):
    """Returns microseconds a step of a scene by engine, and the ratio to MuJoCo's batch of the same round."""
    out = {}
    for engine, figures in rounds.items():
        out[engine] = {"us_per_step": spread(figures)}
        out[engine][f"to_{BASE}"] = spread(np.array(figures) / np.array(rounds[BASE]))
    return out


def machine():
    model = platform.processor()
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo") as info:
            model = next((line.split(":")[1].strip() for line in info if line.startswith("model name")), model)
    return {"processor": model, "cores": os.cpu_count(), "load_average": os.getloadavg()}


def table(scenes, engines, key):
    """Returns a line for each scene, a column for each engine: median (5 % to 95 %)."""
    rows = [["", *engines]]
    for name, figures in scenes.items():
        rows.append([name, *(cell(figures[engine][key]) if engine in figures else "" for engine in engines)])
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = []
    for name, *cells in rows:
        lines.append("   ".join([name.ljust(widths[0]), *(c.rjust(w) for c, w in zip(cells, widths[1:]))]))
    return "\n".join(lines)


def cell(figure):
    digits = 2 if figure["median"] < 10 else 1 if figure["median"] < 100 else 0
    median, low, high = (f"{figure[part]:.{digits}f}" for part in ("median", "low", "high"))
    return f"{median} ({low} to {high})"


def slope(lengths, costs):
    """Fits a straight line to costs over joints: microseconds a joint, and the part of the variance that it
    explains."""
    line = np.polyfit(lengths, costs, 1)
    left = np.var(costs - np.polyval(line, lengths)) / np.var(costs)
    return line[0], 1 - left


def plot(chains, engines, path):
    """Plots cost over joints: all engines on logarithmic axes, and the two fastest on linear ones."""
    figure, (all_of_them, fastest) = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
    colours = dict(zip(engines, ("#d9480f", "#1971c2", "#2f9e44", "#862e9c")))
    lengths = np.array(list(chains))
    for axes, shown in ((all_of_them, engines), (fastest, engines[:2])):
        for engine in shown:
            figures = [chains[length][engine]["us_per_step"] for length in chains]
            middle = np.array([figure["median"] for figure in figures])
            bars = [middle - [figure["low"] for figure in figures], [figure["high"] for figure in figures] - middle]
            axes.errorbar(lengths, middle, yerr=bars, label=engine, color=colours[engine], marker="o", ms=4,
                          capsize=3, elinewidth=0.8)
        axes.set_xlabel("revolute joints in the chain")
        axes.set_ylabel("microseconds a step")
        axes.grid(True, which="both", alpha=0.25)
        axes.legend()
    all_of_them.set_xscale("log")
    all_of_them.set_yscale("log")
    ticks = [2, 5, 10, 20, 40, 60]
    all_of_them.set_xticks(ticks, [str(tick) for tick in ticks])
    all_of_them.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    fastest.set_xlim(left=0)
    fastest.set_ylim(bottom=0)
    figure.suptitle("A fixed chain holding a bent pose: 1 ms a step, actuators on, no contacts, one thread "
                    "(median, bars 5 to 95 %)")
    figure.savefig(path, dpi=120)
