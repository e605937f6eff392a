#!/usr/bin/env python3
"""simd, MuJoCo and PyBullet against the truth; started by `make truth`.

Runs the cases of tests/reference/cases.py in each at 0.1, 0.25, 1 and 4 ms, and two swings for a minute.
Also runs the closed forms of the physics suite, and ten times as many of its random worlds. Writes
report.md, report.json and plots into target/truth. Ends with status 1 if simd breaks a promise of the
report.
"""

import argparse
import json
import sys
from importlib.metadata import version
from math import isfinite, log
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[2]
sys.path.insert(0, str(HERE.parent))

import exact  # noqa: E402
import in_mujoco  # noqa: E402
import in_pybullet  # noqa: E402
import in_simd  # noqa: E402
import plots  # noqa: E402
import robots  # noqa: E402
from cases import TIME_STEPS, cases, swings  # noqa: E402

LOOKS = 40
"""Number of instants of a case; multiples of every time step."""
UNSTABLE = 10.0
"""Error, rad or m, from which a run counts as diverged."""
ALLOWED = {"Euler": 1.05, "Leapfrog": 0.05}
"""Maximum ratio of simd's error to MuJoCo Euler's in passive and smooth cases."""
NO_WORSE = 1.02
"""Maximum ratio of leapfrog's error to Euler's, in any case."""
ORDERS = {"Euler": (1 / 1.3, 1.3), "Leapfrog": (1.8, 2.2)}
"""Slopes of a correct method's error; leapfrog's in passive and smooth cases."""
UNRESOLVED = 1e-9
"""Accuracy of the reference; smaller errors give no slope."""


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--out", type=Path, default=REPOSITORY / "target" / "truth")
    arguments.add_argument("--only", help="run only cases whose names contain this")
    options = arguments.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    chosen = [case for case in cases() if not options.only or options.only in case.name]

    grids = {case.name: instants(case) for case in chosen}
    asks = [(case, method, h, grids[case.name]) for case in chosen for method in ORDERS for h in TIME_STEPS]
    answers = in_simd.run(REPOSITORY, options.out, asks)
    own = {(case.name, method, h): views for (case, method, h, _), views in zip(asks, answers, strict=True)}
    results = []
    for case in chosen:
        print(case.name, flush=True)
        results.append(measure(case, grids[case.name], own, options.out))
    forms, all_met = in_simd.closed_forms(REPOSITORY)
    energies = [minute(case, forms) for case in swings()]
    properties, all_held = in_simd.properties(REPOSITORY)

    for result in results:
        result["plot"] = plots.case(result, options.out)
    draw_overviews(results, options.out)
    figures = {"cases": results, "closed_forms": forms, "energies": energies, "properties": properties}
    (options.out / "report.json").write_text(json.dumps(figures, indent=1) + "\n")
    text = report(results, (forms, all_met), energies, (properties, all_held))
    (options.out / "report.md").write_text(text)
    failed = [result["name"] for result in results if not result["held"]]
    print(f"written: {options.out / 'report.md'}, with {len(results)} cases and {len(forms)} figures of closed forms")
    if failed or not all_met or not forms or not all_held:
        sys.exit(f"not held: {failed or ('closed forms' if not all_met or not forms else 'random worlds')}")


def instants(case):
    """About LOOKS of them, at multiples of the largest time step."""
    coarse = max(TIME_STEPS)
    every = max(1, round(case.seconds / coarse / LOOKS))
    return [round(coarse * every * (k + 1), 9) for k in range(round(case.seconds / coarse / every))]


def measure(case, grid, own, folder):
    reference, accuracy = exact.reference(case, grid)

    def errors(views):
        found = (exact.difference(a, b) for a, b in zip(views, reference, strict=True))
        return [error if isfinite(error) and error < UNSTABLE else None for error in found]

    found = {"simd": {h: errors(own[case.name, "Leapfrog", h]) for h in TIME_STEPS},
             "simd Euler": {h: errors(own[case.name, "Euler", h]) for h in TIME_STEPS},
             "MuJoCo": {h: errors(in_mujoco.run(case, h, grid)) for h in TIME_STEPS},
             # Four evaluations a step: at equal cost its step is four times as long.
             "MuJoCo RK4, 4 h": {h: errors(in_mujoco.run(case, 4 * h, grid, in_mujoco.mujoco.mjtIntegrator.mjINT_RK4))
                                 for h in TIME_STEPS if 4 * h <= max(TIME_STEPS)}}
    if case.drive:
        fast = in_mujoco.mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        found["MuJoCo implicitfast"] = {h: errors(in_mujoco.run(case, h, grid, fast)) for h in TIME_STEPS}
    if in_pybullet.can(case):
        found["PyBullet"] = {h: errors(in_pybullet.run(case, h, grid, folder)) for h in TIME_STEPS}
    at_1_ms = {engine: plots.worst(by_step[1e-3]) for engine, by_step in found.items()}
    own_error, peer = at_1_ms["simd"], at_1_ms["MuJoCo"]
    exactly = own_error is not None and own_error < plots.ROUNDING
    ratio = own_error / peer if own_error and peer and not exactly else None
    order = None if exactly else slope(found["simd"])
    held = all(holds(case, method, found[name], found) for method, name in
               [("Leapfrog", "simd"), ("Euler", "simd Euler")])
    result = {
        "name": case.name, "subject": case.subject, "accuracy": accuracy, "instants": grid, "errors": found,
        "unit": "rad or m" if case.free or robots.slides(case.urdf) else "rad", "at_1_ms": at_1_ms,
        "ratio": ratio, "order": order, "held": held,
    }
    result["message"] = message(result)
    return result


