"""Topics of bags as tables: record batches of Arrow, and files of them.

Needs pyarrow: `pip install 'rosidl-adapter-proto[tables]'`.
"""

from __future__ import annotations

import array
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from rosidl_adapter_proto.bags.bag import Bag, open_bag
from rosidl_adapter_proto.bags.model import Topic, message_place
from rosidl_adapter_proto.bags.order import Run
from rosidl_adapter_proto.bags.output import check_new, written_aside
from rosidl_adapter_proto.bags.places import find_place, written_locally
from rosidl_adapter_proto.bags.storage import StorageReader
from rosidl_adapter_proto.bags.table_files import format_of, open_table
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.schema.registry import Schema
from rosidl_adapter_proto.transcode.arrow import MAXIMUM_BYTES, MAXIMUM_ROWS, ColumnReader, pa
from rosidl_adapter_proto.transcode.columns import SERIALIZATIONS
from rosidl_adapter_proto.transcode.error import TranscodeError
from rosidl_adapter_proto.transcode.plan import chosen_names
from rosidl_adapter_proto.transcode.records import Records

if TYPE_CHECKING:
    from rosidl_adapter_proto.time import Time

LOG_TIME = "log_time"
PUBLISH_TIME = "publish_time"

_THREADS = min(4, os.cpu_count() or 1)  # decompressing keeps no more of them busy while one fills columns


def table_reader(
    bag: Bag | str | os.PathLike[str],
    topic: str,
    *,
    fields: Iterable[str] | None = None,
    start: Time | None = None,
    end: Time | None = None,
    maximum_rows: int = MAXIMUM_ROWS,
    maximum_bytes: int = MAXIMUM_BYTES,
) -> pa.RecordBatchReader:
    """Return a reader of the messages of a topic, which Arrow's libraries take: one row for each message.

    The columns are when a message was recorded and when it was sent, `log_time` and `publish_time`, and then the fields
    of the message (`ColumnReader`). Where the message has a field of such a name itself, the first get an underscore
    before their names. Rows come in the order in which messages were recorded, and are read when they are asked for.

    Args:
        bag: The bag, or where it is.
        topic: The name of the topic.
        fields: Read only these fields, such as `["header.stamp", "linear_acceleration"]`.
        start: Messages that were recorded at this time or later: nanoseconds since 1970, a `datetime` with a time zone,
            or anything else that `rosidl_adapter_proto.time` takes.
        end: Messages that were recorded before this time.
        maximum_rows: A record batch has so many rows at most.
        maximum_bytes: A record batch ends with the row with which it has so many bytes.

    Raises:
        BagError: Nothing is known of the type of the topic; or, while messages are read, a file is damaged or a message
            is not valid.
        RequestError: There is no such topic.
        SchemaError: The type has no such field.
        TypeError: A time is none, or `fields` is one text.
    """
    bag = bag if isinstance(bag, Bag) else open_bag(bag)
    runs = bag.runs([topic], start=start, end=end, threads=_THREADS)
    rows = _Rows(bag, topic, fields, maximum_rows, maximum_bytes)
    return pa.RecordBatchReader.from_batches(rows.arrow_schema, rows.record_batches(runs))


def record_batches(
    bag: Bag | str | os.PathLike[str],
    topic: str,
    *,
    fields: Iterable[str] | None = None,
    start: Time | None = None,
    end: Time | None = None,
    maximum_rows: int = MAXIMUM_ROWS,
    maximum_bytes: int = MAXIMUM_BYTES,
) -> Iterator[pa.RecordBatch]:
    """Return an iterator over the record batches of a topic; arguments and errors are those of `table_reader`."""
    reader = table_reader(
        bag,
        topic,
        fields=fields,
        start=start,
        end=end,
        maximum_rows=maximum_rows,
        maximum_bytes=maximum_bytes,
    )
    return iter(reader)


def write_table(
    bag: Bag | str | os.PathLike[str],
    topic: str,
    output: str | os.PathLike[str],
    *,
    file_format: str | None = None,
    fields: Iterable[str] | None = None,
    start: Time | None = None,
    end: Time | None = None,
    progress: Callable[[int], None] | None = None,
) -> int:
    """Write the messages of a topic to a file, which appears when it is complete.

    Args:
        bag: As for `table_reader`.
        topic: As for `table_reader`.
        output: The file, by a path or a URL; nothing may be there.
        file_format: `parquet`, `arrow` or `csv`; by default what the suffix of the file says: `.parquet`, `.arrow`,
            `.feather` or `.csv`.
        fields: As for `table_reader`.
        start: As for `table_reader`.
        end: As for `table_reader`.
        progress: Called with a number of rows once they are written.

    Returns:
        The number of rows.

    Raises:
        RequestError: The suffix says nothing, or there is no such format.
        BagError: As for `table_reader`, or the file exists or cannot be written.
        SchemaError: As for `table_reader`.
        TypeError: As for `table_reader`.
    """
    path = find_place(output)
    chosen = format_of(path, file_format)
    check_new(path)
    reader = table_reader(bag, topic, fields=fields, start=start, end=end)
    count = 0
    with (
        written_aside(path, is_folder=False) as place,
        written_locally(place) as local,
        open_table(local, chosen, reader.schema) as table,
    ):
        for batch in reader:
            table.write(batch)
            count += batch.num_rows
            if progress is not None:
                progress(batch.num_rows)
    return count


