"""PyBullet's module on a simd daemon: `import simd_client.pybullet as pybullet` is the only line of a
script that changes.

A script runs unchanged with `python -m simd_client.pybullet script.py`. docs/pybullet.md describes each
function, and its intended differences from PyBullet.
"""

from . import (
    cameras,
    colors,
    connections,
    constants,
    constraints,
    contacts,
    convex_parts,
    debug_items,
    dynamics,
    files,
    filters,
    headless,
    input_events,
    inverse_kinematics,
    joint_motors,
    joints,
    kinematics,
    loading,
    matrices,
    mjcf,
    pictures,
    plugins,
    reactions,
    rotations,
    scene,
    sdf,
    shapes,
    simulation,
    import_hooks,
    state_log,
    unsupported,
    user_data,
    window,
)
from .cameras import *
from .colors import *
from .connections import *
from .constants import *
from .constraints import *
from .contacts import *
from .convex_parts import *
from .debug_items import *
from .dynamics import *
from .errors import error
from .files import *
from .filters import *
from .headless import *
from .input_events import *
from .inverse_kinematics import *
from .joint_motors import *
from .joints import *
from .kinematics import *
from .loading import *
from .matrices import *
from .mjcf import *
from .pictures import *
from .plugins import *
from .reactions import *
from .rotations import *
from .scene import *
from .sdf import *
from .shapes import *
from .simulation import *
from .state_log import *
from .unsupported import *
from .user_data import *
from .window import *

import_hooks.install()

__all__ = ["error"]
__all__ += cameras.__all__
__all__ += colors.__all__
__all__ += connections.__all__
__all__ += constants.__all__
__all__ += constraints.__all__
__all__ += contacts.__all__
__all__ += convex_parts.__all__
__all__ += debug_items.__all__
__all__ += dynamics.__all__
__all__ += files.__all__
__all__ += filters.__all__
__all__ += headless.__all__
__all__ += input_events.__all__
__all__ += inverse_kinematics.__all__
__all__ += joint_motors.__all__
__all__ += joints.__all__
__all__ += kinematics.__all__
__all__ += loading.__all__
__all__ += matrices.__all__
__all__ += mjcf.__all__
__all__ += pictures.__all__
__all__ += plugins.__all__
__all__ += reactions.__all__
__all__ += rotations.__all__
__all__ += scene.__all__
__all__ += sdf.__all__
__all__ += shapes.__all__
__all__ += simulation.__all__
__all__ += state_log.__all__
__all__ += unsupported.__all__
__all__ += user_data.__all__
__all__ += window.__all__
