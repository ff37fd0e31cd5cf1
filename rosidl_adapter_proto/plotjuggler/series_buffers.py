"""Collects what parsers make of the messages of a topic, key by key."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy

from rosidl_adapter_proto.plotjuggler.columns import Column
from rosidl_adapter_proto.plotjuggler.series_model import Series, Values
from rosidl_adapter_proto.plotjuggler.values import NUMBER_FORMATS, BuiltinType

if TYPE_CHECKING:
    from numpy.typing import NDArray

Messages: TypeAlias = "range | NDArray[numpy.int64]"
"""Messages of a topic, counted from 0: a range, if no other lies between them."""

MAXIMUM_KEYS = 20_000
"""The most keys of one topic that become series: a map or an array may have others in each message."""


class Buffer:
    """An array that grows at its end."""

    def __init__(self, dtype: Any) -> None:
        self._array = numpy.empty(64, dtype)
        self._size = 0

    def __len__(self) -> int:
        return self._size

    def extend(self, values: NDArray[Any]) -> None:
        size = self._size + len(values)
        if size > len(self._array):
            grown = numpy.empty(max(size, 2 * len(self._array)), self._array.dtype)
            grown[: self._size] = self._array[: self._size]
            self._array = grown
        self._array[self._size : size] = values
        self._size = size

    def array(self) -> NDArray[Any]:
        """Return what it has, in memory of that size."""
        return self._array[: self._size].copy()


class _Column:
    """The values of one key, all of one type.

    Which message each is of is only kept as soon as there is a message without the key: mostly there is none.
    """

    def __init__(self, kind: BuiltinType) -> None:
        self._texts: list[str] | None = [] if kind == BuiltinType.STRING else None
        dtype = numpy.bool_ if kind == BuiltinType.BOOL else numpy.dtype(NUMBER_FORMATS.get(kind, "u1"))
        self._numbers = Buffer(dtype)
        self._messages: Buffer | None = None

    def __len__(self) -> int:
        return len(self._numbers) if self._texts is None else len(self._texts)

    def extend(self, messages: Messages, values: Values) -> None:
        count = len(self)
        if self._messages is None and not (isinstance(messages, range) and messages.start == count):
            self._messages = Buffer(numpy.int64)
            self._messages.extend(numpy.arange(count))
        if self._messages is not None:
            self._messages.extend(numpy.asarray(messages))
        if self._texts is None:
            self._numbers.extend(values)  # type: ignore[arg-type]
        else:
            self._texts.extend(values)

    def series(
        self, times: NDArray[numpy.int64], places: NDArray[numpy.int64]
    ) -> tuple[NDArray[numpy.int64], Values, NDArray[numpy.int64] | None]:
        """Return times, values and messages, in the order of time; no messages if all have a value.

        Args:
            times: When the messages of the topic were recorded, in the order of time.
            places: Where each message stands in that order.
        """
        values: Values = self._numbers.array() if self._texts is None else self._texts
        messages = places[: len(values)] if self._messages is None else places[self._messages.array()]
        if not _in_order(messages):
            order = numpy.argsort(messages, kind="stable")
            messages = messages[order]
            values = [values[index] for index in order] if isinstance(values, list) else values[order]
        if len(values) == len(times) and bool(numpy.all(numpy.diff(messages) == 1)):
            return times, values, None
        return times[messages], values, messages


def _in_order(numbers: NDArray[numpy.int64]) -> bool:
    return bool(numpy.all(numbers[:-1] <= numbers[1:]))


class TopicSeries:
    """Collects the series of one topic.

    Attributes:
        topic: The name of the topic.
        left_out: How many values were left out, since there were too many keys.

    Args:
        topic: The name of the topic.
        is_chosen: Tells of the name of a series whether somebody wants it.
    """

    def __init__(self, topic: str, is_chosen: Callable[[str], bool]) -> None:
        self.topic = topic
        self.left_out = 0
        self._is_chosen = is_chosen
        self._chosen: dict[str, bool] = {}
        self._times = Buffer(numpy.int64)
        self._columns: dict[tuple[str, BuiltinType], _Column] = {}

    def __len__(self) -> int:
        """Return how many messages there were."""
        return len(self._times)

    def add(self, times: NDArray[numpy.int64], columns: Iterable[Column], refused: Collection[int]) -> None:
        """Add messages.

        Args:
            times: When each was recorded.
            columns: Their values.
            refused: Those that have none, since they could not be parsed.
        """
        taken = numpy.ones(len(times), numpy.bool_)
        taken[list(refused)] = False
        numbers = len(self) + numpy.cumsum(taken) - 1
        self._times.extend(times[taken])
        known: dict[int, Messages] = {}  # most columns have the messages of the one before
        for each in columns:
            if each.kind == BuiltinType.BLOB:
                continue
            if id(each.messages) not in known:
                known[id(each.messages)] = _as_range(numbers[each.messages])
            self._add_values(each, known[id(each.messages)])

    def series(self) -> Iterator[Series]:
        """Yield the series, keys in the order in which they first came."""
        times = self._times.array()
        order = numpy.argsort(times, kind="stable")
        places = numpy.empty(len(times), numpy.int64)
        places[order] = numpy.arange(len(times))
        times = times[order]
        for (key, _), column in self._columns.items():
            yield Series(self.topic, key, *column.series(times, places))

    def _add_values(self, values: Column, messages: Messages) -> None:
        if values.key not in self._chosen:
            self._chosen[values.key] = self._is_chosen(self.topic + values.key)
        if not self._chosen[values.key]:
            return
        key = values.key, values.kind
        if key not in self._columns:
            if len(self._columns) == MAXIMUM_KEYS:
                self.left_out += len(values)
                return
            self._columns[key] = _Column(values.kind)
        self._columns[key].extend(messages, values.values)  # type: ignore[arg-type]


def _as_range(messages: NDArray[numpy.int64]) -> Messages:
    if len(messages) and bool(numpy.all(numpy.diff(messages) == 1)):
        return range(int(messages[0]), int(messages[-1]) + 1)
    return messages
