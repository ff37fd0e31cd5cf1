"""The columns of a type: what a table of its messages has, decided once, as plain data.

The core fills columns straight from serialized messages (`core/include/rosidl_adapter_proto/columns.hpp`). Which there
are follows from the plan of the type; this is a tree of them, and `pack_layout` tells the core.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import IntEnum

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.model import Shape
from rosidl_adapter_proto.interfaces.scalars import CdrForm
from rosidl_adapter_proto.transcode.plan import NOT_IN_PROTOBUF, MessagePlan, Operation, Plan

MAXIMUM_COLUMNS = 10_000
"""So many columns a table has at most, those inside of others included."""

SERIALIZATIONS = ("cdr", "protobuf", "ros1")
"""How messages are serialized that columns are filled with; as in `columns.hpp`."""

TIME = "builtin_interfaces/msg/Time"
DURATION = "builtin_interfaces/msg/Duration"

_TEXTS = (CdrForm.STRING, CdrForm.WSTRING, CdrForm.BYTES)
_TIME_FORMS = {"sec": CdrForm.INT32, "nanosec": CdrForm.UINT32}


class ColumnKind(IntEnum):
    """What a column is; as in `columns.hpp`."""

    NUMBER = 1
    NUMBERS = 2
    TEXT = 3
    LIST = 4
    STRUCT = 5
    TIME = 6


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes:
        name: The name of the field in ROS; `item` for the elements of a list.
        kind: What it is.
        cdr: What its values are in ROS.
        is_array: Whether it is an array, so that all rows have the same length.
        length: The number of elements of an array.
        type_name: The ROS type of a struct or a time.
        columns: What is inside of a struct; of a list, the column of its elements.
    """

    name: str
    kind: ColumnKind
    cdr: CdrForm
    is_array: bool = False
    length: int = 0
    type_name: str = ""
    columns: tuple[Column, ...] = ()


def columns_of(plan: Plan) -> tuple[Column, ...]:
    """Return the columns of a type.

    Raises:
        SchemaError: There are too many.
    """
    return _Layout(plan).message(plan.messages[0])


def pack_layout(columns: Iterable[Column]) -> bytes:
    """Return the kinds of columns in the form that the core reads: one byte for each, before those inside of it."""

    def kinds(some: Iterable[Column]) -> Iterator[int]:
        for each in some:
            yield each.kind
            yield from kinds(each.columns)

    return bytes(kinds(columns))


class _Layout:
    """Makes the columns of one plan, and counts them, since a type can be much larger than its definition."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._count = 0

    def message(self, message: MessagePlan) -> tuple[Column, ...]:
        """Return the columns of a message: those of its fields."""
        return tuple(self._field(each) for each in message.operations if each.protobuf != NOT_IN_PROTOBUF)

    def _field(self, operation: Operation) -> Column:
        self._add()
        name, cdr, shape = operation.name, operation.cdr, operation.shape
        if shape is Shape.SINGLE:
            return self._element(name, operation)
        is_array = shape is Shape.ARRAY
        length = operation.count if is_array else 0
        if cdr not in (*_TEXTS, CdrForm.MESSAGE):
            return Column(name, ColumnKind.NUMBERS, cdr, is_array, length)
        self._add()
        items = (self._element("item", operation),)
        return Column(name, ColumnKind.LIST, cdr, is_array, length, columns=items)

    def _element(self, name: str, operation: Operation) -> Column:
        cdr = operation.cdr
        if cdr in _TEXTS:
            return Column(name, ColumnKind.TEXT, cdr)
        if cdr is not CdrForm.MESSAGE:
            return Column(name, ColumnKind.NUMBER, cdr)
        message = self._plan.messages[operation.message]
        if _is_time(message):
            return Column(name, ColumnKind.TIME, cdr, type_name=message.name)
        return Column(name, ColumnKind.STRUCT, cdr, type_name=message.name, columns=self.message(message))

    def _add(self) -> None:
        self._count += 1
        if self._count > MAXIMUM_COLUMNS:
            raise SchemaError(
                f"{self._plan.type_name}: it has more than {MAXIMUM_COLUMNS} columns; choose some of its fields"
            )


def _is_time(message: MessagePlan) -> bool:
    """Tell whether a message is a time or duration, with both of its fields."""
    fields = {
        each.name: each.cdr
        for each in message.operations
        if each.shape is Shape.SINGLE and each.protobuf != NOT_IN_PROTOBUF
    }
    names = [each.name for each in message.operations]
    return message.name in (TIME, DURATION) and fields == _TIME_FORMS and names == list(_TIME_FORMS)
