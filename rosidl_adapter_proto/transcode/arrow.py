"""Serialized messages as Arrow record batches, without a message object in between.

This needs pyarrow: `pip install 'rosidl-adapter-proto[tables]'`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.interfaces.scalars import CdrForm
from rosidl_adapter_proto.schema.registry import Schema
from rosidl_adapter_proto.transcode import _core
from rosidl_adapter_proto.transcode.codec import MAXIMUM_SIZE, plan_errors
from rosidl_adapter_proto.transcode.columns import (
    DURATION,
    SERIALIZATIONS,
    Column,
    ColumnKind,
    columns_of,
    pack_layout,
)
from rosidl_adapter_proto.transcode.plan import build_plan

try:
    import pyarrow as pa
except ImportError as error:
    raise ImportError(
        f"tables need pyarrow ({error}); pip install 'rosidl-adapter-proto[tables]'", name="pyarrow"
    ) from error

if TYPE_CHECKING:
    from typing_extensions import Buffer

__all__ = ["MAXIMUM_BYTES", "MAXIMUM_ROWS", "ColumnReader", "pa"]

MAXIMUM_ROWS = 2**17
"""So many rows a record batch has, unless somebody asks for others."""

MAXIMUM_BYTES = 16 * 2**20
"""A record batch ends with the row with which it has so many bytes, unless somebody asks for others.

