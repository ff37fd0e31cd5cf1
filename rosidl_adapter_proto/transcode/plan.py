"""The plan: everything about one type that the transcoder needs to know, decided once, as plain data.

A plan joins a REP-2011 type description, which says how a type lies in CDR, with a protobuf descriptor, which says what
its field numbers are. The two sides stay apart: each operation has a name and a form in ROS and in protobuf.
`Plan.pack` gives it to the native core, which checks it again when it loads it.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from google.protobuf.descriptor import Descriptor, FieldDescriptor

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.description import (
    FieldDescription,
    IndividualTypeDescription,
    TypeDescription,
    described_type,
)
from rosidl_adapter_proto.interfaces.model import EMPTY_STRUCT_FIELD, Shape, TypeName
from rosidl_adapter_proto.interfaces.scalars import NESTED_TYPE_ID, CdrForm, Scalar
from rosidl_adapter_proto.schema.typemap import MAXIMUM_DEPTH

VERSION = 2
"""The version of packed plans, which the core must have too."""

UNBOUNDED = 0xFFFFFFFF
"""A count or string length without a bound."""

NOT_IN_PROTOBUF = 0
"""The protobuf form of a field that is skipped when CDR is read, and zeros when it is written."""

PROTOBUF_TYPES = {
    name: getattr(FieldDescriptor, f"TYPE_{name.upper()}")
    for name in (
        *("double", "float", "int32", "int64", "uint32", "uint64", "sint32", "sint64", "fixed32", "fixed64"),
        *("sfixed32", "sfixed64", "bool", "string", "bytes", "message", "group", "enum"),
    )
}
"""The numbers of protobuf types by their names."""

_PROTOBUF_TYPE_NAMES = {number: name for name, number in PROTOBUF_TYPES.items()}


@dataclass(frozen=True)
class Operation:
    """One field: how it lies in CDR, and which protobuf field it is.

    Attributes:
        name: The name of the field in ROS.
        protobuf_name: Its name in protobuf; empty if it is not there.
        scalar: The type of an element, as a type id without shape or bound (REP-2011).
        cdr: How an element lies in CDR.
        protobuf: The type of the protobuf field, a number of `FieldDescriptor.TYPE_*`, or `NOT_IN_PROTOBUF`.
        number: The number of the protobuf field; 0 if it is not there.
        shape: Whether it is one element, an array or a sequence.
        count: The length of an array; the bound of a sequence.
        string_bound: The greatest number of characters in a string.
        message: Which message of the plan is nested here.
        omit_empty: Whether a single nested message that has no bytes is left out.
    """

    name: str
    protobuf_name: str
    scalar: int
    cdr: CdrForm
    protobuf: int
    number: int
    shape: Shape = Shape.SINGLE
    count: int = UNBOUNDED
    string_bound: int = UNBOUNDED
    message: int = 0
    omit_empty: bool = False


@dataclass(frozen=True)
class MessagePlan:
    """One message: its names in ROS and in protobuf, and its fields in the order of CDR."""

    name: str
    protobuf_name: str
    operations: tuple[Operation, ...]


@dataclass(frozen=True)
class Plan:
    """The messages of one type, itself first, and each before the ones that it contains.

    Attributes:
        messages: The messages.
        partial: Whether fields are missing, so that nothing can be said about what follows the last one, and messages
            can be read from CDR but not written.
    """

    messages: tuple[MessagePlan, ...]
    partial: bool = False

    @property
    def type_name(self) -> str:
        """The ROS type, such as `sensor_msgs/msg/Imu`."""
        return self.messages[0].name

    def pack(self) -> bytes:
        """Return the plan in the form that `core/src/plan.cpp` reads: little endian, no padding.

        A header (the mark `RPP` and the version as a digit, the numbers of messages and operations, the size of all
        names, 1 if it is partial), the messages (their first operation, their number of operations, their names), the
        operations, and the names. A name is a place and a size in the names.
        """
        names = _Names()
        messages: list[bytes] = []
        operations: list[bytes] = []
        for message in self.messages:
            places = (*names.add(message.name), *names.add(message.protobuf_name))
            messages.append(struct.pack("<6I", len(operations), len(message.operations), *places))
            for each in message.operations:
                forms = (each.scalar, each.cdr, each.protobuf, each.shape, each.omit_empty)
                numbers = (each.number, each.count, each.string_bound, each.message)
                places = (*names.add(each.name), *names.add(each.protobuf_name))
                operations.append(struct.pack("<5B3x8I", *forms, *numbers, *places))
        mark = f"RPP{VERSION}".encode()
        sizes = (len(messages), len(operations), len(names.text), self.partial)
        return b"".join((struct.pack("<4s4I", mark, *sizes), *messages, *operations, names.text))


class _Names:
    """All names of a plan, each of them once."""

    def __init__(self) -> None:
        self.text = bytearray()
        self._places: dict[str, tuple[int, int]] = {}

    def add(self, name: str) -> tuple[int, int]:
        """Return the place and the size of a name."""
        if name not in self._places:
            encoded = name.encode()
            self._places[name] = len(self.text), len(encoded)
            self.text += encoded
        return self._places[name]


def plan_of_parts(messages: list[MessagePlan], *, partial: bool = False) -> Plan:
    """Return the plan of the last message; in `messages`, parts come first and operations count from there."""
    last = len(messages) - 1

    def from_outermost(operation: Operation) -> Operation:
        nested = operation.cdr is CdrForm.MESSAGE
        return replace(operation, message=last - operation.message) if nested else operation

    return Plan(
        tuple(
            replace(each, operations=tuple(map(from_outermost, each.operations)))
            for each in reversed(messages)
        ),
        partial,
    )


_Paths = frozenset[tuple[str, ...]]
"""Which parts of a field are chosen, as paths from it; the empty path is the field itself."""

_ALL: _Paths = frozenset({()})
_NOTHING: _Paths = frozenset()


def chosen_names(fields: Iterable[str] | None) -> tuple[str, ...] | None:
    """Return the names of chosen fields; None for all.

    Raises:
        TypeError: It is one text, whose letters would be taken for names.
    """
    if isinstance(fields, str):
        raise TypeError(f"fields must be a list of names, such as [{fields!r}], not a text")
    return None if fields is None else tuple(fields)


def build_plan(
    type_description: TypeDescription,
    descriptor: Descriptor,
    *,
    omit_empty_messages: bool = False,
    fields: Iterable[str] | None = None,
) -> Plan:
    """Join a type description and a protobuf descriptor.

    Args:
        type_description: The type and everything that it refers to (REP-2011).
        descriptor: The protobuf message; its fields have the names of the ROS fields and any numbers.
        omit_empty_messages: Leave out single nested messages that have no bytes, so that they are not present in the
            protobuf message. By default they are written, since in ROS they always exist.
        fields: Read only these from CDR, such as `header.stamp` or, of each point in a sequence, `points.x`. All of a
            message is read if none of its fields is named. What is not needed to find them is not looked at.

    Raises:
        SchemaError: The two do not describe the same type, the type cannot be transcoded, or it has no such field.
        TypeError: `fields` is one text.
    """
    top = type_description["type_description"]
    names = chosen_names(fields)
    chosen = _ALL if names is None else frozenset(tuple(each.split(".")) for each in names)
    if not chosen:
        raise SchemaError(
            f"{top['type_name']}: no field is chosen; name one, or give no fields for all of them"
        )
    builder = _Builder(
        {
            top["type_name"]: top,
            **{each["type_name"]: each for each in type_description["referenced_type_descriptions"]},
        },
        omit_empty_messages,
    )
    builder.add(_Part(top["type_name"], descriptor, chosen, fields is not None, top["type_name"]), ())
    return builder.plan(partial=fields is not None)


@dataclass(frozen=True)
class _Part:
    """A message to plan.

    Attributes:
        type_name: Its ROS type.
        descriptor: Its protobuf type.
        chosen: What of it is read.
        last: Whether nothing is read after it, so that it ends with the last field that is chosen.
        path: Where it is, for errors.
    """

    type_name: str
    descriptor: Descriptor
    chosen: _Paths
    last: bool
    path: str

    @property
    def key(self) -> tuple[str, str, _Paths, bool]:
        """What decides its operations."""
        return self.type_name, self.descriptor.full_name, self.chosen, self.last


class _Builder:
    """Collects the messages of a plan, parts first."""

    def __init__(self, types: dict[str, IndividualTypeDescription], omit_empty: bool) -> None:
        self._types = types
        self._omit_empty = omit_empty
        self._messages: list[MessagePlan] = []
        self._indices: dict[tuple[str, str, _Paths, bool], int] = {}

    def add(self, part: _Part, outer: tuple[str, ...]) -> int:
        """Add a message and everything in it; return its index counted from the innermost."""
        type_name = part.type_name
        if type_name in outer:
            raise SchemaError(
                f"{type_name}: it contains itself, which IDL structs cannot; correct its type description"
            )
        if len(outer) >= MAXIMUM_DEPTH:
            raise SchemaError(
                f"{type_name}: messages are nested more than {MAXIMUM_DEPTH} deep; flatten {outer[0]}"
            )
        if type_name not in self._types:
            raise SchemaError(
                f"{type_name}: {outer[-1]} refers to it and its type description is missing; add it"
            )
        if part.key not in self._indices:
            operations = tuple(self._operations(part, (*outer, type_name)))
            self._indices[part.key] = len(self._messages)
            self._messages.append(MessagePlan(type_name, part.descriptor.full_name, operations))
        return self._indices[part.key]

    def plan(self, *, partial: bool) -> Plan:
        """Return the plan of the message that was added last."""
        return plan_of_parts(self._messages, partial=partial)

    def _operations(self, part: _Part, outer: tuple[str, ...]) -> Iterator[Operation]:
        type_name, descriptor = part.type_name, part.descriptor
        fields = self._types[type_name]["fields"]
        if not fields:
            raise SchemaError(f"{type_name}: it has no fields; an empty struct has {EMPTY_STRUCT_FIELD}")
        names = [field["name"] for field in fields]
        unknown = set(descriptor.fields_by_name) - set(names)
        if unknown:
            raise SchemaError(
                f"{type_name}: {descriptor.full_name} has fields that the ROS type does not have:"
                f" {', '.join(sorted(unknown))}; generate it again"
            )
        chosen = _chosen_of_each(part, names)
        end = len(fields)
        if part.last:
            end = 1 + max(index for index, name in enumerate(names) if chosen[name])
        for index, field in enumerate(fields[:end]):
            yield self._operation(part, field, chosen[field["name"]], part.last and index == end - 1, outer)

    def _operation(
        self, part: _Part, field: FieldDescription, chosen: _Paths, last: bool, outer: tuple[str, ...]
    ) -> Operation:
        name = field["name"]
        where = f"{part.type_name}.{name}"
        protobuf_field = part.descriptor.fields_by_name.get(name)
        if protobuf_field is None:
            raise SchemaError(
                f"{where}: {part.descriptor.full_name} does not have this field; generate it again"
            )
        try:
            shape, element, capacity, string_bound = described_type(field["type"])
        except ValueError as error:
            raise SchemaError(f"{where}: {error}") from None
        form = _form(where, element)
        _check_protobuf_type(where, form, shape, protobuf_field)
        message = 0
        if form.cdr is CdrForm.MESSAGE:
            nested = protobuf_field.message_type
            assert nested is not None  # its type is message
            nested_last = last and shape is Shape.SINGLE and chosen != _ALL
            message = self.add(
                _Part(field["type"]["nested_type_name"], nested, chosen, nested_last, f"{part.path}.{name}"),
                outer,
            )
        elif chosen and chosen != _ALL:
            _, path = max((len(each), each) for each in chosen)
            raise SchemaError(f"{part.path}.{name} is no message and has no field {path[0]!r}")
        in_protobuf = bool(chosen) and name != EMPTY_STRUCT_FIELD
        return Operation(
            name=name,
            protobuf_name=protobuf_field.name if in_protobuf else "",
            scalar=form.type_id,
            cdr=form.cdr,
            protobuf=protobuf_field.type if in_protobuf else NOT_IN_PROTOBUF,
            number=protobuf_field.number if in_protobuf else 0,
            shape=shape,
            count=capacity or UNBOUNDED,
            string_bound=string_bound or UNBOUNDED,
            message=message,
            omit_empty=self._omit_empty and form.cdr is CdrForm.MESSAGE and shape is Shape.SINGLE,
        )


def _chosen_of_each(part: _Part, names: list[str]) -> dict[str, _Paths]:
    """Return what is chosen of each field of a message."""
    if () in part.chosen:
        return dict.fromkeys(names, _ALL)
    result = dict.fromkeys(names, _NOTHING)
    for first, *rest in sorted(part.chosen):
        if first not in result:
            from rosidl_adapter_proto.interfaces.catalog import near_misses

            near = near_misses(first, names, {each: repr(each) for each in names})
            raise SchemaError(f"{part.path} has no field {first!r}{near}")
        result[first] |= {tuple(rest)}
    return {name: _ALL if () in paths else paths for name, paths in result.items()}


@dataclass(frozen=True)
class _Form:
    """What an element is on both sides: `single` and `many` are the protobuf types of one and of several."""

    type_id: int
    cdr: CdrForm
    single: int
    many: int
    repeated: bool


def _form(where: str, element: Scalar | TypeName) -> _Form:
    if isinstance(element, TypeName):
        message = FieldDescriptor.TYPE_MESSAGE
        return _Form(NESTED_TYPE_ID, CdrForm.MESSAGE, message, message, repeated=True)
    if element.cdr is None:
        raise SchemaError(
            f"{where}: {element.name} has no one layout in CDR and cannot be transcoded; make the field a double"
        )
    single, many = PROTOBUF_TYPES[element.protobuf], PROTOBUF_TYPES[element.many]
    return _Form(element.type_id, element.cdr, single, many, element.repeated)


def _check_protobuf_type(where: str, form: _Form, shape: Shape, field: FieldDescriptor) -> None:
    single = shape is Shape.SINGLE
    repeated = not single and form.repeated
    expected = form.single if single else form.many
    if field.type != expected or is_repeated(field) != repeated:
        raise SchemaError(
            f"{where}: the protobuf field is {_type_text(field.type, is_repeated(field))} where"
            f" {_type_text(expected, repeated)} is needed; generate its message again"
        )


def is_repeated(field: FieldDescriptor) -> bool:
    """Tell whether a field is repeated."""
    # `label` warns in newer releases of protobuf; `is_repeated` does not exist in older ones.
    if hasattr(field, "is_repeated"):
        return bool(field.is_repeated)
    return bool(field.label == FieldDescriptor.LABEL_REPEATED)  # type: ignore[attr-defined]


def _type_text(protobuf_type: int, repeated: bool) -> str:
    name = _PROTOBUF_TYPE_NAMES[protobuf_type]
    return f"repeated {name}" if repeated else name
