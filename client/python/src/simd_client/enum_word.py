"""Conversion of a caller's words and counts to messages; invalid ones are refused with a sentence."""

from __future__ import annotations

from typing import Any, get_args


def enum_name(prefix: str, word: str, words: Any, what: str) -> str:
    """Returns the name of an enum's value: its prefix and one of the words of a `Literal`. Raises
    `ValueError` for another word; `what` names the argument."""
    known: tuple[str, ...] = get_args(words)
    if word.lower() not in known:
        raise ValueError(f"there is no {what} {word!r}; give {_one_of(known)}")
    return f"{prefix}_{word.upper()}"


def count_within(what: str, value: int, most: int) -> int:
    """Returns the number. Raises `ValueError` unless it is from 0 to `most`."""
    if not 0 <= value <= most:
        raise ValueError(f"{what} is {value}; give a number from 0 to {most}")
    return value


def _one_of(words: tuple[str, ...]) -> str:
    quoted = [repr(word) for word in words]
    return " or ".join([", ".join(quoted[:-1]), quoted[-1]]) if len(quoted) > 1 else quoted[0]
