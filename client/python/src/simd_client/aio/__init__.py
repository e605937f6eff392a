"""The client for asyncio. It has the names of `simd_client`; calls to the daemon are awaited, including
properties.

    from simd_client import aio

    async with aio.connect() as sim:
        await sim.pause()
        arm = await sim.load("arm.urdf", fixed=True)
        await arm.joints["elbow"].set_position(0.5)
        await sim.step(1000)
        print(await arm.position)

No thread waits for an answer: replies and publications arrive by callback. Objects belong to one event loop.
The blocking client, `simd_client.blocking`, is generated from this package by `tools/make_blocking.py`.
"""

from simd_client.aio.callbacks import Callbacks
from simd_client.aio.cameras import Camera, Cameras, PictureStream, WorldCameras
from simd_client.aio.claim import Claim
from simd_client.aio.connect import Connecting, connect
from simd_client.aio.constraints import Constraints
from simd_client.aio.joint import Joint, Joints
from simd_client.aio.parameters import Parameters
from simd_client.aio.recording import Recording
from simd_client.aio.robot import Robot
from simd_client.aio.sensors import ReadingStream, Sensor, Sensors, WorldSensors
from simd_client.aio.simulation import Simulation
from simd_client.aio.view import View
from simd_client.aio.watch import EventWatch, Watch

__all__ = [
    "Callbacks",
    "Camera",
    "Cameras",
    "Claim",
    "Connecting",
    "Constraints",
    "EventWatch",
    "Joint",
    "Joints",
    "Parameters",
    "PictureStream",
    "ReadingStream",
    "Recording",
    "Robot",
    "Sensor",
    "Sensors",
    "Simulation",
    "View",
    "Watch",
    "WorldCameras",
    "WorldSensors",
    "connect",
]