def minute(case, forms):
    """Returns the change of a swing's energy in a minute: simd's figure from the line of its test."""
    own = [form["found"] for form in forms if form["form"].startswith(f"energy over a minute, {case.name}:")]
    kinds = in_mujoco.mujoco.mjtIntegrator
    return {"name": case.name, "simd": own[0] if own else None,
            "MuJoCo": in_mujoco.energy_change(case, 1e-3, kinds.mjINT_EULER),
            "MuJoCo RK4, 4 h": in_mujoco.energy_change(case, 4e-3, kinds.mjINT_RK4)}


def holds(case, method, own, found):
    """Whether an integrator keeps the report's promises."""
    error, peer = plots.worst(own[1e-3]), plots.worst(found["MuJoCo"][1e-3])
    if error is None:
        return False
    smooth, exactly = case.subject == "smooth", error < plots.ROUNDING
    near = not smooth or exactly or peer is None or error <= ALLOWED[method] * peer
    lowest, highest = ORDERS[method]
    judged = smooth or method == "Euler"
    straight = exactly or not judged or error < UNRESOLVED or lowest < slope(own) < highest
    euler = [plots.worst(found["simd Euler"][h]) for h in TIME_STEPS]
    no_worse = method == "Euler" or all(
        plots.worst(own[h]) is not None and (other is None or plots.worst(own[h]) <= NO_WORSE * other + UNRESOLVED)
        for h, other in zip(TIME_STEPS, euler, strict=True))
    return near and straight and no_worse


def slope(by_step):
    """Returns the growth of the error with the time step, from the finest to 1 ms: 1 is first order."""
    fine, coarse = min(by_step), 1e-3
    errors = [plots.worst(by_step[h]) for h in (fine, coarse)]
    if None in errors or min(errors) <= 0.0:
        return 0.0
    return log(errors[1] / errors[0]) / log(coarse / fine)


def message(result):
    own, peer = result["at_1_ms"]["simd"], result["at_1_ms"]["MuJoCo"]
    if own is None:
        return "simd has left the case"
    if result["order"] is None:
        return "simd is exact at 1 ms, to rounding"
    if peer is None:
        return f"simd is within {own:.1e} {result['unit']} at 1 ms, where MuJoCo's Euler is unstable"
    if abs(result["ratio"] - 1) < 1e-3:
        return f"simd and MuJoCo's Euler make the same error, {own:.1e} {result['unit']} at 1 ms"
    nearer = "less" if result["ratio"] < 1 else "more"
    times = max(result["ratio"], 1 / result["ratio"])
    return f"simd is off by {own:.1e} {result['unit']} at 1 ms, {times:.3g} times {nearer} than MuJoCo's Euler"


def draw_overviews(results, folder):
    for subjects, title, name in [
        (("smooth",), "Passive, smooth: leapfrog is of second order", "passive_smooth.png"),
        (("kinked", "driven"), "Friction, limits, mimic, actuators: simd does not soften them", "rows.png"),
    ]:
        chosen = [result for result in results if result["subject"] in subjects]
        if chosen:
            plots.overview(chosen, title, folder / name)
    plots.orders([result for result in results if result["order"]], folder / "order.png")


ABOVE = """\
# simd against the truth

Made by `make truth`: the cases of `tests/reference/cases.py`, and the closed forms and random worlds of `tests/physics`.

Reference: Pinocchio {pinocchio}, Runge-Kutta of order 4 from event to event. MuJoCo {mujoco}, Euler. PyBullet
{pybullet}, DIRECT.

**Largest ratio to MuJoCo's Euler at 1 ms, passive smooth cases: {ratio:.4f}; allowed {allowed}. With simd's own
Euler {euler_ratio:.4f}; allowed {euler_allowed}.**
**Closed forms: {met} of {forms} figures met{failed}. Random worlds: {held} of {properties} properties held{missing}.**

![passive, smooth](passive_smooth.png)

![rows and actuators](rows.png)

![order](order.png)

## Cases

Largest error of a joint or the root over the case at 1 ms, rad or m. `simd` is leapfrog, `MuJoCo` Euler. RK4 has a step
of 4 ms: four evaluations for each of which simd's step has one. Order: how leapfrog's error goes with the time step from
0.1 to 1 ms. Held: for passive smooth cases second order (1.8 to 2.2) and a ratio of {allowed} at the most; at no time step
worse than Euler; simd's Euler of first order, and within {euler_allowed} of MuJoCo's. Exact: below {rounding:.0e}.

| case | kind | reference to | simd | simd Euler | MuJoCo | MuJoCo RK4, 4 ms | PyBullet | simd / MuJoCo | order | held |
|---|---|---|---|---|---|---|---|---|---|---|
"""

