"""Makes `import pybullet_data` and `pybullet_utils.bullet_client` work if they are not installed, and `import
pybullet` in a script of the runner."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import CodeType, ModuleType

from . import data

# Folder with this package's module `pybullet`.
_MODULES = Path(__file__).with_name("modules")
_DATA = "pybullet_data"
_UTILS = "pybullet_utils"
_CLIENT = "pybullet_utils.bullet_client"


class _StandIns(MetaPathFinder, Loader):
    """Finder that comes after all installed packages, except for `BulletClient`, which connects with this
    package in any case."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Finds the module of that name, if it is a replaced one."""
        del target
        # An installed package has a path, and its missing modules are not replaced.
        if fullname in (_DATA, _UTILS) or (fullname == _CLIENT and not path):
            return ModuleSpec(fullname, self, is_package=fullname == _UTILS)
        return None

    def get_code(self, fullname: str) -> CodeType:
        """Returns the code for `python -m` and `runpy`: it imports the module's names."""
        source = {_DATA: "pybullet.data", _UTILS: "", _CLIENT: "pybullet.bullet_client"}[fullname]
        text = f"from simd_client.{source} import *" if source else ""
        return compile(text, f"<{fullname}>", "exec")

    def exec_module(self, module: ModuleType) -> None:
        """Fills the module."""
        if module.__name__ == _DATA:
            module.__doc__ = data.__doc__
            module.__file__ = str(data.OWN / "__init__.py")
            setattr(module, "getDataPath", data.getDataPath)
        elif module.__name__ == _CLIENT:
            from . import bullet_client

            module.__doc__ = bullet_client.__doc__
            setattr(module, "BulletClient", bullet_client.BulletClient)


class _FirstOfAll(MetaPathFinder):
    """Finder that comes before all others, only for `BulletClient`."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Finds this package's module, also within an installed package of PyBullet."""
        del path, target
        return ModuleSpec(fullname, _StandIns()) if fullname == _CLIENT else None


def install() -> None:
    """Installs the finder for a script that imports `simd_client.pybullet`."""
    if not any(isinstance(finder, _StandIns) for finder in sys.meta_path):
        sys.meta_path.append(_StandIns())
        sys.meta_path.insert(0, _FirstOfAll())


def replace_in_children() -> None:
    """Makes processes that the script starts import this module too. `spawn` and `forkserver` pass the path,
    and other programs get it from the environment."""
    sys.path.insert(1, str(_MODULES))
    already = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join([str(_MODULES), *([already] if already else [])])


def replace(pybullet: ModuleType) -> None:
    """Installs the module for a script of the runner: `import pybullet` and packages on top of it use it."""
    install()
    sys.modules["pybullet"] = pybullet
    sys.modules[_DATA] = data
    utils = importlib.import_module(_UTILS)
    # This holds even if the real one is installed.
    bullet_client = module_from_spec(ModuleSpec(_CLIENT, _StandIns()))
    _StandIns().exec_module(bullet_client)
    sys.modules[_CLIENT] = bullet_client
    setattr(utils, "bullet_client", bullet_client)
