"""Arrays of numbers, which go as a whole: between `array.array` or numpy on the side of ROS, and bytes of protobuf."""

from __future__ import annotations

import importlib
from array import array
from collections.abc import Callable, Iterable
from functools import cache, lru_cache, partial
from typing import Any, NoReturn

from google.protobuf.message import Message

from rosidl_adapter_proto.adapter.values import NO_SEQUENCES, absent_or_exactly, each, float32, in_range

# The ROS array type of each numeric type: what array.array and numpy call it.
NUMPY_TYPES = {
    "b": "|i1",
    "B": "|u1",
    "h": "<i2",
    "H": "<u2",
    "i": "<i4",
    "I": "<u4",
    "q": "<i8",
    "Q": "<u8",
    "f": "<f4",
    "d": "<f8",
}


_BYTES = (bytes, bytearray, memoryview)


def numbers(values: Any, typecode: str) -> Any:
    """Return numbers as an array (`array.array` or numpy) of the C type that `typecode` names in `array`."""
    if type(values) is array and values.typecode == typecode:
        return values
    dtype = getattr(values, "dtype", None)
    if dtype is not None and dtype.str == NUMPY_TYPES[typecode] and values.ndim == 1:
        return values
    if isinstance(values, NO_SEQUENCES) and not (typecode in "bB" and isinstance(values, _BYTES)):
        raise TypeError(f"expected a sequence of numbers, not {type(values).__name__}")
    if dtype is not None and dtype.kind == "c":
        raise TypeError("expected real numbers, not complex ones")
    if typecode == "f":
        return array("f", each(float32, values))
    try:
        return array(typecode, values)
    except OverflowError:
        _raise_first_that_does_not_fit(values, typecode)


def _raise_first_that_does_not_fit(values: Iterable[int], typecode: str) -> NoReturn:
    bits = 8 * array(typecode).itemsize
    lowest, highest = (-(1 << bits - 1), (1 << bits - 1) - 1) if typecode.islower() else (0, (1 << bits) - 1)
    each(lambda value: in_range(value, lowest, highest), values)
    raise OverflowError(f"a value is not in the range from {lowest} to {highest}")


def packed(field_number: int, values: Any) -> bytes:
    """Return a packed repeated field of fixed-width numbers as it is on the wire (protobuf encoding, "Packed")."""
    data: bytes = values.tobytes()
    return _packed_prefix(field_number, len(data)) + data if data else b""


@lru_cache(maxsize=4096)  # most arrays have the same length again and again
def _packed_prefix(field_number: int, length: int) -> bytes:
    return _varint(field_number << 3 | 2) + _varint(length)


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def packed_fields(message: Message, *field_numbers: int) -> tuple[bytes, ...]:
    """Return the little-endian bytes of packed fixed-width number fields of a message.

    Serializing the whole message and finding them in it takes less time than asking protobuf for a single one.
    """
    message_class: Any = type(message)
    return _native_packed_fields(message_class)(message, *field_numbers)


@cache
def _native_packed_fields(message_class: Any) -> Callable[..., tuple[bytes, ...]]:
    native = importlib.import_module("rosidl_adapter_proto.transcode._core")
    return partial(native.packed_fields, message_class.SerializeToString)


def array_of(data: bytes, typecode: str) -> Any:
    """Return little-endian bytes as a numpy array of the C type of `typecode`."""
    return _numpy().frombuffer(data, NUMPY_TYPES[typecode])


def elements(field: Any, typecode: str) -> Any:
    """Return a repeated number field as an array (`array.array` or numpy) of the C type of `typecode`."""
    # Newer protobuf runtimes give numpy the whole array at once; for others array.array is faster than numpy.
    if hasattr(field, "__array__") and typecode not in "hH":
        return _numpy().asarray(field, dtype=NUMPY_TYPES[typecode])
    return numbers(field, typecode)


@cache
def _numpy() -> Any:
    return importlib.import_module("numpy")


def fill_array(destination: Any, values: Any) -> None:
    """Overwrite a numpy array of a ROS message with the elements of a field; with zeros if it has none."""
    if len(values) == 0:
        destination.fill(0)
    else:
        destination[:] = (
            values if len(values) == len(destination) else absent_or_exactly(values, len(destination))
        )
