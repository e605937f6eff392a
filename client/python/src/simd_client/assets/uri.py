"""Parses the `filename` of a URDF."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Union
from urllib.parse import unquote_to_bytes

from simd_client.assets.missing import Why


class Unreadable(Exception):
    """The URI cannot be looked up."""

    def __init__(self, why: Why) -> None:
        super().__init__(why.phrase)
        self.why = why


@dataclass(frozen=True)
class InPackage:
    """`package://NAME/rest` and `model://NAME/rest`."""

    name: str
    rest: str


@dataclass(frozen=True)
class Absolute:
    """Parses `file:///path` and `/path`."""

    path: str


@dataclass(frozen=True)
class Relative:
    """A path relative to the URDF's folder."""

    path: str


Uri = Union[InPackage, Absolute, Relative]


def readings(uri: str) -> list[Uri]:
    """Returns the possible meanings of a URI, the literal one first: a `%20` is rarely, but sometimes, part
    of a name.

    Raises `Unreadable`.
    """
    text = uri.strip().replace("\\", "/")
    if not text:
        raise Unreadable(Why.EMPTY)
    if "$(" in text or "${" in text:
        raise Unreadable(Why.XACRO)
    found = [_parse(text)]
    if "%" in text:
        try:
            decoded = unquote_to_bytes(text).decode()
        except UnicodeDecodeError:
            return found
        # Decoding may have produced characters with a meaning.
        second = _parse(decoded.replace("\\", "/"))
        if second not in found:
            found.append(second)
    return found


def _parse(text: str) -> Uri:
    if "\0" in text:
        raise Unreadable(Why.NULL)
    scheme, separator, path = text.partition("://")
    if not separator:
        # `file:/a` is short for `file:///a`.
        return _path_of(text.removeprefix("file:") if text.startswith("file:/") else text)
    scheme = scheme.lower()
    if scheme in ("package", "model"):
        name, slash, rest = path.partition("/")
        if not slash:
            raise Unreadable(Why.NO_FILE)
        if name in (".", ".."):
            raise Unreadable(Why.NO_PACKAGE)
        if not rest:
            raise Unreadable(Why.NO_FILE)
        return InPackage(name, rest.lstrip("/"))
    if scheme == "file":
        if path.startswith("localhost/"):
            path = path.removeprefix("localhost")
        if not path:
            raise Unreadable(Why.NO_FILE)
        # Users often write two slashes instead of three, and mean a relative path.
        return _path_of(path)
    raise Unreadable(Why.NETWORK if scheme in ("http", "https", "ftp") else Why.SCHEME)


def _path_of(path: str) -> Uri:
    if re.match(r"[A-Za-z]:/", path.lstrip("/")):
        raise Unreadable(Why.WINDOWS)
    return Absolute(path) if path.startswith("/") else Relative(path)
