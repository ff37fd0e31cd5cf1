"""The scalar types of IDL: one row for each, with every fact about it.

What reads definitions, maps them to protobuf, converts or transcodes values looks here, and so does the native core,
whose list of CDR forms a test holds against this one. A new type is one row, and one CDR form if none fits
(CONTRIBUTING.md has the steps).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from enum import Enum, IntEnum
from math import frexp


class Family(Enum):
    """What values of a type are, in definitions and in Python."""

    BOOLEAN = "boolean"
    INTEGER = "integer"
    FLOATING_POINT = "floating point"
    OCTET = "octet"
    CHARACTER = "character"
    STRING = "string"
    WSTRING = "wstring"


class CdrForm(IntEnum):
    """How one element lies in CDR (DDS-XTypes 1.3, section 7.4.1.1), and what its values are; as in `core/`.

    Those behind `MESSAGE` are of protobuf messages that do not come from ROS (`transcode/protobuf_plan.py`): in CDR
    they are what another form is, and in protobuf they are not.
    """

    BOOLEAN = 1
    UINT8 = 2
    INT8 = 3
    CHAR = 4
    UINT16 = 5
    INT16 = 6
    WCHAR = 7
    UINT32 = 8
    INT32 = 9
    FLOAT = 10
    UINT64 = 11
    INT64 = 12
    DOUBLE = 13
    STRING = 14
    WSTRING = 15
    MESSAGE = 16
    VARINT32 = 17
    VARUINT32 = 18
    VARINT64 = 19
    VARUINT64 = 20
    ZIGZAG32 = 21
    ZIGZAG64 = 22
    BYTES = 23


@dataclass(frozen=True)
class Scalar:
    """An IDL type whose values have no parts.

    Attributes:
        name: What the model calls it, which is its name in IDL (OMG IDL 4.2, rules 24 to 41 and 206 to 215).
        family: What its values are.
        type_id: Its number in a type description (REP-2011, `type_description_interfaces/msg/FieldType`).
        protobuf: The protobuf type of one value.
        many: The protobuf type of an array or sequence.
        repeated: Whether an array or sequence is a repeated field; else it is one protobuf value.
        cdr: How it lies in CDR; None if that depends on the machine, so that it cannot be transcoded.
        cpp: The C++ type of a value in ROS.
        msg: Its names in `.msg`, if it has any.
        idl: Its names in `.idl` besides `name`.
        bounded_type_id: Its number in a type description when it has a bound.
        bits: Width of an integer, octet or character.
        signed: Whether it has values below zero.
        largest_character: Largest character that a message can have, as a number.
        largest_float: Largest finite number of a floating-point type, as far as Python and protobuf have it.
        typecode: What `array.array` calls it, if ROS has its arrays as array.array (sequences) or numpy (arrays).
    """

    name: str
    family: Family
    type_id: int
    protobuf: str
    many: str
    repeated: bool
    cdr: CdrForm | None
    cpp: str
    msg: tuple[str, ...] = ()
    idl: tuple[str, ...] = ()
    bounded_type_id: int | None = None
    bits: int = 0
    signed: bool = False
    largest_character: int = 0
    largest_float: float = 0.0
    typecode: str | None = None

    @property
    def range(self) -> tuple[int, int]:
        """The smallest and the largest value of an integer, an octet, or a character as a number."""
        if not self.bits:
            raise ValueError(f"{self.name} has no range")
        if self.signed:
            return -(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1
        return 0, self.largest_character or (1 << self.bits) - 1

    @property
    def smallest_infinite(self) -> float:
        """The smallest number that is rounded to infinity (IEEE 754, section 4.3.1).

        It is halfway to the next power of two; infinity itself if no other number is too large.
        """
        if not self.largest_float:
            raise ValueError(f"{self.name} has no infinity")
        _, exponent = frexp(self.largest_float)
        half_of_next = 2.0 ** (exponent - 1)
        return self.largest_float / 2 + half_of_next

    @property
    def is_string(self) -> bool:
        """Whether it is a string or a wide string."""
        return self.family in (Family.STRING, Family.WSTRING)


def _integer(
    name: str, type_id: int, protobuf: str, cdr: CdrForm, typecode: str, *, idl: tuple[str, ...] = ()
) -> Scalar:
    """Return the row of an integer of 16 bits or more, whose arrays are repeated fields."""
    return Scalar(
        name,
        Family.INTEGER,
        type_id,
        protobuf,
        protobuf,
        True,
        cdr,
        f"{name}_t",
        msg=(name,),
        idl=idl,
        bits=int(name.rpartition("int")[2]),
        signed=name.startswith("int"),
        typecode=typecode,
    )


_ROWS = (
    Scalar("boolean", Family.BOOLEAN, 15, "bool", "bool", True, CdrForm.BOOLEAN, "bool", msg=("bool",)),
    Scalar(
        "octet", Family.OCTET, 16, "uint32", "bytes", False, CdrForm.UINT8, "uint8_t", msg=("byte",), bits=8
    ),
    # rclpy reads ASCII only: other bytes make it fail, and of other characters it writes one byte of their UTF-8.
    Scalar(
        "char",
        Family.CHARACTER,
        13,
        "uint32",
        "string",
        False,
        CdrForm.CHAR,
        "uint8_t",
        bits=8,
        largest_character=0x7F,
    ),
    Scalar(
        "wchar",
        Family.CHARACTER,
        14,
        "uint32",
        "string",
        False,
        CdrForm.WCHAR,
        "char16_t",
        bits=16,
        largest_character=0xFFFF,
    ),
    Scalar(
        "int8",
        Family.INTEGER,
        2,
        "int32",
        "bytes",
        False,
        CdrForm.INT8,
        "int8_t",
        msg=("int8",),
        bits=8,
        signed=True,
        typecode="b",
    ),
    Scalar(
        "uint8",
        Family.INTEGER,
        3,
        "uint32",
        "bytes",
        False,
        CdrForm.UINT8,
        "uint8_t",
        msg=("uint8", "char"),
        bits=8,
        typecode="B",
    ),
    _integer("int16", 4, "int32", CdrForm.INT16, "h", idl=("short",)),
    _integer("uint16", 5, "uint32", CdrForm.UINT16, "H", idl=("unsigned short",)),
    _integer("int32", 6, "sfixed32", CdrForm.INT32, "i", idl=("long",)),
    _integer("uint32", 7, "fixed32", CdrForm.UINT32, "I", idl=("unsigned long",)),
    _integer("int64", 8, "sfixed64", CdrForm.INT64, "q", idl=("long long",)),
    _integer("uint64", 9, "fixed64", CdrForm.UINT64, "Q", idl=("unsigned long long",)),
    Scalar(
        "float",
        Family.FLOATING_POINT,
        10,
        "float",
        "float",
        True,
        CdrForm.FLOAT,
        "float",
        msg=("float32",),
        largest_float=3.4028234663852886e38,
        typecode="f",
    ),
    Scalar(
        "double",
        Family.FLOATING_POINT,
        11,
        "double",
        "double",
        True,
        CdrForm.DOUBLE,
        "double",
        msg=("float64",),
        largest_float=sys.float_info.max,
        typecode="d",
    ),
    # Fast CDR copies the bytes of the machine: 80-bit x87 numbers on x86-64, 128-bit IEEE numbers on ARM.
    Scalar(
        "long double",
        Family.FLOATING_POINT,
        12,
        "double",
        "double",
        True,
        None,
        "long double",
        largest_float=sys.float_info.max,
    ),
    Scalar(
        "string",
        Family.STRING,
        17,
        "string",
        "string",
        True,
        CdrForm.STRING,
        "std::string",
        msg=("string",),
        bounded_type_id=21,
    ),
    # UTF-16 code units, little-endian, without a mark: as rosidl_typesupport_protobuf has them.
    Scalar(
        "wstring",
        Family.WSTRING,
        18,
        "bytes",
        "bytes",
        True,
        CdrForm.WSTRING,
        "std::u16string",
        msg=("wstring",),
        bounded_type_id=22,
    ),
)

SCALARS: dict[str, Scalar] = {row.name: row for row in _ROWS}
"""Every scalar type by its name."""

NESTED_TYPE_ID = 1
"""The number of a nested message in a type description (REP-2011)."""

RESERVED_TYPE_IDS = {19: "fixed string", 20: "fixed wstring"}
"""Numbers that no row may have, since REP-2011 has them for types that no definition can spell."""