class _Rows:
    """Makes record batches of the messages of one topic.

    Attributes:
        arrow_schema: Their columns.
    """

    def __init__(
        self, bag: Bag, topic: str, fields: Iterable[str] | None, maximum_rows: int, maximum_bytes: int
    ) -> None:
        self._topic = topic
        limits = {"maximum_rows": maximum_rows, "maximum_bytes": maximum_bytes}
        self._readers, columns = _column_readers(bag, topic, fields, limits)
        self._log_times, self._publish_times = bytearray(), bytearray()
        self._count = 0
        names = (_free_name(each, columns.names) for each in (LOG_TIME, PUBLISH_TIME))
        times = [pa.field(each, pa.timestamp("ns", "UTC"), nullable=False) for each in names]
        self.arrow_schema = pa.schema([*times, *columns])

    def record_batches(self, runs: Iterator[tuple[StorageReader, Run]]) -> Iterator[pa.RecordBatch]:
        """Yield record batches of runs of messages."""
        before: ColumnReader | None = None
        for file, run in runs:
            for reader, indexes in self._parts(file.path, run):
                if before is not None and before is not reader and len(before):
                    yield self._record_batch(before)
                before = reader
                yield from self._append(reader, file.path, run.records, indexes)
        if before is not None and len(before):
            yield self._record_batch(before)

    def _parts(self, path: str, run: Run) -> Iterator[tuple[ColumnReader, Sequence[int]]]:
        """Yield the parts of a run, and what reads each: mostly one part, since topics seldom change their type."""
        first_reader, *others = set(self._readers.values())
        if not others:
            yield first_reader, run.indexes
            return
        readers = [self._readers[path, run.records.topic_ids[index]] for index in run.indexes]
        first = 0
        for last in range(1, len(readers) + 1):
            if last == len(readers) or readers[last] is not readers[first]:
                yield readers[first], run.indexes[first:last]
                first = last

    def _append(
        self, reader: ColumnReader, path: str, records: Records, indexes: Sequence[int]
    ) -> Iterator[pa.RecordBatch]:
        """Append messages, and yield record batches that are full."""
        ranges = _chosen(records.ranges, indexes, 2)
        log_times = _chosen(records.log_times, indexes)
        publish_times = _chosen(records.publish_times, indexes)
        start = 0
        while start < len(indexes):
            try:
                stop = reader.append(records.data, ranges=ranges, start=start)
            except TranscodeError as error:
                index = error.batch_index or 0
                error.batch_index = None
                number = self._count + index - start + 1
                place = message_place(path, number, self._topic, log_times[index])
                raise BagError(f"{place}: {error}") from error
            self._log_times += log_times[start:stop].cast("B")
            self._publish_times += publish_times[start:stop].cast("B")
            self._count += stop - start
            if stop < len(indexes):
                yield self._record_batch(reader)
            start = stop

    def _record_batch(self, reader: ColumnReader) -> pa.RecordBatch:
        batch = reader.record_batch()
        times = [_timestamps(each, self._topic) for each in (self._log_times, self._publish_times)]
        self._log_times, self._publish_times = bytearray(), bytearray()
        return pa.RecordBatch.from_arrays([*times, *batch.columns], schema=self.arrow_schema)


def _column_readers(
    bag: Bag, topic: str, fields: Iterable[str] | None, limits: Mapping[str, int]
) -> tuple[dict[tuple[str, int], ColumnReader], pa.Schema]:
    """Return what reads the messages of a topic, by file and topic id, and the columns, which all of them have."""
    chosen = chosen_names(fields)
    made: dict[tuple[Schema, str], ColumnReader] = {}
    readers: dict[tuple[str, int], ColumnReader] = {}
    for file in bag.files:
        for topic_id, each in file.topics.items():
            if each.name != topic:
                continue
            key = bag.types.schema(each), _serialization_format(each)
            if key not in made:
                made[key] = ColumnReader(key[0], chosen, serialization_format=key[1], **limits)
            readers[file.path, topic_id] = made[key]
    columns, *others = (each.arrow_schema for each in made.values())
    if any(each != columns for each in others):
        types = " and ".join(f"{schema.type_name} ({schema.type_hash})" for schema, _ in made)
        raise BagError(
            f"{bag.path}: {topic} has messages of several types, whose columns are not the same: {types}; choose "
            "fields that are the same in all of them"
        )
    return readers, columns


def _serialization_format(topic: Topic) -> str:
    if topic.serialization_format not in SERIALIZATIONS:
        raise BagError(
            f"topic {topic.name}: its messages are {topic.serialization_format}, which cannot be read as a table; "
            f"{', '.join(SERIALIZATIONS)} can"
        )
    return topic.serialization_format


def _free_name(name: str, taken: Collection[str]) -> str:
    """Return a name for a column of ours: those of the message come first."""
    while name in taken:
        name = f"_{name}"
    return name


def _chosen(numbers: memoryview, indexes: Sequence[int], width: int = 1) -> memoryview:
    """Return the numbers of some messages, each of which has `width` of them: without a copy if they lie together."""
    if isinstance(indexes, range):
        return numbers[indexes.start * width : indexes.stop * width]
    pairs = (numbers[index * width + each] for index in indexes for each in range(width))
    return memoryview(array.array("Q", pairs))


def _timestamps(nanoseconds: bytearray, topic: str) -> pa.Array:
    times = pa.Array.from_buffers(pa.uint64(), len(nanoseconds) // 8, [None, pa.py_buffer(nanoseconds)])
    try:
        return times.cast(pa.int64()).view(pa.timestamp("ns", "UTC"))
    except pa.ArrowInvalid:
        latest = max(memoryview(nanoseconds).cast("Q"))
        raise BagError(
            f"a message of {topic} has the time {latest}, and no timestamp goes beyond {2**63 - 1} (the year 2262)"
        ) from None
