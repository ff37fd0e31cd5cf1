"""How a mistake in a definition is shown: what is wrong, where, and the line itself."""

from __future__ import annotations

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.model import Location

_LONGEST_EXCERPT = 200


def problem(message: str, text: str, location: Location) -> DefinitionError:
    """Return the error for a mistake at `location` of a definition.

    Its text is `file:line:column: message`, the source line, and a caret under the column.

    Args:
        message: What is wrong and what to do, without the place.
        text: The whole text that the location counts lines of.
        location: Where the mistake is.
    """
    lines = text.split("\n")
    line = lines[location.line - 1].rstrip("\r") if location.line <= len(lines) else ""
    start = max(0, location.column - 1 - _LONGEST_EXCERPT // 2)
    excerpt = line[start : start + _LONGEST_EXCERPT] if len(line) > _LONGEST_EXCERPT else line
    before_caret = excerpt[: location.column - 1 - (start if excerpt != line else 0)]
    # A tab stays a tab below, so that it is as wide in the line of the caret as in the line above.
    padding = "".join("\t" if each == "\t" else " " for each in before_caret)
    return DefinitionError(f"{location}: {message}\n  {excerpt}\n  {padding}^")


def wide_string_warning(bound: int) -> str:
    """Return what to know of a sequence of wide strings with a bound, `wstring<=5[]` or `sequence<wstring<5>>`."""
    return (
        f"ROS 2 takes the bound of these wide strings for that of the sequence too, and so it is generated: at most "
        f"{bound} elements; give the sequence a bound of its own"
    )
