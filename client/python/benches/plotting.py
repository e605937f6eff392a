"""Figures of benches, drawn without a screen."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

# It has no whole types.
matplotlib: Any = importlib.import_module("matplotlib")
matplotlib.use("Agg")
pyplot: Any = importlib.import_module("matplotlib.pyplot")

TARGET = Path(__file__).parents[3] / "target" / "rollouts"
"""Default folder of pictures."""


def subplots(columns: int, title: str) -> tuple[Any, list[Any]]:
    """Returns a figure with axes side by side, each with a grid."""
    figure, axes = pyplot.subplots(1, columns, figsize=(5.5 * columns, 4.5), layout="constrained", squeeze=False)
    figure.suptitle(title)
    found: list[Any] = list(axes[0])
    for each in found:
        each.grid(True, alpha=0.25)
    return figure, found


def save(figure: Any, path: Path) -> None:
    """Writes a PNG, and prints its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)
    pyplot.close(figure)
    print(f"written: {path}")


def spread(values: list[float], unit: float = 1.0) -> str:
    """Formats the median (5 % to 95 %), in a unit."""
    low, median, high = np.percentile(np.array(values) / unit, [5, 50, 95])
    return f"{median:.2f} ({low:.2f} to {high:.2f})"
