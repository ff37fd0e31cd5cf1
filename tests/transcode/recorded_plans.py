"""Plans of the texts that recordings have of their types, made without what the native core makes them with."""

from __future__ import annotations

from functools import cache

from google.protobuf.descriptor_pool import DescriptorPool

from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import type_closure
from rosidl_adapter_proto.interfaces.find import Source, store_source
from rosidl_adapter_proto.interfaces.recorded import (
    ROS2MSG,
    recorded_definitions,
    recorded_source,
    recorded_type_name,
)
from rosidl_adapter_proto.schema.descriptor import file_descriptor
from rosidl_adapter_proto.schema.numbering import HashNumbering
from rosidl_adapter_proto.schema.proto import check_nesting, proto_file
from rosidl_adapter_proto.schema.typemap import proto_full_name
from rosidl_adapter_proto.transcode.plan import Plan, build_plan


def plan_of_text(text: bytes, type_name: str) -> Plan:
    """Return the plan of a type with hashed field numbers; only times may be missing in its text."""
    name = recorded_type_name(type_name)
    catalog = Catalog((recorded_source(recorded_definitions(text, ROS2MSG, type_name, "the text")), times()))
    files = [
        proto_file(catalog.definition(each).interface, HashNumbering(), catalog.definition_name)
        for each in type_closure(catalog, name)
    ]
    check_nesting(files)
    pool = DescriptorPool()
    for file in files:
        pool.AddSerializedFile(file_descriptor(file).SerializeToString())
    return build_plan(catalog.describe(name), pool.FindMessageTypeByName(proto_full_name(name)))


@cache
def times() -> Source:
    """Return the source of what a text may leave out."""
    package = store_source().packages["builtin_interfaces"]
    return Source("times", {"builtin_interfaces": package})
