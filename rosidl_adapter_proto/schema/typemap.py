"""The IDL to protobuf type map.

It is that of rosidl_typesupport_protobuf: types, names and therefore bytes on the wire are the same.
"""

from __future__ import annotations

import re

from rosidl_adapter_proto.interfaces.model import NAMESPACES, FieldType, Shape, TypeName, type_parts
from rosidl_adapter_proto.interfaces.scalars import SCALARS

MSG_TYPE_TO_PROTO = {name: row.protobuf for name, row in SCALARS.items()}
"""The protobuf type of each IDL type; a `wstring` is its UTF-16 code units, little-endian, without a mark."""

DEFAULT_PYTHON_ROOT = "rosidl_proto"
"""The namespace package that generated packages are in, unless another is chosen."""

PROTO_PACKAGE_POSTFIX = "pb"
"""The last part of each protobuf package name."""

_PROTO_FULL_NAME = re.compile(rf"(\w+)\.({'|'.join(NAMESPACES)})\.{PROTO_PACKAGE_POSTFIX}\.(\w+)", re.ASCII)

PROTO_SERVICE_CALL_NAME = "Call"
"""The rpc of a ROS service."""

PROTO_ACTION_SEND_GOAL_CALL_NAME = "SendGoal"
"""The rpc that sends a goal to an action."""

PROTO_ACTION_GET_RESULT_CALL_NAME = "GetResult"
"""The rpc that waits for the result of an action's goal."""

MAXIMUM_DEPTH = 100
"""How many messages may lie in each other: protobuf's own limit for parsers."""


def proto_package(name: TypeName) -> str:
    """Return the protobuf package of a type: `std_msgs.msg.pb`."""
    return f"{name.package}.{name.namespace}.{PROTO_PACKAGE_POSTFIX}"


def proto_full_name(name: TypeName) -> str:
    """Return the full protobuf name of a type: `std_msgs.msg.pb.String`."""
    return f"{proto_package(name)}.{name.name}"


def type_of_proto_name(full_name: str) -> TypeName | None:
    """Return the type whose `proto_full_name` it is; None if it is that of no type."""
    match = _PROTO_FULL_NAME.fullmatch(full_name)
    return TypeName(*match.groups()) if match else None


def proto_path(name: TypeName) -> str:
    """Return the path of the `.proto` file of an interface: `std_msgs/msg/String.proto`."""
    return f"{name}.proto"


def is_repeated(field_type: FieldType) -> bool:
    """Tell whether a type is a repeated field in protobuf."""
    parts = type_parts(field_type)
    return parts.shape is not Shape.SINGLE and (isinstance(parts.element, TypeName) or parts.element.repeated)


def proto_type(field_type: FieldType) -> str:
    """Return the protobuf type of a field, without `repeated`; messages by full name with a leading dot."""
    parts = type_parts(field_type)
    if isinstance(parts.element, TypeName):
        return f".{proto_full_name(parts.element)}"
    return parts.element.protobuf if parts.shape is Shape.SINGLE else parts.element.many
