#!/usr/bin/env python3
"""Microseconds a step of simd beside MuJoCo, PyBullet and rapier; started by `make bench`.

One run, one thread each. In every round each simulator steps each robot for a few milliseconds, in turn.
Other load on the machine thus affects all alike. Writes peers.json and peers.png into target/bench.
"""

import argparse
import gc
import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from statistics import median

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
sys.path.insert(0, str(HERE / "peers"))

import contacts_mujoco  # noqa: E402
import contacts_pybullet  # noqa: E402
import figures  # noqa: E402
import in_mujoco  # noqa: E402
import in_pybullet  # noqa: E402
import rays  # noqa: E402
import robots  # noqa: E402
import scenes as contact  # noqa: E402
from worker import Worker  # noqa: E402

ENGINES = ["simd", "MuJoCo", "PyBullet", "rapier"]
BATCH = 0.004
"""Approximate duration of a batch of steps, seconds: less than most schedulers' slice."""
CROWD_BATCH = 0.02
"""Duration of a batch of many robots: their memory is large and threads must wake up, but both end in a small
part of it."""
EULER = "simd, euler"
"""simd with the integrator that equals MuJoCo's Euler, for the robots."""
CONTACT_ENGINES = ["simd", "MuJoCo", "PyBullet"]
"""Engines of the scenes with contact, all awake."""
THREADS = {"simd": "simd, 2 threads", "MuJoCo": "MuJoCo, 2 threads"}
"""Engines with two threads, for many robots."""
BESIDE = "simd, two worlds"
"""Engine for many robots: on one thread, while another process does the same on another processor."""
ASLEEP = {"simd": "simd, may sleep", "MuJoCo": "MuJoCo, may sleep"}
"""Engines of the stack in which still bodies may sleep."""
LENGTHS = [2, 4, 6, 8, 12, 16, 20, 30, 40, 50, 60]
"""Joints of the chains."""

