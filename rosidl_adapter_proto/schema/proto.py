"""From the model to a `.proto` file, as plain data in which everything is decided."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    BasicType,
    Constant,
    Field,
    Interface,
    Message,
    SequenceType,
    Service,
    StringType,
    TypeName,
    Value,
    integer_range,
    messages,
    references,
    value_type,
)
from rosidl_adapter_proto.schema.numbering import Numbering
from rosidl_adapter_proto.schema.typemap import (
    PROTO_ACTION_GET_RESULT_CALL_NAME,
    PROTO_ACTION_SEND_GOAL_CALL_NAME,
    PROTO_SERVICE_CALL_NAME,
    is_repeated,
    proto_full_name,
    proto_package,
    proto_path,
    proto_type,
)


@dataclass(frozen=True)
class ProtoField:
    """A field of a protobuf message.

    Attributes:
        name: Its name, the same as in ROS.
        repeated: Whether it is a repeated field.
        type: Its protobuf type; a message by full name with a leading dot.
        number: Its field number.
        comment: The lines to stand above it.
        source: The ROS field it stands for.
    """

    name: str
    repeated: bool
    type: str
    number: int
    comment: tuple[str, ...]
    source: Field


@dataclass(frozen=True)
class ProtoMessage:
    """A protobuf message.

    Attributes:
        name: Its name, the same as in ROS.
        comment: The lines to stand above it.
        fields: Its fields, in order of declaration.
        reserved_numbers: Numbers of fields that it had once.
        reserved_names: Names of fields that it had once.
        has_json_conflict: Whether two of its fields share a JSON name, which proto3 only allows with an option.
        source: The ROS message it stands for.
    """

    name: str
    comment: tuple[str, ...]
    fields: tuple[ProtoField, ...]
    reserved_numbers: tuple[int, ...]
    reserved_names: tuple[str, ...]
    has_json_conflict: bool
    source: Message


@dataclass(frozen=True)
class ProtoRpc:
    """One rpc of a service; request and response by full name with a leading dot."""

    name: str
    request: str
    response: str


@dataclass(frozen=True)
class ProtoService:
    """A protobuf service."""

    name: str
    rpcs: tuple[ProtoRpc, ...]


@dataclass(frozen=True)
class ProtoFile:
    """A `.proto` file: what one interface definition becomes.

    Attributes:
        path: Its path below the folder of all `.proto` files, with slashes.
        package: Its protobuf package.
        numbering: How its fields are numbered, for the file's header.
        imports: Paths of the files it imports.
        messages: Its messages.
        service: Its service, if the interface is a service or an action.
        source: The interface it is made from.
    """

    path: str
    package: str
    numbering: str
    imports: tuple[str, ...]
    messages: tuple[ProtoMessage, ...]
    service: ProtoService | None
    source: Interface


def proto_file(
    interface: Interface,
    numbering: Numbering,
    owner: Callable[[TypeName], TypeName],
    *,
    events: bool = False,
) -> ProtoFile:
    """Map an interface to a `.proto` file.

    Args:
        interface: What to map.
        numbering: How to number its fields.
        owner: Gives the interface that each referred type is part of.
        events: Whether to include the `_Event` messages of service introspection.

    Raises:
        SchemaError: Protobuf cannot take a name, or a lock file disagrees.
    """
    own = messages(interface, events=events)
    imports = {proto_path(owner(name)) for message in own for _, name in references(message)}
    path = proto_path(interface.name)
    return ProtoFile(
        path,
        proto_package(interface.name),
        numbering.name,
        tuple(sorted(imports - {path})),
        tuple(_proto_message(message, numbering) for message in own),
        _service(interface),
        interface,
    )


def check_names(files: Iterable[ProtoFile]) -> None:
    """Check that no two files define the same protobuf name.

    Raises:
        SchemaError: Two do, as `srv/Set.srv` and an action's `.idl` named `Set_Request` would.
    """
    owners: dict[str, str] = {}
    for file in files:
        names = [message.name for message in file.messages]
        if file.service:
            names.append(file.service.name)
        for name in names:
            full_name = f"{file.package}.{name}"
            other = owners.setdefault(full_name, file.path)
            if other != file.path:
                raise SchemaError(
                    f"{full_name} is defined by both {other} and {file.path}; rename one of the interfaces"
                )


def _proto_message(message: Message, numbering: Numbering) -> ProtoMessage:
    for name in (message.name.package, message.name.name, *(each.name for each in message.fields)):
        if not _IDENTIFIER.fullmatch(name):
            raise SchemaError(
                f"{message.name}: protobuf cannot take the name {name!r}; "
                "use letters, digits and underscores, beginning with a letter"
            )
    numbers = numbering.numbers(message)
    json_names = [_json_name(each.name) for each in message.fields]
    return ProtoMessage(
        message.name.name,
        _lines([*message.comment, *_constant_lines(message.constants)]),
        tuple(
            ProtoField(
                each.name,
                is_repeated(each.type),
                proto_type(each.type),
                numbers.fields[each.name],
                _lines([*each.comment, *facts(each)]),
                each,
            )
            for each in message.fields
        ),
        tuple(sorted(numbers.reserved.values())),
        tuple(sorted(numbers.reserved)),
        len(set(json_names)) < len(json_names),
        message,
    )


_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def _json_name(name: str) -> str:
    """Protobuf's JSON name of a field: underscores go, and the letter behind each is capitalized."""
    return re.sub(r"_+([a-z]?)", lambda match: match[1].upper(), name)


