from __future__ import annotations

import array
import math
import struct
from collections import Counter

import pytest

from rosidl_adapter_proto.interfaces import msg
from rosidl_adapter_proto.interfaces.idl import values
from rosidl_adapter_proto.interfaces.model import BasicType, StringType
from rosidl_adapter_proto.interfaces.scalars import (
    NESTED_TYPE_ID,
    RESERVED_TYPE_IDS,
    SCALARS,
    CdrForm,
    Family,
    Scalar,
)

ROWS = pytest.mark.parametrize("row", SCALARS.values(), ids=SCALARS)


@pytest.mark.parametrize("table", [msg._VALUE_READERS, values.FITTERS])
def test_tables_by_family_are_complete(table: dict[Family, object]) -> None:
    assert table.keys() == set(Family)


def test_nothing_is_called_or_numbered_twice() -> None:
    rows = SCALARS.values()
    ids = [each for row in rows for each in (row.type_id, row.bounded_type_id) if each is not None]
    for names in (
        [*ids, NESTED_TYPE_ID, *RESERVED_TYPE_IDS],
        [name for row in rows for name in row.msg],
        [name for row in rows for name in (row.name, *row.idl)],
    ):
        assert max(Counter(names).values()) == 1


def test_every_cdr_form_of_ros_is_used() -> None:
    of_ros = {form for form in CdrForm if form < CdrForm.MESSAGE}
    assert {row.cdr for row in SCALARS.values()} - {None} == of_ros


@ROWS
def test_a_row_agrees_with_itself(row: Scalar) -> None:
    has_bits = row.family in (Family.INTEGER, Family.OCTET, Family.CHARACTER)
    assert bool(row.bits) == has_bits
    assert bool(row.largest_character) == (row.family is Family.CHARACTER)
    assert bool(row.largest_float) == (row.family is Family.FLOATING_POINT)
    assert row.is_string == (row.bounded_type_id is not None)
    assert not row.repeated or row.many == row.protobuf
    assert row.typecode is None or not row.bits or array.array(row.typecode).itemsize * 8 == row.bits
    if has_bits:
        assert row.range == (
            (-(2**row.bits) // 2, 2**row.bits // 2 - 1)
            if row.signed
            else (0, row.largest_character or 2**row.bits - 1)
        )
    else:
        with pytest.raises(ValueError, match=f"^{row.name} has no range$"):
            row.range  # noqa: B018


@ROWS
def test_the_model_finds_its_row(row: Scalar) -> None:
    model = StringType(row.family is Family.WSTRING) if row.is_string else BasicType(row.name)
    assert model.scalar is row


def test_the_smallest_infinite_numbers() -> None:
    """What struct refuses (CPython rounds as IEEE 754 does) and the number below, which it takes."""
    smallest = SCALARS["float"].smallest_infinite
    with pytest.raises(OverflowError):
        struct.pack("<f", smallest)
    assert struct.unpack("<f", struct.pack("<f", math.nextafter(smallest, 0))) == (
        SCALARS["float"].largest_float,
    )
    assert SCALARS["double"].smallest_infinite == math.inf
    with pytest.raises(ValueError, match=r"^int8 has no infinity$"):
        SCALARS["int8"].smallest_infinite  # noqa: B018
