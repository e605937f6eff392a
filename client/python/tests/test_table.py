"""Tables with names from untrusted files."""

from __future__ import annotations

from simd_client.table import Table


def test_invisible_characters_are_written_out() -> None:
    table = Table(["joint"], [["a\u202eb\u200bc"], ["\x1b[31m"], ["\u00e9paule 1"]])
    assert table.text() == "  joint\n  a\\u{202e}b\\u{200b}c\n  \\u{1b}[31m\n  \u00e9paule 1"
    page = table.html("\u2028")
    assert page.startswith("<b>\\u{2028}</b>") and "<td>a\\u{202e}b\\u{200b}c</td>" in page
