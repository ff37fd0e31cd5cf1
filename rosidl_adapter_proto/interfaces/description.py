"""REP-2011 type descriptions and RIHS01 type hashes, made from the model.

The dictionaries have the form of `type_description_interfaces/msg/TypeDescription`, as in the `.json` files that
ROS 2 installs beside its interfaces.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from typing import TypedDict

from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    BasicType,
    Field,
    FieldType,
    Interface,
    Message,
    SequenceType,
    Service,
    StringType,
    TypeName,
    ValueType,
    messages,
    references,
    value_type,
)
from rosidl_adapter_proto.interfaces.scalars import SCALARS

# type_description_interfaces/msg/FieldType: arrays, bounded and unbounded sequences add a multiple of 48.
FIELD_TYPE_IDS = {
    "nested": 1,
    "int8": 2,
    "uint8": 3,
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float": 10,
    "double": 11,
    "long double": 12,
    "char": 13,
    "wchar": 14,
    "boolean": 15,
    "octet": 16,
    "string": 17,
    "wstring": 18,
    "bounded string": 21,
    "bounded wstring": 22,
}
ARRAY_OFFSET, BOUNDED_SEQUENCE_OFFSET, UNBOUNDED_SEQUENCE_OFFSET = 48, 96, 144
_ELEMENT_NAMES = {type_id: name for name, type_id in FIELD_TYPE_IDS.items()}


class FieldTypeDescription(TypedDict):
    """`type_description_interfaces/msg/FieldType`."""

    type_id: int
    capacity: int
    string_capacity: int
    nested_type_name: str


class FieldDescription(TypedDict):
    """`type_description_interfaces/msg/Field`."""

    name: str
    type: FieldTypeDescription
    default_value: str


class IndividualTypeDescription(TypedDict):
    """`type_description_interfaces/msg/IndividualTypeDescription`."""

    type_name: str
    fields: list[FieldDescription]


class TypeDescription(TypedDict):
    """`type_description_interfaces/msg/TypeDescription`."""

    type_description: IndividualTypeDescription
    referenced_type_descriptions: list[IndividualTypeDescription]


def structs(interface: Interface) -> tuple[Message, ...]:
    """Return everything of an interface that ROS describes and hashes, the interface itself first.

    Services and actions, and the services derived from an action, are described as messages of their parts.
    """
    if isinstance(interface, Message):
        return (interface,)
    if isinstance(interface, Service):
        return (
            _struct_of_parts(
                interface.name,
                request_message=interface.request.name,
                response_message=interface.response.name,
                event_message=interface.event.name,
            ),
            *messages(interface, events=True),
        )
    return (
        _struct_of_parts(
            interface.name,
            goal=interface.goal.name,
            result=interface.result.name,
            feedback=interface.feedback.name,
            send_goal_service=interface.send_goal.name,
            get_result_service=interface.get_result.name,
            feedback_message=interface.feedback_message.name,
        ),
        interface.goal,
        interface.result,
        interface.feedback,
        *structs(interface.send_goal),
        *structs(interface.get_result),
        interface.feedback_message,
    )


def _struct_of_parts(name: TypeName, **parts: TypeName) -> Message:
    return Message(name, tuple(Field(part, type_name) for part, type_name in parts.items()))


def field_type_description(field_type: FieldType) -> FieldTypeDescription:
    """Describe the type of a field."""
    element = value_type(field_type)
    string_capacity, nested = 0, ""
    if isinstance(element, BasicType):
        key = element.name
    elif isinstance(element, StringType):
        key = "wstring" if element.wide else "string"
        if element.bound is not None:
            key, string_capacity = f"bounded {key}", element.bound
    else:
        key, nested = "nested", str(element)
    offset, capacity = 0, 0
    if isinstance(field_type, ArrayType):
        offset, capacity = ARRAY_OFFSET, field_type.size
    elif isinstance(field_type, SequenceType):
        bounded = field_type.bound is not None
        offset = BOUNDED_SEQUENCE_OFFSET if bounded else UNBOUNDED_SEQUENCE_OFFSET
        capacity = field_type.bound or 0
    return {
        "type_id": FIELD_TYPE_IDS[key] + offset,
        "capacity": capacity,
        "string_capacity": string_capacity,
        "nested_type_name": nested,
    }


def described_field_type(description: FieldTypeDescription) -> FieldType:
    """Return the type that `field_type_description` describes.

    Raises:
        ValueError: The type id is none of REP-2011, or the name of a nested type is none.
    """
    type_id = description["type_id"]
    shape, element_id = divmod(type_id - 1, ARRAY_OFFSET)
    offset, key = shape * ARRAY_OFFSET, _ELEMENT_NAMES.get(element_id + 1)
    if key is None or not 0 <= offset <= UNBOUNDED_SEQUENCE_OFFSET:
        raise ValueError(f"type id {type_id} is unknown (REP-2011); correct the type description")
    element: ValueType
    if key == "nested":
        element = TypeName.parse(description["nested_type_name"])
    elif key in SCALARS and not SCALARS[key].is_string:
        element = BasicType(key)
    else:
        bound = description["string_capacity"] if key.startswith("bounded") else None
        element = StringType(wide=key.endswith("wstring"), bound=bound)
    if offset == ARRAY_OFFSET:
        return ArrayType(element, description["capacity"])
    if offset == BOUNDED_SEQUENCE_OFFSET:
        return SequenceType(element, description["capacity"])
    return SequenceType(element) if offset == UNBOUNDED_SEQUENCE_OFFSET else element


def individual_description(message: Message) -> IndividualTypeDescription:
    """Describe one message, without the types it refers to."""
    return {
        "type_name": str(message.name),
        "fields": [
            {
                "name": each.name,
                "type": field_type_description(each.type),
                # rosidl takes str() of what its parser made of the @default annotation.
                "default_value": "" if each.default is None else str(each.default),
            }
            for each in message.fields
        ],
    }


def describe(name: TypeName, find: Callable[[TypeName], Message]) -> TypeDescription:
    """Return the full type description of `name`: itself, and everything it refers to in order of name.

    Args:
        name: The type to describe.
        find: Gives any type that is referred to.
    """
    top = find(name)
    referenced: dict[TypeName, Message] = {}
    waiting = [name for _, name in references(top)]
    while waiting:
        current = waiting.pop()
        if current not in referenced:
            referenced[current] = find(current)
            waiting.extend(name for _, name in references(referenced[current]))
    return {
        "type_description": individual_description(top),
        "referenced_type_descriptions": [
            individual_description(referenced[each]) for each in sorted(referenced, key=str)
        ],
    }


def type_hash(description: TypeDescription) -> str:
    """Return the RIHS01 hash of a type description: SHA-256 of its JSON without default values (REP-2011)."""

    def without_defaults(individual: IndividualTypeDescription) -> object:
        return {
            "type_name": individual["type_name"],
            "fields": [{"name": f["name"], "type": f["type"]} for f in individual["fields"]],
        }

    hashed = {
        "type_description": without_defaults(description["type_description"]),
        "referenced_type_descriptions": [
            without_defaults(each) for each in description["referenced_type_descriptions"]
        ],
    }
    text = json.dumps(hashed, ensure_ascii=True, separators=(", ", ": "))
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()
