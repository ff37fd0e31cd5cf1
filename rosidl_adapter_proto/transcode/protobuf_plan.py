"""The plan of any protobuf message, also of one that does not come from ROS.

In CDR, each field is what its protobuf type is by nature: `int32` a number of 32 bits, `bytes` a sequence of bytes.
The core makes the same plans from serialized descriptors (`core/src/schema/file_descriptor_set.cpp`), and tests compare
them.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.descriptor_pb2 import FieldDescriptorProto

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.model import EMPTY_STRUCT_FIELD, Shape
from rosidl_adapter_proto.interfaces.scalars import NESTED_TYPE_ID, SCALARS, CdrForm, Scalar
from rosidl_adapter_proto.schema.typemap import MAXIMUM_DEPTH
from rosidl_adapter_proto.transcode import _core
from rosidl_adapter_proto.transcode.plan import (
    NOT_IN_PROTOBUF,
    PROTOBUF_TYPES,
    UNBOUNDED,
    MessagePlan,
    Operation,
    Plan,
    is_repeated,
    plan_of_parts,
)

MAXIMUM_OPERATIONS = 20_000
"""So many fields a plan has at most, those of all its messages together; as in `core/`."""

MAXIMUM_ENUM_VALUES = 100_000
"""So many values the enums of all fields have at most, an enum counted for each field; as in `core/`."""

MAXIMUM_RECURSION = 4
"""A type that contains itself stands so many times on the way down, and then its field is left out; as in `core/`."""

SCALAR_OPTION = 68_725
"""The number of a private field of `FieldOptions`: the type id of the ROS scalar (REP-2011), as one byte.

