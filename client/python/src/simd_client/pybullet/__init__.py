"""PyBullet's module on a simd daemon: `import simd_client.pybullet as pybullet` is the only line of a
script that changes.

A script runs as it is with `python -m simd_client.pybullet script.py`. What each function does, and where
it differs from PyBullet on purpose, is told in docs/pybullet.md.
"""

from .cameras import *
from .connections import *
from .constants import *
from .constraints import *
from .dynamics import *
from .errors import error as error
from .headless import *
from .joints import *
from .kinematics import *
from .loading import *
from .rotations import *
from .shapes import *
from .simulation import *
from .state_log import *
from .unsupported import *
