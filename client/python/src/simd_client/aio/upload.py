"""Sends descriptions and files to the daemon, and fetches files from it."""

from __future__ import annotations

import hashlib
from pathlib import Path

from simd_client import proto
from simd_client.aio.connection import Connection
from simd_client.aio.runtime import in_thread
from simd_client.description_files import (
    PART_BYTES,
    AnyPath,
    DescriptionFiles,
    Packages,
    hash_of,
    part_of,
)
from simd_client.errors import AnswerError
from simd_client.expansion import Arguments
from simd_client.progress import Bars
from simd_client.proto import methods
from simd_client.replacement import replace_file


async def upload(
    connection: Connection,
    path: AnyPath,
    packages: Packages | None = None,
    xacro_arguments: Arguments | None = None,
    bars: Bars | None = None,
) -> proto.DescriptionSource:
    """Sends a URDF and the files that the daemon lacks. A xacro file is expanded first."""
    files = await in_thread(lambda: DescriptionFiles(path, packages, xacro_arguments))
    return await upload_files(connection, files, bars)


async def upload_files(
    connection: Connection, files: DescriptionFiles, bars: Bars | None = None
) -> proto.DescriptionSource:
    """Like `send_urdf`, for a URDF that was read."""
    request = proto.PrepareDescriptionRequest(urdf=files.urdf)
    prepared = await connection.call_until_silent(methods.PrepareDescription, request)
    sent: set[str] = set()
    # Included SDF and MJCF files name more files, and so do meshes: pictures, and materials. Each file is
    # looked up once, so that this ends.
    while True:
        new = [asset.uri for asset in prepared.assets if not files.knows(asset.uri)]
        await in_thread(lambda: files.find(new))
        if not any(uri in files.hashes for uri in new):
            break
        request = proto.PrepareDescriptionRequest(urdf=files.urdf, assets=files.hashes)
        prepared = await connection.call_until_silent(methods.PrepareDescription, request)
        lacking = proto.AssetState.ASSET_STATE_LACKING
        named = {files.hashes[a.uri] for a in prepared.assets if a.state == lacking and a.uri in files.hashes}
        hashes = sorted(named - sent)
        if bars is not None:
            total = await in_thread(lambda: sum(files.paths[each].stat().st_size for each in hashes))
            bars.begin(f"{files.name}: sending", total, "B")
        for sha256 in hashes:
            await send_file(connection, files.paths[sha256], sha256, bars)
        sent.update(hashes)
        if files.name_more(hashes):
            prepared = await connection.call_until_silent(methods.PrepareDescription, request)
    return proto.DescriptionSource(
        description=prepared.description, assets=files.hashes, missing=files.missing
    )


async def send_file(connection: Connection, path: Path, sha256: str, bars: Bars | None = None) -> None:
    """Sends one file in parts. Raises `UploadMismatch` if it does not have the hash."""
    total = await in_thread(lambda: path.stat().st_size)
    offset = 0
    while True:
        data = await in_thread(lambda: part_of(path, offset))
        request = proto.UploadAssetRequest(sha256=sha256, total_bytes=total, offset=offset, data=data)
        await connection.call(methods.UploadAsset, request)
        offset += len(data)
        if bars is not None:
            bars.add(len(data))
        # A file that has shrunk ends early; the daemon then detects the different hash.
        if not data or offset >= total:
            return


async def send_bytes(connection: Connection, data: bytes) -> str:
    """Sends bytes from memory, in parts. Returns their hash."""
    sha256 = await in_thread(lambda: hashlib.sha256(data).hexdigest())
    for offset in range(0, max(len(data), 1), PART_BYTES):
        part = data[offset : offset + PART_BYTES]
        request = proto.UploadAssetRequest(sha256=sha256, total_bytes=len(data), offset=offset, data=part)
        await connection.call(methods.UploadAsset, request)
    return sha256


async def send_saved_state(connection: Connection, path: Path) -> str:
    """Sends the file of a saved state. Returns its hash."""
    sha256 = await in_thread(lambda: hash_of(path))
    await send_file(connection, path, sha256)
    return sha256


async def fetch_file(connection: Connection, sha256: str) -> bytes:
    """Fetches a file from the daemon, in parts."""
    parts: list[bytes] = []
    have = 0
    while True:
        answer = await connection.call(methods.GetAsset, proto.GetAssetRequest(sha256=sha256, offset=have))
        parts.append(answer.data)
        have += len(answer.data)
        if have >= answer.total_bytes or not answer.data:
            return b"".join(parts)


async def write_file(connection: Connection, sha256: str, path: Path) -> None:
    """Fetches a file from the daemon and writes it to this disk. Raises `AnswerError` if it does not have the
    hash."""
    content = await fetch_file(connection, sha256)
    if await in_thread(lambda: hashlib.sha256(content).hexdigest()) != sha256:
        raise AnswerError("the file that the daemon sent does not have its hash")
    await in_thread(lambda: replace_file(path, content))
