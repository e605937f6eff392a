"""Snapshots out to files on this disk and in from them."""

from __future__ import annotations

import hashlib
from pathlib import Path

from simd_client import proto
from simd_client.errors import AnswerError
from simd_client.plan import Plan, ask, work
from simd_client.plans.robots import AnyPath, asset, hash_of, send
from simd_client.proto import methods
from simd_client.world import Snapshot, snapshot_from_proto

LONGER = 120.0
"""Seconds that an export or import may take beyond other calls: all robots of a world are read again."""


def export(name: str, path: AnyPath) -> Plan[Path]:
    """Writes a snapshot into a file."""
    answer = yield from ask(methods.ExportSnapshot, proto.ExportSnapshotRequest(name=name), LONGER)
    content = yield from asset(answer.sha256)
    file = Path(path)
    if (yield from work(lambda: hashlib.sha256(content).hexdigest())) != answer.sha256:
        raise AnswerError("the file does not have the hash that was said")
    yield from work(lambda: file.write_bytes(content))
    return file


def import_(path: AnyPath, name: str) -> Plan[Snapshot]:
    """Keeps the snapshot of a file."""
    file = Path(path)
    sha256 = yield from work(lambda: hash_of(file))
    yield from send(file, sha256)
    request = proto.ImportSnapshotRequest(sha256=sha256, name=name)
    return snapshot_from_proto((yield from ask(methods.ImportSnapshot, request, LONGER)).snapshot)
