"""A renderer that is test code: its pictures have the number of steps in each pixel."""

from __future__ import annotations

import threading
import zlib
from collections.abc import Generator
from contextlib import contextmanager

import numpy as np
from daemon import Daemon

import simd_client
from simd_client import CameraSensor, proto
from simd_client.proto import methods

EYE = CameraSensor(width=4, height=3, horizontal_field_of_view=1.2, near=0.1, far=50.0, picture="color_and_depth")


def answer(task: proto.PictureTask) -> proto.PutPictureRequest:
    """Returns a picture with the number of steps in each pixel; depths are packed."""
    pixels, step = task.width * task.height, task.stamp.step
    put = proto.PutPictureRequest(id=task.id, renderer="test")
    if task.planes.color:
        put.color.data = bytes([step % 256]) * (3 * pixels)
    if task.planes.depth:
        put.depth.data = zlib.compress(np.full(pixels, step, "<f4").tobytes())
        put.depth.compression = proto.PlaneCompression.PLANE_COMPRESSION_ZLIB
    if task.planes.segmentation:
        put.segmentation.data = np.full(pixels, 1, "<u4").tobytes()
    return put


@contextmanager
def rendering(daemon: Daemon) -> Generator[None]:
    """Runs a renderer within the context."""
    ended = threading.Event()
    with simd_client.connect(daemon.endpoint) as client:
        client.call(methods.NextPicture, proto.NextPictureRequest(renderer="test"))

        def draw() -> None:
            while not ended.is_set():
                request = proto.NextPictureRequest(renderer="test", timeout=0.2)
                found = client.call(methods.NextPicture, request, wait=0.2)
                if found.HasField("task"):
                    client.call(methods.PutPicture, answer(found.task))

        thread = threading.Thread(target=draw)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()
