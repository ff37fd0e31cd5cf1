"""Columns: what the core fills from CDR and from protobuf is what protobuf objects have."""

from __future__ import annotations

import array
import random
import struct
from typing import Any

import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference_cdr import write_cdr
from ros_types import (
    Types,
    nasty_types,
    protobuf_message,
    random_value,
    struct_type,
)

from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.errors import RequestError, SchemaError
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source
from rosidl_adapter_proto.interfaces.store import distributions
from rosidl_adapter_proto.schema.registry import Schema
from rosidl_adapter_proto.transcode import TranscodeError, Transcoder
from rosidl_adapter_proto.transcode.arrow import ColumnReader
from tests.columns import row_of, rows_of, schema_of

ROWS = 4
NASTY = nasty_types()
TIMES: Types = {
    **struct_type("builtin_interfaces/msg/Time", sec="int32", nanosec="uint32"),
    **struct_type("builtin_interfaces/msg/Duration", sec="int32", nanosec="uint32"),
}
STRING = struct_type("test/msg/String", data="string")


def check(types: Types, schema: Schema, seed: str) -> None:
    """Check that columns read from CDR, in both byte orders, and from protobuf have what protobuf objects have."""
    rng = random.Random(seed)
    name = schema.type_name
    values = [random_value(types, name, rng) for _ in range(ROWS)]
    messages = [protobuf_message(types, name, each, schema.message_class()) for each in values]
    expected = [repr(row_of(types, name, each)) for each in messages]
    serialized = {
        "cdr": [write_cdr(types, name, each) for each in values],
        "big-endian cdr": [write_cdr(types, name, each, big_endian=True) for each in values],
        "protobuf": [each.SerializeToString() for each in messages],
    }
    for form, each in serialized.items():
        reader = ColumnReader(schema, serialization_format=form.rpartition(" ")[2])
        assert reader.append(each) == ROWS
        batch = reader.record_batch()
        assert batch.num_rows == ROWS
        assert batch.schema == reader.arrow_schema
        found = rows_of(batch) if batch.num_columns else [{}] * ROWS
        assert list(map(repr, found)) == expected, (name, form)


def described(schema: Schema) -> Types:
    description: Any = schema.type_description
    every = (description["type_description"], *description["referenced_type_descriptions"])
    return {each["type_name"]: each for each in every}


@pytest.mark.parametrize("store", ["installed", *distributions()])
def test_every_type(store: str) -> None:
    registry = TypeRegistry() if store == "installed" else TypeRegistry(Catalog((store_source(store),)))
    for name in list(registry):
        schema = registry[name]
        for each in (schema, *schema.parts.values()):
            if each.message is not None:
                check(described(each), each, each.type_name)


@pytest.mark.parametrize("name", NASTY)
def test_every_kind_of_field(name: str) -> None:
    for seed in range(10):
        check(NASTY, schema_of(NASTY, name), f"{name} {seed}")


def test_types_of_columns() -> None:
    types = {
        **TIMES,
        **struct_type("test/msg/Empty", structure_needs_at_least_one_member="uint8"),
        **struct_type(
            "test/msg/All",
            flag="boolean",
            raw="octet",
            letter="char",
            wide_letter="wchar",
            small="int8",
            text="string",
            wide="wstring",
            blob="uint8[]",
            uuid="uint8[16]",
            offsets="int8[]",
            letters="char[2]",
            numbers="float[<=3]",
            matrix="double[9]",
            texts="string[]",
            stamp="builtin_interfaces/msg/Time",
            stamps="builtin_interfaces/msg/Time[]",
            lifetime="builtin_interfaces/msg/Duration",
            nothing="test/msg/Empty",
            nothings="test/msg/Empty[]",
        ),
    }

    def of(item: pa.DataType, size: int = -1) -> pa.DataType:
        return pa.list_(pa.field("item", item, nullable=False), size)

    expected = {
        "flag": pa.bool_(),
        "raw": pa.uint8(),
        "letter": pa.uint8(),
        "wide_letter": pa.uint16(),
        "small": pa.int8(),
        "text": pa.string(),
        "wide": pa.string(),
        "blob": pa.binary(),
        "uuid": pa.binary(16),
        "offsets": of(pa.int8()),
        "letters": of(pa.uint8(), 2),
        "numbers": of(pa.float32()),
        "matrix": of(pa.float64(), 9),
        "texts": of(pa.string()),
        "stamp": pa.timestamp("ns"),
        "stamps": of(pa.timestamp("ns")),
        "lifetime": pa.duration("ns"),
    }
    found = ColumnReader(schema_of(types, "test/msg/All")).arrow_schema
    assert found == pa.schema([pa.field(*each, nullable=False) for each in expected.items()])


