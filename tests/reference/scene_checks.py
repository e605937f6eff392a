"""Checks of a scene: figures of a run from any simulator, with the maximum of each."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from scenes import Scene


@dataclass
class Check:
    says: str
    """A sentence with a placeholder for the figure."""
    figure: Callable
    """Function that computes the figure from all views."""
    most: float


@dataclass
class Shown:
    """A scene, and its checks."""

    scene: Scene
    checks: list
    peers: tuple
    """Peers that run it: MuJoCo, PyBullet."""
    without: str = ""
    """Reason why another peer does not."""
    eye: list = field(default_factory=lambda: [2.0, -3.0, 1.5])
    at: list = field(default_factory=lambda: [0.0, 0.0, 0.3])
    follows: bool = False
    """Whether the eye and its target are relative to the first free body."""
    instants: tuple = ()
    look: float = 0.01
    """Seconds between views."""


def inside(views, start, end=1e9):
    return [view for view in views if start - 1e-9 <= view.time <= end + 1e-9]


def roots(views, columns, body=0):
    """Returns columns of a root in each view: position 0 to 2, quaternion 3 to 6, velocity 7 to 9, angular
    velocity 10 to 12."""
    return np.array([view.roots[body, columns] for view in views])


def spread(values):
    """Returns the largest difference of any component; infinity for NaN."""
    return worst(np.ptp(values, axis=0))


def worst(values):
    """Returns the largest size; infinity for NaN."""
    values = np.abs(np.asarray(values, dtype=float))
    return float(values.max()) if np.isfinite(values).all() else float("inf")


def moved(views, body=None):
    """Returns the largest distance of a body, or any, from its place in the first view, m."""
    rows = slice(None) if body is None else [body]
    first = views[0].roots[rows, :3]
    return worst([np.linalg.norm(view.roots[rows, :3] - first, axis=1).max() for view in views])


def rotation(quaternion):
    x, y, z, w = quaternion
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def tilt(view, body=0):
    """Returns the angle of a body's z axis against the vertical, rad."""
    return float(np.arccos(np.clip(rotation(view.roots[body, 3:7])[2, 2], -1.0, 1.0)))


def spin_energy(view, moment, body=0):
    """Returns the rotational energy of a body with these principal moments, J."""
    own = rotation(view.roots[body, 3:7]).T @ view.roots[body, 10:13]
    return 0.5 * float(np.dot(moment, own**2))


def deepest(start):
    return lambda views: worst([view.deepest for view in inside(views, start)])
