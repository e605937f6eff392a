"""`python -m simd_client.pybullet [options] script.py [args]`: runs an
unchanged PyBullet script."""

from __future__ import annotations

import argparse
import os
import runpy
import shlex
import sys
from pathlib import Path

import simd_client.pybullet as pybullet
from simd_client import tls
from simd_client.pybullet import connections, import_hooks


def main(arguments: list[str] | None = None) -> None:
    """Runs the script as `python script.py args` would."""
    parser = argparse.ArgumentParser(
        prog="python -m simd_client.pybullet",
        description="Runs a PyBullet script on a running or a new simd daemon.",
    )
    parser.add_argument("--endpoint", help="endpoint of the daemon, for instance tcp/127.0.0.1:7447#lab")
    parser.add_argument("--new", action="store_true", help="start a new daemon, even if one is running")
    parser.add_argument(
        "--remove-robots", action="store_true", help="delete the script's robots at its end"
    )
    parser.add_argument("--limits", action="store_true", help="apply limits of effort and velocity in URDFs to motors")
    parser.add_argument("--mimic", action="store_true", help="let joints with <mimic> follow their leaders")
    parser.add_argument("--tls-ca", metavar="FILE", help="authority that signed the daemon's certificate")
    parser.add_argument("--tls-cert", metavar="FILE", help="certificate of the script, if the daemon asks for one")
    parser.add_argument("--tls-key", metavar="FILE", help="private key of that certificate")
    parser.add_argument("script", help="script to run")
    parser.add_argument("args", nargs=argparse.REMAINDER, help="arguments of the script")
    asked = parser.parse_args(arguments)
    script = Path(asked.script)
    if not script.is_file():
        parser.error(f"there is no file {script}")
    # Missing files are reported before the script begins.
    tls.authority(asked.tls_ca, asked.tls_cert, asked.tls_key)
    os.environ[connections.OPTIONS] = shlex.join(_options(asked))
    import_hooks.replace(pybullet)
    sys.argv = [asked.script, *asked.args]
    sys.path[0] = str(script.resolve().parent)
    import_hooks.replace_in_children()
    runpy.run_path(asked.script, run_name="__main__")


def _options(asked: argparse.Namespace) -> list[str]:
    """Options for each `connect` of the script and of its children."""
    switches = ("new", "remove_robots", "limits", "mimic")
    values = ("endpoint", "tls_ca", "tls_cert", "tls_key")
    given = [f"--{name.replace('_', '-')}" for name in switches if getattr(asked, name)]
    named = [f"--{name.replace('_', '-')}={getattr(asked, name)}" for name in values if getattr(asked, name)]
    return given + named


if __name__ == "__main__":
    main()
