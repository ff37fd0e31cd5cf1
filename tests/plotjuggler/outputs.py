"""What plugins write, made for tests without the code that reads it."""

from __future__ import annotations

import struct

from rosidl_adapter_proto.plotjuggler.values import BuiltinType

Written = tuple[str, BuiltinType, bytes]


def released(*pairs: Written) -> bytes:
    """Return pairs as the released host reads them: texts have a length of 32 bits."""
    return _pairs(pairs, "<I")


def page(*pairs: Written) -> bytes:
    """Return pairs as PlotJuggler's page says: texts have a length of 16 bits."""
    return _pairs(pairs, "<H")


def _pairs(pairs: tuple[Written, ...], length: str) -> bytes:
    written = struct.pack("<I", len(pairs))
    for key, kind, value in pairs:
        name = key.encode()
        written += struct.pack(length, len(name)) + name + bytes([kind])
        written += struct.pack(length, len(value)) + value if kind == BuiltinType.STRING else value
    return written


MODULE_NUMBERS = {BuiltinType.FLOAT64: 0, BuiltinType.INT64: 1, BuiltinType.UINT64: 2, BuiltinType.BOOL: 3}
MODULE_NUMBERS |= {BuiltinType.STRING: 4}


def module(*pairs: Written, time: int | None = None) -> bytes:
    """Return values as parser modules give them: names without a slash, behind the values."""
    size = 24 + sum(9 + len(value) + 4 * (kind == BuiltinType.STRING) for _, kind, value in pairs)
    written = struct.pack("<HBBB7xqI", 1, 1, 0, time is not None, time or 0, len(pairs))
    names = b""
    for key, kind, value in pairs:
        name = key.removeprefix("/").encode()
        written += struct.pack("<IIB", size + len(names), len(name), MODULE_NUMBERS[kind])
        written += struct.pack("<I", len(value)) + value if kind == BuiltinType.STRING else value
        names += name
    return written + names
