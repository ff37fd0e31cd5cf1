"""Descriptor sets that the native core reads: the plans that Python makes of them, byte for byte."""

from __future__ import annotations

import random
from dataclasses import astuple
from typing import Any

import pytest
from google.protobuf import (
    any_pb2,
    api_pb2,
    descriptor_pb2,
    empty_pb2,
    struct_pb2,
    timestamp_pb2,
    type_pb2,
    wrappers_pb2,
)
from google.protobuf.descriptor import Descriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from hypothesis import given
from protobuf_types import add_field, add_message, descriptor_of, general_file, set_option
from ros_types import Types, describe, installed_types, nasty_types, protobuf_class

from rosidl_adapter_proto.bags.descriptors import descriptor_set, recorded_class
from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.model import Shape
from rosidl_adapter_proto.transcode import _core
from rosidl_adapter_proto.transcode.plan import Plan, build_plan
from rosidl_adapter_proto.transcode.protobuf_plan import protobuf_plan
from tests.transcode.protobuf_schemas import files
from tests.transcode.wire import delimited

WELL_KNOWN = [
    *(each.DESCRIPTOR for each in (any_pb2.Any, api_pb2.Api, empty_pb2.Empty, type_pb2.Type)),
    *(each.DESCRIPTOR for each in (struct_pb2.Struct, struct_pb2.Value, struct_pb2.ListValue)),
    *(each.DESCRIPTOR for each in (timestamp_pb2.Timestamp, wrappers_pb2.BytesValue)),
    *descriptor_pb2.DESCRIPTOR.message_types_by_name.values(),
]


def check(descriptor: Descriptor, data: bytes | None = None) -> None:
    """Compare the plans of a message, and what there is to say of its fields."""
    data = descriptor_set(descriptor) if data is None else data
    try:
        plan, notes = protobuf_plan(descriptor)
    except SchemaError:
        with pytest.raises(ValueError, match=r"more than"):
            _core.read_file_descriptor_set(data, descriptor.full_name)
        return
    packed, found = _core.read_file_descriptor_set(data, descriptor.full_name)
    assert packed == plan.pack()
    assert found == [astuple(each) for each in notes]


@pytest.mark.parametrize("descriptor", WELL_KNOWN, ids=lambda each: each.full_name)
def test_well_known_types(descriptor: Descriptor) -> None:
    check(descriptor)


def test_every_installed_type() -> None:
    assert len(installed_types()) > 300
    for name in installed_types():
        check(protobuf_class(installed_types(), name).DESCRIPTOR)


def test_everything_that_messages_can_have() -> None:
    check(descriptor_of([general_file()], "test.General"))


@given(files())
def test_any_message(file: descriptor_pb2.FileDescriptorProto) -> None:
    check(descriptor_of([file], "test.M0"), FileDescriptorSet(file=[file]).SerializeToString())


# What the option of a field tells ----------------------------------------------------------------------------------


def fields(plan: Plan) -> list[list[tuple[object, ...]]]:
    """Return what a plan says of the values of each field."""
    return [
        [
            (each.name, each.scalar, each.cdr, each.number, each.shape is Shape.SINGLE)
            for each in message.operations
        ]
        for message in plan.messages
    ]


@pytest.mark.parametrize("types", [installed_types(), nasty_types()], ids=["installed", "nasty"])
def test_a_recorded_set_tells_all_of_the_ros_type(types: Types) -> None:
    for name in types:
        message_class, description = protobuf_class(types, name), describe(types, name)
        data = descriptor_set(message_class.DESCRIPTOR, description)
        recorded: Any = recorded_class(data, message_class.DESCRIPTOR.full_name).DESCRIPTOR
        assert fields(protobuf_plan(recorded)[0]) == fields(build_plan(description, message_class.DESCRIPTOR))
        check(recorded, data)


# Sets that others make ---------------------------------------------------------------------------------------------


def file_with(**texts: str) -> descriptor_pb2.FileDescriptorProto:
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package="test", syntax="proto3")
    add_message(file, "Type", **texts)
    return file


def set_of(*some: descriptor_pb2.FileDescriptorProto) -> bytes:
    return FileDescriptorSet(file=some).SerializeToString()


def test_the_order_of_files_does_not_matter() -> None:
    file, other = file_with(part=".other.Part"), descriptor_pb2.FileDescriptorProto(package="other")
    add_message(other, "Part", value="int32")
    assert _core.read_file_descriptor_set(set_of(file, other), "test.Type") == _core.read_file_descriptor_set(
        set_of(other, file), "test.Type"
    )


def test_a_dot_before_the_name() -> None:
    data = set_of(file_with(value="int32"))
    assert _core.read_file_descriptor_set(data, ".test.Type") == _core.read_file_descriptor_set(
        data, "test.Type"
    )


def test_types_in_types_without_a_package() -> None:
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", syntax="proto3")
    outer = add_message(file, "Outer", part=".Outer.Part", kind="enum .Outer.Part.Kind")
    part = outer.nested_type.add(name="Part")
    part.enum_type.add(name="Kind").value.add(name="NONE", number=0)
    add_field(part, "value", 1, ["int32"])
    check(descriptor_of([file], "Outer"), set_of(file))
    check(descriptor_of([file], "Outer.Part"), set_of(file))


