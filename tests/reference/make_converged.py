#!/usr/bin/env python3
"""Makes pinocchio.json: where our test robots really are after a while.

Pinocchio's articulated-body algorithm, integrated by Runge-Kutta of order 4 at a step
small enough that halving it changes nothing above 1e-9. The suite tests/physics holds
simd against these figures: its error must fall in proportion to the time step.
"""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pybullet_data

HERE = Path(__file__).resolve().parent
ASSETS = HERE.parent / "assets"
# Robots that others made, from the PyPI package `pybullet`.
OTHERS = "pybullet_data/"


def integrate(model, q, v, damping, seconds, h):
    data = model.createData()

    def rate(q, v):
        return pin.aba(model, data, q, v, -damping * v)

    for _ in range(round(seconds / h)):
        # On the tangent space at q; order 4 in v, and in q through the same stages.
        k1v, k1a = v, rate(q, v)
        k2v = v + h / 2 * k1a
        k2a = rate(pin.integrate(model, q, h / 2 * k1v), k2v)
        k3v = v + h / 2 * k2a
        k3a = rate(pin.integrate(model, q, h / 2 * k2v), k3v)
        k4v = v + h * k3a
        k4a = rate(pin.integrate(model, q, h * k3v), k4v)
        q = pin.integrate(model, q, h / 6 * (k1v + 2 * k2v + 2 * k3v + k4v))
        v = v + h / 6 * (k1a + 2 * k2a + 2 * k3a + k4a)
    return q, v


def case(name, urdf, start, rates, damping=0.0, seconds=0.5):
    if urdf.startswith(OTHERS):
        path = Path(pybullet_data.getDataPath()) / urdf.removeprefix(OTHERS)
    else:
        path = ASSETS / urdf
    model = pin.buildModelFromUrdf(str(path))
    # A continuous joint is (cos, sin) in Pinocchio: integrate from its zero.
    q0 = pin.integrate(model, pin.neutral(model), np.array(start, float))
    v0 = np.array(rates, float)
    coarse, _ = integrate(model, q0, v0, damping, seconds, 2e-4)
    q, v = integrate(model, q0, v0, damping, seconds, 1e-4)
    assert np.abs(pin.difference(model, coarse, q)).max() < 1e-9, name
    return {
        "name": name,
        "urdf": urdf,
        "start": start,
        "rates": rates,
        "damping": damping,
        "seconds": seconds,
        "joints": [model.names[i] for i in range(1, model.njoints)],
        "positions": pin.difference(model, pin.neutral(model), q).tolist(),
        "velocities": v.tolist(),
    }


def main():
    arm = "seven_arm/urdf/seven_arm.urdf"
    tree = "branching/urdf/branching.urdf"
    bent = [0.3, -0.5, 0.7, -1.1, 0.2, 0.9, -0.4]
    moving = [0.5, -0.3, 0.8, 0.2, -1.0, 0.6, 1.5]
    cases = [
        case("seven_arm", arm, bent, moving),
        case("seven_arm with damping", arm, bent, moving, damping=0.2),
        case("branching", tree, [0.4, 0.1, -0.6, 0.8, -0.3], [1.0, 0.2, -2.0, 1.5, 3.0]),
    ]
    for urdf, joints in {"kuka_iiwa/model.urdf": 7, "a1/a1.urdf": 12}.items():
        start = [0.3 * (-1) ** i * (i % 3 + 1) / 3 for i in range(joints)]
        rates = [0.5 * (-1) ** (i // 2) for i in range(joints)]
        cases.append(case(urdf, OTHERS + urdf, start, rates, seconds=0.3))
    out = {"made_by": f"make_converged.py with Pinocchio {pin.__version__}", "cases": cases}
    (HERE / "pinocchio.json").write_text(json.dumps(out, indent=1) + "\n")
    for made in cases:
        print(made["name"], made["joints"], np.round(made["positions"], 4))


main()