def test_times_are_counted_in_nanoseconds() -> None:
    cdr = struct.pack("<4siI", b"\0\1\0\0", -2, 4_294_967_295)
    types = {**TIMES, **struct_type("test/msg/T", stamp="builtin_interfaces/msg/Time")}
    reader = ColumnReader(schema_of(types, "test/msg/T"))
    reader.append([cdr])
    assert rows_of(reader.record_batch()) == [{"stamp": 2_294_967_295}]


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        (["c.x", "a"], {"a": 1, "c": {"x": 3}}),
        (["stamp.sec"], {"stamp": {"sec": 5}}),
        (["stamp"], {"stamp": 5_000_000_006}),
        (["stamp.sec", "stamp.nanosec"], {"stamp": 5_000_000_006}),
        (["cs.y"], {"cs": [{"y": 8}]}),
    ],
)
@pytest.mark.parametrize("form", ["cdr", "protobuf"])
def test_chosen_fields(fields: list[str], expected: dict[str, Any], form: str) -> None:
    types = {
        **TIMES,
        **struct_type("test/msg/C", x="int32", y="int32"),
        **struct_type(
            "test/msg/A",
            a="int32",
            b="string",
            c="test/msg/C",
            stamp="builtin_interfaces/msg/Time",
            cs="test/msg/C[]",
            last="string",
        ),
    }
    schema = schema_of(types, "test/msg/A")
    value = {
        "a": 1,
        "b": "b",
        "c": {"x": 3, "y": 4},
        "stamp": {"sec": 5, "nanosec": 6},
        "cs": [{"x": 7, "y": 8}],
        "last": "",
    }
    reader = ColumnReader(schema, fields, serialization_format=form)
    if form == "cdr":
        reader.append([write_cdr(types, "test/msg/A", value)])
    else:
        reader.append(
            [protobuf_message(types, "test/msg/A", value, schema.message_class()).SerializeToString()]
        )
    assert rows_of(reader.record_batch()) == [expected]


def test_messages_of_ros_1() -> None:
    types = {
        **TIMES,
        **struct_type("test/msg/Empty", structure_needs_at_least_one_member="uint8"),
        **struct_type(
            "test/msg/R",
            a="int8",
            stamp="builtin_interfaces/msg/Time",
            names="string[]",
            nothing="test/msg/Empty",
            x="double",
        ),
    }
    ros1 = struct.pack("<bIIII2sI0sd", 1, 5, 6, 2, 2, b"ab", 0, b"", 2.5)
    reader = ColumnReader(schema_of(types, "test/msg/R"), serialization_format="ros1")
    reader.append([ros1])
    assert rows_of(reader.record_batch()) == [{"a": 1, "stamp": 5_000_000_006, "names": ["ab", ""], "x": 2.5}]
    with pytest.raises(TranscodeError, match="1 bytes follow the last field"):
        reader.append([ros1 + b"0"])


# Batches -------------------------------------------------------------------------------------------------------------


def string(text: str) -> bytes:
    return struct.pack("<4sI", b"\0\1\0\0", len(text) + 1) + text.encode() + b"\0"


def texts(batch: pa.RecordBatch) -> list[str]:
    return [each["data"] for each in rows_of(batch)]


