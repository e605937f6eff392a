"""The table of docs/pybullet.md against the module."""

from __future__ import annotations

import re
from pathlib import Path

import simd_client.pybullet as pybullet
from simd_client.pybullet import headless, plugins, unsupported

TABLE = Path(__file__).resolve().parents[4] / "docs/pybullet.md"
STATES = ("works", "accepted", "raises")


def rows() -> dict[str, str]:
    """State by function."""
    found: dict[str, str] = {}
    for line in TABLE.read_text().splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) == 3 and cells[1] in STATES:
            for name in re.findall(r"`(\w+)`", cells[0]):
                assert name not in found, f"{name} is listed twice"
                found[name] = cells[1]
    return found


def test_every_function_is_listed() -> None:
    public = {
        name
        for name in dir(pybullet)
        if callable(getattr(pybullet, name)) and not name.startswith("_") and name != "error"
    }
    assert public == set(rows())


def test_states_are_true() -> None:
    listed = rows()
    raising = {name for name, state in listed.items() if state == "raises"}
    assert set(unsupported.__all__) <= raising
    # The function raises from a module with other functions too.
    assert raising - set(unsupported.__all__) == {"loadBullet"}
    accepted = {name for name, state in listed.items() if state == "accepted"}
    assert accepted == set(headless.__all__) | set(plugins.__all__)
