"""Adapters of registries that have another version of a type, beside those of what is installed."""

from __future__ import annotations

from typing import Any

import pytest
from google.protobuf import descriptor_pool
from google.protobuf.descriptor_pb2 import FileDescriptorProto

from rosidl_adapter_proto import Schema, TypeRegistry, adapter_for

VERSIONS = {
    "old": "uint32 seq\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
    "new": "builtin_interfaces/Time stamp\nwstring frame_id\nfloat64[3] more\n",
    "installed": "",
}
REGISTRIES = {
    version: TypeRegistry.from_texts({"std_msgs/msg/Header": text} if text else {})
    for version, text in VERSIONS.items()
}


def message_schemas(registry: TypeRegistry) -> list[Schema]:
    """Return every message, and those of services and actions."""
    found: list[Schema] = []
    for schema in map(registry.__getitem__, registry):
        for part in schema.parts.values() or [schema]:
            found += part.parts.values() or [part]
    return found


def nested_message(message: Any, field: str) -> Any:
    value = getattr(message, field)
    return value.add() if hasattr(value, "add") else value


@pytest.mark.parametrize("version", ["old", "new"])
def test_adapters_of_one_registry_work_together(version: str) -> None:
    registry = REGISTRIES[version]
    for each in REGISTRIES.values():  # all are there before the rest of one is made
        adapter_for("std_msgs/msg/Header", each)
    schemas = message_schemas(registry)
    assert len(schemas) > 200
    with_header = 0
    for schema in schemas:
        name = schema.type_name
        adapter = adapter_for(name, registry)
        assert schema.registry is registry
        assert adapter.custom_type is schema.message_class, name
        message = adapter.new()
        for field in adapter.fields:
            if field.nested is None:
                continue
            with_header += field.nested.type_name == "std_msgs/msg/Header"
            assert field.nested is adapter_for(field.nested.type_name, registry)
            part = nested_message(adapter.custom_type(), field.name)
            assert type(part) is field.nested.custom_type, name
            part.CopyFrom(field.nested.new())  # which takes no other class
            assert part == field.nested.new()
        data = adapter.to_cdr(message)
        assert adapter.to_cdr(adapter.from_cdr(data)) == data, name
    assert with_header > 30


def test_registries_do_not_share_what_one_has_otherwise() -> None:
    for name in ("std_msgs/msg/Header", "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/Pose"):
        assert len({registry[name].message_class for registry in REGISTRIES.values()}) == 3
    old, new, installed = (each["std_msgs/msg/Header"] for each in REGISTRIES.values())
    assert list(old.descriptor.fields_by_name) == ["seq", "stamp", "frame_id"]
    assert list(new.descriptor.fields_by_name) == ["stamp", "frame_id", "more"]
    assert installed.message_class is TypeRegistry()["std_msgs/msg/Header"].message_class
    again = TypeRegistry.from_texts({"std_msgs/msg/Header": VERSIONS["old"]})
    assert again["std_msgs/msg/Header"].message_class is old.message_class


def test_a_type_that_is_the_same_comes_first() -> None:
    """All that was given decides, not what is asked for."""
    pose, user, header = "geometry_msgs/msg/Pose", "versions_first/msg/User", "std_msgs/msg/Header"
    registry = TypeRegistry.from_texts(
        {header: "int8 x", user: "std_msgs/Header header\ngeometry_msgs/Pose pose"}
    )
    made = adapter_for(pose, registry)
    assert made.custom_type is not adapter_for(pose).custom_type
    assert adapter_for(user, registry).new(pose=made.new(), header={"x": 1}).header.x == 1


def test_another_version_does_not_take_a_place_that_is_not_filled_yet() -> None:
    a, b = "versions_promise/msg/A", "versions_promise/msg/B"
    first = TypeRegistry.from_texts({a: "int8 x", b: "A a"})
    assert first[a].message_class is not None
    other = TypeRegistry.from_texts({a: "int8 x", b: "A a\nint8 y"})
    assert adapter_for(b, other).new(a=adapter_for(a, other).new(x=1)).a.x == 1
    assert adapter_for(b, first).new(a=adapter_for(a, first).new(x=1)).a.x == 1
    assert first[b].registry is first
    pool = descriptor_pool.Default()  # type: ignore[no-untyped-call, unused-ignore]
    assert first[b].descriptor.file.pool is pool


def test_another_version_that_comes_late() -> None:
    """What has it and what is in that is made apart; adapters go with those that they are in."""
    early, late, user = (f"versions_late/msg/{each}" for each in ("Early", "Late", "User"))
    registry = TypeRegistry.from_texts({early: "int8 x", late: "int8 y", user: "Early early\nLate late"})
    before = adapter_for(early, registry)
    foreign = FileDescriptorProto(
        name="versions_late/msg/Late.proto", package="versions_late.msg.pb", syntax="proto3"
    )
    foreign.message_type.add(name="Late")
    pool = descriptor_pool.Default()  # type: ignore[no-untyped-call, unused-ignore]
    pool.AddSerializedFile(foreign.SerializeToString())

    adapter, apart = adapter_for(user, registry), registry[user].registry
    assert apart is not registry
    assert adapter_for(late, registry) is adapter_for(late, apart) is adapter.fields[1].nested
    assert adapter_for(early, registry) is before
    assert adapter_for(early, apart) is adapter.fields[0].nested
    message = adapter.new(early=adapter.fields[0].nested.new(x=1), late=adapter.fields[1].nested.new(y=2))
    assert adapter.from_cdr(adapter.to_cdr(message)) == message