def _service(interface: Interface) -> ProtoService | None:
    if isinstance(interface, Message):
        return None
    if isinstance(interface, Service):
        calls = {PROTO_SERVICE_CALL_NAME: interface}
    else:
        calls = {
            PROTO_ACTION_SEND_GOAL_CALL_NAME: interface.send_goal,
            PROTO_ACTION_GET_RESULT_CALL_NAME: interface.get_result,
        }
    rpcs = tuple(
        ProtoRpc(name, f".{proto_full_name(call.request.name)}", f".{proto_full_name(call.response.name)}")
        for name, call in calls.items()
    )
    return ProtoService(interface.name.name, rpcs)


def facts(field: Field) -> list[str]:
    """Say what the protobuf type of a field does not: its unit, range, bounds and default value in ROS."""
    element = value_type(field.type)
    lines = []
    if field.unit:
        lines.append(f"Unit: {field.unit}")
    if isinstance(element, BasicType) and element.name in _NARROW_TYPES:
        lowest, highest = integer_range(element.name)
        lines.append(f"Values from {lowest} to {highest}.")
    if isinstance(element, StringType) and element.bound is not None:
        lines.append(f"At most {_count(element.bound, 'character')}.")
    if isinstance(field.type, ArrayType):
        lines.append(f"Exactly {_count(field.type.size, 'element')}.")
    if isinstance(field.type, SequenceType) and field.type.bound is not None:
        lines.append(f"At most {_count(field.type.bound, 'element')}.")
    if field.default is not None:
        lines.append(f"Default in ROS: {_literal(field.default)}")
    return lines


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"


_NARROW_TYPES = ("int8", "uint8", "int16", "uint16", "octet")


def _constant_lines(constants: Iterable[Constant]) -> list[str]:
    lines = [
        f"  {each.name} = {_literal(each.value)}" + (f"  ({' '.join(each.comment)})" if each.comment else "")
        for each in constants
    ]
    return ["", "Constants:", *lines] if lines else []


def _literal(value: Value) -> str:
    return json.dumps(list(value) if isinstance(value, tuple) else value, ensure_ascii=False)


def _lines(lines: Iterable[str]) -> tuple[str, ...]:
    """Split at every line break there is, since one inside a comment would end it, and drop outer empty lines."""
    split = [line.rstrip() for each in lines for line in each.splitlines() or [""]]
    while split and not split[0]:
        split.pop(0)
    while split and not split[-1]:
        split.pop()
    return tuple(split)