NOTES = """
All: 1 ms a step, one thread, double precision. First table: no shapes and so no contacts, limits on, each joint held
at a bent pose that each batch starts from. Ratios are of batches of one round, and below 1 where it is faster than
MuJoCo.
simd      Simulation::step; actuators as a robot is spawned with, default gains, effort limits. Its default integrator, leapfrog;
          `simd, euler` is the one that equals MuJoCo's.
MuJoCo    {mujoco}, mj_step with nstep: its loop in C. Euler. Position actuators with simd's stiffness; simd's damping
          as joint damping, since Euler integrates that implicitly: as an actuator's kv it is not stable at these gains.
          A mimic joint is the equality that it makes of it.
PyBullet  {pybullet}, DIRECT, one stepSimulation a step called from Python. POSITION_CONTROL; its solver's
          defaults; inertia from the file, fixed links merged. It ignores mimic: the follower has a motor of its own.
rapier    0.36.1, f64, optimised as simd-core is; its multibody joints, fixed links merged; ForceBased motors of simd's
          gains, limits, mimic; one substep; no sleep. PhysicsPipeline::step, with islands and a broad phase of nothing.
Contact:  another table. Friction 0.8, no restitution, no contacts within a robot, no sleeping. It is timed after it
          has settled, from the same state each round. simd: circular cones, its defaults. MuJoCo: pyramidal cones, its
          default solver, for the spheres conjugate gradients, which take it the least time. The stack once more,
          where what is still may sleep: simd's default, MuJoCo's flag `sleep`. The heap is timed as it settles.
Many:     robots 3 m apart in one world, on one thread and on two. MuJoCo steps a world on one thread: with two,
          `mujoco.rollout` steps a world for each robot. Two worlds: on one thread, while another process steps such a world on
          the other processor, which two threads use too; where it is shared with other machines, they slow down both alike.
Rays: in one call from Python for MuJoCo and PyBullet (`mj_multiRay` with normals, `rayTestBatch` with numThreads=1), from
          one point. simd: PublishedState::cast_rays, which makes a tree of all shapes in each call and names what is hit.
Other MuJoCo: `explicit kv` is Euler with kv in the actuator and a sixth of the bandwidth, which still shakes the
          humanoid; `implicitfast` has kv in the actuator too, and holds simd's gains.
"""


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--rounds", type=int, default=60, help="rounds of the robots")
    arguments.add_argument("--chain-rounds", type=int, default=30, help="rounds of the chains")
    arguments.add_argument("--contact-rounds", type=int, default=15, help="rounds of the scenes with contact; 0 for none")
    arguments.add_argument("--crowd-rounds", type=int, default=40, help="rounds of many robots")
    arguments.add_argument("--out", type=Path, default=REPOSITORY / "target" / "bench")
    arguments.add_argument("--contact", default="", help="run only scenes with contact whose names contain this")
    options = arguments.parse_args()
    folder = options.out / "robots"
    folder.mkdir(parents=True, exist_ok=True)

    table = robots.robots(folder)
    chains = robots.chains(folder, LENGTHS)
    scenes = table + chains
    touching = contact.contact_scenes(folder) if options.contact_rounds else []
    crowded = [scene for scene in contact.crowds(touching) if options.contact in scene.name] if touching else []
    touching = [scene for scene in touching if options.contact in scene.name]
    held = [scene for scene in robots.crowds(folder) if options.contact in scene.name] if options.contact_rounds else []
    shining = [scene for scene in rays.scenes() if options.contact_rounds and options.contact in scene.name]
    worker = Worker(build_worker(), scenes + touching + shining + held + crowded, folder)
    load = os.getloadavg()
    cases = [Case(worker, index, scene, scene in table) for index, scene in enumerate(scenes)]
    run("robots", cases[: len(table)], options.rounds)
    run("chains", cases[len(table):], options.chain_rounds)
    contacts = [ContactCase(worker, len(scenes) + index, scene) for index, scene in enumerate(touching)]
    run("contacts", contacts, options.contact_rounds)
    casts = [RayCase(worker, len(scenes) + len(touching) + index, scene) for index, scene in enumerate(shining)]
    run("rays", casts, options.contact_rounds)
    first = len(scenes) + len(touching) + len(shining)
    workers = worker, worker.another()
    many = [HeldCrowd(workers, first + index, scene) for index, scene in enumerate(held)]
    many += [StandingCrowd(workers, first + len(held) + index, scene) for index, scene in enumerate(crowded)]
    run("crowds", many, options.crowd_rounds)
    for of in workers:
        of.close()

    of_robots = {case.name: figures.summary(case.rounds) for case in cases[: len(table)]}
    of_chains = {length: figures.summary(case.rounds) for length, case in zip(LENGTHS, cases[len(table):])}
    of_contacts = {case.name: figures.summary(case.rounds) for case in contacts}
    of_rays = {case.name: figures.summary(case.rounds) for case in casts}
    show(of_robots, of_chains, load)
    show_contacts(of_contacts, contacts)
    show_rays(of_rays, casts)
    of_crowds = {case.name: figures.summary(case.rounds) for case in many}
    show_crowds(of_crowds, many)
    result = {
        "machine": figures.machine(),
        "notes": notes(),
        "robots": of_robots,
        "chains": of_chains,
        "contacts": of_contacts,
        "rays": of_rays,
        "crowds": of_crowds,
        "held_within": {case.name: case.errors for case in cases + contacts + many},
        "batches_us_per_step": {case.name: case.rounds for case in cases + contacts},
    }
    (options.out / "peers.json").write_text(json.dumps(result, indent=1) + "\n")
    figures.plot(of_chains, ENGINES, options.out / "peers.png")
    print(f"written: {options.out / 'peers.json'}, {options.out / 'peers.png'}")


class Case:
    """A scene in each simulator."""

    batch = BATCH

    def __init__(self, worker, index, scene, in_table):
        self.name = scene.name
        joints = worker.joints(index)
        self.engines = {
            "simd": worker.engine("simd", index),
            "MuJoCo": in_mujoco.engine(scene, joints),
            "PyBullet": in_pybullet.engine(scene, joints),
            "rapier": worker.engine("rapier", index),
        }
        if in_table:
            kinds = in_mujoco.Settings
            self.engines[EULER] = worker.engine("euler", index)
            self.engines["explicit kv"] = in_mujoco.engine(scene, joints, kinds.EXPLICIT)
            self.engines["implicitfast"] = in_mujoco.engine(scene, joints, kinds.IMPLICIT)
        self.start()

    def start(self):
        self.steps = {name: steps_of(engine, self.batch) for name, engine in self.engines.items()}
        self.rounds = {name: [] for name in self.engines}
        self.errors = dict.fromkeys(self.engines, 0.0)

    def round(self, turn):
        """Times a batch in each simulator; each time another one is first."""
        names = list(self.engines)
        for name in names[turn % len(names):] + names[: turn % len(names)]:
            seconds, error = self.engines[name](self.steps[name])
            self.rounds[name].append(seconds / self.steps[name] * 1e6)
            self.errors[name] = max(self.errors[name], error)


