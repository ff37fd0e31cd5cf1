"""Messages as flat pairs, worked out from objects in Python: what series of plugins are compared with.

A pair is a key, the numpy name of the value's type or `string`, and the value. The keys are those of PlotJuggler.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

FlatPair: TypeAlias = tuple[str, str, Any]

LONGEST_ARRAY = 500
"""Longer arrays are left out, unless somebody wants something else."""


def flatten_ros(message: Any, prefix: str = "") -> Iterator[FlatPair]:
    """Yield the pairs of an object of rclpy, from what rosidl says of its fields."""
    for slot, kind in zip(message.__slots__, type(message).SLOT_TYPES, strict=False):
        name = slot.removeprefix("_")
        if name == "structure_needs_at_least_one_member":
            continue
        value = getattr(message, name)
        if type(kind).__name__ in ("Array", "BoundedSequence", "UnboundedSequence"):
            if len(value) <= LONGEST_ARRAY:
                for index, each in enumerate(value):
                    yield from _flatten_ros_value(each, kind.value_type, f"{prefix}/{name}[{index}]")
        else:
            yield from _flatten_ros_value(value, kind, f"{prefix}/{name}")


_ROS_TYPES = {"boolean": "bool", "octet": "uint8", "char": "uint8", "wchar": "uint16"}
_ROS_TYPES |= {"float": "float32", "double": "float64"}


def _flatten_ros_value(value: Any, kind: Any, key: str) -> Iterator[FlatPair]:
    if type(kind).__name__ == "NamespacedType":
        yield from flatten_ros(value, key)
    elif type(kind).__name__.endswith("String"):
        yield key, "string", value
    else:
        number = ord(value) if kind.typename == "octet" else value
        yield key, _ROS_TYPES.get(kind.typename, kind.typename), number


def flatten_protobuf(message: Message, prefix: str = "") -> Iterator[FlatPair]:
    """Yield the pairs of any protobuf message, from its descriptor."""
    for field in message.DESCRIPTOR.fields:
        key, value = f"{prefix}/{field.name}", getattr(message, field.name)
        entry = (
            field.message_type if field.message_type and field.message_type.GetOptions().map_entry else None
        )
        if entry:
            for name in value:
                shown = str(name).lower() if isinstance(name, bool) else name
                yield from _flatten_protobuf_value(
                    value[name], entry.fields_by_name["value"], f"{key}/{shown}"
                )
        elif _is_repeated(field):
            if len(value) <= LONGEST_ARRAY:
                for index, each in enumerate(value):
                    yield from _flatten_protobuf_value(each, field, f"{key}[{index}]")
        else:
            yield from _flatten_protobuf_value(value, field, key)


_PROTOBUF_TYPES = {
    FieldDescriptor.CPPTYPE_BOOL: "bool",
    FieldDescriptor.CPPTYPE_INT32: "int32",
    FieldDescriptor.CPPTYPE_INT64: "int64",
    FieldDescriptor.CPPTYPE_UINT32: "uint32",
    FieldDescriptor.CPPTYPE_UINT64: "uint64",
    FieldDescriptor.CPPTYPE_FLOAT: "float32",
    FieldDescriptor.CPPTYPE_DOUBLE: "float64",
    FieldDescriptor.CPPTYPE_ENUM: "int32",
}


def _flatten_protobuf_value(value: Any, field: Any, key: str) -> Iterator[FlatPair]:
    if field.cpp_type == FieldDescriptor.CPPTYPE_MESSAGE:
        yield from flatten_protobuf(value, key)
    elif field.type == FieldDescriptor.TYPE_ENUM and value in field.enum_type.values_by_number:
        yield key, "string", field.enum_type.values_by_number[value].name
    elif field.type == FieldDescriptor.TYPE_STRING:
        yield key, "string", value
    elif field.type == FieldDescriptor.TYPE_BYTES:
        yield from _flatten_bytes(value, key)
    else:
        yield key, _PROTOBUF_TYPES[field.cpp_type], value


def _flatten_bytes(value: Sequence[int], key: str) -> Iterator[FlatPair]:
    if len(value) <= LONGEST_ARRAY:
        for index, each in enumerate(value):
            yield f"{key}[{index}]", "uint8", each


def _is_repeated(field: Any) -> bool:
    if hasattr(field, "is_repeated"):  # protobuf 6.31
        return bool(field.is_repeated)
    return bool(field.label == FieldDescriptor.LABEL_REPEATED)
