"""The program `simd-camera`, started for a world in this process."""

from __future__ import annotations

import os
import time

from simd_client import extras, proto
from simd_client.blocking.simulation import Simulation
from simd_client.child_process import ChildProcess
from simd_client.embedded_link import EmbeddedLink
from simd_client.errors import NoRenderer
from simd_client.programs import DAEMON, find
from simd_client.proto import methods

PROGRAM, VARIABLE = "simd-camera", "SIMD_CAMERA"
"""The renderer's program, and the environment variable that names it."""

# Address at which the world is served to it.
_ADDRESS = "127.0.0.1:0"
# Maximum wall seconds until it asks for work, and between two looks.
_START, _LOOK = 30.0, 0.02


class RendererProcess(ChildProcess):
    """A renderer of a world in this process. It ends with this object, or with the process."""

    def __init__(self, sim: Simulation) -> None:
        """Starts it, and waits until it asks for work. Raises `NoRenderer` if it cannot draw, with the reason."""
        program = find(PROGRAM, VARIABLE, beside=os.environ.get(DAEMON))
        if program is None:
            raise NoRenderer(
                f"`{PROGRAM}`, which draws pictures, is not on the PATH: {extras.DAEMON}, or name the program with {VARIABLE}"
            )
        if not isinstance(sim.link, EmbeddedLink):
            raise NoRenderer("a renderer is started for a world in this process; daemons have their own")
        address = sim.link.serve(_ADDRESS, says=False)
        command = [str(program), "--endpoint", f"http://{address}", "--until-stdin-closes"]
        super().__init__(command, {"RUST_LOG": "warn"}, prints=False)
        until = time.monotonic() + _START
        while not sim.call(methods.ListCameras, proto.ListCamerasRequest()).renderers:
            if not self.running():
                raise NoRenderer(self.last_words() or f"{PROGRAM} ended without a word")
            if time.monotonic() > until:
                self.end()
                raise NoRenderer(f"{PROGRAM} asked for no work within {_START:g} s")
            time.sleep(_LOOK)
