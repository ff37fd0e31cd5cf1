"""Adapters, with their conversions, constants and default values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rosidl_adapter_proto.adapter.contract import constant_name
from rosidl_adapter_proto.generate.targets.python.comments import docstring_lines
from rosidl_adapter_proto.generate.targets.python.conversions import Lines, Writer, method
from rosidl_adapter_proto.generate.targets.python.layout import quoted
from rosidl_adapter_proto.generate.targets.python.names import Names
from rosidl_adapter_proto.interfaces.model import Interface, TypeName
from rosidl_adapter_proto.schema.conversion import NAMED_PARTS, has_defaults, message_conversion, ros_class
from rosidl_adapter_proto.schema.proto import ProtoField, ProtoMessage, ProtoScalarValue, plain_lines


@dataclass(frozen=True)
class AdapterField:
    """One field of an adapter.

    Attributes:
        name: Its name.
        info: Its `FieldInfo`, as Python text.
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
    """The adapter class of one message.

    Attributes:
        set_in_parent: The call that makes the protobuf message present where it is nested.
    """

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
    set_in_parent: str
    defaults: tuple[tuple[str, str | tuple[str, ...]], ...]
    has_defaults: bool

    @property
    def summary(self) -> str:
        """The first line of its docstring."""
        return f"Converts between protobuf {self.custom_full_name} and ROS {self.type_name}."

    @property
    def infos(self) -> tuple[str, ...]:
        """What the adapter tells of each field."""
        return tuple(each.info for each in self.fields)

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
    lines = {field.name: writer.lines(proto, field, how) for field, how in conversion.fields}
    return MessageAdapter(
        class_name=names.adapter(proto.type_name),
        custom=proto.name,
        custom_full_name=proto.full_name,
        type_name=str(proto.type_name),
        type_hash=names.catalog.hash(proto.type_name),
        ros_class=ros_class(proto.type_name, interface),
        comment=("", *comment) if (comment := docstring_lines(proto.source.comment)) else (),
        constants=tuple(
            AdapterConstant(
                constant_name(each.name, proto.name), _literal(each.value), tuple(plain_lines(each.comment))
            )
            for each in proto.constants
        ),
        packed_numbers=conversion.packed_numbers,
        fields=tuple(
            AdapterField(each.name, _field_info(each, writer.adapter_names), *lines.get(each.name, ((), ())))
            for each in proto.fields
        ),
        set_in_parent=method(proto, "SetInParent"),
        defaults=_defaults(proto),
        has_defaults=has_defaults(proto.source, names.catalog.message),
    )


def _field_info(field: ProtoField, adapter_names: Mapping[TypeName, str]) -> str:
    """Return the `FieldInfo` of a field, without the arguments that have their defaults."""
    numbers = [field.type_id, field.capacity or 0, field.string_bound or 0]
    nested = [adapter_names[field.element]] if isinstance(field.element, TypeName) else []
    while not nested and numbers[-1] == 0:
        numbers.pop()
    return f"adapter.FieldInfo({', '.join([quoted(field.name), *map(str, numbers), *nested])})"


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


def _defaults(proto: ProtoMessage) -> tuple[tuple[str, str | tuple[str, ...]], ...]:
    """Return the default values of a message, in terms of protobuf, as literals and lists of literals by name."""
    return tuple(
        (
            quoted(each.name),
            tuple(map(_literal, each.default)) if isinstance(each.default, tuple) else _literal(each.default),
        )
        for each in proto.fields
        if each.default is not None
    )


def _literal(value: ProtoScalarValue) -> str:
    if isinstance(value, (str, bytes)):
        return quoted(value)
    if isinstance(value, float) and not math.isfinite(value):
        return f'float("{value}")'
    return repr(value).replace("e+", "e")  # as black writes 1e+16
