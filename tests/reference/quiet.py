"""PyBullet without the output of its C code: a line at its import, and one for each link that it reads."""

import ctypes
import os
from contextlib import contextmanager


@contextmanager
def silence():
    libc = ctypes.CDLL(None)
    libc.fflush(None)
    kept = [os.dup(stream) for stream in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    try:
        yield
    finally:
        libc.fflush(None)
        for stream, copy in zip((1, 2), kept):
            os.dup2(copy, stream)
            os.close(copy)
        os.close(nowhere)


with silence():
    import pybullet  # noqa: E402, F401
