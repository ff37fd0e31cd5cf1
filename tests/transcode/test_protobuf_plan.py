"""Plans of protobuf messages that do not come from ROS."""

from __future__ import annotations

import random
from typing import Any

import pytest
from google.protobuf import descriptor_pb2, empty_pb2, struct_pb2
from google.protobuf.descriptor import Descriptor
from hypothesis import given
from hypothesis import strategies as st
from protobuf_types import (
    add_field,
    add_message,
    class_of,
    descriptor_of,
    fill,
    general_file,
    set_option,
)
from reference_cdr import write_cdr
from ros_types import struct_type

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.model import Shape
from rosidl_adapter_proto.interfaces.scalars import CdrForm
from rosidl_adapter_proto.transcode import TranscodeError, _core
from rosidl_adapter_proto.transcode.plan import UNBOUNDED, Plan, is_repeated
from rosidl_adapter_proto.transcode.protobuf_plan import (
    MAXIMUM_OPERATIONS,
    NATURAL_FORMS,
    FlatNote,
    is_map_entry,
    protobuf_plan,
)
from tests.transcode.protobuf_schemas import files

NATURAL_VALUES: dict[str, list[Any]] = {
    "int32": [0, 1, -1, 2**31 - 1, -(2**31)],
    "sint32": [0, 1, -1, 2**31 - 1, -(2**31)],
    "sfixed32": [0, 1, -1, 2**31 - 1, -(2**31)],
    "uint32": [0, 1, 127, 128, 2**32 - 1],
    "fixed32": [0, 1, 127, 128, 2**32 - 1],
    "int64": [0, 1, -1, 2**63 - 1, -(2**63)],
    "sint64": [0, 1, -1, 2**63 - 1, -(2**63)],
    "sfixed64": [0, 1, -1, 2**63 - 1, -(2**63)],
    "uint64": [0, 1, 2**64 - 1],
    "fixed64": [0, 1, 2**64 - 1],
    "enum": [0, 7, -3],
    "bool": [True, False],
    "float": [0.0, -1.5],
    "double": [0.0, -1.5],
    "string": ["", "a\u00e9"],
}
"""Values of each protobuf type whose values in CDR have a type of their own."""


def transcoder(plan: Plan) -> _core.Transcoder:
    return _core.Transcoder(plan.pack(), plan.type_name, 2**31 - 1)


def descriptor_with(**fields: str) -> Descriptor:
    """Return the message `test.Type` with some fields; there are the types of `general_file` beside it."""
    file = general_file()
    add_message(file, "Type", **fields)
    return descriptor_of([file], "test.Type")


def operations(descriptor: Descriptor) -> dict[str, tuple[CdrForm, int, Shape]]:
    plan, _ = protobuf_plan(descriptor)
    return {each.name: (each.cdr, each.protobuf, each.shape) for each in plan.messages[0].operations}


@pytest.mark.parametrize("name", NATURAL_VALUES)
def test_in_cdr_a_field_is_what_it_is_by_nature(name: str) -> None:
    text = "enum .test.Color" if name == "enum" else name
    descriptor = descriptor_with(first="bool", one=text, many=f"repeated {text}")
    both_ways = transcoder(protobuf_plan(descriptor)[0])
    scalar, _ = NATURAL_FORMS[name]
    types = struct_type("test/msg/Type", first="boolean", one=scalar, many=f"{scalar}[]")
    for value in NATURAL_VALUES[name]:
        fields = {"first": True, "one": value, "many": NATURAL_VALUES[name]}
        proto = class_of(descriptor)(**fields).SerializeToString()
        cdr = write_cdr(types, "test/msg/Type", fields)
        assert both_ways.proto_to_cdr(proto) == cdr
        assert class_of(descriptor).FromString(both_ways.cdr_to_proto(cdr)) == class_of(descriptor)(
            **{each: found for each, found in fields.items() if found}
        )


def test_bytes_are_a_sequence_of_bytes() -> None:
    descriptor = descriptor_with(one="bytes", many="repeated bytes")
    proto = class_of(descriptor)(one=b"ab", many=[b"", b"\xff\0"]).SerializeToString()
    cdr = bytes.fromhex("00010000 02000000 6162 0000 02000000 00000000 02000000 ff00")
    assert transcoder(protobuf_plan(descriptor)[0]).proto_to_cdr(proto) == cdr
    assert transcoder(protobuf_plan(descriptor)[0]).cdr_to_proto(cdr) == proto
    assert operations(descriptor) == {
        "one": (CdrForm.UINT8, 12, Shape.SEQUENCE),
        "many": (CdrForm.BYTES, 12, Shape.SEQUENCE),
    }