class ContactCase(Case):
    """Times a scene with contact in each simulator that supports it."""

    def __init__(self, worker, index, scene):
        self.name, self.scene = scene.name, scene
        scene.joints = worker.joints(index) if scene.urdf else []
        self.engines = {"simd": worker.engine("simd", index), "MuJoCo": contacts_mujoco.engine(scene),
                        "PyBullet": contacts_pybullet.engine(scene)}
        if scene.things and not scene.heap:
            self.engines[ASLEEP["simd"]] = worker.engine("asleep", index)
            self.engines[ASLEEP["MuJoCo"]] = contacts_mujoco.engine(scene, sleep=True)
        self.start()


class RayCase(Case):
    """Times rays into a scene in each simulator that supports them; a batch consists of calls."""

    def __init__(self, worker, index, scene):
        self.name = scene.name
        sides = {"simd": rays.in_simd(worker, index, scene), "MuJoCo": rays.in_mujoco(scene),
                 "PyBullet": rays.in_pybullet(scene)}
        self.engines = {name: batch for name, (batch, _) in sides.items()}
        self.apart = {name: abs(known - sides["MuJoCo"][1]) for name, (_, known) in sides.items()}
        self.steps = dict.fromkeys(self.engines, 1)
        self.rounds = {name: [] for name in self.engines}
        self.errors = dict.fromkeys(self.engines, 0.0)


class HeldCrowd(Case):
    """Many robots that hold a pose without contact, on one thread and on two."""

    batch = CROWD_BATCH

    def __init__(self, workers, index, scene):
        self.name, self.drift = scene.name, None
        joints = workers[0].joints(index)
        self.engines = crowd_engines(workers, index) | {"MuJoCo": in_mujoco.engine(scene, joints)}
        self.start()


class StandingCrowd(Case):
    """Many standing robots. MuJoCo's two threads have a world for each robot."""

    batch = CROWD_BATCH

    def __init__(self, workers, index, scene):
        self.name, self.drift = scene.name, scene.drift
        scene.joints = workers[0].joints(index)
        self.engines = crowd_engines(workers, index) | {
            "MuJoCo": contacts_mujoco.engine(scene), THREADS["MuJoCo"]: contacts_mujoco.rollout(scene, 2)}
        self.start()


def crowd_engines(workers, index):
    """Figures of simd, one after the other in a round."""
    worker, other = workers
    return {BESIDE: worker.engine_beside(other, "simd", index), THREADS["simd"]: worker.engine("threads", index),
            "simd": worker.engine("simd", index)}


def steps_of(engine, batch):
    """Returns the number of steps in a batch."""
    steps = 10
    while True:
        seconds, _ = engine(steps)
        if seconds > batch / 4:
            return max(10, round(steps * batch / seconds))
        steps *= 2


def run(what, cases, rounds):
    gc.disable()
    for turn in range(rounds):
        if sys.stderr.isatty():
            print(f"\r{what}: round {turn + 1} of {rounds} ", end="", file=sys.stderr, flush=True)
        for case in cases:
            case.round(turn)
    gc.enable()


