"""How fields are converted: every scalar type in every shape has a way, made of helpers that there are."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from math import inf

import pytest

from rosidl_adapter_proto import adapter
from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    BasicType,
    Field,
    FieldType,
    Message,
    SequenceType,
    StringType,
    TypeName,
    ValueType,
)
from rosidl_adapter_proto.interfaces.scalars import SCALARS, Family, Scalar
from rosidl_adapter_proto.schema.conversion import (
    CARRIERS,
    COMPACT_VALUES,
    FLOAT_CHECKS,
    VALUES,
    ZEROS,
    BothWays,
    Carrier,
    Compact,
    FieldConversion,
    Helper,
    MessageConversion,
    Messages,
    Numbers,
    OneMessage,
    OneValue,
    Step,
    Values,
    has_defaults,
    message_conversion,
)
from rosidl_adapter_proto.schema.numbering import HashNumbering
from rosidl_adapter_proto.schema.proto import proto_file

INNER = TypeName("p", "msg", "Inner")


def convert(*types: FieldType) -> MessageConversion:
    """Return how a message with fields of these types is converted."""
    fields = tuple(Field(f"f{number}", each) for number, each in enumerate(types))
    message = Message(TypeName("p", "msg", "Outer"), fields)
    return message_conversion(proto_file(message, HashNumbering(), lambda name: name).messages[0])


def convert_one(field_type: FieldType) -> FieldConversion:
    ((_, conversion),) = convert(field_type).fields
    return conversion


def value_types(row: Scalar) -> Iterator[ValueType]:
    if row.is_string:
        yield from (StringType(row.family is Family.WSTRING, bound) for bound in (None, 5))
    else:
        yield BasicType(row.name)


ROWS = [(row, each) for row in SCALARS.values() for each in value_types(row)]


@pytest.mark.parametrize(("row", "value"), ROWS, ids=[f"{row.name} {value}" for row, value in ROWS])
def test_every_row_in_every_shape(row: Scalar, value: ValueType) -> None:
    assert isinstance(convert_one(value), OneValue)
    for field_type in (ArrayType(value, 3), SequenceType(value), SequenceType(value, 4)):
        conversion = convert_one(field_type)
        if row.typecode:
            assert isinstance(conversion, Numbers)
            assert conversion.typecode == row.typecode
            assert (conversion.carrier is Carrier.BYTES) == (row.many == "bytes")
        else:
            assert isinstance(conversion, Values if row.repeated else Compact)
        assert conversion.size == (3 if isinstance(field_type, ArrayType) else None)


@pytest.mark.parametrize(
    ("element", "expected"),
    [
        ("boolean", BothWays((Step(Helper.BOOLEAN),))),
        ("octet", BothWays((Step(Helper.OCTET),), (Step(Helper.ROS_OCTET),))),
        ("char", BothWays((Step(Helper.CHARACTER, (127,)),), (Step(Helper.ROS_CHARACTER, (127,)),))),
        ("wchar", BothWays((Step(Helper.CHARACTER, (65535,)),), (Step(Helper.ROS_CHARACTER, (65535,)),))),
        ("int8", BothWays((Step(Helper.IN_RANGE, (-128, 127)),), (Step(Helper.IN_RANGE, (-128, 127)),))),
        ("uint16", BothWays((Step(Helper.IN_RANGE, (0, 65535)),), (Step(Helper.IN_RANGE, (0, 65535)),))),
        ("int32", BothWays()),
        ("uint64", BothWays()),
        ("float", BothWays((Step(Helper.FLOAT32),))),
        ("double", BothWays()),
        ("long double", BothWays()),
    ],
)
def test_one_value(element: str, expected: BothWays) -> None:
    assert convert_one(BasicType(element)) == OneValue(expected)


def test_floats_that_python_has_and_ros_has_not_are_checked() -> None:
    rows = [row for row in SCALARS.values() if row.family is Family.FLOATING_POINT]
    assert list(FLOAT_CHECKS) == [row.name for row in rows]
    assert [bool(FLOAT_CHECKS[row.name]) for row in rows] == [row.smallest_infinite < inf for row in rows]


def test_strings() -> None:
    text = Step(Helper.TEXT, (5,))
    assert convert_one(StringType()) == OneValue(BothWays((Step(Helper.STRING),), (Step(Helper.ROS_STRING),)))
    bounded = BothWays((text, Step(Helper.STRING)), (Step(Helper.ROS_STRING), text))
    assert convert_one(StringType(bound=5)) == OneValue(bounded)
    wide = BothWays((text, Step(Helper.WIDE)), (Step(Helper.ROS_WIDE), text))
    length = BothWays((Step(Helper.EXACTLY, (2,)),), (Step(Helper.ABSENT_OR_EXACTLY, (2,)),))
    assert convert_one(ArrayType(StringType(True, 5), 2)) == Values(wide, length, 2, "")


def test_messages() -> None:
    at_most = (Step(Helper.AT_MOST, (4,)),)
    assert convert_one(INNER) == OneMessage(INNER)
    assert convert_one(SequenceType(INNER)) == Messages(INNER, BothWays(), None)
    assert convert_one(SequenceType(INNER, 4)) == Messages(INNER, BothWays(at_most, at_most), None)


def test_compact() -> None:
    at_most = Step(Helper.AT_MOST, (4,))
    assert convert_one(SequenceType(BasicType("octet"), 4)) == Compact(
        BothWays((at_most, Step(Helper.OCTETS)), (Step(Helper.ROS_OCTETS), at_most)), None, b"\0"
    )


def test_packed_numbers() -> None:
    """Only arrays that lie in protobuf as in memory, and not beside a repeated message."""
    many = SequenceType(BasicType("double"))
    conversion = convert(
        BasicType("double"), many, SequenceType(BasicType("int16")), ArrayType(BasicType("uint8"), 2)
    )
    assert conversion.packed_numbers == (conversion.fields[1][0].number,)
    indices = [each.packed_index for _, each in conversion.fields[1:] if isinstance(each, Numbers)]
    assert indices == [0, None, None]

    conversion = convert(many, SequenceType(INNER))
    assert conversion.packed_numbers == ()


def test_an_empty_message_has_nothing_to_convert() -> None:
    message = Message(
        TypeName("p", "msg", "Empty"), (Field("structure_needs_at_least_one_member", BasicType("uint8")),)
    )
    proto = proto_file(message, HashNumbering(), lambda name: name).messages[0]

    assert message_conversion(proto) == MessageConversion((), ())


@pytest.mark.parametrize(
    ("field", "expected"),
    [
        (Field("x", BasicType("int32"), 1), True),
        (Field("x", BasicType("int32"), 0), True),
        (Field("x", BasicType("int32")), False),
        (Field("x", INNER), True),
        (Field("x", ArrayType(INNER, 2)), True),
        (Field("x", SequenceType(INNER)), False),
    ],
)
def test_has_defaults(field: Field, expected: bool) -> None:
    inner = Message(INNER, (Field("y", BasicType("int32"), 3),))
    assert has_defaults(Message(TypeName("p", "msg", "Outer"), (field,)), lambda name: inner) is expected


def test_each_message_is_looked_at_once_for_defaults() -> None:
    """However often it is referred to, and however deep it is."""
    found = []

    def find(name: TypeName) -> Message:
        found.append(name)
        depth = int(name.name[1:]) + 1
        nested = TypeName("p", "msg", f"M{depth}")
        fields = tuple(Field(each, nested if depth < 1500 else BasicType("int32")) for each in "abc")
        return Message(name, fields)

    assert not has_defaults(find(TypeName("p", "msg", "M0")), find)
    assert len(found) == len(set(found)) == 1500


def test_tables_are_complete() -> None:
    assert set(VALUES) == set(ZEROS) == set(Family)
    rows = SCALARS.values()
    assert set(COMPACT_VALUES) == {row.family for row in rows if not row.repeated and not row.typecode}
    assert {row.many for row in rows if row.typecode} <= set(CARRIERS)


@pytest.mark.parametrize("helper", list(Helper))
def test_helpers_are_functions_of_adapters(helper: Helper) -> None:
    """They take a value, and the arguments that steps have."""
    function = getattr(adapter, helper.value)
    assert function.__name__ == helper.value

    used = {
        len(step.arguments)
        for _, value in ROWS
        for field_type in (value, ArrayType(value, 3), SequenceType(value, 4))
        for step in steps(convert_one(field_type))
        if step.helper is helper
    }

    (arguments,) = used
    inspect.signature(function).bind(None, *range(arguments))


def steps(conversion: FieldConversion) -> Iterator[Step]:
    for ways in vars(conversion).values():
        if isinstance(ways, BothWays):
            yield from (*ways.to_custom, *ways.to_ros)
