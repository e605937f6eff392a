"""Messages advise the package's own extras."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from simd_client import extras

PROJECT = Path(__file__).parents[1] / "pyproject.toml"


def test_commands_have_the_versions_of_the_extras() -> None:
    section = PROJECT.read_text().split("[project.optional-dependencies]\n")[1].split("\n[")[0]
    brought = dict(re.findall(r'^(\w+) = \["(.*)"\]$', section, flags=re.MULTILINE))
    for name, command in [("xacro", extras.XACRO), ("plot", extras.PLOT), ("notebook", extras.NOTEBOOK), ("gym", extras.GYM), ("ray", extras.RAY)]:
        assert command == f"pip install '{brought[name]}'"


# Commands that ask an index or a registry for a package of simd's: a file or folder begins with `.` or a folder's name.
FROM_AN_INDEX = re.compile(
    r"\b(?:pip3?|pipx|uv(?: pip| tool)?|conda|mamba|poetry|cargo|npm|npx|pnpm|yarn|apt(?:-get)?|brew) (?:install|i|add)"
    r"""(?: -[-\w]+)* ['"]?simd(?:\b|[-_])"""
)
TEXTS = {".html", ".ipynb", ".js", ".md", ".proto", ".py", ".rs", ".sh", ".toml", ".ts", ".tsx", ".txt", ".yml", ""}


def texts() -> Iterator[Path]:
    """Returns the files of the repository that a reader, a user or a program can meet."""
    for folder, below, files in os.walk(PROJECT.parents[2]):
        below[:] = [name for name in below if name not in ("target", "node_modules", "dist") and name[0] != "."]
        yield from (Path(folder, name) for name in files if Path(name).suffix in TEXTS)


def test_nothing_advises_to_install_a_package_that_no_index_has() -> None:
    pages = (page for page in texts() if page.is_file() and page != Path(__file__))
    advice = {page: FROM_AN_INDEX.findall(page.read_text(errors="replace")) for page in pages}
    assert "Guide.tsx" in {page.name for page in advice}
    assert [(page, found) for page, found in advice.items() if found] == []


@pytest.mark.parametrize("advice", ["pip install simd-client", "pip install 'simd_client[gym]'", "uv add simd-client", "cargo install --locked simd", "apt install simd"])
def test_advice_to_ask_an_index_is_found(advice: str) -> None:
    assert FROM_AN_INDEX.search(advice)


@pytest.mark.parametrize("advice", ["pip install ./client/python", "pip install dist/simd_client-*.whl", "cargo install --locked --path server", "apt install ./simd_*.deb"])
def test_advice_with_a_file_or_a_folder_passes(advice: str) -> None:
    assert not FROM_AN_INDEX.search(advice)
