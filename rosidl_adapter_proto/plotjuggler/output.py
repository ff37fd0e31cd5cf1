"""What a plugin writes for one message, read within its bounds: which pairs there are, and where their values stand.

Messages of a topic mostly differ only in their values, so a layout that was read once tells where the values of other
outputs are, provided that all bytes but those of values are the same.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.values import NUMBER_FORMATS, Blob, BuiltinType, Value

TIME_KEY = "__timestamp"

NUMBER_SIZES = {kind: int(text[2:]) for kind, text in NUMBER_FORMATS.items()}
BLOB_SIZE = 8

MODULE_KINDS = {
    0: BuiltinType.FLOAT64,
    1: BuiltinType.INT64,
    2: BuiltinType.UINT64,
    3: BuiltinType.BOOL,
    4: BuiltinType.STRING,
}
MODULE_HEADER = struct.Struct("<HBBB7xqI")
MODULE_FIELD_SIZE = 9
SCALAR_ROUTE = 1


@dataclass(frozen=True, slots=True)
class Field:
    """A pair of an output.

    Attributes:
        key: Its key.
        kind: The type of its value.
        offset: Where its value begins; the text of a text, without its length.
        size: How many bytes its value has.
    """

    key: str
    kind: BuiltinType
    offset: int
    size: int


@dataclass(frozen=True, slots=True)
class Layout:
    """Where everything stands in an output.

    Attributes:
        fields: Its pairs, without the one that is the time.
        time: The value that is the time of the message, or None: seconds, or nanoseconds if `time_in_nanoseconds`.
        time_in_nanoseconds: Whether the time is in nanoseconds, as modules have it.
        ignored: Bytes that may have any value: begin and end.
    """

    fields: tuple[Field, ...]
    time: Field | None = None
    time_in_nanoseconds: bool = False
    ignored: tuple[tuple[int, int], ...] = ()


ReadLayout: TypeAlias = Callable[[bytes, bool], Layout]
"""Reads the layout of an output; the flag tells whether a time in it is the time of the message."""


def read_released(data: bytes, embedded_time: bool) -> Layout:
    """Read what `pj_parser_decode` wrote: lengths of texts have 32 bits.

    Raises:
        PluginError: It is not what it should be; the text says at which byte.
    """
    return _read_pairs(data, embedded_time, "<I", NUMBER_SIZES)


def read_page(data: bytes, embedded_time: bool) -> Layout:
    """Read what `pj_parser_parse` wrote: lengths of texts have 16 bits, and there is no `BOOL`.

    Raises:
        PluginError: It is not what it should be; the text says at which byte.
    """
    return _read_pairs(data, embedded_time, "<H", _PAGE_NUMBERS)


_PAGE_NUMBERS: dict[BuiltinType, int] = {
    kind: size for kind, size in NUMBER_SIZES.items() if kind != BuiltinType.BOOL
}


def _read_pairs(
    data: bytes, embedded_time: bool, length_format: str, numbers: dict[BuiltinType, int]
) -> Layout:
    reader = _Reader(data)
    count: int = reader.number("<I", "the number of pairs")
    smallest = struct.calcsize(length_format) + 2
    if count * smallest > len(data) - 4:
        raise PluginError(f"says that it has {count} pairs, which {len(data)} bytes cannot hold")
    fields = []
    time = None
    for index in range(count):
        key = reader.text(length_format, f"the key of pair {index}")
        kind_offset = reader.offset
        kind = _builtin_type(reader.number("<B", f"the type of {key}"), kind_offset, key)
        if kind in numbers:
            field = Field(key, kind, *reader.skip(numbers[kind], f"the value of {key}"))
        elif kind == BuiltinType.STRING:
            size: int = reader.number(length_format, f"the length of {key}")
            field = Field(key, kind, *reader.skip(size, f"the text of {key}"))
        elif kind == BuiltinType.BLOB:
            field = Field(key, kind, *reader.skip(BLOB_SIZE, f"the blob of {key}"))
        else:
            raise PluginError(f"byte {kind_offset}: {key} has the type {kind.name}, which has no value here")
        if embedded_time and key == TIME_KEY:
            if index or kind not in numbers:
                raise PluginError(f"byte {kind_offset}: {TIME_KEY} is not a number in the first pair")
            time = field
        else:
            fields.append(field)
    if reader.offset != len(data):
        raise PluginError(f"byte {reader.offset}: {len(data) - reader.offset} bytes follow the last pair")
    return Layout(tuple(fields), time)


def read_module(data: bytes, embedded_time: bool) -> Layout:
    """Read what `pj_module_parse` gave: numbers of 64 bits, bools and texts, names behind the values.

    Keys get the `/` that names have not.

    Raises:
        PluginError: It is not what it should be; the text says at which byte.
    """
    reader = _Reader(data)
    reader.skip(MODULE_HEADER.size, "the header")
    version, route, _, has_time, _, count = MODULE_HEADER.unpack_from(data)
    if (version, route) != (1, SCALAR_ROUTE):
        raise PluginError(f"byte 0: version {version} and route {route} instead of 1 and {SCALAR_ROUTE}")
    if has_time > 1:
        raise PluginError(f"byte 4: {has_time} says neither that there is a time nor that there is none")
    if count * (MODULE_FIELD_SIZE + 1) > len(data) - MODULE_HEADER.size:
        raise PluginError(f"says that it has {count} fields, which {len(data)} bytes cannot hold")
    fields = []
    for index in range(count):
        name_offset: int = reader.number("<I", f"the place of name {index}")
        name_size: int = reader.number("<I", f"the length of name {index}")
        if name_offset + name_size > len(data):
            raise PluginError(
                f"byte {reader.offset - 8}: name {index} is at {name_offset} and has {name_size} bytes,"
                f" but there are {len(data)}"
            )
        key = "/" + _utf8(data[name_offset : name_offset + name_size], name_offset, f"name {index}")
        number: int = reader.number("<B", f"the type of {key}")
        if number not in MODULE_KINDS:
            raise PluginError(f"byte {reader.offset - 1}: {key} has the type {number}, which there is not")
        kind = MODULE_KINDS[number]
        if kind == BuiltinType.STRING:
            size: int = reader.number("<I", f"the length of {key}")
        else:
            size = NUMBER_SIZES[kind]
        fields.append(Field(key, kind, *reader.skip(size, f"the value of {key}")))
    time = Field(TIME_KEY, BuiltinType.INT64, 12, 8) if embedded_time and has_time else None
    return Layout(tuple(fields), time, time_in_nanoseconds=True, ignored=((3, 4), (5, 20)))


def field_value(data: bytes, field: Field, message_size: int) -> Value:
    """Return the value of a pair.

    Args:
        data: The output.
        field: Where the value is in it.
        message_size: How many bytes the message has that it was made of.

    Raises:
        PluginError: A text that is not UTF-8, or a blob that is not in the message.
    """
    if field.kind == BuiltinType.STRING:
        return _utf8(data[field.offset : field.offset + field.size], field.offset, f"the text of {field.key}")
    if field.kind == BuiltinType.BLOB:
        offset, size = struct.unpack_from("<II", data, field.offset)
        if offset + size > message_size:
            raise blob_outside(field, offset, size, message_size)
        return Blob(offset, size)
    number: bool | int | float
    (number,) = struct.unpack_from(_STRUCT_FORMATS[field.kind], data, field.offset)
    return number


_STRUCT_LETTERS = {"u1": "B", "u2": "H", "u4": "I", "u8": "Q", "i1": "b", "i2": "h", "i4": "i", "i8": "q"}
_STRUCT_LETTERS |= {"f4": "f", "f8": "d"}
_STRUCT_FORMATS = {kind: "<" + _STRUCT_LETTERS[text[1:]] for kind, text in NUMBER_FORMATS.items()}
_STRUCT_FORMATS[BuiltinType.BOOL] = "<?"


def message_time(data: bytes, layout: Layout) -> int:
    """Return the time that is in an output that has one, in nanoseconds.

    Raises:
        PluginError: It is not a number of seconds that there is.
    """
    assert layout.time is not None
    value = field_value(data, layout.time, 0)
    assert isinstance(value, (int, float))
    if layout.time_in_nanoseconds:
        return int(value)
    if not abs(value) < MAXIMUM_SECONDS:
        raise no_time(layout.time, float(value))
    return round(value * 1e9)


MAXIMUM_SECONDS = 2**63 / 1e9


def no_time(field: Field, seconds: float) -> PluginError:
    """Return the error for seconds that are no time in 64 bits of nanoseconds."""
    return PluginError(f"byte {field.offset}: {seconds} seconds are no time since 1970")


def blob_outside(field: Field, offset: int, size: int, message_size: int) -> PluginError:
    """Return the error for a blob that the message has not."""
    return PluginError(
        f"byte {field.offset}: {field.key} is a blob of {size} bytes at {offset},"
        f" but the message has {message_size} bytes"
    )


def _builtin_type(number: int, offset: int, key: str) -> BuiltinType:
    try:
        return BuiltinType(number)
    except ValueError:
        raise PluginError(f"byte {offset}: {key} has the type {number}, which there is not") from None


def _utf8(data: bytes, offset: int, what: str) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        raise PluginError(f"byte {offset + error.start}: {what} is not UTF-8") from None


class _Reader:
    """Takes one thing after the other, none past the end.

    Attributes:
        data: The output.
        offset: Where the next thing begins.
    """

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.offset = 0

    def skip(self, size: int, what: str) -> tuple[int, int]:
        """Step over bytes, and return where they begin and how many they are."""
        begin = self.offset
        if size > len(self.data) - begin:
            raise PluginError(f"byte {begin}: {what} has {size} bytes, but {len(self.data) - begin} are left")
        self.offset = begin + size
        return begin, size

    def number(self, number_format: str, what: str) -> int:
        begin, _ = self.skip(struct.calcsize(number_format), what)
        value: int
        (value,) = struct.unpack_from(number_format, self.data, begin)
        return value

    def text(self, length_format: str, what: str) -> str:
        begin, size = self.skip(self.number(length_format, f"the length of {what}"), what)
        return _utf8(self.data[begin : begin + size], begin, what)