Recordings have it where a protobuf type does not tell the ROS type. Numbers from 50000 to 99999 are for such use
(https://protobuf.dev/programming-guides/proto2/#customoptions).
"""

_SCALAR_TAG = bytes.fromhex("aa c7 21")
"""What stands before it in a serialized message: its number and the wire type of bytes."""

NATURAL_FORMS: dict[str, tuple[str, CdrForm]] = {
    "double": ("double", CdrForm.DOUBLE),
    "float": ("float", CdrForm.FLOAT),
    "int64": ("int64", CdrForm.VARINT64),
    "uint64": ("uint64", CdrForm.VARUINT64),
    "int32": ("int32", CdrForm.VARINT32),
    "fixed64": ("uint64", CdrForm.UINT64),
    "fixed32": ("uint32", CdrForm.UINT32),
    "bool": ("boolean", CdrForm.BOOLEAN),
    "string": ("string", CdrForm.STRING),
    "bytes": ("uint8", CdrForm.BYTES),
    "uint32": ("uint32", CdrForm.VARUINT32),
    "enum": ("int32", CdrForm.VARINT32),
    "sfixed32": ("int32", CdrForm.INT32),
    "sfixed64": ("int64", CdrForm.INT64),
    "sint32": ("int32", CdrForm.ZIGZAG32),
    "sint64": ("int64", CdrForm.ZIGZAG64),
}
"""What each protobuf type is by nature: the IDL name of an element, and its form in CDR."""

_NATURAL = {PROTOBUF_TYPES[name]: (SCALARS[scalar], form) for name, (scalar, form) in NATURAL_FORMS.items()}
_SCALARS_BY_TYPE_ID = {each.type_id: each for each in SCALARS.values() if each.cdr is not None}


@dataclass(frozen=True)
class FlatNote:
    """What a plan cannot say of a field; as in `flat.hpp`.

    Attributes:
        enum_values: The numbers of an enum, sorted, and their names.
        map: It is a map: each element is an entry.
        single: It is one message that may contain itself: a sequence of at most one.
    """

    enum_values: tuple[tuple[int, str], ...] = ()
    map: bool = False
    single: bool = False


NO_NOTE = FlatNote()


def protobuf_plan(descriptor: Descriptor) -> tuple[Plan, list[FlatNote]]:
    """Return the plan of a protobuf message, and a note for each operation in the order of the packed plan.

    Groups and extensions are left out. There are no notes at all if there is nothing to say.

    Raises:
        SchemaError: It has too many fields, its messages are nested too deeply, or an option of a field is damaged.
    """
    builder = _Builder(descriptor)
    builder.add(descriptor, ())
    plan = plan_of_parts(builder.messages)
    notes = [note for each in reversed(builder.notes) for note in each]
    return plan, notes if any(note != NO_NOTE for note in notes) else []


def tell_scalar(field: FieldDescriptorProto, scalar: Scalar) -> None:
    """Say in the options of a field which ROS type it is, if its protobuf type does not tell."""
    natural, _ = _NATURAL[field.type]
    if scalar is not natural and scalar.cdr is not None:
        field.options.MergeFromString(_SCALAR_TAG + bytes([1, scalar.type_id]))


class _Builder:
    """Collects the messages of a plan, parts first, each with the notes of its operations."""

    def __init__(self, descriptor: Descriptor) -> None:
        self.messages: list[MessagePlan] = []
        self.notes: list[list[FlatNote]] = []
        self._name = descriptor.full_name
        self._circles = _circles(descriptor)
        self._known: dict[tuple[str, frozenset[tuple[str, int]]], tuple[int, int]] = {}
        self._operations = self._enum_values = 0

    def add(self, descriptor: Descriptor, outer: tuple[str, ...]) -> tuple[int, int]:
        """Add a message and everything in it; return its index and how deep it goes."""
        name = descriptor.full_name
        path = (*outer, name)
        circle = self._circles[name]
        key = name, frozenset(Counter(each for each in path if self._circles[each] == circle).items())
        if key not in self._known:
            _check_depth(self._name, len(path))
            operations: list[Operation] = []
            notes: list[FlatNote] = []
            depth = 1
            for field in descriptor.fields:
                if field.type == FieldDescriptor.TYPE_GROUP or field.name == EMPTY_STRUCT_FIELD:
                    continue
                index = 0
                if (part := field.message_type) is not None:
                    if _stands_too_often(part, path):
                        continue
                    index, inner = self.add(part, path)
                    depth = max(depth, 1 + inner)
                note = self._note(descriptor, field)
                operations.append(_operation(field, index, note))
                notes.append(note)
                self._count(1, 0 if field.enum_type is None else len(field.enum_type.values))
            if not operations:
                operations, notes = [_filler()], [NO_NOTE]
                self._count(1, 0)
            self._known[key] = len(self.messages), depth
            self.messages.append(MessagePlan(name, name, tuple(operations)))
            self.notes.append(notes)
        index, depth = self._known[key]
        _check_depth(self._name, len(outer) + depth)
        return index, depth

    def _note(self, descriptor: Descriptor, field: FieldDescriptor) -> FlatNote:
        if field.enum_type is not None:
            values: dict[int, str] = {}
            for value in field.enum_type.values:
                values.setdefault(value.number, value.name)
            return FlatNote(enum_values=tuple(sorted(values.items())))
        part = field.message_type
        if part is None:
            return NO_NOTE
        if is_map_entry(part):
            return FlatNote(map=True)
        circular = self._circles[part.full_name] == self._circles[descriptor.full_name]
        return FlatNote(single=circular and not is_repeated(field) and not is_map_entry(descriptor))

    def _count(self, operations: int, enum_values: int) -> None:
        self._operations += operations
        self._enum_values += enum_values
        if self._operations > MAXIMUM_OPERATIONS:
            raise SchemaError(f"{self._name}: it has more than {MAXIMUM_OPERATIONS} fields; split it")
        if self._enum_values > MAXIMUM_ENUM_VALUES:
            raise SchemaError(
                f"{self._name}: its enums have more than {MAXIMUM_ENUM_VALUES} values, one counted for each field;"
                " split it"
            )


def _check_depth(name: str, depth: int) -> None:
    if depth > MAXIMUM_DEPTH:
        raise SchemaError(f"{name}: messages are nested more than {MAXIMUM_DEPTH} deep; flatten it")


def _stands_too_often(part: Descriptor, path: tuple[str, ...]) -> bool:
    """Tell whether a field with such a message is left out: a map is, if its values are."""
    inner = part.fields if is_map_entry(part) else ()
    parts = [part, *(field.message_type for field in inner if field.message_type is not None)]
    return any(path.count(each.full_name) >= MAXIMUM_RECURSION for each in parts)


def is_map_entry(descriptor: Descriptor) -> bool:
    """Tell whether a message is the entry of a map."""
    return bool(descriptor.has_options and descriptor.GetOptions().map_entry)


def _circles(descriptor: Descriptor) -> dict[str, int]:
    """Number the types in a message: those that contain each other have the same number (Tarjan's algorithm)."""
    order: dict[str, int] = {}
    lowest: dict[str, int] = {}
    circles: dict[str, int] = {}
    open_types: list[str] = []

    def visit(each: Descriptor, depth: int) -> None:
        _check_depth(descriptor.full_name, depth)
        name = each.full_name
        order[name] = lowest[name] = len(order)
        open_types.append(name)
        for field in each.fields:
            part = field.message_type
            if part is None or field.type == FieldDescriptor.TYPE_GROUP or field.name == EMPTY_STRUCT_FIELD:
                continue
            if part.full_name not in order:
                visit(part, depth + 1)
            if part.full_name not in circles:
                lowest[name] = min(lowest[name], lowest[part.full_name])
        if lowest[name] == order[name]:
            while name not in circles:
                circles[open_types.pop()] = order[name]

    visit(descriptor, 1)
    return circles


def _operation(field: FieldDescriptor, message: int, note: FlatNote) -> Operation:
    name, repeated = field.name, is_repeated(field)
    shape = Shape.SEQUENCE if repeated else Shape.SINGLE
    if field.message_type is not None:
        shape, count = (Shape.SEQUENCE, 1) if note.single else (shape, UNBOUNDED)
        return Operation(
            name,
            name,
            NESTED_TYPE_ID,
            CdrForm.MESSAGE,
            field.type,
            field.number,
            shape,
            count,
            message=message,
        )
    scalar, form = _NATURAL[field.type]
    if form is CdrForm.BYTES and not repeated:
        form, shape = CdrForm.UINT8, Shape.SEQUENCE
    told = _SCALARS_BY_TYPE_ID.get(scalar_option(field))
    if told is not None and told.cdr is not None:
        if not repeated and field.type == PROTOBUF_TYPES[told.protobuf]:
            scalar, form, shape = told, told.cdr, Shape.SINGLE
        elif repeated == told.repeated and field.type == PROTOBUF_TYPES[told.many]:
            scalar, form, shape = told, told.cdr, Shape.SEQUENCE
    # On the wire an enum is an int32.
    protobuf = PROTOBUF_TYPES["int32"] if field.type == FieldDescriptor.TYPE_ENUM else field.type
    return Operation(name, name, scalar.type_id, form, protobuf, field.number, shape)


def _filler() -> Operation:
    """Return what ROS has in a message without fields."""
    return Operation(EMPTY_STRUCT_FIELD, "", SCALARS["uint8"].type_id, CdrForm.UINT8, NOT_IN_PROTOBUF, 0)


def scalar_option(field: FieldDescriptor) -> int:
    """Return the type id that a field has as `SCALAR_OPTION`; 0 if it has none.

    Raises:
        SchemaError: It has several.
    """
    if not field.has_options:
        return 0
    options = field.GetOptions()
    try:
        (content,) = _core.packed_fields(type(options).SerializeToString, options, SCALAR_OPTION)
    except ValueError:
        raise SchemaError(
            f"{field.full_name}: its option {SCALAR_OPTION} is there more than once; keep one"
        ) from None
    return content[0] if len(content) == 1 else 0
