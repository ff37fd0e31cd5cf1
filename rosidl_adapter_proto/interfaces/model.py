"""The model of ROS 2 interfaces: what everything between reading and writing speaks.

A `Message` has fields and constants; a `Service` and an `Action` group messages and derive the ones that ROS
adds to them. Everything is immutable and compares by value. Comments, locations, the text a definition was read from
and the warnings about it do not take part in comparisons: two definitions are equal when they describe the same type.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

from rosidl_adapter_proto.interfaces.scalars import SCALARS, Scalar

NAMESPACES = ("msg", "srv", "action")
"""The namespaces of interfaces in a package."""

EMPTY_STRUCT_FIELD = "structure_needs_at_least_one_member"
"""The field, a `uint8`, that ROS gives to a struct that has none, since IDL structs cannot be empty."""


@dataclass(frozen=True, order=True)
class TypeName:
    """The full name of an interface: `std_msgs/msg/String` in ROS's own spelling."""

    package: str
    namespace: str
    name: str

    def __str__(self) -> str:
        return f"{self.package}/{self.namespace}/{self.name}"

    @classmethod
    def parse(cls, text: str) -> TypeName:
        """Read `package/namespace/Name`.

        Raises:
            ValueError: `text` does not have three parts.
        """
        parts = text.split("/")
        if len(parts) != 3 or not all(parts):
            raise ValueError(f"{text!r} is not of the form package/namespace/Name")
        return cls(*parts)

    def sibling(self, suffix: str) -> TypeName:
        """Return the name of a type derived from this one: `SetBool` and `_Request` give `SetBool_Request`."""
        return TypeName(self.package, self.namespace, self.name + suffix)


@dataclass(frozen=True)
class BasicType:
    """A number, boolean, character or octet; `name` is a key of `SCALARS` that is not a string."""

    name: str

    @property
    def scalar(self) -> Scalar:
        """The row with every fact about it."""
        return SCALARS[self.name]


@dataclass(frozen=True)
class StringType:
    """A string (UTF-8) or wide string (UTF-16), with at most `bound` characters if it has one."""

    wide: bool = False
    bound: int | None = None

    @property
    def scalar(self) -> Scalar:
        """The row with every fact about it."""
        return SCALARS["wstring" if self.wide else "string"]


ValueType = BasicType | StringType | TypeName
"""What an element can be: a basic type, a string, or another message by its name."""


@dataclass(frozen=True)
class ArrayType:
    """A fixed number of elements."""

    value_type: ValueType
    size: int


@dataclass(frozen=True)
class SequenceType:
    """A varying number of elements, at most `bound` if it has one."""

    value_type: ValueType
    bound: int | None = None


FieldType = ValueType | ArrayType | SequenceType

ScalarValue = bool | int | float | str
Value = ScalarValue | tuple[ScalarValue, ...]
"""A constant or default value; a tuple for an array or sequence."""


def value_type(field_type: FieldType) -> ValueType:
    """Return the element type of an array or sequence, and any other type itself."""
    if isinstance(field_type, (ArrayType, SequenceType)):
        return field_type.value_type
    return field_type


class Shape(IntEnum):
    """How many elements a field has."""

    SINGLE = 0
    ARRAY = 1
    SEQUENCE = 2


class TypeParts(NamedTuple):
    """A field type taken apart.

    Attributes:
        shape: How many elements there are.
        element: The scalar type of an element, or the message that it is.
        capacity: The length of an array; the bound of a sequence, None if it has none; None for a single element.
        string_bound: The greatest number of characters in a string, None if it has no bound.
    """

    shape: Shape
    element: Scalar | TypeName
    capacity: int | None = None
    string_bound: int | None = None


def type_parts(field_type: FieldType) -> TypeParts:
    """Take a field type apart."""
    value = value_type(field_type)
    element = value if isinstance(value, TypeName) else value.scalar
    bound = value.bound if isinstance(value, StringType) else None
    if isinstance(field_type, ArrayType):
        return TypeParts(Shape.ARRAY, element, field_type.size, bound)
    if isinstance(field_type, SequenceType):
        return TypeParts(Shape.SEQUENCE, element, field_type.bound, bound)
    return TypeParts(Shape.SINGLE, element, None, bound)


@dataclass(frozen=True)
class Location:
    """A place in a definition: line and column count from 1."""

    file: str
    line: int
    column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True)
class Annotation:
    """An IDL annotation: `@key` has no parameters, `@verbatim(language="comment", text="...")` has two.

    A single unnamed parameter, as in `@range(3)`, is named `value` (OMG IDL 4.2, section 7.4.15).
    """

    name: str
    parameters: tuple[tuple[str, ScalarValue], ...] = ()


