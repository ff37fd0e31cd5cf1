"""What parser plugins make of a message: pairs of a key and a value.

The types of values are those of PlotJuggler's page on WebAssembly plugins (docs/wasm_plugins.md), and `BOOL`, which the
released program has besides.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TypeAlias


class BuiltinType(enum.IntEnum):
    """The type of a value, by the number that stands before it."""

    UINT8 = 0
    UINT16 = 1
    UINT32 = 2
    UINT64 = 3
    INT8 = 8
    INT16 = 9
    INT32 = 10
    INT64 = 11
    FLOAT32 = 16
    FLOAT64 = 17
    STRING = 18
    BLOB = 19
    BOOL = 20
    OTHER = 255


NUMBER_FORMATS = {
    BuiltinType.UINT8: "<u1",
    BuiltinType.UINT16: "<u2",
    BuiltinType.UINT32: "<u4",
    BuiltinType.UINT64: "<u8",
    BuiltinType.INT8: "<i1",
    BuiltinType.INT16: "<i2",
    BuiltinType.INT32: "<i4",
    BuiltinType.INT64: "<i8",
    BuiltinType.FLOAT32: "<f4",
    BuiltinType.FLOAT64: "<f8",
    BuiltinType.BOOL: "|u1",
}
"""How each number is written, as numpy says it. Any byte but 0 is true."""


@dataclass(frozen=True, slots=True)
class Blob:
    """Bytes of the message that are not shown.

    Attributes:
        offset: Where they begin in the message.
        size: How many bytes they are.
    """

    offset: int
    size: int


Value: TypeAlias = "bool | int | float | str | Blob"


@dataclass(frozen=True, slots=True)
class Pair:
    """A key and its value.

    Attributes:
        key: What it is in the message, such as `/header/stamp/sec` or `/ranges[0]`; a topic and a key in one are the
            name of a series.
        kind: The type of the value.
        value: The value.
    """

    key: str
    kind: BuiltinType
    value: Value


@dataclass(frozen=True, slots=True)
class ArrayPolicy:
    """What becomes of long arrays.

    Attributes:
        clamp: Whether their first elements are shown; else they are left out.
        maximum: How many elements are not yet long.
    """

    clamp: bool
    maximum: int


def shown(text: str) -> str:
    """Return a text of a plugin or a bag as it can be printed: short, and without what controls a terminal."""
    cut = text if len(text) <= _MAXIMUM_SHOWN else text[:_MAXIMUM_SHOWN] + "..."
    return cut if cut.isprintable() else ascii(cut)


_MAXIMUM_SHOWN = 200
