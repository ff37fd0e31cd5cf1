"""Plugins are run, message by message and in batches."""

from __future__ import annotations

import struct
from array import array

from rosidl_adapter_proto.plotjuggler.host import open_plugin
from rosidl_adapter_proto.plotjuggler.values import BuiltinType, Pair
from tests.plotjuggler import wat


def output(*pairs: tuple[str, BuiltinType, bytes]) -> bytes:
    """Return what a plugin writes in the dialect `released`."""
    written = struct.pack("<I", len(pairs))
    for key, kind, value in pairs:
        written += struct.pack("<I", len(key.encode())) + key.encode() + bytes([kind]) + value
    return written


def test_a_message() -> None:
    parser = open_plugin(wat.plugin()).parser("/topic", "a/Type", b"")
    message = output(
        ("/x", BuiltinType.FLOAT64, struct.pack("<d", 1.5)), ("/y", BuiltinType.INT8, struct.pack("<b", -2))
    )
    parsed = parser.parse(message)
    assert parsed.pairs == (
        Pair("/x", BuiltinType.FLOAT64, 1.5),
        Pair("/y", BuiltinType.INT8, -2),
    )
    assert parsed.refused is None


def test_a_batch() -> None:
    parser = open_plugin(wat.plugin()).parser("/topic", "a/Type", b"")
    data = b""
    ranges = array("Q")
    for index in range(10_000):
        message = output(("/x", BuiltinType.FLOAT64, struct.pack("<d", index)))
        if index == 5:
            message = b""
        ranges.extend((len(data), len(data) + len(message)))
        data += message
    batch = parser.parse_batch(data, ranges)
    (column,) = batch.columns
    assert (column.key, column.kind) == ("/x", BuiltinType.FLOAT64)
    expected = [index for index in range(10_000) if index != 5]
    assert column.messages.tolist() == expected
    assert list(column.values) == expected
    assert batch.refused == {5: "pj_parser_decode returned 0"}
