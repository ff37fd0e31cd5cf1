"""Protobuf wire format, spelled out for tests (https://protobuf.dev/programming-guides/encoding/)."""

from __future__ import annotations

import struct

VARINT, FIXED64, DELIMITED, GROUP_START, GROUP_END, FIXED32 = range(6)


def varint(value: int, *, size: int = 1) -> bytes:
    """Encode a number, negative ones as 64 bits, in at least `size` bytes."""
    value &= 2**64 - 1
    result = bytearray()
    while value >= 0x80 or len(result) < size - 1:
        result.append(value & 0x7F | 0x80)
        value >>= 7
    result.append(value)
    return bytes(result)


def tag(number: int, wire_type: int) -> bytes:
    return varint(number << 3 | wire_type)


def number(field: int, value: int) -> bytes:
    return tag(field, VARINT) + varint(value)


def fixed32(field: int, value: int) -> bytes:
    return tag(field, FIXED32) + struct.pack("<I", value)


def double(field: int, value: float) -> bytes:
    return tag(field, FIXED64) + struct.pack("<d", value)


def delimited(field: int, *parts: bytes) -> bytes:
    content = b"".join(parts)
    return tag(field, DELIMITED) + varint(len(content)) + content
