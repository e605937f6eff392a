"""Tables: aligned text for a terminal, HTML for a notebook."""

from __future__ import annotations

import html
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass


# Control characters, format characters (reversed text, zero width), and separators of lines and paragraphs.
_HIDDEN = {"Cc", "Cf", "Zl", "Zp"}


def printable(text: str) -> str:
    """Returns the text with invisible characters as `\\u{202e}`: names come from untrusted files."""
    return "".join(
        f"\\u{{{ord(char):x}}}" if unicodedata.category(char) in _HIDDEN else char for char in text
    )


@dataclass(frozen=True)
class Table:
    """Rows of text under their headings."""

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]

    def text(self) -> str:
        """Formats aligned columns, indented by two."""
        lines = [[printable(cell) for cell in line] for line in (self.headings, *self.rows)]
        widths = [max(len(line[column]) for line in lines) for column in range(len(self.headings))]
        padded = ("  ".join(cell.ljust(width) for cell, width in zip(line, widths)) for line in lines)
        return "\n".join("  " + line.rstrip() for line in padded)

    def html(self, title: str) -> str:
        """A table with a title."""
        head = "".join(f"<th>{html.escape(cell)}</th>" for cell in self.headings)
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(printable(cell))}</td>" for cell in row) + "</tr>" for row in self.rows
        )
        return f"<b>{html.escape(printable(title))}</b><table><tr>{head}</tr>{body}</table>"