BETWEEN = """
MuJoCo's limits, dry friction and equalities are soft by design, with a time constant of 20 ms; its errors there are not
for want of accuracy. The dampers of its actuators are explicit in Euler: a stiff one with a limit switches from limit
to limit. Its `implicitfast`, which is drawn beside it for cases with actuators, has them implicit.

PyBullet. {of_pybullet}

## Closed forms

From the tests below `tests/physics/closed_forms`, which say formula, source and why this tolerance, and of `tests/physics/energy.rs`.

| what | time step, ms | formula | simd | difference | tolerance | met |
|---|---|---|---|---|---|---|
"""

ENERGY = """
## Energy over a minute

Two robots swing from rest at 1 ms; RK4 has a step of 4 ms. The largest change of energy, as a part of that above the lowest
point that the swing comes to.

| robot | simd | MuJoCo | MuJoCo RK4, 4 ms |
|---|---|---|---|
"""

RANDOM = """
## Random bodies and worlds

Property tests of `tests/physics`, with ten times as many seeds as `make test` has. Largest: of all seeds what came nearest to its
bound, as a part of that; of what comes to rest it is the bound of energy.

| what holds | seeds | largest | held |
|---|---|---|---|
"""


def report(results, of_forms, energies, of_properties):
    (forms, all_met), (properties, all_held) = of_forms, of_properties
    smooth = [result["ratio"] for result in results if result["subject"] == "smooth" and result["ratio"]]
    euler = [result["at_1_ms"]["simd Euler"] / result["at_1_ms"]["MuJoCo"] for result in results
             if result["subject"] == "smooth" and (result["at_1_ms"]["MuJoCo"] or 0.0) > plots.ROUNDING]
    text = ABOVE.format(
        pinocchio=version("pin"), mujoco=version("mujoco"), pybullet=version("pybullet"), allowed=ALLOWED["Leapfrog"],
        euler_allowed=ALLOWED["Euler"], euler_ratio=max(euler, default=float("nan")),
        ratio=max(smooth, default=float("nan")), met=sum(map(met, forms)), forms=len(forms),
        failed="" if all_met else ", and a test failed", held=sum(not each["failed"] for each in properties),
        properties=len(in_simd.WIDE), missing="" if all_held else ", and a test failed", rounding=plots.ROUNDING)
    text += "".join(map(case_line, results))
    text += BETWEEN.format(of_pybullet=in_pybullet.__doc__.split("\n\n")[1].strip())
    text += "".join(map(form_line, forms)) + ENERGY + "".join(map(energy_line, energies))
    text += RANDOM + "".join(map(property_line, properties)) + "\n## Each case\n"
    return text + "".join(f"\n![{result['name']}]({result['plot']})\n" for result in results)


def case_line(result):
    at = result["at_1_ms"]
    cells = [f"[{result['name']}]({result['plot']})", result["subject"], f"{result['accuracy']:.0e}",
             *(figure(at[engine]) for engine in ("simd", "simd Euler", "MuJoCo", "MuJoCo RK4, 4 h")),
             figure(at["PyBullet"]) if "PyBullet" in at else "no armature",
             f"{result['ratio']:.4f}" if result["ratio"] else "-",
             f"{result['order']:.3f}" if result["order"] is not None else "exact", yes(result["held"])]
    return f"| {' | '.join(cells)} |\n"


def form_line(form):
    apart = abs(form["found"] - form["expected"])
    cells = [form["form"], f"{form['time_step'] * 1e3:g}", f"{form['expected']:.9g}", f"{form['found']:.9g}",
             f"{apart:.1e}", f"{form['tolerance']:.1e}", yes(met(form))]
    return f"| {' | '.join(cells)} |\n"


def energy_line(energy):
    cells = [energy["name"], *(figure(energy[engine]) for engine in ("simd", "MuJoCo", "MuJoCo RK4, 4 h"))]
    return f"| {' | '.join(cells)} |\n"


def property_line(found):
    failed = ", ".join(map(str, found["failed"]))
    largest = "no number" if found["largest"] is None else f"{found['largest']:.3g}"
    cells = [found["property"], str(found["seeds"]), largest, f"**not by seeds {failed}**" if failed else yes(True)]
    return f"| {' | '.join(cells)} |\n"


def figure(value):
    return "unstable" if value is None else f"{value:.2e}"


def yes(held):
    return "yes" if held else "**no**"


def met(form):
    return abs(form["found"] - form["expected"]) <= form["tolerance"]


if __name__ == "__main__":
    main()
