"""Expands xacro with the official package, an optional extra (`extras.XACRO`)."""

from __future__ import annotations

import importlib
import os
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.dom import Node
from xml.dom.minidom import Document, Element

from simd_client import extras
from simd_client.assets import package
from simd_client.assets.package import RosPaths
from simd_client.errors import XacroError

# The package keeps its working state in its module.
_lock = threading.Lock()

Arguments = Mapping[str, object]


def is_xacro(path: Path) -> bool:
    """Whether a file is xacro by its name."""
    return path.suffix.lower() == ".xacro"


def expanded(
    path: Path, arguments: Arguments | None, packages: Mapping[str, str | os.PathLike[str]] | None
) -> bytes:
    """Returns the expanded URDF of a xacro file. `$(find NAME)` searches `packages`, then ROS's folders, then
    the folders above the file; paths below a found package become `package://NAME/...`. Expressions are
    Python: expand only files that you trust.

    Raises `XacroError`, also if the package `xacro` is not installed.
    """
    try:
        xacro: Any = importlib.import_module("xacro")
        substitutions: Any = importlib.import_module("xacro.substitution_args")
    except ImportError as missing:
        why = f"xacro files need the official package: {extras.XACRO}"
        raise XacroError(f"{path}: {why}, or expand the file with `xacro`") from missing
    found: dict[str, Path] = {}

    def find(name: str) -> str:
        if name not in found:
            found[name] = _folder(name, path, packages)
        return str(found[name])

    mappings = {name: _text(value) for name, value in (arguments or {}).items()}
    with _lock:
        original, in_expressions = substitutions._eval_find, dict(substitutions._eval_dict)
        substitutions._eval_find = find
        substitutions._eval_dict["find"] = find
        try:
            document: Document = xacro.process_file(str(path), mappings=mappings)
        except SystemExit as ended:
            raise XacroError(f"{path}: xacro ended with {ended.code}") from ended
        except Exception as problem:
            raise XacroError(f"{path}: {type(problem).__name__}: {problem}") from problem
        finally:
            substitutions._eval_find = original
            substitutions._eval_dict.update(in_expressions)
    if document.documentElement is not None:
        _name_packages(document.documentElement, found)
    return document.toxml(encoding="utf-8")


def _text(value: object) -> str:
    """Converts an argument as xacro reads it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _folder(name: str, path: Path, packages: Mapping[str, str | os.PathLike[str]] | None) -> Path:
    if packages and name in packages:
        return Path(packages[name]).absolute()
    for folder in RosPaths.of_environment().folders(name):
        if folder.is_dir():
            return folder
    for folder in package.ancestors(path.parent):
        if package.is_named(folder, name):
            return folder.absolute()
        if (folder / name / "package.xml").is_file():
            return (folder / name).absolute()
    raise LookupError(f"there is no package `{name}`: say where it is in `packages`")


def _name_packages(element: Element, found: Mapping[str, Path]) -> None:
    """Replaces paths of this disk, so that none is sent."""
    filename = element.getAttribute("filename")
    path = filename.removeprefix("file://")
    for name, folder in found.items():
        if path.startswith(f"{folder}/"):
            element.setAttribute("filename", f"package://{name}/{path.removeprefix(f'{folder}/')}")
    for child in element.childNodes:
        if child.nodeType == Node.ELEMENT_NODE:
            _name_packages(child, found)