@dataclass(frozen=True)
class Constant:
    """A named value; its type is a basic type or a string."""

    name: str
    type: BasicType | StringType
    value: ScalarValue
    comment: tuple[str, ...] = field(default=(), compare=False)
    unit: str | None = field(default=None, compare=False)
    location: Location | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Field:
    """A field of a message.

    Attributes:
        comment: The lines of its comment, without comment marks.
        unit: The unit that its comment or annotation names, such as `m/s`.
        annotations: Every IDL annotation but those that `default`, `comment` and `unit` stand for.
    """

    name: str
    type: FieldType
    default: Value | None = None
    comment: tuple[str, ...] = field(default=(), compare=False)
    unit: str | None = field(default=None, compare=False)
    annotations: tuple[Annotation, ...] = ()
    location: Location | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Message:
    """A struct: what travels on a topic, or one part of a service or an action."""

    name: TypeName
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()
    comment: tuple[str, ...] = field(default=(), compare=False)
    annotations: tuple[Annotation, ...] = ()
    text: str = field(default="", compare=False, repr=False)
    warnings: tuple[str, ...] = field(default=(), compare=False, repr=False)


@dataclass(frozen=True)
class Service:
    """A request and a response."""

    name: TypeName
    request: Message
    response: Message
    text: str = field(default="", compare=False, repr=False)
    warnings: tuple[str, ...] = field(default=(), compare=False, repr=False)

    @property
    def event(self) -> Message:
        """The introspection event of the service (REP-2012)."""
        return Message(
            self.name.sibling("_Event"),
            (
                Field("info", TypeName("service_msgs", "msg", "ServiceEventInfo")),
                Field("request", SequenceType(self.request.name, 1)),
                Field("response", SequenceType(self.response.name, 1)),
            ),
        )


@dataclass(frozen=True)
class Action:
    """A goal, a result and feedback, and the services and message that ROS derives from them."""

    name: TypeName
    goal: Message
    result: Message
    feedback: Message
    text: str = field(default="", compare=False, repr=False)
    warnings: tuple[str, ...] = field(default=(), compare=False, repr=False)

    @property
    def send_goal(self) -> Service:
        """The service that sends a goal."""
        name = self.name.sibling("_SendGoal")
        return Service(
            name,
            Message(name.sibling("_Request"), (_GOAL_ID, Field("goal", self.goal.name))),
            Message(
                name.sibling("_Response"),
                (
                    Field("accepted", BasicType("boolean")),
                    Field("stamp", TypeName("builtin_interfaces", "msg", "Time")),
                ),
            ),
        )

    @property
    def get_result(self) -> Service:
        """The service that waits for the result of a goal."""
        name = self.name.sibling("_GetResult")
        return Service(
            name,
            Message(name.sibling("_Request"), (_GOAL_ID,)),
            Message(
                name.sibling("_Response"),
                (Field("status", BasicType("int8")), Field("result", self.result.name)),
            ),
        )

    @property
    def feedback_message(self) -> Message:
        """The message of the feedback topic."""
        return Message(
            self.name.sibling("_FeedbackMessage"),
            (_GOAL_ID, Field("feedback", self.feedback.name)),
        )


_GOAL_ID = Field("goal_id", TypeName("unique_identifier_msgs", "msg", "UUID"))

Interface = Message | Service | Action


def messages(interface: Interface, *, events: bool = False) -> tuple[Message, ...]:
    """Return every message of an interface, the derived ones of services and actions included.

    Args:
        interface: What was read from one definition.
        events: Whether to include the `_Event` messages of service introspection.
    """
    if isinstance(interface, Message):
        return (interface,)
    if isinstance(interface, Service):
        event = (interface.event,) if events else ()
        return (interface.request, interface.response, *event)
    return (
        interface.goal,
        interface.result,
        interface.feedback,
        *messages(interface.send_goal, events=events),
        *messages(interface.get_result, events=events),
        interface.feedback_message,
    )


def parts(interface: Interface) -> dict[TypeName, dict[str, TypeName]]:
    """Return the parts of each service and action that an interface is or has, by what ROS calls them."""
    if isinstance(interface, Message):
        return {}
    if isinstance(interface, Service):
        return {interface.name: {"request": interface.request.name, "response": interface.response.name}}
    own = {
        "goal": interface.goal.name,
        "result": interface.result.name,
        "feedback": interface.feedback.name,
        "send_goal": interface.send_goal.name,
        "get_result": interface.get_result.name,
        "feedback_message": interface.feedback_message.name,
    }
    return {interface.name: own, **parts(interface.send_goal), **parts(interface.get_result)}


def references(message: Message) -> Iterator[tuple[Field, TypeName]]:
    """Yield each field whose value is another message, or an array or sequence of one, and that message's name."""
    for each in message.fields:
        name = value_type(each.type)
        if isinstance(name, TypeName):
            yield each, name
