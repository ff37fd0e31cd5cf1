"""Single values and their errors: what generated conversions call for fields that are no arrays of numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Sized
from math import isfinite
from typing import Any, TypeVar

from rosidl_adapter_proto.errors import ConversionError

SizedT = TypeVar("SizedT", bound=Sized)

CONVERSION_ERRORS = (ConversionError, TypeError, ValueError, OverflowError, AttributeError, AssertionError)
"""What a value that does not fit can raise while it is converted; the setters of ROS messages assert."""

LARGEST_FLOAT32 = 3.4028235677973366e38
"""Halfway between the largest float32 and the next power of two: from here on a float becomes infinite."""

NO_SEQUENCES = (str, bytes, bytearray, memoryview, set, frozenset, Mapping)
"""What can be iterated over, but is not the sequence that a field of ROS wants."""


def conversion_error(type_name: str, field: str, error: Exception) -> ConversionError:
    """Return the error for a field of a type, where `error` was raised while that field was converted."""
    if not isinstance(error, ConversionError):
        return ConversionError(type_name, field, str(error))
    inner = error.field_path
    separator = "." if field and inner and not inner.startswith("[") else ""
    return ConversionError(type_name, f"{field}{separator}{inner}", error.reason)


def in_range(value: int, lowest: int, highest: int) -> int:
    """Return an integer that is not outside the range."""
    if lowest <= value <= highest:
        return value
    raise ValueError(f"{value} is not in the range from {lowest} to {highest}")


def float32(value: float) -> float:
    """Return a number that a float32 can hold."""
    if -LARGEST_FLOAT32 < value < LARGEST_FLOAT32 or not isfinite(value):
        return value
    raise ValueError(f"{value} is too large for a float32")


def at_most(values: SizedT, bound: int, what: str = "element") -> SizedT:
    """Return values that are not more than the bound."""
    if len(values) > bound:
        raise ValueError(f"{_count(len(values), what)}, more than the bound of {bound}")
    return values


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"


def exactly(values: SizedT, size: int) -> SizedT:
    """Return values that are as many as the array is long."""
    if len(values) != size:
        raise ValueError(f"{_count(len(values), 'element')}, but the array has {size}")
    return values


def absent_or_exactly(values: SizedT, size: int) -> SizedT:
    """Return the values of an array in protobuf: none, which stands for zeros, or all."""
    if len(values) not in (0, size):
        raise ValueError(f"{_count(len(values), 'element')}, but the array has {size} (or none, for zeros)")
    return values


def text(value: str, bound: int) -> str:
    """Return a string of at most `bound` characters."""
    return at_most(value, bound, "character")


def each(convert: Callable[[Any], Any], values: Iterable[Any]) -> list[Any]:
    """Convert each element; an error names its index."""
    converted: list[Any] = []
    try:
        for value in values:
            converted.append(convert(value))
    except CONVERSION_ERRORS as error:
        raise conversion_error("", f"[{len(converted)}]", error) from None
    return converted


def sequence(values: Iterable[Any]) -> Iterable[Any]:
    """Return the values of a sequence; a single string, or what has no order, is none."""
    if isinstance(values, NO_SEQUENCES):
        raise TypeError(f"expected a sequence, not {type(values).__name__}")
    return values


def ros_string(value: str) -> str:
    """Return a string that ROS can hold: NUL ends a string there."""
    if "\0" in value:
        raise ValueError(f"a string of ROS cannot hold NUL, as at character {value.index(chr(0))}")
    return value


def string(value: object) -> str:
    """Return a string; anything else is an error."""
    if isinstance(value, str):
        return value
    raise TypeError(f"expected str, not {type(value).__name__}")


def boolean(value: Any) -> bool:
    """Return a bool; anything else, other than 0 and 1, is an error."""
    if value is True or value is False or value in (0, 1):  # the latter for numpy.bool_
        return bool(value)
    raise TypeError(f"expected bool, not {value!r}")


def octet(value: bytes | int) -> int:
    """Return the number of a ROS octet, which is a single byte in Python; some libraries have a number already."""
    return ord(value) if isinstance(value, bytes) else in_range(value, 0, 0xFF)


def ros_octet(value: int) -> bytes:
    """Return the single byte that is a ROS octet in Python."""
    return bytes((in_range(value, 0, 0xFF),))


def octets(values: Sequence[bytes | int]) -> bytes:
    """Return ROS octets, each a single byte in Python, as one bytes object."""
    if isinstance(values, (bytes, bytearray, memoryview)):
        return bytes(values)
    return bytes(each(octet, values))


def ros_octets(values: bytes) -> list[bytes]:
    """Return the bytes one by one, as ROS has octets in Python."""
    return [values[index : index + 1] for index in range(len(values))]


def character(value: str, largest: int) -> int:
    """Return the code of a character that is not above `largest`."""
    return in_range(ord(value), 0, largest)


def ros_character(value: int, largest: int) -> str:
    """Return the character of a code that is not above `largest`."""
    return chr(in_range(value, 0, largest))


def characters(values: Iterable[str], largest: int) -> str:
    """Return characters, the wide ones of which are UTF-16 code units, as one string."""
    units = "".join(chr(code) for code in each(lambda value: character(value, largest), values))
    try:
        return ros_wide(wide(units)).encode().decode()
    except UnicodeEncodeError as error:
        raise ValueError(
            f"half of a surrogate pair stands alone, as at character {error.start}; send both halves"
        ) from None


def ros_characters(values: str, largest: int) -> list[str]:
    """Return the characters of a string one by one, wide ones as UTF-16 code units."""
    return each(lambda unit: ros_character(unit, largest), memoryview(wide(values)).cast("H"))


def wide(value: str) -> bytes:
    """Return a wide string as its UTF-16 code units, little-endian; a surrogate may stand alone, as in ROS."""
    return string(value).encode("utf-16-le", "surrogatepass")


def ros_wide(value: bytes) -> str:
    """Return the wide string of UTF-16 code units."""
    return value.decode("utf-16-le", "surrogatepass")