@pytest.mark.parametrize("name", ["Near", "Type.Near", "test.Type.Near", ".test.Type.Near"])
@pytest.mark.parametrize("has_type", [True, False])
def test_types_are_looked_for_from_the_inside_to_the_outside(name: str, has_type: bool) -> None:
    file = file_with()
    message = file.message_type[0]
    add_field(message.nested_type.add(name="Near"), "inside", 1, ["int32"])
    add_field(add_message(file, "Near"), "outside", 1, ["int32"])
    field = message.field.add(name="near", number=1, label=1, type_name=name)
    data = set_of(file)
    field.type = field.TYPE_MESSAGE  # which not every version of protobuf finds out by itself
    check(descriptor_of([file], "test.Type"), set_of(file) if has_type else data)


def test_messages_of_editions_may_be_groups() -> None:
    features = getattr(descriptor_pb2, "FeatureSet", None)
    if features is None:
        pytest.skip("this protobuf has no editions")
    for of_file, of_field in ((0, 0), (2, 0), (2, 1), (1, 2)):
        file: Any = general_file()
        file.syntax, file.edition = "editions", descriptor_pb2.Edition.Value("EDITION_2023")
        del file.message_type[-1].field[-1], file.message_type[-1].nested_type[-1]  # a group of proto2
        if of_file:
            file.options.features.message_encoding = of_file
        for field in file.message_type[1].field if of_field else ():
            if field.type_name:
                field.options.features.message_encoding = of_field
        check(descriptor_of([file], "test.General"), set_of(file))


def deep() -> bytes:
    message = b""
    for _ in range(101):
        message = delimited(3, message)
    return delimited(1, delimited(4, message))


def bad_field(**changes: object) -> bytes:
    file = file_with(value="int32")
    for name, value in changes.items():
        setattr(file.message_type[0].field[0], name, value)
    return set_of(file)


def enum_file(count: int, users: int, name: str = "V") -> bytes:
    file = file_with(**{f"f{i}": "enum .test.E" for i in range(users)})
    enum = file.enum_type.add(name="E")
    for number in range(count):
        enum.value.add(name=f"{name}{number}", number=number)
    return set_of(file)


def twice() -> bytes:
    file = file_with(value="int32")
    for _ in range(2):
        set_option(file.message_type[0].field[0], b"\2")
    return set_of(file)


def many_types() -> bytes:
    return set_of(
        descriptor_pb2.FileDescriptorProto(enum_type=[descriptor_pb2.EnumDescriptorProto(name="E")] * 50_001)
    )


DAMAGED = "the descriptor set is damaged"
LONG = "the descriptor set has a name of more than 512 bytes"
NO_TYPE = "the descriptor set does not have the type of a field"


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", "the descriptor set does not have the message"),
        (enum_file(1, 1).replace(b"Type", b"Else"), "the descriptor set does not have the message"),
        (b"\x0a\x05", DAMAGED),
        (b"\x0b", DAMAGED),
        (b"\x0a\x02\x22\x05", DAMAGED),
        (deep(), DAMAGED),
        (enum_file(2, 1).replace(b"V1", b"\xff\xfe"), DAMAGED),
        (bytes(4 * 2**20 + 1), "the descriptor set has more than 4194304 bytes"),
        (many_types(), "the descriptor set has more than 50000 types"),
        (set_of(descriptor_pb2.FileDescriptorProto(package="a" * 513)), LONG),
        (enum_file(1, 1, "V" * 512), LONG),
        (enum_file(1001, 100), "the enums of the type have more than 100000 values"),
        (bad_field(number=0), "a field has a number that protobuf does not have"),
        (bad_field(number=-1), "a field has a number that protobuf does not have"),
        (bad_field(number=2**29), "a field has a number that protobuf does not have"),
        (bad_field().replace(b"\x28\x05", b"\x28\x13"), "a field has a type that protobuf does not have"),
        (bad_field(type=11, type_name=".test.Missing"), NO_TYPE),
        (bad_field(type=11, type_name="Missing"), NO_TYPE),
        (bad_field(type=14, type_name=".test.Type"), NO_TYPE),
        (bad_field(type=11, type_name="a" * 513), LONG),
        (twice(), "an option of a field that tells its ROS type is there more than once"),
        (
            set_of(file_with(**{f"f{i}": "int32" for i in range(20_001)})),
            "the type has more than 20000 fields, those of the types in it included",
        ),
    ],
)
def test_what_is_wrong(data: bytes, expected: str) -> None:
    with pytest.raises(ValueError, match=f"^{expected}$"):
        _core.read_file_descriptor_set(data, "test.Type")


def test_messages_are_nested_a_hundred_deep_at_most() -> None:
    file = file_with(part=".test.M0")
    for i in range(99):
        add_message(file, f"M{i}", part=f".test.M{i + 1}")
    add_message(file, "M99", value="int32")
    assert _core.read_file_descriptor_set(set_of(file), "test.M0")
    with pytest.raises(ValueError, match=r"^messages are nested more than 100 deep$"):
        _core.read_file_descriptor_set(set_of(file), "test.Type")


@pytest.mark.parametrize("seed", range(20))
def test_damaged_sets_do_no_harm(seed: int) -> None:
    rng = random.Random(seed)
    whole = set_of(general_file())
    for _ in range(500):
        data = bytearray(whole)
        for _ in range(rng.randrange(1, 5)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        try:
            packed, _ = _core.read_file_descriptor_set(bytes(data), "test.General")
        except ValueError:
            continue
        try:
            _core.Transcoder(packed, "test.General", 100)
        except ValueError as error:  # names that are no UTF-8, and numbers that are there twice
            assert "the plan " in str(error)