def test_bytes_that_are_cut_off() -> None:
    descriptor = descriptor_with(many="repeated bytes")
    expected = r"^test.Type.many\[0\] at byte 12: 3 bytes are needed and 2 are left; the data is cut off"
    with pytest.raises(TranscodeError, match=expected):
        transcoder(protobuf_plan(descriptor)[0]).cdr_to_proto(
            bytes.fromhex("00010000 01000000 03000000 6162")
        )


def content(message: Any) -> dict[str, Any]:
    """Return all that is not a default; an empty message counts for as much as one that is absent."""
    result = {}
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        part = field.message_type
        if part is not None and is_map_entry(part):
            nested = part.fields_by_name["value"].message_type is not None
            found: Any = {key: content(each) if nested else each for key, each in value.items()}
        elif part is not None:
            parts = value if is_repeated(field) else [value] * message.HasField(field.name)
            found = [content(each) for each in parts]
            found = found if is_repeated(field) else any(found) and found
        else:
            found = list(value) if is_repeated(field) else value
        if found:
            result[field.name] = found
    return result


def check_round_trip(descriptor: Descriptor, seed: int) -> None:
    message = fill(class_of(descriptor)(), random.Random(seed))
    plan, _ = protobuf_plan(descriptor)
    both_ways = transcoder(plan)
    try:
        cdr = both_ways.proto_to_cdr(message.SerializeToString())
    except TranscodeError:  # what was said of a field does not fit its value
        return
    proto = both_ways.cdr_to_proto(cdr)
    assert content(class_of(descriptor).FromString(proto)) == content(message)
    assert both_ways.proto_to_cdr(proto) == cdr


@pytest.mark.parametrize("seed", range(50))
def test_messages_survive_both_directions(seed: int) -> None:
    descriptor = descriptor_of([general_file()], "test.General")
    check_round_trip(descriptor, seed)


@given(files(), st.integers(0, 1000))
def test_any_message_survives_both_directions(file: descriptor_pb2.FileDescriptorProto, seed: int) -> None:
    check_round_trip(descriptor_of([file], "test.M0"), seed)


def test_values_of_python() -> None:
    message = struct_pb2.Struct()
    message.update({"a": 1.5, "b": {"c": ["x", False, None]}})
    both_ways = transcoder(protobuf_plan(message.DESCRIPTOR)[0])
    assert both_ways.cdr_to_proto(both_ways.proto_to_cdr(message.SerializeToString())) is not None


def test_notes() -> None:
    plan, notes = protobuf_plan(descriptor_of([general_file()], "test.General"))
    found = [
        (message.name, operation.name, note)
        for (message, operation), note in zip(
            ((each, operation) for each in plan.messages for operation in each.operations), notes, strict=True
        )
        if note != FlatNote()
    ]
    values = ((-3, "DARK"), (0, "BLACK"), (7, "RED"))
    assert found == [
        ("test.General", "color", FlatNote(enum_values=values)),
        ("test.General", "colors", FlatNote(enum_values=values)),
        ("test.General", "counts", FlatNote(map=True)),
        ("test.General", "nodes", FlatNote(map=True)),
        *[("test.Node", "left", FlatNote(single=True))] * 3,
    ]


def test_nothing_to_say() -> None:
    plan, notes = protobuf_plan(empty_pb2.Empty.DESCRIPTOR)
    assert notes == []
    (operation,) = plan.messages[0].operations
    assert (operation.name, operation.number) == ("structure_needs_at_least_one_member", 0)


def test_a_type_that_contains_itself_goes_four_deep() -> None:
    plan, _ = protobuf_plan(descriptor_of([general_file()], "test.Node"))
    assert [[each.name for each in message.operations] for message in plan.messages] == [
        *[["name", "left", "more"]] * 3,
        ["name"],
    ]
    left, more = plan.messages[0].operations[1:]
    assert (left.shape, left.count, more.shape, more.count) == (Shape.SEQUENCE, 1, Shape.SEQUENCE, UNBOUNDED)


def test_types_that_contain_each_other_are_planned_once_for_each_way_down() -> None:
    plan, _ = protobuf_plan(struct_pb2.Value.DESCRIPTOR)
    assert len(plan.messages) < 50
    names = [each.name for each in plan.messages]
    assert set(names) == {
        f"google.protobuf.{each}" for each in ("Value", "Struct", "ListValue", "Struct.FieldsEntry")
    }


