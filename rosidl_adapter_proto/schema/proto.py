"""From the model to a `.proto` file, as plain data in which everything is decided."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.description import field_type_description
from rosidl_adapter_proto.interfaces.model import (
    Constant,
    Field,
    FieldType,
    Interface,
    Message,
    ScalarValue,
    Service,
    Shape,
    TypeName,
    Value,
    messages,
    references,
    type_parts,
)
from rosidl_adapter_proto.interfaces.scalars import SCALARS, Family, Scalar
from rosidl_adapter_proto.schema.numbering import Numbering
from rosidl_adapter_proto.schema.typemap import (
    MAXIMUM_DEPTH,
    PROTO_ACTION_GET_RESULT_CALL_NAME,
    PROTO_ACTION_SEND_GOAL_CALL_NAME,
    PROTO_SERVICE_CALL_NAME,
    is_repeated,
    proto_full_name,
    proto_package,
    proto_path,
    proto_type,
)

ProtoScalarValue = bool | int | float | str | bytes
ProtoValue = ProtoScalarValue | tuple[ProtoScalarValue, ...]
"""A value as a protobuf class takes it; a tuple for a repeated field."""


@dataclass(frozen=True)
class ProtoField:
    """A field of a protobuf message.

    Attributes:
        name: Its name, the same as in ROS.
        repeated: Whether it is a repeated field.
        type: Its protobuf type; a message by full name with a leading dot.
        number: Its field number.
        json_name: Its name in protobuf's JSON.
        comment: The lines to stand above it.
        shape: How many elements it has in ROS.
        element: The scalar type of an element in ROS, or the message that it is.
        capacity: The length of an array; the bound of a sequence, None if it has none; None for a single element.
        string_bound: The greatest number of characters in a string, None if it has no bound.
        limits: The smallest and largest number that ROS has, where the protobuf type of one element has others.
        default: Its default value in ROS, if it has one, as the protobuf class takes it.
        type_id: The number of its type in a type description (REP-2011).
        source: The ROS field it stands for.
    """

    name: str
    repeated: bool
    type: str
    number: int
    json_name: str
    comment: tuple[str, ...]
    shape: Shape
    element: Scalar | TypeName
    capacity: int | None
    string_bound: int | None
    limits: tuple[float, float] | None
    default: ProtoValue | None
    type_id: int
    source: Field


@dataclass(frozen=True)
class ProtoMessage:
    """A protobuf message.

    Attributes:
        name: Its name, the same as in ROS.
        full_name: Its name with its protobuf package.
        type_name: The ROS type it stands for.
        comment: The lines to stand above it.
        fields: Its fields, in order of declaration.
        constants: The constants of the ROS message.
        reserved_numbers: Numbers of fields that it had once.
        reserved_names: Names of fields that it had once.
        has_json_conflict: Whether two of its fields share a JSON name, which proto3 only allows with an option.
        source: The ROS message it stands for.
    """

    name: str
    full_name: str
    type_name: TypeName
    comment: tuple[str, ...]
    fields: tuple[ProtoField, ...]
    constants: tuple[Constant, ...]
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


def check_nesting(files: Iterable[ProtoFile]) -> None:
    """Check that protobuf can read every message, however deep others are nested in it.

    Args:
        files: Each file behind those that it imports.

    Raises:
        SchemaError: Messages are nested too deep.
    """
    depths: dict[TypeName, int] = {}
    for file in files:
        own = {message.type_name: message for message in file.messages}
        for message in own.values():
            _measure(message, own, depths)


def _measure(message: ProtoMessage, own: Mapping[TypeName, ProtoMessage], depths: dict[TypeName, int]) -> int:
    """Return how many messages lie in each other, from this one on; those of `own` may not be in `depths` yet."""
    if message.type_name not in depths:
        depth = 1
        for field, name in references(message.source):
            nested = _measure(own[name], own, depths) if name in own else depths[name]
            if nested == MAXIMUM_DEPTH:
                raise SchemaError(
                    f"{_place(message.source, field)} nests messages more than {MAXIMUM_DEPTH} deep, which protobuf "
                    f"does not read; flatten {name} or what is in it"
                )
            depth = max(depth, nested + 1)
        depths[message.type_name] = depth
    return depths[message.type_name]


def _place(message: Message, field: Field) -> str:
    """Return how errors call a field, with the place where it is defined if that is known."""
    return f"{message.name}.{field.name}" + (f" ({field.location})" if field.location else "")


LARGEST_COUNT = 0xFFFF_FFFF
"""The largest number of elements or characters that CDR has a count for (DDS-XTypes 1.3, section 7.4.3.5)."""


def _check_counts(message: Message) -> None:
    """Check that CDR can count what each field may hold."""
    for field in message.fields:
        shape, _, capacity, string_bound = type_parts(field.type)
        what = "the length of an array" if shape is Shape.ARRAY else "the bound of a sequence"
        for count, called in ((capacity, what), (string_bound, "the bound of a string")):
            if count is not None and count > LARGEST_COUNT:
                raise SchemaError(
                    f"{_place(message, field)}: {called} must be at most {LARGEST_COUNT}, since ROS sends no more, "
                    f"not {count}"
                )


def _proto_message(message: Message, numbering: Numbering) -> ProtoMessage:
    for name in (message.name.package, message.name.name, *(each.name for each in message.fields)):
        if not _IDENTIFIER.fullmatch(name):
            raise SchemaError(
                f"{message.name}: protobuf cannot take the name {name!r}; "
                "use letters, digits and underscores, beginning with a letter"
            )
    _check_counts(message)
    numbers = numbering.numbers(message)
    fields = tuple(_proto_field(each, numbers.fields[each.name]) for each in message.fields)
    return ProtoMessage(
        message.name.name,
        proto_full_name(message.name),
        message.name,
        _lines([*message.comment, *_constant_lines(message.constants)]),
        fields,
        message.constants,
        tuple(sorted(numbers.reserved.values())),
        tuple(sorted(numbers.reserved)),
        len({each.json_name for each in fields}) < len(fields),
        message,
    )


def _proto_field(field: Field, number: int) -> ProtoField:
    shape, element, capacity, string_bound = type_parts(field.type)
    return ProtoField(
        field.name,
        is_repeated(field.type),
        proto_type(field.type),
        number,
        _json_name(field.name),
        _lines([*field.comment, *facts(field)]),
        shape,
        element,
        capacity,
        string_bound,
        None if isinstance(element, TypeName) else _limits(element),
        None if field.default is None else _proto_value(field.type, field.default),
        field_type_description(field.type)["type_id"],
        field,
    )


def _limits(scalar: Scalar) -> tuple[float, float] | None:
    if scalar.bits and scalar.bits < _PROTOBUF_INTEGER_BITS:
        return scalar.range
    if scalar.largest_float and scalar.largest_float < SCALARS[scalar.protobuf].largest_float:
        return -scalar.largest_float, scalar.largest_float
    return None


_PROTOBUF_INTEGER_BITS = 32
"""The width of the narrowest integers in protobuf; its floating-point types are those of the same name in IDL."""


def _proto_value(field_type: FieldType, value: Value) -> ProtoValue:
    """Return the default value of a field as its protobuf class takes it."""
    element = type_parts(field_type).element
    assert isinstance(element, Scalar)  # a message has no default value
    if not isinstance(value, tuple):
        return _proto_scalar(element, value)
    if element.repeated:
        return tuple(_proto_scalar(element, each) for each in value)
    return _COMPACT_VALUES[element.many]([int(each) for each in value])


def _proto_scalar(scalar: Scalar, value: ScalarValue) -> ProtoScalarValue:
    return str(value).encode("utf-16-le") if scalar.family is Family.WSTRING else value


_COMPACT_VALUES: Mapping[str, Callable[[list[int]], str | bytes]] = {
    "bytes": lambda numbers: bytes(each & 0xFF for each in numbers),
    "string": lambda numbers: "".join(map(chr, numbers)),
}
"""How an array becomes one protobuf value, for each type that it may have there."""


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
    shape, element, capacity, string_bound = type_parts(field.type)
    lines = []
    if field.unit:
        lines.append(f"Unit: {field.unit}")
    if (
        isinstance(element, Scalar)
        and element.family is not Family.CHARACTER
        and (limits := _limits(element))
    ):
        lines.append(f"Values from {limits[0]} to {limits[1]}.")
    if string_bound is not None:
        lines.append(f"At most {_count(string_bound, 'character')}.")
    if capacity is not None:
        lines.append(f"{'Exactly' if shape is Shape.ARRAY else 'At most'} {_count(capacity, 'element')}.")
    if field.default is not None:
        lines.append(f"Default in ROS: {_literal(field.default)}")
    return lines


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"


def _constant_lines(constants: Iterable[Constant]) -> list[str]:
    lines = [
        f"  {each.name} = {_literal(each.value)}" + (f"  ({' '.join(each.comment)})" if each.comment else "")
        for each in constants
    ]
    return ["", "Constants:", *lines] if lines else []


def _literal(value: Value) -> str:
    return json.dumps(list(value) if isinstance(value, tuple) else value, ensure_ascii=False)


def plain_lines(lines: Iterable[str]) -> Iterator[str]:
    """Yield lines that can stand in a comment of any language.

    They are split at every line break there is, since one inside a comment would end it. Other control characters, of
    which NUL ends a file for protoc and Python, are replaced by the pictures that Unicode has of them.
    """
    for each in lines:
        for line in each.splitlines() or [""]:
            yield line.rstrip().translate(_CONTROL_PICTURES)


_CONTROL_PICTURES = {**{code: 0x2400 + code for code in range(0x20) if chr(code) != "\t"}, 0x7F: 0x2421}


def _lines(lines: Iterable[str]) -> tuple[str, ...]:
    """Return lines that can stand in a comment, without outer empty ones."""
    split = list(plain_lines(lines))
    while split and not split[0]:
        split.pop(0)
    while split and not split[-1]:
        split.pop()
    return tuple(split)
