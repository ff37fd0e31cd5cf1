"""Comments in generated Python."""

from __future__ import annotations

from collections.abc import Iterable

from rosidl_adapter_proto.schema.proto import plain_lines


def docstring_lines(lines: Iterable[str]) -> tuple[str, ...]:
    """Return lines that can stand in a docstring."""
    return tuple(line.replace("\\", "\\\\").replace('"""', r"\"\"\"") for line in plain_lines(lines))
