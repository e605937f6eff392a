"""PyBullet's module on a simd daemon."""
from .constants import *
from .errors import error
from .rotations import *
from .cameras import *
from .connections import *
from .loading import *
from .joints import *
from .simulation import *
