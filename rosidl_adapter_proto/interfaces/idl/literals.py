"""The values of literals (section 7.2.6)."""

from __future__ import annotations

import re
from collections.abc import Callable

from rosidl_adapter_proto.interfaces.idl.mistakes import Mistake
from rosidl_adapter_proto.interfaces.model import ScalarValue

SMALLEST_INTEGER, LARGEST_INTEGER = -(1 << 63), (1 << 64) - 1
"""The range of whole numbers in constant expressions: that of the types with 64 bits."""

_LONGEST_INTEGER = 100


def _integer(literal: str) -> int:
    base = 16 if literal[:2] in ("0x", "0X") else 8 if literal[0] == "0" else 10
    try:
        value = int(literal[:_LONGEST_INTEGER], base)
    except ValueError:
        raise Mistake("a whole number that begins with 0 is octal: remove the 0") from None
    if len(literal) > _LONGEST_INTEGER or value > LARGEST_INTEGER:
        raise Mistake("a whole number must fit into 64 bits")
    return value


def _character(literal: str) -> str:
    text = _unescaped(literal[literal.index("'") + 1 : -1], wide=literal[0] == "L")
    if len(text) != 1:
        raise Mistake("expected one character between two '")
    return text


LITERALS: dict[str, Callable[[str], ScalarValue]] = {
    "INTEGER": _integer,
    "FLOAT": float,
    "FIXED": lambda literal: float(literal[:-1]),
    "BOOLEAN": lambda literal: literal == "TRUE",
    "CHARACTER": _character,
}
"""What gives the value of each kind of literal, strings aside."""


def string_value(literal: str) -> str:
    """Return the text of a string literal, narrow or wide."""
    wide = literal[0] == "L"
    text = _unescaped(literal[2 if wide else 1 : -1], wide)
    # `rosidl_parser` looks for escaped quotes and backslashes a second time, in what it has decoded.
    return _TWICE_ESCAPED.sub(r"\1", text) if "\\" in text else text


_TWICE_ESCAPED = re.compile(r'\\(["\\])')

# Table 7-9. As in `rosidl_parser`, `\?` is left as it is, and `\u` in a string that is not wide.
_ESCAPE = re.compile(r"""\\(?:([ntvbrfa\\'"])|([0-7]{1,3})|x([0-9A-Fa-f]{1,2})|u([0-9A-Fa-f]{1,4}))""")
_ESCAPED_CHARACTERS = dict(zip("ntvbrfa", "\n\t\v\b\r\f\a", strict=True))


def _unescaped(text: str, wide: bool) -> str:
    def character(match: re.Match[str]) -> str:
        simple, octal, hexadecimal, unicode = match.groups()
        if simple:
            return _ESCAPED_CHARACTERS.get(simple, simple)
        if unicode and not wide:
            return match[0]
        return chr(int(octal, 8) if octal else int(hexadecimal or unicode, 16))

    return _ESCAPE.sub(character, text) if "\\" in text else text


def joined_surrogates(text: str) -> str:
    """Return a text where two `\\u` escapes that make one character (a surrogate pair) are that character."""
    if text.isascii():
        return text
    try:
        return text.encode("utf-16-le", "surrogatepass").decode("utf-16-le")
    except UnicodeDecodeError:
        raise Mistake("half of a surrogate pair is not a character: write both halves") from None
