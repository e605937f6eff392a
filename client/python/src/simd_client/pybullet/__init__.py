"""PyBullet's module on a simd daemon: `import simd_client.pybullet as pybullet` is the only line of a
script that changes.

A script runs as it is with `python -m simd_client.pybullet script.py`. What each function does, and where
it differs from PyBullet on purpose, is described in docs/pybullet.md.
"""

from . import (
    cameras,
    connections,
    constants,
    constraints,
    contacts,
    dynamics,
    headless,
    joints,
    kinematics,
    loading,
    reactions,
    rotations,
    shapes,
    simulation,
    stand_in,
    state_log,
    unsupported,
)
from .cameras import *
from .connections import *
from .constants import *
from .constraints import *
from .contacts import *
from .dynamics import *
from .errors import error
from .headless import *
from .joints import *
from .kinematics import *
from .loading import *
from .reactions import *
from .rotations import *
from .shapes import *
from .simulation import *
from .state_log import *
from .unsupported import *

stand_in.install()

__all__ = ["error"]
__all__ += cameras.__all__
__all__ += connections.__all__
__all__ += constants.__all__
__all__ += constraints.__all__
__all__ += contacts.__all__
__all__ += dynamics.__all__
__all__ += headless.__all__
__all__ += joints.__all__
__all__ += kinematics.__all__
__all__ += loading.__all__
__all__ += reactions.__all__
__all__ += rotations.__all__
__all__ += shapes.__all__
__all__ += simulation.__all__
__all__ += state_log.__all__
__all__ += unsupported.__all__
