"""Generates the blocking client from the asyncio client: `src/simd_client/blocking` from `src/simd_client/aio`.

    python tools/make_blocking.py

Both ends of each pair in REPLACED are text. A line that ends in `# asyncio only` is left out, and one that begins with
`# blocking: ` is uncommented. `connect.py` and `runtime.py` are written by hand in both folders.
"""

from __future__ import annotations

import re
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "src" / "simd_client"
BY_HAND = ("__init__.py", "connect.py", "runtime.py")
HEADER = "# Generated from simd_client/aio/{name} by tools/make_blocking.py; do not edit.\n"

REPLACED = [
    ("async def ", "def "),
    ("async with", "with"),
    ("async for", "for"),
    ("await ", ""),
    ("AsyncIterator", "Iterator"),
    ("StopAsyncIteration", "StopIteration"),
    ("__aenter__", "__enter__"),
    ("__aexit__", "__exit__"),
    ("__aiter__", "__iter__"),
    ("__anext__", "__next__"),
    ("simd_client.aio", "simd_client.blocking"),
    (
        "Belongs to one event loop. Calls",
        "May be used from several threads at once; iterators (`watch`, `events`) and claims belong to one. Calls",
    ),
    ("Belongs to one event loop.", "Belongs to one thread."),
    (
        "The function is called on a task of the event loop, and may be a coroutine function.",
        "The function is called on a separate thread, which does not keep the program from ending.",
    ),
    ("Belongs to the event loop that it was made on.", "Belongs to one thread."),
]


def main() -> None:
    """Writes the generated files."""
    for name, code in generated().items():
        (PACKAGE / "blocking" / name).write_text(code)


def generated() -> dict[str, str]:
    """The code of each generated file, by its name. Raises `ValueError` for a replacement that is never used."""
    sources = {
        path.name: path.read_text()
        for path in sorted((PACKAGE / "aio").glob("*.py"))
        if path.name not in BY_HAND
    }
    for text, _ in REPLACED:
        if not any(text in source for source in sources.values()):
            raise ValueError(f"{text!r} is in none of the sources")
    return {name: HEADER.format(name=name) + blocking(source) for name, source in sources.items()}


def blocking(source: str) -> str:
    """The blocking code of an asyncio module."""
    source = re.sub(r"^.*# asyncio only\n", "", source, flags=re.MULTILINE)
    source = re.sub(r"^( *)# blocking: ", r"\1", source, flags=re.MULTILINE)
    source = without_parentheses(source)
    for text, replacement in REPLACED:
        source = source.replace(text, replacement)
    return source


def without_parentheses(source: str) -> str:
    """`(await call()).attribute` becomes `await call().attribute`, of which only `await` is left to remove."""
    while True:
        for found in re.finditer(r"(?<![\w\])])\((?=await )", source):
            end = closing(source, found.start())
            if source[end + 1 : end + 2] in (".", "["):
                break
        else:
            return source
        begin = found.start()
        source = source[:begin] + source[begin + 1 : end] + source[end + 1 :]


def closing(source: str, opening: int) -> int:
    """The index of the parenthesis that closes the one at `opening`."""
    depth = 0
    for index in range(opening, len(source)):
        depth += {"(": 1, ")": -1}.get(source[index], 0)
        if depth == 0:
            return index
    raise ValueError("a parenthesis is not closed")


if __name__ == "__main__":
    main()