Memory for larger ones comes from the system anew each time, and finding it takes longer than filling it.
"""

_NUMBERS = {
    CdrForm.BOOLEAN: pa.bool_(),
    CdrForm.UINT8: pa.uint8(),
    CdrForm.INT8: pa.int8(),
    CdrForm.CHAR: pa.uint8(),
    CdrForm.UINT16: pa.uint16(),
    CdrForm.INT16: pa.int16(),
    CdrForm.WCHAR: pa.uint16(),
    CdrForm.UINT32: pa.uint32(),
    CdrForm.INT32: pa.int32(),
    CdrForm.FLOAT: pa.float32(),
    CdrForm.UINT64: pa.uint64(),
    CdrForm.INT64: pa.int64(),
    CdrForm.DOUBLE: pa.float64(),
}
"""What one number becomes."""


class ColumnReader:
    """Reads serialized messages of one type into record batches.

    The fields of a message become the columns of a table, in their order: nested messages are structs, sequences are
    lists, and `docs/tables.md` has the whole list of types. Nothing is null. What has no fields has no column.

    Attributes:
        arrow_schema: The columns.

    Args:
        schema: The type of the messages.
        fields: Read only these, such as `header.stamp` or, of each point in a sequence, `points.x`.
        serialization_format: How the messages are serialized: `cdr`, `protobuf` or `ros1`.
        maximum_rows: A record batch has so many rows at most.
        maximum_bytes: A record batch ends with the row with which it has so many bytes, or before the row with which
            a column would have more than 2 GiB.

    Raises:
        SchemaError: The type has no such field, becomes too many columns, or its messages are too large.
        RequestError: The serialization format is another one.
        TypeError: `fields` is one text.
        ValueError: `maximum_rows` or `maximum_bytes` is not positive.
    """

    def __init__(
        self,
        schema: Schema,
        fields: Iterable[str] | None = None,
        *,
        serialization_format: str = "cdr",
        maximum_rows: int = MAXIMUM_ROWS,
        maximum_bytes: int = MAXIMUM_BYTES,
    ) -> None:
        if serialization_format not in SERIALIZATIONS:
            raise RequestError(
                f"tables are made of {', '.join(SERIALIZATIONS)} messages, not of {serialization_format!r} ones; "
                "convert them first"
            )
        if maximum_rows < 1 or maximum_bytes < 1:
            raise ValueError("maximum_rows and maximum_bytes must be 1 or more")
        plan = build_plan(schema.type_description, schema.descriptor, fields=fields)
        self._columns = columns_of(plan)
        self._maximum_rows = maximum_rows
        self._maximum_bytes = maximum_bytes
        with plan_errors(plan):
            transcoder = _core.Transcoder(plan.pack(), plan.type_name, MAXIMUM_SIZE)
        layout, serialization = pack_layout(self._columns), SERIALIZATIONS.index(serialization_format)
        self._filler = _core.ColumnFiller(transcoder, layout, serialization)
        self.arrow_schema = pa.schema(_fields(self._columns))

    def __len__(self) -> int:
        """Return the number of rows that the next record batch has so far."""
        return self._filler.rows

    def append(
        self, messages: Sequence[Buffer] | Buffer, *, ranges: Buffer | None = None, start: int = 0
    ) -> int:
        """Append messages to the next record batch, while other Python threads run, until it is full.

        Args:
            messages: The messages; with `ranges`, the one buffer that they are in.
            ranges: Where in the buffer each message is, as `Transcoder.cdr_to_proto_batch` takes them.
            start: The index of the first message to append.

        Returns:
            The index of the first message that was not appended, since the record batch is full; the number of
            messages if all were.

        Raises:
            TranscodeError: A message is not valid. Those before it were appended, and `batch_index` tells which it is.
        """
        return self._filler.append(messages, ranges, start, self._maximum_rows, self._maximum_bytes)

    def record_batch(self) -> pa.RecordBatch:
        """Return what was appended since the last record batch."""
        rows, columns = self._filler.take()
        parts = iter(columns)
        arrays = [array for each in self._columns if (array := _array(each, parts)) is not None]
        if not arrays:  # then only this way tells how many rows there are
            return pa.RecordBatch.from_struct_array(pa.StructArray.from_buffers(pa.struct([]), rows, [None]))
        return pa.RecordBatch.from_arrays(arrays, schema=self.arrow_schema)

    def record_batches(
        self, messages: Sequence[Buffer] | Buffer, *, ranges: Buffer | None = None
    ) -> Iterator[pa.RecordBatch]:
        """Yield record batches of all messages; arguments and errors are those of `append`."""
        numbers: Any = messages if ranges is None else memoryview(ranges)
        count = len(numbers) if ranges is None else len(numbers) // 2
        start = 0
        while start < count:
            start = self.append(messages, ranges=ranges, start=start)
            yield self.record_batch()


def _fields(columns: Iterable[Column]) -> list[pa.Field]:
    """Return the fields of columns, without those that have nothing inside."""
    types = ((each.name, _data_type(each)) for each in columns)
    return [pa.field(name, found, nullable=False) for name, found in types if found is not None]


def _data_type(column: Column) -> pa.DataType | None:
    if column.kind is ColumnKind.NUMBER:
        return _NUMBERS[column.cdr]
    if column.kind is ColumnKind.TEXT:
        return pa.string()
    if column.kind is ColumnKind.TIME:
        return pa.duration("ns") if column.type_name == DURATION else pa.timestamp("ns")
    if column.kind is ColumnKind.STRUCT:
        fields = _fields(column.columns)
        return pa.struct(fields) if fields else None
    length = column.length if column.is_array else -1
    if column.kind is ColumnKind.LIST:
        items = _fields(column.columns)
        return pa.list_(items[0], length) if items else None
    if column.cdr is CdrForm.UINT8:
        return pa.binary(length)
    return pa.list_(pa.field("item", _NUMBERS[column.cdr], nullable=False), length)


_Part = tuple[int, Any, Any]
"""What the core has of a column: its number of rows, its offsets, and its values."""


def _array(column: Column, parts: Iterator[_Part]) -> pa.Array | None:
    """Return the array of a column; it takes its part, and those of the columns inside of it, off `parts`."""
    rows, offsets, values = next(parts)
    buffers = [None] if offsets is None else [None, pa.py_buffer(offsets)]
    children = None
    if column.kind in (ColumnKind.STRUCT, ColumnKind.LIST):
        children = [array for each in column.columns if (array := _array(each, parts)) is not None]
    elif column.kind is ColumnKind.NUMBERS and column.cdr is not CdrForm.UINT8:
        count = rows * column.length if offsets is None else memoryview(offsets).cast("I")[rows]
        children = [pa.Array.from_buffers(_NUMBERS[column.cdr], count, [None, pa.py_buffer(values)])]
    else:
        buffers.append(pa.py_buffer(values))
    data_type = _data_type(column)
    if data_type is None:
        return None
    return pa.Array.from_buffers(data_type, rows, buffers, null_count=0, children=children)
