"""From a `.proto` file to its Python modules, as plain data in which everything is decided.

Each interface gets three modules: `<Name>_pb2.py` with the protobuf classes, `<Name>_pb2.pyi` with their types, and
`<Name>_adapter.py` with the adapters. The templates only put into place what stands here.
"""

from __future__ import annotations

import keyword
import math
from collections.abc import Mapping
from dataclasses import dataclass

from rosidl_adapter_proto.adapter import TypeAdapter
from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.generate.targets.python.comments import docstring_lines, plain_lines
from rosidl_adapter_proto.generate.targets.python.conversions import Lines, Writer
from rosidl_adapter_proto.generate.targets.python.names import Names
from rosidl_adapter_proto.generate.targets.python.stubs import StubMessage, stub, stub_alias
from rosidl_adapter_proto.interfaces.model import (
    Action,
    Interface,
    Message,
    SequenceType,
    Service,
    TypeName,
    parts,
    references,
)
from rosidl_adapter_proto.schema.conversion import message_conversion
from rosidl_adapter_proto.schema.proto import ProtoField, ProtoFile, ProtoMessage, ProtoValue


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
        base: `ServiceAdapter` or `ActionAdapter`.
        parameters: The protobuf classes that the base is parametrized with.
        parts: What it has, and the class that each is.
    """

    class_name: str
    base: str
    parameters: tuple[str, ...]
    type_name: str
    type_hash: str
    ros_class: str
    parts: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class PythonModules:
    """The Python modules of one interface.

    Attributes:
        name: The name of the interface; the modules are `<name>_pb2` and `<name>_adapter`.
        package: The Python package they are in.
        proto_path: The path of the `.proto` file.
        type_name: The ROS name of the interface.
        pb2_imports: Modules of the files that the `.proto` file imports.
        helpers: What the adapters use of `rosidl_adapter_proto.adapter`.
        adapter_imports: Module and class of other adapters that are used, and what the class is called here.
        custom_names: The protobuf classes.
        messages: Adapter classes.
        groups: Classes that group adapters.
        stubs: Message classes for the type stub.
    """

    name: str
    package: str
    proto_path: str
    type_name: str
    pb2_imports: tuple[str, ...]
    helpers: tuple[str, ...]
    adapter_imports: tuple[tuple[str, str, str], ...]
    custom_names: tuple[str, ...]
    messages: tuple[MessageAdapter, ...]
    groups: tuple[GroupAdapter, ...]
    stubs: tuple[StubMessage, ...]

    @property
    def stub_imports(self) -> tuple[tuple[str, str], ...]:
        """The modules that the type stub imports, and what each is called there."""
        return tuple((module, stub_alias(module)) for module in self.pb2_imports)

    @property
    def has_containers(self) -> bool:
        """Whether the type stub has a repeated field."""
        return any("_containers." in field.type for message in self.stubs for field in message.fields)


def python_modules(file: ProtoFile, names: Names) -> PythonModules:
    """Decide what the Python modules of a `.proto` file are.

    Raises:
        SchemaError: A name is a keyword of Python.
    """
    source = file.source
    for part in (source.name.package, source.name.name):
        if keyword.iskeyword(part):
            raise SchemaError(f"{source.name}: {part!r} is a keyword of Python; rename it")
    adapter_names = _local_adapter_names(file, names)
    writer = Writer(adapter_names)
    adapters = tuple(_message_adapter(each, source, names, writer) for each in file.messages)
    groups = list(parts(source).items())
    groups.sort(key=lambda each: each[0] == source.name)  # an action refers to its services
    return PythonModules(
        name=source.name.name,
        package=names.package(source.name),
        proto_path=file.path,
        type_name=str(source.name),
        pb2_imports=tuple(
            f"{names.root}.{path.removesuffix('.proto').replace('/', '.')}_pb2" for path in file.imports
        ),
        helpers=tuple(sorted({*_USED_BY_ALL, *writer.helpers})),
        adapter_imports=tuple(
            (names.module(name, "adapter"), names.adapter(name), local_name)
            for name, local_name in adapter_names.items()
            if names.catalog.definition_name(name) != source.name
        ),
        custom_names=tuple(each.name for each in file.messages),
        messages=adapters,
        groups=tuple(_group(name, group, source, names) for name, group in groups),
        stubs=tuple(stub(each, source, names) for each in file.messages),
    )


_USED_BY_ALL = ("check_custom", "conversion_error", "finish_custom", "finish_ros_message")


# --- Adapters ---


def _message_adapter(
    proto: ProtoMessage,
    interface: Interface,
    names: Names,
    writer: Writer,
) -> MessageAdapter:
    conversion = message_conversion(proto)
    lines = {field.name: writer.lines(field, how) for field, how in conversion.fields}
    return MessageAdapter(
        class_name=names.adapter(proto.type_name),
        custom=proto.name,
        custom_full_name=proto.full_name,
        type_name=str(proto.type_name),
        type_hash=names.catalog.hash(proto.type_name),
        ros_class=_ros_class(proto.type_name, interface),
        comment=docstring_lines(proto.source.comment),
        constants=tuple(
            AdapterConstant(_constant_name(each.name), _literal(each.value), plain_lines(each.comment))
            for each in proto.constants
        ),
        packed_numbers=conversion.packed_numbers,
        fields=tuple(
            AdapterField(each.name, _field_info(each, writer.adapter_names), *lines.get(each.name, ((), ())))
            for each in proto.fields
        ),
        defaults=_defaults(proto),
        has_defaults=_has_defaults(proto.source, names),
    )


def _field_info(field: ProtoField, adapter_names: Mapping[TypeName, str]) -> str:
    """Return the arguments of a `FieldInfo` behind the name, without those that have their defaults."""
    arguments = [field.type_id, field.capacity or 0, field.string_bound or 0]
    if isinstance(field.element, TypeName):
        return ", ".join([*map(str, arguments), adapter_names[field.element]])
    while arguments[-1] == 0:
        arguments.pop()
    return ", ".join(map(str, arguments))


def _constant_name(name: str) -> str:
    """Return the attribute of a constant; not one that adapters have already, as an `.idl` may name it."""
    return f"{name}_" if hasattr(TypeAdapter, name) or name in TypeAdapter.__annotations__ else name


def _ros_class(name: TypeName, interface: Interface) -> str:
    """Return where ROS has the Python class of a type: `module:Class`."""
    path = interface.name.name
    if isinstance(interface, Service):
        path += _ros_part(name, interface)
    elif isinstance(interface, Action):
        implementation = {
            interface.send_goal: "SendGoalService",
            interface.get_result: "GetResultService",
        }
        own = {
            interface.goal.name: "Goal",
            interface.result.name: "Result",
            interface.feedback.name: "Feedback",
            interface.feedback_message.name: "Impl.FeedbackMessage",
        }
        if name in own:
            path += f".{own[name]}"
        for service, service_class in implementation.items():
            if name.name.startswith(service.name.name):
                path += f".Impl.{service_class}{_ros_part(name, service)}"
    return f"{interface.name.package}.{interface.name.namespace}:{path}"


def _ros_part(name: TypeName, service: Service) -> str:
    part = name.name.removeprefix(service.name.name).removeprefix("_")
    return f".{part}" if part else ""


_GROUPS = {
    "request": ("ServiceAdapter", ("request", "response")),
    "goal": ("ActionAdapter", ("goal", "result", "feedback")),
}
"""The base class of a group, and the parts that it is parametrized with, by the first part."""


def _group(name: TypeName, group: Mapping[str, TypeName], interface: Interface, names: Names) -> GroupAdapter:
    base, parameters = _GROUPS[next(iter(group))]
    return GroupAdapter(
        class_name=names.adapter(name),
        base=base,
        parameters=tuple(group[part].name for part in parameters),
        type_name=str(name),
        type_hash=names.catalog.hash(name),
        ros_class=_ros_class(name, interface),
        parts=tuple((part, names.adapter(each)) for part, each in group.items()),
    )


def _local_adapter_names(file: ProtoFile, names: Names) -> dict[TypeName, str]:
    """Return what the adapters that a module refers to are called in it.

    An adapter of another package keeps its name unless the module has another use for it.
    """
    own = {message.source.name for message in file.messages}
    local = {name: names.adapter(name) for name in own}
    taken = {*local.values(), *(name.name for name in own), names.adapter(file.source.name)}
    referred = {name for message in file.messages for _, name in references(message.source)}
    for name in sorted(referred - own):
        class_name = names.adapter(name)
        if class_name in taken:
            class_name = f"{name.package}_{name.namespace}_{class_name}"
        local[name] = class_name
        taken.add(class_name)
    return dict(sorted(local.items()))


# --- Default values and constants ---


def _defaults(proto: ProtoMessage) -> str:
    """Return the default values of a message as the Python text of a dictionary, in terms of protobuf."""
    items = [f"{each.name!r}: {_literal(each.default)}" for each in proto.fields if each.default is not None]
    return "{" + ", ".join(items) + "}" if items else ""


def _has_defaults(message: Message, names: Names) -> bool:
    if any(each.default is not None for each in message.fields):
        return True
    # A sequence is empty by default, whatever its elements are.
    return any(
        _has_defaults(names.catalog.message(name), names)
        for field, name in references(message)
        if not isinstance(field.type, SequenceType)
    )


def _literal(value: ProtoValue) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_literal, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return f'float("{value}")'
    return repr(value)
