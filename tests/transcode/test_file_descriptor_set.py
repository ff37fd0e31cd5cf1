"""Descriptor sets that the native core reads: the plans that Python makes of them, byte for byte."""

from __future__ import annotations

from dataclasses import astuple

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
from protobuf_types import descriptor_of, general_file
from ros_types import installed_types, protobuf_class

from rosidl_adapter_proto.bags.descriptors import descriptor_set
from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.transcode import _core
from rosidl_adapter_proto.transcode.protobuf_plan import protobuf_plan
from tests.transcode.protobuf_schemas import files

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
