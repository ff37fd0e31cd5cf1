"""Adapters, with their conversions, constants and default values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rosidl_adapter_proto.adapter.contract import constant_name
from rosidl_adapter_proto.generate.targets.python.comments import docstring_lines, plain_lines
from rosidl_adapter_proto.generate.targets.python.conversions import Lines, Writer
from rosidl_adapter_proto.generate.targets.python.names import Names
from rosidl_adapter_proto.interfaces.model import Interface, TypeName
from rosidl_adapter_proto.schema.conversion import NAMED_PARTS, has_defaults, message_conversion, ros_class
from rosidl_adapter_proto.schema.proto import ProtoField, ProtoMessage, ProtoValue


@dataclass(frozen=True)
class AdapterField:
    """One field of an adapter.

    Attributes:
        name: Its name.
        info: The arguments of its `FieldInfo` after the name, as Python text.
        to_custom: The lines that convert it to protobuf.
        to_ros: The lines that convert it to ROS.
    """

    name: str
    info: str
    to_custom: Lines
    to_ros: Lines


@dataclass(frozen=True)
class AdapterConstant:
    """A constant of the ROS message, which becomes an attribute of the adapter class."""

    name: str
    value: str
    comment: tuple[str, ...]


@dataclass(frozen=True)
class MessageAdapter:
    """The adapter class of one message."""

    class_name: str
    custom: str
    custom_full_name: str
    type_name: str
    type_hash: str
    ros_class: str
    comment: tuple[str, ...]
    constants: tuple[AdapterConstant, ...]
    packed_numbers: tuple[int, ...]
    fields: tuple[AdapterField, ...]
    defaults: str
    has_defaults: bool

    @property
    def converted(self) -> tuple[AdapterField, ...]:
        """The fields that ROS has in Python: not the one that stands for an empty struct."""
        return tuple(each for each in self.fields if each.to_custom)


@dataclass(frozen=True)
class GroupAdapter:
    """The class that groups the adapters of a service or an action.

    Attributes:
        name: The name of the service or action, by which ROS users know it; here it is the adapter.
        base: `ServiceAdapter` or `ActionAdapter`.
        custom_types: The protobuf classes that the base is parametrized with, and what each is called in ROS.
        parts: What it has, and the class that each is.
    """

    name: str
    class_name: str
    base: str
    custom_types: tuple[tuple[str, str], ...]
    type_name: str
    type_hash: str
    ros_class: str
    parts: tuple[tuple[str, str], ...]


def message_adapter(
    proto: ProtoMessage,
    interface: Interface,
    names: Names,
    writer: Writer,
) -> MessageAdapter:
    """Decide what the adapter of a message of an interface is."""
    conversion = message_conversion(proto)
    lines = {field.name: writer.lines(field, how) for field, how in conversion.fields}
    return MessageAdapter(
        class_name=names.adapter(proto.type_name),
        custom=proto.name,
        custom_full_name=proto.full_name,
        type_name=str(proto.type_name),
        type_hash=names.catalog.hash(proto.type_name),
        ros_class=ros_class(proto.type_name, interface),
        comment=docstring_lines(proto.source.comment),
        constants=tuple(
            AdapterConstant(constant_name(each.name), _literal(each.value), plain_lines(each.comment))
            for each in proto.constants
        ),
        packed_numbers=conversion.packed_numbers,
        fields=tuple(
            AdapterField(each.name, _field_info(each, writer.adapter_names), *lines.get(each.name, ((), ())))
            for each in proto.fields
        ),
        defaults=_defaults(proto),
        has_defaults=has_defaults(proto.source, names.catalog.message),
    )


def _field_info(field: ProtoField, adapter_names: Mapping[TypeName, str]) -> str:
    """Return the arguments of a `FieldInfo` behind the name, without those that have their defaults."""
    arguments = [field.type_id, field.capacity or 0, field.string_bound or 0]
    if isinstance(field.element, TypeName):
        return ", ".join([*map(str, arguments), adapter_names[field.element]])
    while arguments[-1] == 0:
        arguments.pop()
    return ", ".join(map(str, arguments))


def group_adapter(
    name: TypeName, group: Mapping[str, TypeName], interface: Interface, names: Names
) -> GroupAdapter:
    """Decide what the class is that groups the adapters of a service or an action of an interface."""
    return GroupAdapter(
        name=name.name,
        class_name=names.adapter(name),
        base="ServiceAdapter" if "request" in group else "ActionAdapter",
        custom_types=tuple(
            (NAMED_PARTS[part], each.name) for part, each in group.items() if part in NAMED_PARTS
        ),
        type_name=str(name),
        type_hash=names.catalog.hash(name),
        ros_class=ros_class(name, interface),
        parts=tuple((part, names.adapter(each)) for part, each in group.items()),
    )


def _defaults(proto: ProtoMessage) -> str:
    """Return the default values of a message as the Python text of a dictionary, in terms of protobuf."""
    items = [f"{each.name!r}: {_literal(each.default)}" for each in proto.fields if each.default is not None]
    return "{" + ", ".join(items) + "}" if items else ""


def _literal(value: ProtoValue) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_literal, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return f'float("{value}")'
    return repr(value)