def test_record_batches_have_so_many_rows() -> None:
    reader = ColumnReader(schema_of(STRING, "test/msg/String"), maximum_rows=2)
    messages = [string(each) for each in "abcde"]
    assert [texts(each) for each in reader.record_batches(messages)] == [["a", "b"], ["c", "d"], ["e"]]


def test_record_batches_have_so_many_bytes() -> None:
    reader = ColumnReader(schema_of(STRING, "test/msg/String"), maximum_bytes=100)
    sizes = [texts(each) for each in reader.record_batches([string("x" * 30)] * 7)]
    assert list(map(len, sizes)) == [3, 3, 1]


def test_messages_in_one_buffer() -> None:
    reader = ColumnReader(schema_of(STRING, "test/msg/String"))
    messages = [string("a"), string("bc")]
    ranges = array.array("Q", [4, 4 + len(messages[0]), 4 + len(messages[0]), 4 + len(b"".join(messages))])
    buffer = bytearray(b"....") + b"".join(messages)
    assert reader.append(buffer, ranges=ranges, start=1) == 2
    assert texts(reader.record_batch()) == ["bc"]
    assert [texts(each) for each in reader.record_batches(buffer, ranges=ranges)] == [["a", "bc"]]


def test_a_record_batch_keeps_its_memory() -> None:
    reader = ColumnReader(schema_of(STRING, "test/msg/String"))
    reader.append([string("a"), string("b")])
    first = reader.record_batch()
    reader.append([string("c")] * 10)
    second = reader.record_batch()
    del reader
    assert texts(first) == ["a", "b"]
    assert texts(second) == ["c"] * 10


def test_no_rows() -> None:
    reader = ColumnReader(schema_of(NASTY, "test/msg/Nasty"))
    assert rows_of(reader.record_batch()) == []
    assert list(reader.record_batches([])) == []


def test_a_row_that_does_not_fit_is_the_next_batch() -> None:
    # Each element has a gigabyte of zeros, which no byte of the message stands for.
    types = struct_type("test/msg/Zeros", data=f"double[{2**27}]")
    types |= struct_type("test/msg/Many", data="test/msg/Zeros[]")
    schema = schema_of(types, "test/msg/Many")
    message: Any = schema.message_class()
    message.data.add()
    message.data.add()
    too_large = message.SerializeToString()
    reader = ColumnReader(schema, serialization_format="protobuf")
    assert reader.append([b"", too_large]) == 1
    assert rows_of(reader.record_batch()) == [{"data": []}]
    with pytest.raises(TranscodeError) as caught:
        reader.append([too_large])
    assert str(caught.value) == (
        "test/msg/Many.data[1].data at byte 0 of message 0: a column would have more than 2147483647 bytes, or all "
        "of them more than twice that; choose fewer fields"
    )


# Errors --------------------------------------------------------------------------------------------------------------


def refusal(schema: Schema, messages: list[bytes], form: str = "cdr") -> str:
    with pytest.raises(TranscodeError) as caught:
        ColumnReader(schema, serialization_format=form).append(messages)
    return str(caught.value)


def test_invalid_text() -> None:
    schema = schema_of(STRING, "test/msg/String")
    bad = string("a").replace(b"a", b"\xff")
    assert refusal(schema, [string("a"), bad]) == (
        "test/msg/String.data at byte 8 of message 1: the text is not valid UTF-8; encode it as UTF-8, or use "
        "bytes for what is not text"
    )


def test_text_with_nul_inside() -> None:
    schema = schema_of(STRING, "test/msg/String")
    proto = schema.message_class(data="a\0b").SerializeToString()
    for form, message in (("cdr", string("a-b").replace(b"-", b"\0")), ("protobuf", proto)):
        reader = ColumnReader(schema, serialization_format=form)
        reader.append([message])
        assert rows_of(reader.record_batch()) == [{"data": "a\0b"}]


