"""The plan: everything about one type that the transcoder needs to know, decided once, as plain data.

A plan joins a REP-2011 type description, which says how a type lies in CDR, with a protobuf descriptor, which says what
its field numbers are. `Plan.pack` gives it to the native core, which checks it again when it loads it.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from enum import IntEnum

from google.protobuf.descriptor import Descriptor, FieldDescriptor

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.description import (
    FieldDescription,
    IndividualTypeDescription,
    TypeDescription,
    described_type,
)
from rosidl_adapter_proto.interfaces.model import EMPTY_STRUCT_FIELD, Shape, TypeName

MAXIMUM_DEPTH = 100
"""How deep messages may be nested: protobuf's own limit for parsers."""

UNBOUNDED = 0xFFFFFFFF
"""A count or string length without a bound."""


class Kind(IntEnum):
    """What one element of a field is; `core/plan.hpp` has the same list and says how each lies in CDR and protobuf."""

    PLACEHOLDER = 0
    BOOL = 1
    UINT8 = 2
    INT8 = 3
    CHAR = 4
    UINT16 = 5
    INT16 = 6
    WCHAR = 7
    FIXED32 = 8
    FIXED64 = 9
    STRING = 10
    WSTRING = 11
    MESSAGE = 12


@dataclass(frozen=True)
class Mapping:
    """How elements of one IDL type are transcoded.

    Attributes:
        kind: What the core does with them.
        single: The protobuf type of a field with one element.
        many: The protobuf type of an array or sequence.
        repeated: Whether an array or sequence is a repeated field.
    """

    kind: Kind
    single: int
    many: int
    repeated: bool = True


def _repeated(kind: Kind, protobuf_type: int) -> Mapping:
    return Mapping(kind, protobuf_type, protobuf_type)


MAPPINGS = {
    "nested": _repeated(Kind.MESSAGE, FieldDescriptor.TYPE_MESSAGE),
    "int8": Mapping(Kind.INT8, FieldDescriptor.TYPE_INT32, FieldDescriptor.TYPE_BYTES, repeated=False),
    "uint8": Mapping(Kind.UINT8, FieldDescriptor.TYPE_UINT32, FieldDescriptor.TYPE_BYTES, repeated=False),
    "int16": _repeated(Kind.INT16, FieldDescriptor.TYPE_INT32),
    "uint16": _repeated(Kind.UINT16, FieldDescriptor.TYPE_UINT32),
    "int32": _repeated(Kind.FIXED32, FieldDescriptor.TYPE_SFIXED32),
    "uint32": _repeated(Kind.FIXED32, FieldDescriptor.TYPE_FIXED32),
    "int64": _repeated(Kind.FIXED64, FieldDescriptor.TYPE_SFIXED64),
    "uint64": _repeated(Kind.FIXED64, FieldDescriptor.TYPE_FIXED64),
    "float": _repeated(Kind.FIXED32, FieldDescriptor.TYPE_FLOAT),
    "double": _repeated(Kind.FIXED64, FieldDescriptor.TYPE_DOUBLE),
    "char": Mapping(Kind.CHAR, FieldDescriptor.TYPE_UINT32, FieldDescriptor.TYPE_STRING, repeated=False),
    "wchar": Mapping(Kind.WCHAR, FieldDescriptor.TYPE_UINT32, FieldDescriptor.TYPE_STRING, repeated=False),
    "boolean": _repeated(Kind.BOOL, FieldDescriptor.TYPE_BOOL),
    "octet": Mapping(Kind.UINT8, FieldDescriptor.TYPE_UINT32, FieldDescriptor.TYPE_BYTES, repeated=False),
    "string": _repeated(Kind.STRING, FieldDescriptor.TYPE_STRING),
    "wstring": _repeated(Kind.WSTRING, FieldDescriptor.TYPE_BYTES),
}
"""How each IDL type is transcoded. `long double` is missing: Fast CDR copies the bytes of the machine, which are 80-bit
x87 numbers on x86-64 and 128-bit IEEE numbers on ARM, and the encapsulation does not tell which."""

_PROTOBUF_TYPE_NAMES = {
    getattr(FieldDescriptor, f"TYPE_{name.upper()}"): name
    for name in (
        *("double", "float", "int32", "int64", "uint32", "uint64", "sint32", "sint64", "fixed32", "fixed64"),
        *("sfixed32", "sfixed64", "bool", "string", "bytes", "message", "group", "enum"),
    )
}


@dataclass(frozen=True)
class Operation:
    """One field: how it lies in CDR and which protobuf field it is.

    Attributes:
        name: The name of the field.
        number: The number of the protobuf field.
        kind: What one element is.
        shape: Whether it is one element, an array or a sequence.
        count: The length of an array; the bound of a sequence.
        string_bound: The greatest number of characters in a string.
        message: Which message of the plan is nested here.
        omit_empty: Whether a single nested message that has no bytes is left out.
    """

    name: str
    number: int
    kind: Kind
    shape: Shape = Shape.SINGLE
    count: int = UNBOUNDED
    string_bound: int = UNBOUNDED
    message: int = 0
    omit_empty: bool = False


@dataclass(frozen=True)
class Plan:
    """The messages of one type, itself first, and each before the ones that it contains."""

    type_name: str
    messages: tuple[tuple[Operation, ...], ...]

    def pack(self) -> bytes:
        """Return the plan in the form that `core/plan.cpp` reads: little endian, no padding.

        A header (the mark `RPP1`, the numbers of messages and operations, the size of all names), the messages (their
        first operation and their number of operations), the operations, and the names of the fields.
        """
        messages: list[bytes] = []
        operations: list[bytes] = []
        names = bytearray()
        for message in self.messages:
            messages.append(struct.pack("<II", len(operations), len(message)))
            for each in message:
                name = each.name.encode()
                operations.append(
                    struct.pack(
                        "<BBBxIIIIII",
                        each.kind,
                        each.shape,
                        each.omit_empty,
                        each.number,
                        each.count,
                        each.string_bound,
                        each.message,
                        len(names),
                        len(name),
                    )
                )
                names += name
        header = struct.pack("<4sIII", b"RPP1", len(messages), len(operations), len(names))
        return b"".join((header, *messages, *operations, names))


