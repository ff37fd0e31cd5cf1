"""How each field is converted between a protobuf message and a ROS message in Python, as plain data.

There are six ways, a class each. Generated adapters have them as lines of Python, adapters made at run time interpret
them. Nothing here knows either.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

from rosidl_adapter_proto.interfaces.model import (
    EMPTY_STRUCT_FIELD,
    Action,
    Interface,
    Message,
    ScalarValue,
    SequenceType,
    Service,
    Shape,
    TypeName,
    references,
)
from rosidl_adapter_proto.interfaces.scalars import Family, Scalar
from rosidl_adapter_proto.schema.proto import ProtoField, ProtoMessage


class Helper(Enum):
    """The functions of `rosidl_adapter_proto.adapter`, by name, that steps call."""

    ABSENT_OR_EXACTLY = "absent_or_exactly"
    AT_MOST = "at_most"
    BOOLEAN = "boolean"
    CHARACTER = "character"
    CHARACTERS = "characters"
    EXACTLY = "exactly"
    FLOAT32 = "float32"
    IN_RANGE = "in_range"
    OCTET = "octet"
    OCTETS = "octets"
    ROS_CHARACTER = "ros_character"
    ROS_CHARACTERS = "ros_characters"
    ROS_OCTET = "ros_octet"
    ROS_OCTETS = "ros_octets"
    ROS_STRING = "ros_string"
    ROS_WIDE = "ros_wide"
    STRING = "string"
    TEXT = "text"
    WIDE = "wide"


@dataclass(frozen=True)
class Step:
    """What a value becomes next: what the helper returns for it and the arguments."""

    helper: Helper
    arguments: tuple[float, ...] = ()


Steps = tuple[Step, ...]
"""What is done with a value, in order; nothing if it is the same on both sides."""


@dataclass(frozen=True)
class BothWays:
    """What is done on the way to protobuf, and on the way to ROS."""

    to_custom: Steps = ()
    to_ros: Steps = ()


@dataclass(frozen=True)
class OneMessage:
    """A single message: its own adapter fills it."""

    nested: TypeName


@dataclass(frozen=True)
class OneValue:
    """A single value."""

    value: BothWays


@dataclass(frozen=True)
class Messages:
    """An array or sequence of messages: the adapter of the message fills each.

    Attributes:
        nested: The message.
        length: Checks how many there are.
        size: The length of an array, None for a sequence.
    """

    nested: TypeName
    length: BothWays
    size: int | None


class Carrier(Enum):
    """How protobuf has an array of numbers."""

    BYTES = "bytes"
    """One value of bytes, each a number."""
    FIXED = "fixed"
    """A packed repeated field that has the bytes of the numbers as they are in memory."""
    VARINTS = "varints"
    """A packed repeated field that has a varint for each number."""


@dataclass(frozen=True)
class Numbers:
    """An array or sequence of numbers that ROS has as an array of a C type: their bytes are copied as a whole.

    Attributes:
        typecode: The C type, as `array.array` calls it.
        carrier: How protobuf has them.
        length: Checks how many there are.
        size: The length of an array, None for a sequence.
        packed_index: Which of the `packed_numbers` of the message this is, None if it is none.
        has_default: Whether a new ROS message is not empty here.
    """

    typecode: str
    carrier: Carrier
    length: BothWays
    size: int | None
    packed_index: int | None
    has_default: bool


@dataclass(frozen=True)
class Compact:
    """An array or sequence of octets or characters, which is one value in protobuf.

    Attributes:
        values: Converts all elements at once, and checks how many there are.
        size: The length of an array, None for a sequence.
        zero: What an array in ROS is full of if protobuf has none.
    """

    values: BothWays
    size: int | None
    zero: ScalarValue | bytes


@dataclass(frozen=True)
class Values:
    """Any other array or sequence, which is a list in ROS: each element is converted for itself.

    Attributes:
        value: Converts an element.
        length: Checks how many there are.
        size: The length of an array, None for a sequence.
        zero: What an array in ROS is full of if protobuf has none.
    """

    value: BothWays
    length: BothWays
    size: int | None
    zero: ScalarValue | bytes


FieldConversion = OneMessage | OneValue | Messages | Numbers | Compact | Values


@dataclass(frozen=True)
class MessageConversion:
    """How a message is converted.

    Attributes:
        fields: The fields that ROS has in Python, with their conversions, in order; that which stands for an empty
            struct is not one.
        packed_numbers: Field numbers of arrays whose bytes are taken from the serialized message, all in one go.
    """

    fields: tuple[tuple[ProtoField, FieldConversion], ...]
    packed_numbers: tuple[int, ...]


def message_conversion(message: ProtoMessage) -> MessageConversion:
    """Decide how a message is converted."""
    packed_numbers = _packed_numbers(message)
    packed_indices = {number: index for index, number in enumerate(packed_numbers)}
    return MessageConversion(
        tuple(
            (each, _field_conversion(each, packed_indices))
            for each in message.fields
            if each.name != EMPTY_STRUCT_FIELD
        ),
        packed_numbers,
    )


def _packed_numbers(message: ProtoMessage) -> tuple[int, ...]:
    """Return the numbers of the fields that are taken from the serialized message.

    There are none where it holds many others: these would be serialized here, and once more each for itself.
    """
    if any(each.repeated and isinstance(each.element, TypeName) for each in message.fields):
        return ()
    return tuple(
        each.number
        for each in message.fields
        if each.shape is not Shape.SINGLE
        and isinstance(each.element, Scalar)
        and each.element.typecode
        and CARRIERS[each.type] is Carrier.FIXED
    )


def _field_conversion(field: ProtoField, packed_indices: Mapping[int, int]) -> FieldConversion:
    element = field.element
    if field.shape is Shape.SINGLE:
        if isinstance(element, TypeName):
            return OneMessage(element)
        return OneValue(VALUES[element.family](field))
    length = _length(field)
    size = field.capacity if field.shape is Shape.ARRAY else None
    if isinstance(element, TypeName):
        return Messages(element, length, size)
    if element.typecode:
        index = packed_indices.get(field.number)
        return Numbers(
            element.typecode, CARRIERS[field.type], length, size, index, has_default=bool(field.default)
        )
    zero = ZEROS[element.family]
    if not element.repeated:
        all_at_once = COMPACT_VALUES[element.family](field)
        # What is counted is what ROS has: some characters of text are two in ROS.
        values = BothWays(
            length.to_custom + all_at_once.to_custom,
            all_at_once.to_ros + length.to_ros,
        )
        return Compact(values, size, zero)
    return Values(VALUES[element.family](field), length, size, zero)


def _length(field: ProtoField) -> BothWays:
    """Return the checks of how many elements there are; of an array, protobuf may have none, which stands for zeros."""
    if field.capacity is None:
        return BothWays()
    if field.shape is Shape.ARRAY:
        exactly = Step(Helper.EXACTLY, (field.capacity,))
        return BothWays((exactly,), (Step(Helper.ABSENT_OR_EXACTLY, (field.capacity,)),))
    at_most = Step(Helper.AT_MOST, (field.capacity,))
    return BothWays((at_most,), (at_most,))


def _boolean(field: ProtoField) -> BothWays:
    return BothWays((Step(Helper.BOOLEAN),))


def _integer(field: ProtoField) -> BothWays:
    if field.limits is None:
        return BothWays()
    in_range = Step(Helper.IN_RANGE, field.limits)
    return BothWays((in_range,), (in_range,))


def _floating_point(field: ProtoField) -> BothWays:
    assert isinstance(field.element, Scalar)  # a message is none
    check = FLOAT_CHECKS[field.element.name]
    return BothWays(check, check if field.limits else ())


def _octet(field: ProtoField) -> BothWays:
    return BothWays((Step(Helper.OCTET),), (Step(Helper.ROS_OCTET),))


def _character(field: ProtoField) -> BothWays:
    assert field.limits is not None  # characters have them
    largest = field.limits[1:]
    return BothWays((Step(Helper.CHARACTER, largest),), (Step(Helper.ROS_CHARACTER, largest),))


def _string(field: ProtoField) -> BothWays:
    return _bounded(field, Helper.STRING, Helper.ROS_STRING)


def _wstring(field: ProtoField) -> BothWays:
    return _bounded(field, Helper.WIDE, Helper.ROS_WIDE)


def _bounded(field: ProtoField, to_custom: Helper, to_ros: Helper) -> BothWays:
    text = () if field.string_bound is None else (Step(Helper.TEXT, (field.string_bound,)),)
    return BothWays((*text, Step(to_custom)), (Step(to_ros), *text))


VALUES: Mapping[Family, Callable[[ProtoField], BothWays]] = {
    Family.BOOLEAN: _boolean,
    Family.INTEGER: _integer,
    Family.FLOATING_POINT: _floating_point,
    Family.OCTET: _octet,
    Family.CHARACTER: _character,
    Family.STRING: _string,
    Family.WSTRING: _wstring,
}
"""How one value of each family is converted."""

FLOAT_CHECKS: Mapping[str, Steps] = {
    "float": (Step(Helper.FLOAT32),),
    "double": (),
    "long double": (),
}
"""What refuses numbers that are too large, for each floating-point type; every Python float is a double."""

ZEROS: Mapping[Family, ScalarValue | bytes] = {
    Family.BOOLEAN: False,
    Family.INTEGER: 0,
    Family.FLOATING_POINT: 0.0,
    Family.OCTET: b"\0",
    Family.CHARACTER: "\0",
    Family.STRING: "",
    Family.WSTRING: "",
}
"""The value of each family that an array in ROS is full of at first."""


def _octets(field: ProtoField) -> BothWays:
    return BothWays((Step(Helper.OCTETS),), (Step(Helper.ROS_OCTETS),))


def _characters(field: ProtoField) -> BothWays:
    assert field.limits is not None  # characters have them
    largest = field.limits[1:]
    return BothWays((Step(Helper.CHARACTERS, largest),), (Step(Helper.ROS_CHARACTERS, largest),))


COMPACT_VALUES: Mapping[Family, Callable[[ProtoField], BothWays]] = {
    Family.OCTET: _octets,
    Family.CHARACTER: _characters,
}
"""How the values of an array are converted at once, for each family whose arrays are one value in protobuf."""

CARRIERS: Mapping[str, Carrier] = {
    "bytes": Carrier.BYTES,
    "int32": Carrier.VARINTS,
    "uint32": Carrier.VARINTS,
    "fixed32": Carrier.FIXED,
    "sfixed32": Carrier.FIXED,
    "fixed64": Carrier.FIXED,
    "sfixed64": Carrier.FIXED,
    "float": Carrier.FIXED,
    "double": Carrier.FIXED,
}
"""How protobuf has an array of numbers, for each type that it may have there."""


def ros_class(name: TypeName, interface: Interface) -> str:
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


NAMED_PARTS = {
    "request": "Request",
    "response": "Response",
    "goal": "Goal",
    "result": "Result",
    "feedback": "Feedback",
}
"""The parts of services and actions that are messages of the user, and what ROS calls their classes."""


def has_defaults(message: Message, find: Callable[[TypeName], Message]) -> bool:
    """Return whether a message or one that is always in it has a default value.

    A sequence is empty by default, whatever its elements are.

    Args:
        message: The message.
        find: Gives each message that is referred to.
    """
    seen: set[TypeName] = set()
    waiting = [message]
    while waiting:
        each = waiting.pop()
        if any(field.default is not None for field in each.fields):
            return True
        nested = {name for field, name in references(each) if not isinstance(field.type, SequenceType)}
        waiting.extend(map(find, nested - seen))
        seen |= nested
    return False