def test_half_of_a_surrogate_pair() -> None:
    types = struct_type("test/msg/W", data="wstring[]")
    schema = schema_of(types, "test/msg/W")
    for units in ((0xD800,), (0xDC00,), (0xD800, 0x61), (0xD800, 0xD800, 0xDC00), (0xDC00, 0xD800)):
        cdr = struct.pack(f"<4sIII{len(units)}I", b"\0\1\0\0", 2, 0, len(units), *units)
        assert refusal(schema, [cdr]) == (
            "test/msg/W.data[1] at byte 16 of message 0: half of a surrogate pair stands alone, which text cannot "
            "hold; send both halves"
        )


def test_other_formats() -> None:
    with pytest.raises(RequestError) as caught:
        ColumnReader(schema_of(STRING, "test/msg/String"), serialization_format="json")
    assert str(caught.value) == (
        "tables are made of cdr, protobuf, ros1 messages, not of 'json' ones; convert them first"
    )


def test_sizes_of_record_batches() -> None:
    for limit in ("maximum_rows", "maximum_bytes"):
        arguments: Any = {limit: 0}
        with pytest.raises(ValueError, match="maximum_rows and maximum_bytes must be 1 or more"):
            ColumnReader(schema_of(STRING, "test/msg/String"), **arguments)


def test_fields_are_a_list() -> None:
    with pytest.raises(TypeError, match=r"^fields must be a list of names, such as \['data'\], not a text$"):
        ColumnReader(schema_of(STRING, "test/msg/String"), "data")


def test_too_many_columns() -> None:
    types = struct_type("test/msg/D0", **{f"f{i}": "int32" for i in range(100)})
    types |= struct_type("test/msg/D1", **{f"f{i}": "test/msg/D0" for i in range(100)})
    types |= struct_type("test/msg/D2", **{f"f{i}": "test/msg/D1" for i in range(100)})
    with pytest.raises(SchemaError) as caught:
        ColumnReader(schema_of(types, "test/msg/D2"))
    assert str(caught.value) == ("test/msg/D2: it has more than 10000 columns; choose some of its fields")
    assert ColumnReader(schema_of(types, "test/msg/D2"), ["f1.f2"]).arrow_schema.names == ["f1"]


@pytest.mark.parametrize("length", [300_000_000, 4_000_000_000])
def test_messages_that_are_too_large(length: int) -> None:
    schema = TypeRegistry.from_texts({"test/msg/Large": f"float64[{length}] x"})["test/msg/Large"]
    for make in (ColumnReader, lambda large: Transcoder(large.type_description, large.descriptor)):
        with pytest.raises(SchemaError) as caught:
            make(schema)
        assert str(caught.value) == "test/msg/Large: a message of this type is larger than 2 GiB"


def test_a_message_that_fails_leaves_no_row() -> None:
    rng = random.Random(1)
    name = "test/msg/Nasty"
    schema = schema_of(NASTY, name)
    values = [random_value(NASTY, name, rng) for _ in range(3)]
    good = [write_cdr(NASTY, name, each) for each in values]
    reader, plain = ColumnReader(schema), ColumnReader(schema)
    for each in good:
        plain.append([each])
        for size in range(0, len(each), 7):
            with pytest.raises(TranscodeError):
                reader.append([each[:size]])
        reader.append([each])
    assert reader.record_batch().equals(plain.record_batch())


@given(data=st.data())
def test_damaged_messages(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(list(NASTY)))
    schema = schema_of(NASTY, name)
    value = random_value(NASTY, name, random.Random(data.draw(st.integers(0, 3))))
    form = data.draw(st.sampled_from(["cdr", "protobuf"]))
    whole = (
        write_cdr(NASTY, name, value)
        if form == "cdr"
        else protobuf_message(NASTY, name, value, schema.message_class()).SerializeToString()
    )
    reader = ColumnReader(schema, serialization_format=form)
    rows = 0
    for _ in range(5):
        message = bytearray(whole)
        for _ in range(data.draw(st.integers(0, 3))):
            place = data.draw(st.integers(0, len(message)))
            message[place : place + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
        try:
            rows += reader.append([bytes(message)])
        except TranscodeError as error:
            assert error.byte_offset <= len(message)
    assert len(reader) == rows
    batch = reader.record_batch()
    batch.validate(full=True)
    assert batch.num_rows == rows
