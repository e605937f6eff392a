"""The cases in simd: the bench binary `truth`, and the closed forms of the physics suite."""

import functools
import json
import os
import subprocess

import numpy as np

CARGO = os.environ.get("CARGO", "cargo")


def run(repository, folder, asks):
    """Views of each (case, integrator, time step, instants), as exact.py has them."""
    requests = [{"case": case.request(), "integrator": integrator, "time_step": h, "instants": instants}
                for case, integrator, h, instants in asks]
    return [[(np.array(view["joints"]), view["root"] and np.array(view["root"])) for view in views]
            for views in ask(repository, folder, requests)]


def ask(repository, folder, requests):
    """The answer to each request, which `tests/reference/truth/main.rs` says the kinds of."""
    listing = folder / "asks.json"
    listing.write_text(json.dumps(requests))
    answers = subprocess.run([build(repository), str(listing)], stdout=subprocess.PIPE, check=True).stdout
    return [json.loads(answer) for answer in answers.splitlines()]


@functools.cache
def build(repository):
    command = [CARGO, "bench", "--locked", "--profile", "dev", "--workspace", "--bench", "truth", "--no-run"]
    built = subprocess.run([*command, "--message-format=json"], cwd=repository, stdout=subprocess.PIPE, check=True)
    for line in built.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message["target"]["name"] == "truth":
            return message["executable"]
    raise RuntimeError("cargo built no bench called truth")


def closed_forms(repository):
    """What the tests of formulas print, and whether all of them passed."""
    command = [CARGO, "test", "--locked", "--workspace", "--test", "physics", "--", "--nocapture",
               "--test-threads=1", "closed_forms"]
    done = subprocess.run(command, cwd=repository, stdout=subprocess.PIPE, text=True)
    mark = "closed form "
    lines = [line.split(mark, 1)[1] for line in done.stdout.splitlines() if mark in line]
    return [json.loads(line) for line in lines], done.returncode == 0
