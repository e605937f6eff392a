#!/usr/bin/env python3
"""Installs the files of dist/ on empty systems, and does the main job there. `make dist-check` runs it.

The archive goes into an empty folder, and the wheels into a new virtual environment. The Debian package
goes into a Debian that mmdebstrap makes (as root: it needs chroot). If podman is installed, the programs
go into an image. In each a daemon starts, loads a robot and sets a joint, which is then read back.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import venv
from collections.abc import Callable
from pathlib import Path

from release import PROGRAMS, REPOSITORY, run, target_folder

DIST = REPOSITORY / "dist"
ROBOT = REPOSITORY / "tests" / "assets" / "Bench_Arm-1.2 rev B"
# The oldest supported Debian.
SUITE = "bookworm"
MIRROR = "http://deb.debian.org/debian"
# Addresses of a daemon that must not meet another: two free ports.
FREE = ["--listen", "127.0.0.1:0", "--zenoh", "tcp/127.0.0.1:0"]
# Timeout of a command, seconds: longer ones hang.
HUNG = 120

SCRIPT = """
import sys
import simd_client.pybullet as p

# Another daemon may be on this machine.
p.connect(p.DIRECT, options="--new")
p.setGravity(0, 0, -9.81)
arm = p.loadURDF(sys.argv[1], useFixedBase=1)
p.setJointMotorControl2(arm, 0, p.POSITION_CONTROL, targetPosition=0.5)
for _ in range(240):
    p.stepSimulation()
position = p.getJointState(arm, 0)[0]
assert abs(position - 0.5) < 0.01, position
p.disconnect()
"""


def main() -> None:
    """Checks all packages, with a line for each: name, size and duration."""
    for package in sorted(DIST.iterdir()):
        print(f"{package.stat().st_size / 1e6:8.2f} MB  {package.name}")
    checks: list[tuple[str, Callable[[Path], None]]] = [
        ("the archive in an empty folder", check_archive),
        ("the wheels in a new environment", check_wheels),
        ("the Debian package in an empty Debian", check_package),
    ]
    if shutil.which("podman"):
        checks.append(("the image on an empty Debian", check_image))
    else:
        print("podman is not there: no image is built")
    only = sys.argv[1:]
    for title, check in checks:
        if only and check.__name__.removeprefix("check_") not in only:
            continue
        began = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="simd-check-") as scratch:
            check(Path(scratch))
        print(f"{time.monotonic() - began:8.1f} s   {title}: works", flush=True)


def one(pattern: str) -> Path:
    """Returns the one file of this name in dist/."""
    found = list(DIST.glob(pattern))
    if len(found) != 1:
        raise SystemExit(f"there are {len(found)} files {pattern} in {DIST}: `make dist` makes one")
    return found[0]


def check_archive(scratch: Path) -> None:
    """Unpacks and runs the archive, without this system's programs on the PATH."""
    with tarfile.open(one("simd-*-linux.tar.xz")) as archive:
        archive.extractall(scratch, filter="data")
    (root,) = scratch.iterdir()
    for place in (
        "share/man/man1/simd.1.gz",
        "share/man/man1/simd-camera.1.gz",
        "share/man/man1/simctl-joint-set.1.gz",
        "share/bash-completion/completions/simctl",
        "share/doc/simd/THIRD-PARTY-LICENSES.txt",
        "lib/systemd/system/simd@.service",
        "lib/sysusers.d/simd.conf",
        "LICENSE",
    ):
        assert (root / place).stat().st_size > 0, place
    environment = {"PATH": str(root / "bin"), "HOME": str(scratch)}

    def there(name: str) -> list[str]:
        return [str(root / "bin" / name)]

    main_job(there, ROBOT, ["--config", str(root / "etc" / "simd" / "simd.toml")], environment)


def check_wheels(scratch: Path) -> None:
    """Runs the README's line, then a PyBullet script that finds its daemon automatically."""
    venv.create(scratch / "venv", with_pip=True)
    programs = scratch / "venv" / "bin"
    wheels = [one("simd_daemon-*.whl"), one("simd_client-*.whl")]
    run(programs / "pip", "install", "--quiet", "--disable-pip-version-check", *wheels)
    (urdf,) = ROBOT.glob("urdf/*.urdf")
    environment = {"PATH": "/nowhere", "HOME": str(scratch)}
    script = scratch / "script.py"
    script.write_text(SCRIPT)
    # Neither is the environment activated nor its folder on the PATH.
    run(programs / "python", script, urdf, env=environment, timeout=HUNG)
    # Does it in one process.
    run(programs / "pip", "install", "--quiet", "--disable-pip-version-check", one("simd_embedded-*.whl"))
    script.write_text(SCRIPT.replace("--new", "--embedded"))
    run(programs / "python", script, urdf, env=environment, timeout=HUNG)
    main_job(lambda name: [str(programs / name)], ROBOT, [], environment)
    run(programs / "pip", "uninstall", "--quiet", "--yes", "simd-daemon")
    assert not any((programs / name).exists() for name in PROGRAMS)


