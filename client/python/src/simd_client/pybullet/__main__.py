"""`python -m simd_client.pybullet [options] script.py [args]`: runs an
unchanged PyBullet script."""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import runpy
import sys
from pathlib import Path
from types import ModuleType

import simd_client.pybullet as pybullet
from simd_client.pybullet import bullet_client, connections, data


def stand_in() -> None:
    """Makes `import pybullet`, `import pybullet_data` and `pybullet_utils.bullet_client` import our modules."""
    sys.modules["pybullet"] = pybullet
    sys.modules["pybullet_data"] = data
    if importlib.util.find_spec("pybullet_utils") is None:
        utils = ModuleType("pybullet_utils", "Stands in for PyBullet's helpers: bullet_client only.")
        utils.__path__ = []
        sys.modules["pybullet_utils"] = utils
    else:
        utils = importlib.import_module("pybullet_utils")
    sys.modules["pybullet_utils.bullet_client"] = bullet_client
    setattr(utils, "bullet_client", bullet_client)


def main(arguments: list[str] | None = None) -> None:
    """Runs the script as `python script.py args` would."""
    parser = argparse.ArgumentParser(
        prog="python -m simd_client.pybullet",
        description="Runs a PyBullet script on a simd daemon: a running one, or one that it starts.",
    )
    parser.add_argument("--endpoint", help="where the daemon is, for instance tcp/127.0.0.1:7447#lab")
    parser.add_argument("--new", action="store_true", help="start a daemon, even where one is running")
    parser.add_argument(
        "--remove-robots", action="store_true", help="take the script's robots out at its end"
    )
    parser.add_argument("script", help="the script")
    parser.add_argument("args", nargs=argparse.REMAINDER, help="what the script gets")
    asked = parser.parse_args(arguments)
    script = Path(asked.script)
    if not script.is_file():
        parser.error(f"there is no file {script}")
    connections.default_endpoint = asked.endpoint
    connections.always_new = asked.new
    connections.always_remove = asked.remove_robots
    stand_in()
    sys.argv = [asked.script, *asked.args]
    sys.path[0] = str(script.resolve().parent)
    runpy.run_path(asked.script, run_name="__main__")


if __name__ == "__main__":
    main()