@pytest.mark.parametrize(
    ("text", "type_id", "expected"),
    [
        ("int32", 2, (CdrForm.INT8, 5, Shape.SINGLE)),
        ("int32", 4, (CdrForm.INT16, 5, Shape.SINGLE)),
        ("uint32", 3, (CdrForm.UINT8, 13, Shape.SINGLE)),
        ("uint32", 16, (CdrForm.UINT8, 13, Shape.SINGLE)),
        ("uint32", 13, (CdrForm.CHAR, 13, Shape.SINGLE)),
        ("uint32", 14, (CdrForm.WCHAR, 13, Shape.SINGLE)),
        ("repeated int32", 4, (CdrForm.INT16, 5, Shape.SEQUENCE)),
        ("bytes", 2, (CdrForm.INT8, 12, Shape.SEQUENCE)),
        ("bytes", 18, (CdrForm.WSTRING, 12, Shape.SINGLE)),
        ("repeated bytes", 18, (CdrForm.WSTRING, 12, Shape.SEQUENCE)),
        ("string", 13, (CdrForm.CHAR, 9, Shape.SEQUENCE)),
        ("string", 14, (CdrForm.WCHAR, 9, Shape.SEQUENCE)),
        ("sfixed32", 6, (CdrForm.INT32, 15, Shape.SINGLE)),
        # what does not go together counts for nothing
        ("repeated int32", 2, (CdrForm.VARINT32, 5, Shape.SEQUENCE)),
        ("repeated bytes", 2, (CdrForm.BYTES, 12, Shape.SEQUENCE)),
        ("int64", 4, (CdrForm.VARINT64, 3, Shape.SINGLE)),
        ("double", 12, (CdrForm.DOUBLE, 1, Shape.SINGLE)),
        ("int32", 0, (CdrForm.VARINT32, 5, Shape.SINGLE)),
        ("int32", 99, (CdrForm.VARINT32, 5, Shape.SINGLE)),
    ],
)
def test_an_option_tells_the_ros_type(text: str, type_id: int, expected: tuple[CdrForm, int, Shape]) -> None:
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package="test", syntax="proto3")
    message = add_message(file, "Type", value=text)
    set_option(message.field[0], bytes([type_id]))
    assert operations(descriptor_of([file], "test.Type")) == {"value": expected}


def test_an_option_that_is_there_twice() -> None:
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package="test", syntax="proto3")
    message = add_message(file, "Type", value="int32")
    set_option(message.field[0], b"\2")
    set_option(message.field[0], b"\3")
    with pytest.raises(
        SchemaError, match=r"^test.Type.value: its option 68725 is there more than once; keep one$"
    ):
        protobuf_plan(descriptor_of([file], "test.Type"))


def test_groups_are_left_out() -> None:
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package="test", syntax="proto2")
    message = add_message(file, "Type")
    group = message.nested_type.add(name="Part")
    add_field(group, "inside", 1, ["int32"])
    add_field(message, "part", 1, ["group", ".test.Type.Part"])
    add_field(message, "other", 2, ["int32"])
    assert operations(descriptor_of([file], "test.Type")) == {
        "other": (CdrForm.VARINT32, 5, Shape.SINGLE),
    }


def chain(count: int) -> Descriptor:
    """Return a message in which so many messages are nested, itself included."""
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package="test", syntax="proto3")
    for i in range(count - 1):
        add_message(file, f"M{i}", part=f".test.M{i + 1}")
    add_message(file, f"M{count - 1}", value="int32")
    return descriptor_of([file], "test.M0")


def test_messages_are_nested_a_hundred_deep_at_most() -> None:
    assert len(protobuf_plan(chain(100))[0].messages) == 100
    with pytest.raises(SchemaError, match=r"^test.M0: messages are nested more than 100 deep; flatten it$"):
        protobuf_plan(chain(101))


def test_a_plan_has_so_many_fields_at_most() -> None:
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package="test", syntax="proto3")
    for i in range(19):
        add_message(file, f"M{i}", **{f"f{j}": "int32" for j in range(1000)})
    parts = {f"m{i}": f".test.M{i}" for i in range(19)}
    top = add_message(file, "Top", **parts, **{f"f{j}": "int32" for j in range(1000 - len(parts))})
    plan, _ = protobuf_plan(descriptor_of([file], "test.Top"))
    assert sum(len(each.operations) for each in plan.messages) == MAXIMUM_OPERATIONS
    add_field(top, "more", 1001, ["int32"])
    with pytest.raises(SchemaError, match=r"^test.Top: it has more than 20000 fields; split it$"):
        protobuf_plan(descriptor_of([file], "test.Top"))


def test_enums_have_so_many_values_at_most() -> None:
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package="test", syntax="proto3")
    enum = file.enum_type.add(name="E")
    for i in range(1001):
        enum.value.add(name=f"V{i}", number=i)
    add_message(file, "Type", **{f"f{i}": "enum .test.E" for i in range(100)})
    with pytest.raises(
        SchemaError,
        match=r"^test.Type: its enums have more than 100000 values, one counted for each field; split it$",
    ):
        protobuf_plan(descriptor_of([file], "test.Type"))
