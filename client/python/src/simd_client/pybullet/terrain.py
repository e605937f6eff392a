"""Height fields: heights from pictures and tables, in the order in which Bullet reads them, and new heights
for existing ones."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import meshes, spawning
from .errors import error, unsupported
from .world import World

Table = NDArray[np.float64]

_MAX_BYTES = 64 * 1024 * 1024
_MAX_SAMPLES = 4_000_000
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
# Number of values of a pixel by PNG's type of colour: grey, colours, a number in the palette, grey and
# colours with alpha.
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_PALETTE = 3


def read(function: str, path: Path) -> tuple[Table, int, int]:
    """Returns consecutive heights, with their numbers along x and along y. In a picture black is 0 and white
    1.

    Raises:
        error: if the file cannot be read.
    """
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise error(f"{function}: {path.name} has more than 64 MiB")
        data = path.read_bytes()
    except OSError as problem:
        raise error(f"{function}: {problem}") from None
    try:
        if path.suffix.lower() == ".txt":
            return _of_table(data)
        if data.startswith(_SIGNATURE):
            return _of_picture(data)
    except (ValueError, IndexError, struct.error, zlib.error) as problem:
        raise error(f"{function}: {path.name} cannot be read: {problem}") from None
    raise unsupported(function, f"{path.name}: heights are read from .png and .txt")


def replace(world: World, function: str, number: int, heights: Any, rows: int, columns: int) -> int:
    """Gives a height field other heights; bodies that were made of it are loaded again, in place. As in Bullet, the height at its
    origin stays. Returns its number."""
    parts = world.collision_shapes.get(number)
    old = parts[0].mesh if len(parts) == 1 else None
    if old is None or not old.samples[0]:
        raise error(f"{function}: replaceHeightfieldIndex {number} is not a height field")
    if old.samples != (rows, columns):
        raise error(f"{function}: height field {number} has {old.samples[0]} by {old.samples[1]} heights, and not {rows} by {columns}")
    mesh = meshes.of_heights(function, heights, rows, columns, old.middle)
    if mesh.uri == old.uri:
        return number
    world.collision_shapes.made[number] = (changed(parts[0], mesh=mesh),)
    for body in [body for body in world.bodies.values() if old.uri in body.made_of and body.urdf is not None]:
        assert body.urdf is not None
        text = body.urdf.replace(old.uri.encode(), mesh.uri.encode())
        files = {uri: sha256 for uri, sha256 in body.files.items() if uri != old.uri} | {mesh.uri: mesh.sha256}
        spawning.send(world.wire, text, files, {mesh.sha256: mesh.data})
        entity = spawning.reload(world.wire, body.robot, text, files)
        made = world.replaced(body, entity, body.frames, text)
        made.files = files
        made.paths = {uri: file for uri, file in body.paths.items() if uri != old.uri} | {mesh.uri: mesh.file}
        made.made_of = body.made_of - {old.uri} | {mesh.uri}
    return number


def _of_table(data: bytes) -> tuple[Table, int, int]:
    """Returns a table with a line for each y. Bullet exchanges x and y of a square one."""
    lines = [[float(each) for each in line.split(b",") if each.strip()] for line in data.splitlines()]
    rows = [line for line in lines if line]
    width, height = len(rows[0]) if rows else 0, len(rows)
    if any(len(row) != width for row in rows):
        raise ValueError("all lines must have as many numbers as the first")
    _check(width, height)
    flat = np.array(rows, dtype=np.float64).reshape(-1)
    x, y = np.divmod(np.arange(width * height), height)
    return flat[x + width * y], width, height


def _of_picture(data: bytes) -> tuple[Table, int, int]:
    """Returns the red of each pixel, or its grey. Bullet reads each row from its end."""
    picture = _Picture.read(data)
    red = picture.red()[:, ::-1]
    return red.reshape(-1).astype(np.float64) / 255.0, picture.width, picture.height


def _check(width: int, height: int) -> None:
    if width < 2 or height < 2:
        raise ValueError(f"it has {width} by {height} heights, and must have at least 2 by 2")
    if width * height > _MAX_SAMPLES:
        raise ValueError(f"it has {width} by {height} heights, and may have {_MAX_SAMPLES:,}")


@dataclass
class _Picture:
    """A PNG (the specification of the W3C, third edition), as far as heights need it."""

    width: int
    height: int
    depth: int
    color: int
    palette: bytes
    packed: bytes

    @staticmethod
    def read(data: bytes) -> _Picture:
        width = height = depth = color = 0
        palette, parts = b"", bytearray()
        at = len(_SIGNATURE)
        while at + 8 <= len(data):
            length, kind = struct.unpack_from(">I4s", data, at)
            body = data[at + 8 : at + 8 + length]
            if len(body) < length:
                raise ValueError("it is cut off")
            if kind == b"IHDR":
                width, height, depth, color, _, _, interlace = struct.unpack(">IIBBBBB", body)
                _check(width, height)
                if color not in _CHANNELS or depth not in (1, 2, 4, 8, 16):
                    raise ValueError(f"no picture has the type of colour {color} with {depth} bits")
                if interlace:
                    raise ValueError("it is interlaced: save it without interlacing")
            elif kind == b"PLTE":
                palette = body
            elif kind == b"IDAT":
                parts += body
            elif kind == b"IEND":
                break
            at += 12 + length
        if not width:
            raise ValueError("it has no size")
        return _Picture(width, height, depth, color, palette, bytes(parts))

    def red(self) -> NDArray[np.uint8]:
        """Returns the first value of each pixel, 0 to 255, a row for each line of the picture."""
        bits = self.depth * _CHANNELS[self.color]
        line = (self.width * bits + 7) // 8
        lines = self._unfiltered(line, max(1, bits // 8))
        if self.depth == 16:
            # Upper of the two bytes.
            return lines[:, :: bits // 8]
        if self.depth == 8:
            first = lines[:, :: bits // 8]
        else:
            bits = np.unpackbits(lines, axis=1).reshape(self.height, -1, self.depth)[:, : self.width]
            first = (bits * (1 << np.arange(self.depth - 1, -1, -1))).sum(axis=2).astype(np.uint8)
        if self.color == _PALETTE:
            colors = np.frombuffer(self.palette, dtype=np.uint8)[::3]
            return colors[first]
        if self.depth < 8:
            return (first * (255 // ((1 << self.depth) - 1))).astype(np.uint8)
        return first

    def _unfiltered(self, line: int, step: int) -> NDArray[np.uint8]:
        """Returns the lines without their filters. `step` is the distance in bytes to the same value of the
        pixel to the left."""
        wanted = self.height * (line + 1)
        engine = zlib.decompressobj()
        raw = engine.decompress(self.packed, wanted)
        if len(raw) < wanted:
            raise ValueError("it has fewer lines than it says")
        rows = np.frombuffer(raw, dtype=np.uint8).reshape(self.height, line + 1)
        done: NDArray[np.uint8] = np.zeros((self.height, line), dtype=np.uint8)
        above = bytearray(line)
        for y in range(self.height):
            above = _line(int(rows[y, 0]), bytearray(rows[y, 1:].tobytes()), above, step)
            done[y] = np.frombuffer(above, dtype=np.uint8)
        return done


def _line(kind: int, line: bytearray, above: bytearray, step: int) -> bytearray:
    """Returns one line after a filter by the pixel to the left, the one above, or both."""
    if kind == 0:
        return line
    if kind == 2:
        return bytearray((np.frombuffer(line, np.uint8) + np.frombuffer(above, np.uint8)).astype(np.uint8).tobytes())
    if kind not in (1, 3, 4):
        raise ValueError(f"no line has the filter {kind}")
    for i in range(len(line)):
        left = line[i - step] if i >= step else 0
        if kind == 1:
            guess = left
        elif kind == 3:
            guess = (left + above[i]) // 2
        else:
            guess = _paeth(left, above[i], above[i - step] if i >= step else 0)
        line[i] = (line[i] + guess) & 0xFF
    return line


def _paeth(left: int, up: int, corner: int) -> int:
    """Returns the neighbour that is nearest to left + up - corner."""
    ahead = left + up - corner
    a, b, c = abs(ahead - left), abs(ahead - up), abs(ahead - corner)
    if a <= b and a <= c:
        return left
    return up if b <= c else corner
