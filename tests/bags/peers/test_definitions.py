"""Definitions that are written into recordings, read by a decoder of others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mcap_ros2._dynamic import generate_dynamic

from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.bags.types import ros_definition
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source
from rosidl_adapter_proto.interfaces.model import EMPTY_STRUCT_FIELD
from rosidl_adapter_proto.transcode.codec import Transcoder


def check_fields(decoded: Any, message: str, types: Mapping[str, Any]) -> None:
    """Check that an object has the fields of a message, with those of its messages."""
    fields = [each for each in types[message]["fields"] if each["name"] != EMPTY_STRUCT_FIELD]
    for each in fields:
        nested = each["type"]["nested_type_name"]
        values = getattr(decoded, each["name"])
        for value in (values if isinstance(values, list) else [values]) if nested else []:
            check_fields(value, nested, types)


def test_every_message_is_decoded() -> None:
    registry = TypeRegistry(Catalog((store_source("jazzy"),)))
    for name in registry:
        schema = registry[name]
        description = schema.type_description
        types = {
            each["type_name"]: each
            for each in (description["type_description"], *description["referenced_type_descriptions"])
        }
        decoder = generate_dynamic(name, ros_definition(schema).data.decode())[name]
        cdr = Transcoder(description, schema.descriptor).proto_to_cdr(b"")
        check_fields(decoder(bytes(cdr)), name, types)


def test_values() -> None:
    schema = TypeRegistry(Catalog((store_source("jazzy"),)))["sensor_msgs/msg/JointState"]
    message: Any = schema.message_class()
    message.header.frame_id = "base"
    message.header.stamp.sec = 5
    message.name.extend(["a", "bc"])
    message.position.extend([1.5, 2.5])
    cdr = Transcoder(schema.type_description, schema.descriptor).proto_to_cdr(message.SerializeToString())
    decoder = generate_dynamic(schema.type_name, ros_definition(schema).data.decode())[schema.type_name]
    decoded = decoder(bytes(cdr))
    assert (decoded.header.frame_id, decoded.header.stamp.sec) == ("base", 5)
    assert (decoded.name, decoded.position) == (["a", "bc"], [1.5, 2.5])
