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
    Field,
    FieldType,
    Interface,
    Message,
    Service,
    Shape,
    TypeName,
    TypeParts,
    messages,
    references,
    type_parts,
)
from rosidl_adapter_proto.interfaces.scalars import NESTED_TYPE_ID, SCALARS, Scalar

# type_description_interfaces/msg/FieldType: what a shape, with or without a capacity, adds to the number of an element.
_OFFSETS = {
    (Shape.SINGLE, False): 0,
    (Shape.ARRAY, True): 48,
    (Shape.SEQUENCE, True): 96,
    (Shape.SEQUENCE, False): 144,
}

# The number of each kind of element: a scalar type with or without a string bound, or a nested message (None).
_ELEMENT_IDS: dict[tuple[Scalar | None, bool], int] = {
    (None, False): NESTED_TYPE_ID,
    **{(row, False): row.type_id for row in SCALARS.values()},
    **{(row, True): row.bounded_type_id for row in SCALARS.values() if row.bounded_type_id is not None},
}

_DESCRIBED = {
    element_id + offset: (shape, has_capacity, scalar, is_bounded)
    for (shape, has_capacity), offset in _OFFSETS.items()
    for (scalar, is_bounded), element_id in _ELEMENT_IDS.items()
}
"""What each number stands for."""


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
    shape, element, capacity, string_bound = type_parts(field_type)
    scalar, nested = (None, str(element)) if isinstance(element, TypeName) else (element, "")
    return {
        "type_id": _ELEMENT_IDS[scalar, string_bound is not None] + _OFFSETS[shape, capacity is not None],
        "capacity": capacity or 0,
        "string_capacity": string_bound or 0,
        "nested_type_name": nested,
    }


def described_type(description: FieldTypeDescription) -> TypeParts:
    """Return what the description of a field's type stands for: the inverse of `field_type_description`.

    Raises:
        ValueError: Its type id is unknown, or it does not have the length, bound or name that goes with the type id.
    """
    type_id = description["type_id"]
    if type_id not in _DESCRIBED:
        raise ValueError(f"type id {type_id} is unknown (REP-2011); correct the type description")
    shape, has_capacity, scalar, is_bounded = _DESCRIBED[type_id]
    capacity, string_bound = description["capacity"], description["string_capacity"]
    if (has_capacity and capacity < 1) or (is_bounded and string_bound < 1):
        raise ValueError(
            f"type id {type_id} needs a {'capacity' if has_capacity and capacity < 1 else 'string capacity'} "
            "above 0 (REP-2011); correct the type description"
        )
    return TypeParts(
        shape,
        scalar or TypeName.parse(description["nested_type_name"]),
        capacity if has_capacity else None,
        string_bound if is_bounded else None,
    )


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
