"""The cases in simd: the bench binary `truth`, and the closed forms of the physics suite."""

import functools
import json
import os
import subprocess

import numpy as np

CARGO = os.environ.get("CARGO", "cargo")


def run(repository, folder, asks):
    """Returns views of each (case, integrator, time step, instants), in the form of exact.py."""
    requests = [{"case": case.request(), "integrator": integrator, "time_step": h, "instants": instants}
                for case, integrator, h, instants in asks]
    return [[(np.array(view["joints"]), view["root"] and np.array(view["root"])) for view in views]
            for views in ask(repository, folder, requests)]


def ask(repository, folder, requests):
    """Returns the answer to each request; `tests/reference/truth/main.rs` lists their kinds."""
    listing = folder / "asks.json"
    listing.write_text(json.dumps(requests))
    answers = subprocess.run([build(repository), str(listing)], stdout=subprocess.PIPE, check=True).stdout
    return [json.loads(answer) for answer in answers.splitlines()]


@functools.cache
def build(repository):
    command = [CARGO, "bench", "--locked", "--profile", os.environ.get("PROFILE", "dev"), "--workspace", "--bench", "truth", "--no-run"]
    command += ["--features", os.environ["FEATURES"]] if "FEATURES" in os.environ else []
    built = subprocess.run([*command, "--message-format=json"], cwd=repository, stdout=subprocess.PIPE, check=True)
    for line in built.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message["target"]["name"] == "truth":
            return message["executable"]
    raise RuntimeError("cargo built no bench called truth")


def closed_forms(repository):
    """Returns the output of the tests of formulas and of the energy over a minute, and whether all of them
    passed."""
    arguments = ["--test-threads=1", "closed_forms", "a_minute_of_leapfrog_keeps_the_energy"]
    found, passed = physics(repository, "closed form ", arguments)
    # NaN arrives as None.
    return [form | {"found": float("nan")} if form["found"] is None else form for form in found], passed


WIDE = {
    "PASSIVE_WORLDS": ("heaps_of_random_hulls", 120),
    "BOUNCING_WORLDS": ("heaps_that_bounce", 80),
    "COLLIDING_WORLDS": ("momentum_is_kept_where", 120),
    "FALLING_TREES": ("random_trees_that_fall", 120),
    "SEAMS": ("what_slides_over_a_joint_of_a_floor", 3_000),
    "FLOATING_TREES": ("the_centre_of_mass_of_a_floating_robot", 3_000),
    "HULL_HEAPS": ("heaps_of_a_hundred_hulls", 20),
    "TOWERS": ("random_towers", 300),
    "HELD_BODIES": ("what_friction_can_hold_stays_on_a_table", 120),
    "WHEELS": ("a_wheel_keeps_its_speed_and_its_line", 30),
    "MESH_PAIRS": ("links_push_each_other_where_their_meshes_meet", 400),
    "SPINNING_BODIES": ("free_bodies_keep_energy", 2000),
}
"""The variable with the number of seeds of a property test, the test, and ten times the suite's number."""


def properties(repository):
    """Returns the output of the property tests of WIDE by name, and whether all of them ran and passed."""
    seeds = {variable: str(count) for variable, (_, count) in WIDE.items()}
    found, passed = physics(repository, "random property ", [test for test, _ in WIDE.values()], seeds)
    counts = sorted(line["seeds"] for line in found)
    return sorted(found, key=lambda line: line["property"]), passed and counts == sorted(map(int, seeds.values()))


def physics(repository, mark, arguments, variables=None):
    """Runs tests of the physics suite. Returns their output after a mark, and whether all of them passed."""
    command = [CARGO, "test", "--locked", "--workspace", "--test", "physics", "--", "--nocapture", *arguments]
    environment = os.environ | (variables or {})
    done = subprocess.run(command, cwd=repository, env=environment, stdout=subprocess.PIPE, text=True)
    lines = [line.split(mark, 1)[1] for line in done.stdout.splitlines() if mark in line]
    return [json.loads(line) for line in lines], done.returncode == 0
