"""The records of a recording's chunk, in the form of MCAP: read, made, indexed and transcoded.

A chunk, once it is not compressed, is a sequence of records (https://mcap.dev/spec#records), and most of them are
messages. All of this is done by the native module, while other Python threads run.
"""

from __future__ import annotations

import enum
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.transcode import _core
from rosidl_adapter_proto.transcode.codec import Transcoder

if TYPE_CHECKING:
    from typing_extensions import Buffer

pack_records = _core.pack_records

KEPT_FAILURES = _core.KEPT_FAILURES
"""Of how many messages of a chunk that cannot be transcoded it is told what is wrong: nobody reads more."""

NO_END = 2**64
"""No message is recorded at this time or later: log times are unsigned numbers of 64 bits."""


@dataclass(frozen=True)
class Records:
    """The messages of a chunk, in columns, and whatever else it has.

    Attributes:
        data: The chunk.
        topic_ids: The topic id of each message, which is the id of its channel (`"H"`).
        sequences: The sequence number of each message (`"I"`).
        log_times: When each message was recorded, in nanoseconds (`"Q"`).
        publish_times: When each message was published, in nanoseconds (`"Q"`).
        ranges: Where in the chunk the data of each message is: two numbers for each, the first byte and the one after
            the last, as batches of a `Transcoder` take them (`"Q"`).
        others: The records that are no messages: opcode and content of each.
    """

    data: memoryview = field(repr=False)
    topic_ids: memoryview = field(repr=False)
    sequences: memoryview = field(repr=False)
    log_times: memoryview = field(repr=False)
    publish_times: memoryview = field(repr=False)
    ranges: memoryview = field(repr=False)
    others: Sequence[tuple[int, memoryview]] = field(repr=False)

    def __len__(self) -> int:
        return len(self.topic_ids)

    def __getitem__(self, index: int) -> memoryview:
        """Return the data of a message."""
        index = range(len(self))[index]
        return self.data[self.ranges[2 * index] : self.ranges[2 * index + 1]]


def read_records(
    data: Buffer,
    topic_ids: Collection[int] | None = None,
    start_time: int = 0,
    end_time: int | None = None,
) -> Records:
    """Read a chunk.

    Args:
        data: The chunk, not compressed.
        topic_ids: Only messages of these topics; None for all.
        start_time: Only messages that were recorded at this time or later, in nanoseconds.
        end_time: Only messages that were recorded before this time; None for no end.

    Raises:
        RecordsError: The chunk is damaged.
    """
    view = memoryview(data).cast("B")
    ids, sequences, log_times, publish_times, ranges, others = _core.read_records(
        view, topic_ids, *_time_range(start_time, end_time)
    )
    return Records(
        view,
        memoryview(ids).cast("H"),
        memoryview(sequences).cast("I"),
        memoryview(log_times).cast("Q"),
        memoryview(publish_times).cast("Q"),
        memoryview(ranges).cast("Q"),
        tuple((opcode, view[first:last]) for opcode, first, last in others),
    )


@dataclass(frozen=True)
class RecordIndex:
    """What is in a chunk, for those who look for messages of a topic or of a time.

    Attributes:
        data: The MessageIndex records of the chunk (https://mcap.dev/spec#message-index-op0x07), one after the other:
            one for each topic that has messages, in the order of topic ids. Their entries are sorted by log time.
        places: Where in `data` the record of each topic begins, by topic id.
        message_counts: How many messages of each topic there are, by topic id.
        start_time: When the first message was recorded, in nanoseconds; 0 without messages.
        end_time: When the last message was recorded, in nanoseconds; 0 without messages.
    """

    data: bytes = field(repr=False)
    places: Mapping[int, int]
    message_counts: Mapping[int, int]
    start_time: int
    end_time: int


def index_records(data: Buffer) -> RecordIndex:
    """Index a chunk, not compressed, as MCAP wants it.

    Raises:
        RecordsError: The chunk is damaged, or larger than 2^32 - 1 bytes.
    """
    return RecordIndex(*_core.index_records(data))


class Direction(enum.Enum):
    """From which serialization format messages are transcoded to which other one."""

    CDR_TO_PROTO = "cdr_to_proto"
    PROTO_TO_CDR = "proto_to_cdr"
    ROS1_TO_PROTO = "ros1_to_proto"


@dataclass(frozen=True)
class Route:
    """What becomes of the messages of one topic.

    Attributes:
        topic_id: The topic id in the result.
        transcoder: What transcodes them; None: they are copied as they are.
        direction: How it transcodes them.
        failed_topic_id: Messages that cannot be transcoded are copied as they are, with this topic id; None: they are
            left out.
    """

    topic_id: int
    transcoder: Transcoder | None = None
    direction: Direction = Direction.CDR_TO_PROTO
    failed_topic_id: int | None = None


@dataclass(frozen=True)
class Failure:
    """A message that could not be transcoded.

    Attributes:
        topic_id: Its topic id in the chunk that was converted.
        log_time: When it was recorded, in nanoseconds.
        sequence: Its sequence number.
        index: Which message of the chunk it was, counted from 0.
        error: What is wrong with it: what the transcoder raises for it, or a converter plugin.
    """

    topic_id: int
    log_time: int
    sequence: int
    index: int
    error: Error


@dataclass(frozen=True)
class Converted:
    """A chunk that was converted.

    Attributes:
        data: The new chunk: messages only, in the order of the old one.
        message_count: How many messages it has.
        failure_counts: How many messages of each topic could not be transcoded, by the topic id in the old chunk.
        failures: The first `KEPT_FAILURES` of them, in the order of the old chunk.
    """

    data: memoryview = field(repr=False)
    message_count: int
    failure_counts: Mapping[int, int]
    failures: Sequence[Failure]


class RecordConverter(_core.RecordConverter):
    """Converts chunks: each message is transcoded, copied or left out, as the route of its topic says.

    It may be used by many threads at once, each with a chunk of its own.

    Args:
        routes: What becomes of the messages of each topic, by topic id; None: they are left out.
    """

    def __init__(self, routes: Mapping[int, Route | None]) -> None:
        super().__init__([(topic_id, *_row(route)) for topic_id, route in routes.items()])

    def convert(self, data: Buffer, *, start_time: int = 0, end_time: int | None = None) -> Converted:
        """Convert a chunk. Records that are no messages are left out.

        Args:
            data: The chunk, not compressed.
            start_time: Only messages that were recorded at this time or later, in nanoseconds.
            end_time: Only messages that were recorded before this time; None for no end.

        Raises:
            RecordsError: The chunk is damaged, has a message of a topic that has no route, or its result would be
                larger than 2^32 - 1 bytes.
        """
        memory, message_count, counts, failures = self._convert(data, *_time_range(start_time, end_time))
        return Converted(
            memoryview(memory), message_count, counts, tuple(Failure(*each) for each in failures)
        )


_Row = tuple[str, int, Transcoder | None, int | None]


def _row(route: Route | None) -> _Row:
    """Return a route as the native module takes it: what to do, topic id, transcoder, topic id of what fails."""
    if route is None:
        return "leave_out", 0, None, None
    if route.transcoder is None:
        return "copy", route.topic_id, None, None
    return route.direction.value, route.topic_id, route.transcoder, route.failed_topic_id


def _time_range(start_time: int, end_time: int | None) -> tuple[int, int | None]:
    """Return a range of times in which there are only log times; None for no end."""
    if start_time >= NO_END:
        return 0, 0
    if end_time is not None and end_time >= NO_END:
        end_time = None
    return max(start_time, 0), None if end_time is None else max(end_time, 0)
