"""`ros1_converter`: the serialization format of ROS 1 (https://wiki.ros.org/msg), which is only read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosidl_adapter_proto.converters.interfaces import SerializedBagMessage
from rosidl_adapter_proto.converters.native import NativeDeserializer
from rosidl_adapter_proto.errors import ConverterError
from rosidl_adapter_proto.interfaces.description import described_type
from rosidl_adapter_proto.interfaces.model import EMPTY_STRUCT_FIELD, Shape, TypeName, TypeParts

if TYPE_CHECKING:
    from typing_extensions import Buffer

    from rosidl_adapter_proto.schema.registry import Schema

_ONLY_ROS1 = {("std_msgs/msg/Header", "seq")}
"""What ROS 2 has given up."""

_BYTES = {"int8", "octet"}
"""What `byte` is in ROS 1 and in ROS 2. A byte above 127 is the same one in an array, and a single one an error."""


class Ros1Deserializer(NativeDeserializer):
    """Reads what ROS 1 has recorded. The types are those of ROS 1, whose `std_msgs/Header` has `seq`."""

    serialization_format = "ros1"

    def to_protobuf(self, serialized_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        return self._transcoders[type_support].ros1_to_proto(serialized_message.serialized_data)


def check_ros2_type(ros1: Schema, ros2: Schema) -> None:
    """Check that messages of a type of ROS 1, as protobuf bytes, can be read as those of a type of ROS 2.

    Every field of ROS 1 has to be in ROS 2 with the same type and field number, but for `seq` of a header. Bounds may
    differ: whether a message keeps them is found when it is converted. What only ROS 2 has is zero.

    Args:
        ros1: The type, as the bag defines it.
        ros2: The type that the messages are to have.

    Raises:
        ConverterError: A field would be lost; the message names it.
    """
    ros1_fields, ros2_fields = _fields(ros1), _fields(ros2)
    found: list[tuple[str, Any, str, Any]] = [
        (ros1.type_name, ros1.descriptor, ros2.type_name, ros2.descriptor)
    ]
    for name, descriptor, other_name, other_descriptor in found:  # which grows by what these refer to
        others = ros2_fields[other_name]
        for field_name, parts in ros1_fields[name].items():
            if field_name not in others:
                if (name, field_name) in _ONLY_ROS1 or field_name == EMPTY_STRUCT_FIELD:
                    continue
                raise _lost(name, field_name, f"is not in {other_name} of ROS 2")
            if not _is_same(parts, others[field_name]):
                kinds = f"is {_text(parts)} in ROS 1 and {_text(others[field_name])} in ROS 2"
                raise _lost(name, field_name, kinds)
            field, other = descriptor.fields_by_name[field_name], other_descriptor.fields_by_name[field_name]
            if field.number != other.number:
                numbers = f"has field number {field.number} for ROS 1 and {other.number} for ROS 2"
                raise _lost(name, field_name, numbers)
            if isinstance(parts.element, TypeName):
                nested = (str(parts.element), field.message_type)
                pair = (*nested, str(others[field_name].element), other.message_type)
                if pair not in found:
                    found.append(pair)


def _fields(schema: Schema) -> dict[str, dict[str, TypeParts]]:
    """Return the fields of a type and of all that it refers to, by the names of types and fields."""
    description = schema.type_description
    structs = (description["type_description"], *description["referenced_type_descriptions"])
    return {
        struct["type_name"]: {each["name"]: described_type(each["type"]) for each in struct["fields"]}
        for struct in structs
    }


def _is_same(left: TypeParts, right: TypeParts) -> bool:
    """Tell whether two types are the same but for bounds, and for the names of nested types."""
    if left.shape != right.shape or (left.shape is Shape.ARRAY and left.capacity != right.capacity):
        return False
    if isinstance(left.element, TypeName) or isinstance(right.element, TypeName):
        return isinstance(left.element, TypeName) and isinstance(right.element, TypeName)
    return left.element is right.element or {left.element.name, right.element.name} == _BYTES


def _text(parts: TypeParts) -> str:
    """Return a type as people write it, such as `float64[9]`; bounds are left out."""
    element = parts.element if isinstance(parts.element, TypeName) else parts.element.msg[0]
    length = parts.capacity if parts.shape is Shape.ARRAY else ""
    return str(element) if parts.shape is Shape.SINGLE else f"{element}[{length}]"


def _lost(type_name: str, field_name: str, reason: str) -> ConverterError:
    return ConverterError(
        f"{type_name}.{field_name} {reason}, and would be lost; convert to protobuf instead"
    )
