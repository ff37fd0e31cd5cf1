"""What is wrong with a value, and how errors show things."""

from __future__ import annotations

import reprlib


class Mistake(Exception):
    """What is wrong with a value, where it is not known in which place of the file it stands."""


def shown(value: object) -> str:
    """Return how errors show a value: shortened if it is long."""
    try:
        return reprlib.repr(value)
    except ValueError:  # Python refuses to print whole numbers of thousands of digits
        return "a number of thousands of digits"


def quoted(token: str) -> str:
    """Return how errors show a piece of a file."""
    text = " ".join(token.split())
    return f"'{text}'" if len(text) <= _LONGEST_QUOTE else f"'{text[:_LONGEST_QUOTE]}...'"


_LONGEST_QUOTE = 40


def listed(words: list[str], conjunction: str) -> str:
    """Return words as a list in a sentence: `a, b or c`."""
    return f" {conjunction} ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))