def check_package(scratch: Path) -> None:
    """Installs the package, runs it as its unit does, installs it again over a changed configuration, removes
    and purges it."""
    package = one("simd_*.deb")
    if shutil.which("lintian"):
        # Suppressed checks do not apply outside of Debian: a bug to close, and an address if none is given.
        left_out = "initial-upload-closes-no-bugs,bogus-mail-host,bogus-mail-host-in-debian-changelog"
        run("lintian", "--allow-root", "--fail-on=error,warning", f"--suppress-tags={left_out}", package)
    root = scratch / "root"
    unpack_empty_system(root)
    shutil.copy(package, root / "tmp" / "simd.deb")
    shutil.copytree(ROBOT, root / "srv" / "arm")
    apt = ["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "--quiet=2", "--yes", "--no-install-recommends"]

    inside(root, *apt, "update")
    inside(root, *apt, "install", "/tmp/simd.deb")
    assert inside(root, "id", "-gn", "simd").strip() == "simd"
    assert inside(root, "stat", "-c", "%U:%G %a", "/var/lib/simd").strip() == "simd:simd 750"
    inside(root, "test", "-L", "/etc/systemd/system/multi-user.target.wants/simd.service")
    inside(root, "systemd-analyze", "verify", "--man=no", "simd.service", "simd@lab.service")
    for unit in ("simd.service", "simd@.service"):
        command = started_by(root, unit, "lab")
        shutil.copy(root / "etc/simd/simd.toml", root / "etc/simd/lab.toml")
        as_user = ["chroot", "--userspec=simd:simd", str(root)]
        main_job(lambda name: as_user + (command[:1] if name == "simd" else [name]), Path("/srv/arm"), command[1:])

    # As in a container: without root, and with a read-only file system.
    line = 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && exec chroot --userspec=65532:65532 "$0" "$@"'
    read_only = ["unshare", "--mount", "--propagation=private", "sh", "-ec", line, str(root)]
    main_job(lambda name: [*read_only, name], Path("/srv/arm"), ["--config", "/etc/simd/simd.toml"])

    settings = root / "etc" / "simd" / "simd.toml"
    settings.write_text(settings.read_text() + "\nlog = \"warn\"\n")
    inside(root, *apt, "install", "--reinstall", "/tmp/simd.deb")
    assert 'log = "warn"' in settings.read_text(), "an upgrade keeps what the operator changed"
    inside(root, *apt, "remove", "simd")
    assert settings.is_file() and not (root / "usr/bin/simd").exists()
    (root / "etc/simd/lab.toml").unlink()
    inside(root, *apt, "purge", "simd")
    left = [path for folder in ("etc", "usr", "var/lib", "lib") for path in (root / folder).rglob("*simd*")]
    left = [path for path in left if "sysusers" not in str(path)]
    assert not left, left


def check_image(scratch: Path) -> None:
    """Runs the Containerfile's last stage on an empty Debian, without root, without capabilities and
    read-only.

    The packed binaries replace the results of its build stages, whose base images come from a registry.
    """
    runtime = ["--runtime", "runc"] if shutil.which("runc") else []
    programs = scratch / "src" / "target" / "release"
    programs.mkdir(parents=True)
    wanted = [*(f"bin/{name}" for name in PROGRAMS), "share/doc/simd/THIRD-PARTY-LICENSES.txt"]
    with tarfile.open(one("simd-*-linux.tar.xz")) as archive:
        for member in archive.getmembers():
            if member.name.split("/", 1)[1:] in ([name] for name in wanted):
                member.name = Path(member.name).name
                archive.extract(member, programs, filter="data")
    run("tar", "--create", "--file", scratch / "built.tar", "--directory", scratch, "src")
    images = {name: f"localhost/simd-check-{name}" for name in ("debian", "built", "image")}
    try:
        run("podman", "import", "--quiet", empty_system(), images["debian"])
        run("podman", "import", "--quiet", scratch / "built.tar", images["built"])
        text = (REPOSITORY / "server/packaging/Containerfile").read_text()
        last = text[text.rindex("FROM ${BASE}") :]
        file = scratch / "Containerfile"
        file.write_text(f"ARG BASE\nFROM {images['built']} AS build\n{last}")
        flags = ["--quiet", "--format", "docker", "--isolation", "chroot", "--network", "host"]
        base = ["--build-arg", f"BASE={images['debian']}"]
        run("podman", "build", *flags, *base, "--file", file, "--tag", images["image"], REPOSITORY)
        started = ["podman", *runtime, "run", "--rm", "--read-only", "--cap-drop", "all", "--network", "host"]
        # podman's limits may exceed the limits of this user, and its health checks need systemd.
        started += ["--ulimit=nofile=1024:1024", "--ulimit=nproc=1024:1024", "--no-healthcheck"]
        started += ["--volume", f"{ROBOT}:/srv/arm:ro"]

        def there(name: str) -> list[str]:
            return [*started, "--entrypoint", f"/usr/bin/{name}", images["image"]]

        main_job(there, Path("/srv/arm"), ["--config", "/etc/simd/simd.toml"])
    finally:
        subprocess.run(["podman", "rmi", "--force", *images.values()], stdout=subprocess.DEVNULL, check=False)


def unpack_empty_system(root: Path) -> None:
    """Files of an empty Debian, which uses this system's network."""
    root.mkdir()
    run("tar", "--extract", "--numeric-owner", "--file", empty_system(), "--directory", root)
    for name in ("resolv.conf", "hosts"):
        shutil.copy(Path("/etc") / name, root / "etc" / name)


def empty_system() -> Path:
    """An archive of Debian's essential packages and apt, made once by mmdebstrap."""
    kept = target_folder() / "packages" / f"{SUITE}.tar"
    if not kept.is_file():
        if not shutil.which("mmdebstrap"):
            raise SystemExit("mmdebstrap is not there: apt-get install mmdebstrap")
        kept.parent.mkdir(parents=True, exist_ok=True)
        began = kept.with_suffix(".part.tar")
        run("mmdebstrap", "--quiet", "--mode=root", "--variant=minbase", SUITE, began, MIRROR)
        began.rename(kept)
    return kept


def inside(root: Path, *command: str) -> str:
    """Returns the output of a command in the other system, with its /proc mounted."""
    line = 'mount -t proc proc "$0/proc" && exec chroot "$0" "$@"'
    return run("unshare", "--mount", "--propagation=private", "sh", "-ec", line, root, *command, stderr=subprocess.STDOUT)


def started_by(root: Path, unit: str, instance: str) -> list[str]:
    """Returns the command of an installed unit."""
    text = (root / "lib/systemd/system" / unit).read_text()
    (line,) = [line for line in text.splitlines() if line.startswith("ExecStart=")]
    return shlex.split(line.removeprefix("ExecStart=").replace("%i", instance))


def main_job(
    program: Callable[[str], list[str]], robot: Path, flags: list[str], environment: dict[str, str] | None = None
) -> None:
    """Starts a daemon, loads a robot, sets a joint, steps, reads it, and stops the daemon cleanly."""
    if environment is None:
        environment = {"PATH": os.environ["PATH"], "HOME": "/"}
    began = time.monotonic()
    daemon = subprocess.Popen(
        [*program("simd"), *flags, *FREE, "--paused"], stdout=subprocess.PIPE, text=True, env=environment, cwd="/"
    )
    try:
        assert daemon.stdout is not None
        ready = daemon.stdout.readline()
        print(f"{(time.monotonic() - began) * 1e3:8.1f} ms  until the daemon listens")
        endpoint = next(word for word in ready.split() if word.startswith("http://"))

        def simctl(*arguments: str) -> str:
            command = [*program("simctl"), "--endpoint", endpoint, *arguments]
            return run(*command, env=environment, timeout=HUNG, cwd="/")

        simctl("robot", "load", str(robot), "--fixed", "--name", "arm")
        simctl("joint", "set", "arm", "shoulder=0.5")
        simctl("sim", "step", "2000")
        (joint,) = json.loads(simctl("joint", "get", "arm", "-o", "json"))["joints"]
        assert abs(joint["position"] - 0.5) < 1e-3, joint
        daemon.terminate()
        assert daemon.wait(HUNG) == 0
    finally:
        daemon.kill()
        daemon.wait()


if __name__ == "__main__":
    main()
