"""What plugins write is read within its bounds: what is wrong is told with its place."""

from __future__ import annotations

import random
import struct
from array import array

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import Error, PluginError
from rosidl_adapter_proto.plotjuggler.host import open_plugin
from rosidl_adapter_proto.plotjuggler.output import (
    ReadLayout,
    field_value,
    read_module,
    read_page,
    read_released,
)
from rosidl_adapter_proto.plotjuggler.values import BuiltinType
from tests.plotjuggler import outputs, wat

B = BuiltinType
DOUBLE = ("/x", B.FLOAT64, bytes(8))
TEXT = ("/text", B.STRING, b"value")
BLOB = ("/blob", B.BLOB, struct.pack("<II", 5, 6))
TIME = ("__timestamp", B.FLOAT64, struct.pack("<d", 1.5))


def replaced(data: bytes, offset: int, new: bytes) -> bytes:
    return data[:offset] + new + data[offset + len(new) :]


RELEASED = {
    b"": "byte 0: the number of pairs has 4 bytes, but 0 are left",
    b"\1\0\0": "byte 0: the number of pairs has 4 bytes, but 3 are left",
    b"\1\0\0\0": "says that it has 1 pairs, which 4 bytes cannot hold",
    b"\xff\xff\xff\xff" + bytes(60): "says that it has 4294967295 pairs, which 64 bytes cannot hold",
    bytes(5): "byte 4: 1 bytes follow the last pair",
    outputs.released(DOUBLE)[:-1]: "byte 11: the value of /x has 8 bytes, but 7 are left",
    replaced(
        outputs.released(DOUBLE), 4, b"\xff\xff\xff\xff"
    ): "byte 8: the key of pair 0 has 4294967295 bytes,"
    " but 11 are left",
    replaced(outputs.released(DOUBLE), 8, b"\xff"): "byte 8: the key of pair 0 is not UTF-8",
    replaced(outputs.released(DOUBLE), 9, b"\xc3"): "byte 9: the key of pair 0 is not UTF-8",
    outputs.released(
        DOUBLE, ("/y", B.OTHER, bytes(8))
    ): "byte 25: /y has the type OTHER, which has no value here",
    replaced(outputs.released(DOUBLE), 10, b"\4"): "byte 10: /x has the type 4, which there is not",
    outputs.released(TEXT)[:-1]: "byte 18: the text of /text has 5 bytes, but 4 are left",
    replaced(
        outputs.released(TEXT), 14, b"\xff\xff"
    ): "byte 18: the text of /text has 65535 bytes, but 5 are left",
    outputs.released(BLOB)[:-1]: "byte 14: the blob of /blob has 8 bytes, but 7 are left",
    replaced(outputs.released(DOUBLE, DOUBLE), 0, b"\1"): "byte 19: 15 bytes follow the last pair",
    replaced(
        outputs.released(DOUBLE, DOUBLE), 0, b"\3"
    ): "byte 34: the length of the key of pair 2 has 4 bytes,"
    " but 0 are left",
}
PAGE = {
    outputs.page(("/b", B.BOOL, b"\1")): "byte 8: /b has the type BOOL, which has no value here",
    replaced(outputs.page(TEXT), 12, b"\6"): "byte 14: the text of /text has 6 bytes, but 5 are left",
    replaced(outputs.page(DOUBLE), 4, b"\xff"): "byte 6: the key of pair 0 has 255 bytes, but 11 are left",
}
MODULE_DOUBLE = outputs.module(DOUBLE)
MODULE_TEXT = outputs.module(TEXT)
MODULE = {
    MODULE_DOUBLE[:23]: "byte 0: the header has 24 bytes, but 23 are left",
    replaced(MODULE_DOUBLE, 0, b"\2"): "byte 0: version 2 and route 1 instead of 1 and 1",
    replaced(MODULE_DOUBLE, 2, b"\2"): "byte 0: version 1 and route 2 instead of 1 and 1",
    replaced(MODULE_DOUBLE, 4, b"\2"): "byte 4: 2 says neither that there is a time nor that there is none",
    replaced(MODULE_DOUBLE, 20, b"\2"): "says that it has 2 fields, which 42 bytes cannot hold",
    replaced(MODULE_DOUBLE, 24, b"\x2a"): "byte 24: name 0 is at 42 and has 1 bytes, but there are 42",
    replaced(MODULE_DOUBLE, 32, b"\5"): "byte 32: /x has the type 5, which there is not",
    replaced(MODULE_DOUBLE, 41, b"\xff"): "byte 41: name 0 is not UTF-8",
    replaced(MODULE_TEXT, 33, b"\xff"): "byte 37: the value of /text has 255 bytes, but 9 are left",
}
READERS: list[tuple[ReadLayout, bytes, str]] = [
    *((read_released, data, reason) for data, reason in RELEASED.items()),
    *((read_page, data, reason) for data, reason in PAGE.items()),
    *((read_module, data, reason) for data, reason in MODULE.items()),
]


