"""The IDL to protobuf type map.

It is that of rosidl_typesupport_protobuf: types, names and therefore bytes on the wire are the same.
"""

from __future__ import annotations

from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    BasicType,
    FieldType,
    SequenceType,
    StringType,
    TypeName,
    ValueType,
    value_type,
)

MSG_TYPE_TO_PROTO = {
    "boolean": "bool",
    "octet": "uint32",
    "char": "uint32",
    "wchar": "uint32",
    "float": "float",
    "double": "double",
    "long double": "double",
    "uint8": "uint32",
    "int8": "int32",
    "uint16": "uint32",
    "int16": "int32",
    "uint32": "fixed32",
    "int32": "sfixed32",
    "uint64": "fixed64",
    "int64": "sfixed64",
    "string": "string",
    "wstring": "bytes",
}
"""The protobuf type of each IDL type; a `wstring` is its UTF-16 code units, little-endian, without a mark."""

COMPACT_ARRAYS = {
    "octet": "bytes",
    "uint8": "bytes",
    "int8": "bytes",
    "char": "string",
    "wchar": "string",
}
"""IDL types whose arrays and sequences are one protobuf value instead of a repeated field."""

PROTO_PACKAGE_POSTFIX = "pb"
"""The last part of each protobuf package name."""

PROTO_SERVICE_CALL_NAME = "Call"
"""The rpc of a ROS service."""

PROTO_ACTION_SEND_GOAL_CALL_NAME = "SendGoal"
"""The rpc that sends a goal to an action."""

PROTO_ACTION_GET_RESULT_CALL_NAME = "GetResult"
"""The rpc that waits for the result of an action's goal."""


def proto_package(name: TypeName) -> str:
    """Return the protobuf package of a type: `std_msgs.msg.pb`."""
    return f"{name.package}.{name.namespace}.{PROTO_PACKAGE_POSTFIX}"


def proto_full_name(name: TypeName) -> str:
    """Return the full protobuf name of a type: `std_msgs.msg.pb.String`."""
    return f"{proto_package(name)}.{name.name}"


def proto_path(name: TypeName) -> str:
    """Return the path of the `.proto` file of an interface: `std_msgs/msg/String.proto`."""
    return f"{name}.proto"


def is_repeated(field_type: FieldType) -> bool:
    """Tell whether a type is a repeated field in protobuf."""
    return isinstance(field_type, (ArrayType, SequenceType)) and _compact(field_type.value_type) is None


def proto_type(field_type: FieldType) -> str:
    """Return the protobuf type of a field, without `repeated`; messages by full name with a leading dot."""
    element = value_type(field_type)
    if isinstance(field_type, (ArrayType, SequenceType)):
        compact = _compact(element)
        if compact is not None:
            return compact
    if isinstance(element, TypeName):
        return f".{proto_full_name(element)}"
    if isinstance(element, StringType):
        return MSG_TYPE_TO_PROTO["wstring" if element.wide else "string"]
    return MSG_TYPE_TO_PROTO[element.name]


def _compact(element: ValueType) -> str | None:
    return COMPACT_ARRAYS.get(element.name) if isinstance(element, BasicType) else None
