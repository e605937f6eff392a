"""Messages advise the package's own extras."""

from __future__ import annotations

import re
from pathlib import Path

from simd_client import extras

PROJECT = Path(__file__).parents[1] / "pyproject.toml"
SOURCES = Path(__file__).parents[1] / "src" / "simd_client"


def test_commands_have_the_versions_of_the_extras() -> None:
    section = PROJECT.read_text().split("[project.optional-dependencies]\n")[1].split("\n[")[0]
    brought = dict(re.findall(r'^(\w+) = \["(.*)"\]$', section, flags=re.MULTILINE))
    for name, command in [("xacro", extras.XACRO), ("plot", extras.PLOT), ("notebook", extras.NOTEBOOK), ("gym", extras.GYM)]:
        assert command == f"pip install '{brought[name]}'"


def test_nothing_advises_to_install_a_package_that_no_index_has() -> None:
    pages = [*SOURCES.rglob("*.py"), *(SOURCES.parents[1] / "examples").glob("*")]
    for page in pages:
        if page.is_file() and page.suffix in (".py", ".md", ".ipynb"):
            assert not re.search(r"pip install '?simd", page.read_text()), page