@pytest.mark.parametrize(("read", "data", "reason"), READERS, ids=range(len(READERS)))
def test_what_is_wrong_is_told(read: ReadLayout, data: bytes, reason: str) -> None:
    with pytest.raises(PluginError) as caught:
        read(data, False)
    assert str(caught.value) == reason


def both(data: bytes, embedded_time: bool = False) -> str:
    """Return what is said of an output, of a message alone and in a batch."""
    texts = []
    for batch in (False, True):
        parser = open_plugin(wat.plugin()).parser("/t", "T", b"", embedded_time=embedded_time)
        with pytest.raises(PluginError) as caught:
            if batch:
                good = outputs.released(DOUBLE)
                ranges = array("Q", [0, len(good), len(good), len(good) + len(data)])
                parser.parse_batch(good + data, ranges)
            else:
                parser.parse(data)
        texts.append(str(caught.value).removeprefix(f"plugin: /t (T): message {int(batch)}: "))
    assert texts[0] == texts[1]
    return texts[0]


def test_values_that_are_wrong() -> None:
    assert both(replaced(outputs.released(TEXT), 19, b"\xff")) == "byte 19: the text of /text is not UTF-8"
    blob = outputs.released(("/blob", B.BLOB, struct.pack("<II", 20, 3)))
    assert both(blob) == "byte 14: /blob is a blob of 3 bytes at 20, but the message has 22 bytes"
    assert "4294967295 bytes at 4294967295" in both(replaced(blob, 14, b"\xff" * 8))


def test_times_that_are_wrong() -> None:
    for value, text in ((float("nan"), "nan"), (1e10, "10000000000.0"), (float("-inf"), "-inf")):
        data = outputs.released(("__timestamp", B.FLOAT64, struct.pack("<d", value)))
        assert both(data, True) == f"byte 20: {text} seconds are no time since 1970"
    assert (
        both(outputs.released(DOUBLE, TIME), True) == "byte 34: __timestamp is not a number in the first pair"
    )
    word = outputs.released(("__timestamp", B.STRING, b"now"))
    assert both(word, True) == "byte 19: __timestamp is not a number in the first pair"


GOOD: dict[ReadLayout, bytes] = {
    read_released: outputs.released(
        DOUBLE, TEXT, BLOB, TIME, ("/b", B.BOOL, b"\1"), ("/i", B.INT16, b"\1\2")
    ),
    read_page: outputs.page(TIME, DOUBLE, TEXT, BLOB, ("/i", B.UINT32, b"\1\2\3\4")),
    read_module: outputs.module(DOUBLE, TEXT, ("/b", B.BOOL, b"\1"), ("/i", B.INT64, bytes(8)), time=5),
}


@given(st.sampled_from(list(GOOD)), st.booleans(), st.data())
def test_damaged_outputs_give_our_errors_alone(
    read: ReadLayout, embedded_time: bool, data: st.DataObject
) -> None:
    output = bytearray(GOOD[read])
    for _ in range(data.draw(st.integers(0, 4))):
        output[data.draw(st.integers(0, len(output) - 1))] = data.draw(st.integers(0, 255))
    output = output[: data.draw(st.integers(0, len(output)))]
    _read_all(read, bytes(output), embedded_time)


@given(st.sampled_from(list(GOOD)), st.booleans(), st.binary(max_size=200))
def test_garbage_gives_our_errors_alone(read: ReadLayout, embedded_time: bool, data: bytes) -> None:
    _read_all(read, data, embedded_time)


def _read_all(read: ReadLayout, data: bytes, embedded_time: bool) -> None:
    try:
        layout = read(data, embedded_time)
        for field in layout.fields:
            field_value(data, field, 50)
    except Error:
        return
    ends = [field.offset + field.size for field in layout.fields]
    assert max(ends, default=0) <= len(data)


def test_damaged_outputs_in_batches_are_as_alone() -> None:
    """Outputs that differ in any byte: what a batch says is what single messages say."""
    chance = random.Random(7)
    parser = open_plugin(wat.plugin()).parser("/t", "T", b"")
    good = outputs.released(DOUBLE, TEXT, ("/i", B.INT16, b"\1\2"))
    for _ in range(300):
        messages = []
        for _ in range(5):
            damaged = bytearray(good)
            damaged[chance.randrange(len(good))] = chance.randrange(256)
            messages.append(bytes(damaged))
        expected = []
        problem = None
        for message in messages:
            try:
                expected.append(
                    [(each.key, each.kind, repr(each.value)) for each in parser.parse(message).pairs]
                )
            except PluginError as error:
                problem = str(error)
                break
        size = len(good)
        ranges = array("Q", [edge for at in range(5) for edge in (at * size, at * size + size)])
        try:
            batch = parser.parse_batch(b"".join(messages), ranges)
        except PluginError:
            assert problem is not None
            continue
        assert problem is None
        found: list[list[tuple[str, BuiltinType, str]]] = [[] for _ in messages]
        for column in batch.columns:
            values = column.values if isinstance(column.values, list) else column.values.tolist()
            for index, value in zip(column.messages.tolist(), values, strict=True):
                found[index].append((column.key, column.kind, repr(value)))
        assert [sorted(each) for each in found] == [sorted(each) for each in expected]
