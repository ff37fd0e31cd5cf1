"""Comments in generated Python."""

from __future__ import annotations

from collections.abc import Iterable


def plain_lines(lines: Iterable[str]) -> tuple[str, ...]:
    return tuple(part.rstrip() for line in lines for part in line.splitlines() or [""])


def docstring_lines(lines: Iterable[str]) -> tuple[str, ...]:
    """Return lines that can stand in a docstring."""
    return tuple(line.replace("\\", "\\\\").replace('"""', r"\"\"\"") for line in plain_lines(lines))
