"""Outputs of many messages, made into columns: messages that differ only in their values are read all at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.output import (
    MAXIMUM_SECONDS,
    Field,
    Layout,
    ReadLayout,
    blob_outside,
    no_time,
)
from rosidl_adapter_proto.plotjuggler.session import BrokenContract, Messages, Outputs
from rosidl_adapter_proto.plotjuggler.values import NUMBER_FORMATS, Blob, BuiltinType, shown

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Values: TypeAlias = "NDArray[Any] | list[str] | list[Blob]"

_MAXIMUM_LAYOUTS = 16  # of one size, so that comparing with them costs less than reading
_MAXIMUM_MEMORY = 16 << 20
_FIELD_MEMORY = 200  # of a field, its key and its numbers, about


@dataclass(frozen=True, eq=False, slots=True)
class Column:
    """The values of a key.

    Attributes:
        key: The key, such as `/linear_acceleration/x`.
        kind: The type of its values. A key that has values of two types has two columns.
        messages: Which messages have it, by their index in the batch, in order; a message with two such pairs twice.
        values: The value in each: an array of numbers or bools, or a list of texts or of blobs.
    """

    key: str
    kind: BuiltinType
    messages: NDArray[numpy.int64] = field(repr=False)
    values: Values = field(repr=False)

    def __len__(self) -> int:
        return len(self.messages)


@dataclass(frozen=True, eq=False, slots=True)
class Batch:
    """What a plugin made of a batch of messages.

    Attributes:
        count: How many messages there were.
        columns: The values, keys in the order in which they first came.
        refused: The messages that the plugin did not take, by their index, and why.
        times: The time of each message in nanoseconds: the one that the plugin found in it, where that was asked for,
            else when it was recorded; None if nobody said so.
    """

    count: int
    columns: tuple[Column, ...]
    refused: dict[int, str]
    times: NDArray[numpy.int64] | None


class BatchError(PluginError):
    """A plugin was stopped or broke its contract at a message of a batch.

    Attributes:
        batch: What it made of the messages before that one.
    """

    def __init__(self, reason: str, batch: Batch) -> None:
        super().__init__(reason)
        self.batch = batch


@dataclass(slots=True)
class _Template:
    """A layout, and the bytes that all outputs have that are laid out so.

    Attributes:
        layout: The layout.
        expected: The bytes, in words of 8; those of values are 0.
        mask: Which bits are not of values.
    """

    layout: Layout
    expected: NDArray[numpy.uint64]
    mask: NDArray[numpy.uint64]

    @property
    def memory(self) -> int:
        """About how many bytes it takes."""
        return 2 * self.mask.nbytes + _FIELD_MEMORY * (3 + len(self.layout.fields))


class Templates:
    """The layouts that outputs of a parser have had, by the size of the output."""

    def __init__(self) -> None:
        self._by_size: dict[int, list[_Template]] = {}
        self._memory = 0

    def of_size(self, size: int) -> tuple[_Template, ...]:
        """Return those of outputs of a size."""
        return tuple(self._by_size.get(size, ()))

    def keep(self, size: int, template: _Template) -> bool:
        """Keep one more; False if there are enough of the size. All others are forgotten if they take too much."""
        if len(self._by_size.get(size, ())) == _MAXIMUM_LAYOUTS:
            return False
        if self._memory + template.memory > _MAXIMUM_MEMORY:
            self._by_size.clear()
            self._memory = 0
        self._memory += template.memory
        self._by_size.setdefault(size, []).append(template)
        return True


class Collector:
    """Collects the columns of a batch.

    Attributes:
        messages: The messages of the batch.
        refused: The messages that the plugin did not take, by their index, and why.
        done: How many of the messages were taken or refused.
    """

    def __init__(
        self, messages: Messages, read_layout: ReadLayout, embedded_time: bool, templates: Templates
    ) -> None:
        self.messages = messages
        self.refused: dict[int, str] = {}
        self.done = 0
        self._read_layout = read_layout
        self._embedded_time = embedded_time
        self._templates = templates
        self._parts: dict[tuple[str, BuiltinType], list[tuple[NDArray[numpy.int64], Values]]] = {}
        self._times = messages.times

    def add(self, outputs: Outputs) -> None:
        """Take the outputs of the next messages.

        Raises:
            BrokenContract: An output is not what it should be; those before it are taken.
        """
        before, broken = self._parts, None
        while True:
            self._parts = {}
            try:
                self._add(outputs)
                break
            except BrokenContract as error:  # maybe not the first, as outputs are read by their size
                broken, outputs = error, outputs.before(error.index)
        for name, parts in self._parts.items():
            before.setdefault(name, []).extend(parts)
        self._parts = before
        self.refused |= outputs.refused
        self.done = outputs.end
        if broken is not None:
            raise broken

    def _add(self, outputs: Outputs) -> None:
        region = numpy.frombuffer(outputs.memory, "u1")
        sizes = outputs.sizes
        taken = numpy.flatnonzero(sizes > 0)
        distinct, firsts = numpy.unique(sizes[taken], return_index=True)
        for size in distinct[numpy.argsort(firsts)].tolist():
            rows = taken[sizes[taken] == size] if len(distinct) > 1 else taken
            self._add_size(region, outputs.begins[rows], rows + outputs.first, size)

    def _add_size(
        self, region: NDArray[Any], begins: NDArray[numpy.uint32], rows: NDArray[numpy.int64], size: int
    ) -> None:
        """Take outputs that have the same size."""
        words = (size + 7) // 8
        matrix = _rows_of(region, begins, words)
        for template in self._templates.of_size(size):
            if not len(rows):
                return
            matrix, rows = self._take(template, matrix, rows)
        while len(rows):
            template = self._read(matrix[0].tobytes()[:size], int(rows[0]))
            if self._templates.keep(size, template):
                matrix, rows = self._take(template, matrix, rows)
            else:
                self._add_columns(template.layout, matrix[:1], rows[:1])
                matrix, rows = matrix[1:], rows[1:]

    def _take(
        self, template: _Template, matrix: NDArray[numpy.uint64], rows: NDArray[numpy.int64]
    ) -> tuple[NDArray[numpy.uint64], NDArray[numpy.int64]]:
        """Take the outputs that are laid out as a template says, and return the others."""
        other = matrix & template.mask
        other ^= template.expected
        differs = other.any(axis=1)
        if not differs.any():
            self._add_columns(template.layout, matrix, rows)
            return matrix[:0], rows[:0]
        same = ~differs
        if same.any():
            self._add_columns(template.layout, matrix[same], rows[same])
        return matrix[differs], rows[differs]

    def _read(self, data: bytes, row: int) -> _Template:
        try:
            layout = self._read_layout(data, self._embedded_time)
        except PluginError as error:
            raise BrokenContract(row, str(error)) from None
        size = -(-len(data) // 8) * 8
        mask = numpy.full(size, 0xFF, "u1")
        mask[len(data) :] = 0
        for each in (*layout.fields, *([layout.time] if layout.time else [])):
            mask[each.offset : each.offset + each.size] = 0
        for begin, end in layout.ignored:
            mask[begin:end] = 0
        expected = numpy.frombuffer(data.ljust(size, b"\0"), "u1") & mask
        return _Template(layout, expected.view("<u8"), mask.view("<u8"))

    def _add_columns(self, layout: Layout, matrix: NDArray[numpy.uint64], rows: NDArray[numpy.int64]) -> None:
        if layout.time is not None:
            self._add_times(layout.time, layout.time_in_nanoseconds, matrix, rows)
        for each in layout.fields:
            if each.kind == BuiltinType.STRING:
                values: Values = _texts(each, matrix, rows)
            elif each.kind == BuiltinType.BLOB:
                values = _blobs(each, matrix, rows, self.messages)
            else:
                values = _numbers(each, matrix)
            self._parts.setdefault((each.key, each.kind), []).append((rows, values))

    def _add_times(
        self, place: Field, in_nanoseconds: bool, matrix: NDArray[Any], rows: NDArray[numpy.int64]
    ) -> None:
        found = _numbers(place, matrix)
        if not in_nanoseconds:
            seconds = found.astype("f8")
            wrong = numpy.flatnonzero(~(numpy.abs(seconds) < MAXIMUM_SECONDS))
            if len(wrong):
                raise BrokenContract(int(rows[wrong[0]]), str(no_time(place, seconds[wrong[0]])))
            found = numpy.rint(seconds * 1e9)
        if self._times is None or self._times is self.messages.times:
            given = self.messages.times
            self._times = numpy.zeros(len(self.messages), "i8") if given is None else given.copy()
        self._times[rows] = found

    def batch(self) -> Batch:
        """Return what was collected: the messages that are done."""
        columns = []
        for (key, kind), parts in self._parts.items():
            rows, values = parts[0] if len(parts) == 1 else _merged(parts)
            columns.append(Column(key, kind, rows, values))
        times = None if self._times is None else self._times[: self.done]
        return Batch(self.done, tuple(columns), self.refused, times)


def _rows_of(region: NDArray[Any], begins: NDArray[numpy.uint32], words: int) -> NDArray[numpy.uint64]:
    """Return outputs as rows of words of 8 bytes, without a copy where they follow each other evenly."""
    first = int(begins[0])
    stride = int(begins[1]) - first if len(begins) > 1 else 8
    usable = region[: len(region) // 8 * 8].view("<u8")
    if (numpy.diff(begins.astype("i8")) == stride).all():
        shape = len(begins), words
        return numpy.ndarray(shape, "<u8", buffer=usable, offset=first, strides=(stride, 8))
    return usable[(begins // 8)[:, None] + numpy.arange(words, dtype="u4")]


def _numbers(place: Field, matrix: NDArray[numpy.uint64]) -> NDArray[Any]:
    found = _bytes_at(place, matrix, NUMBER_FORMATS[place.kind])
    return found != 0 if place.kind == BuiltinType.BOOL else found.copy()


def _bytes_at(place: Field, matrix: NDArray[numpy.uint64], number_format: str) -> NDArray[Any]:
    """Return what is at the same place in all rows."""
    size = numpy.dtype(number_format).itemsize
    return matrix.view("u1")[:, place.offset : place.offset + size].view(number_format)[:, 0]


def _texts(place: Field, matrix: NDArray[numpy.uint64], rows: NDArray[numpy.int64]) -> list[str]:
    if not place.size:
        return [""] * len(rows)
    found = _bytes_at(place, matrix, f"V{place.size}")
    data = found.tobytes()
    size = place.size
    if data == data[:size] * len(rows):
        return [_text(data[:size], place, rows[0])] * len(rows)
    return [_text(data[size * at : size * at + size], place, row) for at, row in enumerate(rows)]


def _text(data: bytes, place: Field, row: int) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        where = place.offset + error.start
        raise BrokenContract(int(row), f"byte {where}: the text of {shown(place.key)} is not UTF-8") from None


def _blobs(
    place: Field, matrix: NDArray[numpy.uint64], rows: NDArray[numpy.int64], messages: Messages
) -> list[Blob]:
    packed = _bytes_at(place, matrix, "<u8")
    offsets = (packed & 0xFFFF_FFFF).tolist()
    sizes = (packed >> 32).tolist()
    blobs = []
    for row, offset, size, available in zip(rows, offsets, sizes, messages.sizes[rows].tolist(), strict=True):
        if offset + size > available:
            raise BrokenContract(int(row), str(blob_outside(place, offset, size, available)))
        blobs.append(Blob(offset, size))
    return blobs


def _merged(parts: Sequence[tuple[NDArray[numpy.int64], Any]]) -> tuple[NDArray[numpy.int64], Any]:
    """Return columns of several layouts as one, in the order of messages."""
    rows = numpy.concatenate([each for each, _ in parts])
    order = numpy.argsort(rows, kind="stable")
    if isinstance(parts[0][1], list):
        everything = [value for _, values in parts for value in values]
        return rows[order], [everything[at] for at in order.tolist()]
    return rows[order], numpy.concatenate([values for _, values in parts])[order]
