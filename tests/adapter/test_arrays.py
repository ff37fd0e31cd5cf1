"""What arrays of numbers are called: as the rows of the scalar types, `array.array` and numpy have them."""

from __future__ import annotations

import numpy

from rosidl_adapter_proto.adapter.arrays import NUMPY_TYPES
from rosidl_adapter_proto.interfaces.scalars import SCALARS


def test_every_type_with_a_typecode_is_one_of_numpy() -> None:
    typecodes = {row.typecode for row in SCALARS.values() if row.typecode}
    assert {code: numpy.dtype(code).newbyteorder("<").str for code in typecodes} == NUMPY_TYPES
