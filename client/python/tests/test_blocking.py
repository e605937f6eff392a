"""The blocking client is generated from the asyncio client, and is up to date."""

from __future__ import annotations

import ast

import make_blocking
import pytest

FOLDER = make_blocking.PACKAGE / "blocking"


def test_the_committed_files_are_those_that_the_sources_give() -> None:
    generated = make_blocking.generated()
    committed = {
        path.name: path.read_text()
        for path in FOLDER.glob("*.py")
        if path.name not in make_blocking.BY_HAND
    }
    assert sorted(committed) == sorted(generated)
    stale = [name for name, code in generated.items() if committed[name] != code]
    assert not stale, f"{stale} are not what simd_client/aio gives: run `make python-blocking`"


def test_no_generated_file_has_a_coroutine_or_needs_an_event_loop() -> None:
    awaited = (ast.Await, ast.AsyncFunctionDef, ast.AsyncFor, ast.AsyncWith)
    for path in FOLDER.glob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text())))
        assert not [node for node in nodes if isinstance(node, awaited)], path.name
        imported = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
        assert "asyncio" not in imported, path.name


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("return (await self.read()).position", "return self.read().position"),
        ("(await f((await g()).x))[0]", "f(g().x)[0]"),
        ("return Robot(await f())", "return Robot(f())"),
        ("x = (await f(), 1)", "x = (f(), 1)"),
        ("async with x as y:", "with x as y:"),
        ("    # blocking: @target.setter\n", "    @target.setter\n"),
        ("a\nb  # asyncio only\nc\n", "a\nc\n"),
    ],
)
def test_code_is_translated(source: str, expected: str) -> None:
    assert make_blocking.blocking(source) == expected