def show(of_robots, of_chains, load):
    chains = {f"chain of {length}": figure for length, figure in of_chains.items()}
    everything = of_robots | chains
    print(f"\nmicroseconds a step: median (5 % to 95 %); load average {load[0]:.1f} at the start")
    print(figures.table(everything, ENGINES, "us_per_step"))
    print("\nratio to MuJoCo's time")
    print(figures.table(everything, [name for name in ENGINES if name != figures.BASE], f"to_{figures.BASE}"))
    print("\nintegrators: microseconds a step")
    print(figures.table(of_robots, ["simd", EULER, "MuJoCo"], "us_per_step"))
    print("\nratio to MuJoCo's time")
    print(figures.table(of_robots, ["simd", EULER], f"to_{figures.BASE}"))
    print("\nother settings of MuJoCo: microseconds a step")
    print(figures.table(of_robots, ["MuJoCo", "explicit kv", "implicitfast"], "us_per_step"))
    print("\nover joints, a straight line through the chains")
    for engine in ENGINES:
        slope, explained = figures.slope(LENGTHS, [of_chains[n][engine]["us_per_step"]["median"] for n in LENGTHS])
        print(f"  {engine:10} {slope:8.3f} microseconds a joint, which explains {explained:.1%} of the variance")
    print(notes())


def show_contacts(of_contacts, cases):
    if not cases:
        return
    print("\nscenes with contact, microseconds a step: median (5 % to 95 %)")
    print(figures.table(of_contacts, CONTACT_ENGINES, "us_per_step"))
    print("\nratio to MuJoCo's time")
    print(figures.table(of_contacts, [name for name in CONTACT_ENGINES if name != figures.BASE], f"to_{figures.BASE}"))
    print("\nwhere what is still may sleep, microseconds a step")
    piles = {name: found for name, found in of_contacts.items() if ASLEEP["simd"] in found}
    print(figures.table(piles, list(ASLEEP.values()), "us_per_step"))
    for case in cases:
        for engine, error in case.errors.items():
            verdict = "" if error <= case.scene.drift else ": it does not stand, and the figure does not count"
            print(f"  {case.name}: in {engine} within {error:.1e} m{verdict}")


def show_rays(of_rays, cases):
    if not cases:
        return
    print("\nrays, microseconds a call, one thread: median (5 % to 95 %)")
    print(figures.table(of_rays, CONTACT_ENGINES, "us_per_step"))
    print("\nratio to MuJoCo's time")
    print(figures.table(of_rays, [name for name in CONTACT_ENGINES if name != figures.BASE], f"to_{figures.BASE}"))
    for case in cases:
        for engine, apart in case.apart.items():
            print(f"  {case.name}: in {engine} {(apart < 1e-3).mean():.2%} of the rays end within 1 mm of MuJoCo's")


def show_crowds(of_crowds, cases):
    if not cases:
        return
    print("\nmany robots, microseconds a step: median (5 % to 95 %)")
    print(figures.table(of_crowds, ["simd", BESIDE, "MuJoCo", *THREADS.values()], "us_per_step"))
    print("\nratio to MuJoCo's time on one thread")
    print(figures.table(of_crowds, ["simd", *THREADS.values()], f"to_{figures.BASE}"))
    for case in cases:
        one, beside, two = (case.rounds[name] for name in ("simd", BESIDE, THREADS["simd"]))
        alone, busy = (median(a / b for a, b in zip(of, two)) for of in (one, beside))
        print(f"  {case.name}: two threads are {alone:.2f} times as fast as one in the median round, "
              f"{min(one) / min(two):.2f} times by the fastest round of each, {busy:.2f} times as fast as one of two worlds")
        for engine, error in case.errors.items():
            if case.drift is not None and error > case.drift:
                print(f"  {case.name}: in {engine} within {error:.1e} m: it does not stand, and the figure does not count")


def notes():
    return NOTES.format(mujoco=version("mujoco"), pybullet=version("pybullet"))


def build_worker():
    """Builds the bench binary `peers`, and returns its path."""
    cargo = os.environ.get("CARGO", "cargo")
    command = [cargo, "bench", "--locked", "--profile", os.environ.get("PROFILE", "dev"), "--workspace", "--bench", "peers", "--no-run"]
    # Other features than those of an existing build would compile the daemon again.
    command += ["--features", os.environ["FEATURES"]] if "FEATURES" in os.environ else []
    built = subprocess.run([*command, "--message-format=json"], cwd=REPOSITORY, stdout=subprocess.PIPE, check=True)
    for line in built.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message["target"]["name"] == "peers":
            return message["executable"]
    raise RuntimeError("cargo built no bench called peers")


if __name__ == "__main__":
    main()