def build_plan(
    type_description: TypeDescription, descriptor: Descriptor, *, omit_empty_messages: bool = False
) -> Plan:
    """Join a type description and a protobuf descriptor.

    Args:
        type_description: The type and everything that it refers to (REP-2011).
        descriptor: The protobuf message; its fields have the names of the ROS fields and any numbers.
        omit_empty_messages: Leave out single nested messages that have no bytes, so that they are not present in the
            protobuf message. By default they are written, since in ROS they always exist.

    Raises:
        SchemaError: The two do not describe the same type, or the type cannot be transcoded.
    """
    top = type_description["type_description"]
    builder = _Builder(
        {
            top["type_name"]: top,
            **{each["type_name"]: each for each in type_description["referenced_type_descriptions"]},
        },
        omit_empty_messages,
    )
    builder.add(top["type_name"], descriptor, ())
    return builder.plan(top["type_name"])


class _Builder:
    """Collects the messages of a plan, parts first."""

    def __init__(self, types: dict[str, IndividualTypeDescription], omit_empty: bool) -> None:
        self._types = types
        self._omit_empty = omit_empty
        self._messages: list[list[Operation]] = []
        self._indices: dict[tuple[str, str], int] = {}

    def add(self, type_name: str, descriptor: Descriptor, outer: tuple[str, ...]) -> int:
        """Add a message and everything in it; return its index counted from the innermost."""
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
        key = (type_name, descriptor.full_name)
        if key not in self._indices:
            operations = self._operations(type_name, descriptor, (*outer, type_name))
            self._indices[key] = len(self._messages)
            self._messages.append(operations)
        return self._indices[key]

    def plan(self, type_name: str) -> Plan:
        last = len(self._messages) - 1
        return Plan(
            type_name,
            tuple(
                tuple(
                    replace(each, message=last - each.message if each.kind is Kind.MESSAGE else 0)
                    for each in message
                )
                for message in reversed(self._messages)
            ),
        )

    def _operations(self, type_name: str, descriptor: Descriptor, outer: tuple[str, ...]) -> list[Operation]:
        fields = self._types[type_name]["fields"]
        if not fields:
            raise SchemaError(f"{type_name}: it has no fields; an empty struct has {EMPTY_STRUCT_FIELD}")
        unknown = set(descriptor.fields_by_name) - {field["name"] for field in fields}
        if unknown:
            names = ", ".join(sorted(unknown))
            raise SchemaError(
                f"{type_name}: {descriptor.full_name} has fields that the ROS type does not have: {names};"
                " generate it again"
            )
        return [self._operation(type_name, field, descriptor, outer) for field in fields]

    def _operation(
        self, type_name: str, field: FieldDescription, descriptor: Descriptor, outer: tuple[str, ...]
    ) -> Operation:
        name, field_type = field["name"], field["type"]
        where = f"{type_name}.{name}"
        protobuf_field = descriptor.fields_by_name.get(name)
        if protobuf_field is None:
            raise SchemaError(f"{where}: {descriptor.full_name} does not have this field; generate it again")
        try:
            shape, element, capacity, string_bound = described_type(field_type)
        except ValueError as error:
            raise SchemaError(f"{where}: {error}") from None
        element_name = "nested" if isinstance(element, TypeName) else element.name
        mapping = MAPPINGS.get(element_name)
        if mapping is None:
            raise SchemaError(
                f"{where}: {element_name} has no one layout in CDR and cannot be transcoded; "
                "make the field a double"
            )
        _check_protobuf_type(where, mapping, shape, protobuf_field)
        message = 0
        if mapping.kind is Kind.MESSAGE:
            part = protobuf_field.message_type
            assert part is not None  # its type is message
            message = self.add(field_type["nested_type_name"], part, outer)
        return Operation(
            name=name,
            number=protobuf_field.number,
            kind=Kind.PLACEHOLDER if name == EMPTY_STRUCT_FIELD else mapping.kind,
            shape=shape,
            count=capacity or UNBOUNDED,
            string_bound=string_bound or UNBOUNDED,
            message=message,
            omit_empty=self._omit_empty,
        )


def _check_protobuf_type(where: str, mapping: Mapping, shape: Shape, field: FieldDescriptor) -> None:
    single = shape is Shape.SINGLE
    repeated = not single and mapping.repeated
    expected = mapping.single if single else mapping.many
    if field.type != expected or _is_repeated(field) != repeated:
        raise SchemaError(
            f"{where}: the protobuf field is {_type_text(field.type, _is_repeated(field))} where"
            f" {_type_text(expected, repeated)} is needed; generate its message again"
        )


def _is_repeated(field: FieldDescriptor) -> bool:
    # `label` warns in newer releases of protobuf; `is_repeated` does not exist in older ones.
    if hasattr(field, "is_repeated"):
        return bool(field.is_repeated)
    return bool(field.label == FieldDescriptor.LABEL_REPEATED)  # type: ignore[attr-defined]


def _type_text(protobuf_type: int, repeated: bool) -> str:
    name = _PROTOBUF_TYPE_NAMES[protobuf_type]
    return f"repeated {name}" if repeated else name
