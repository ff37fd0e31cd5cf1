"""ROS 1 bags, reading: version 2.0 of http://wiki.ros.org/Bags/Format.

Messages are in chunks; a topic has a connection for each of its publishers. At the end of a bag is an index, unless its
recorder was killed: then the bag is read once more, to find out what is in it.
"""

from __future__ import annotations

import bz2
import struct
from array import array
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import BinaryIO

from rosidl_adapter_proto.bags.compression import records_of
from rosidl_adapter_proto.bags.model import (
    EVERYTHING,
    ROS1,
    Attachment,
    RecordedDefinition,
    Selection,
    Statistics,
    StoredChunk,
    Topic,
)
from rosidl_adapter_proto.bags.ros1_records import Operation, Record, Source, read_fields
from rosidl_adapter_proto.bags.storage import CHUNK_SIZE, ROSBAG, SALVAGE
from rosidl_adapter_proto.bags.warning_list import WarningList
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.records import pack_records

_MAGIC = b"#ROSBAG V2.0\n"
_KEPT_FIELDS = ("md5sum", "latching")
_MAXIMUM_TOPIC_COUNT = 2**16 - 1


@dataclass
class _Contents:
    """What is in a bag.

    Attributes:
        topics: The topics by their ids.
        topic_ids: The ids of topics, by the numbers of their connections.
        counts: How many messages each topic has.
        times: When the first and the last message were recorded; empty without messages.
        chunk_times: When the first and the last message of each chunk were recorded, by its place in the file.
        loose_start: When the first message that is in no chunk was recorded; None if there is none.
    """

    topics: dict[int, Topic] = field(default_factory=dict)
    topic_ids: dict[int, int] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    times: tuple[int, ...] = ()
    chunk_times: dict[int, tuple[int, int]] = field(default_factory=dict)
    loose_start: int | None = None
    _known: dict[tuple[str, str, bytes], int] = field(default_factory=dict)

    def topic_id(self, number: int, where: str) -> int:
        if number not in self.topic_ids:
            raise BagError(f"{where}: damaged: messages of connection {number}, which is not in the bag")
        return self.topic_ids[number]

    def add_connection(self, record: Record) -> None:
        number = record.number(b"conn")
        if number in self.topic_ids:  # each is among the messages, and again in the index
            return
        topic = _topic(record)
        key = topic.name, topic.type_name, topic.definition.data
        topic_id = self._known.setdefault(key, len(self.topics) + 1)
        if topic_id > _MAXIMUM_TOPIC_COUNT:
            raise BagError(f"{record.where}: more than {_MAXIMUM_TOPIC_COUNT} topics")
        self.topics.setdefault(topic_id, topic)
        self.topic_ids[number] = topic_id
        self.counts.setdefault(topic_id, 0)

    def add_messages(self, number: int, count: int, where: str) -> None:
        self.counts[self.topic_id(number, where)] += count

    def add_times(self, *times: int) -> None:
        if times:
            self.times = min(self.times + times), max(self.times + times)


@dataclass
class _Messages:
    """Messages that become a chunk."""

    topic_ids: array[int] = field(default_factory=lambda: array("H"))
    times: array[int] = field(default_factory=lambda: array("Q"))
    data: list[memoryview] = field(default_factory=list)
    size: int = 0

    def add(self, record: Record, contents: _Contents) -> None:
        topic_id, time = contents.topic_id(record.number(b"conn"), record.where), record.time(b"time")
        self.topic_ids.append(topic_id)
        self.times.append(time)
        self.data.append(record.data())
        self.size += record.size

    def chunk(self, where: str, position: int) -> StoredChunk:
        count = len(self.data)
        data = pack_records(self.topic_ids, array("I", bytes(4 * count)), self.times, self.times, self.data)
        return StoredChunk(where, data, "", len(data), 0, min(self.times), max(self.times), count, position)


class Ros1Reader:
    """A ROS 1 bag, open for reading; see `StorageReader`.

    Types have names like those of ROS 2 (`std_msgs/msg/String`), and the definitions of ROS 1. The connections of a
    topic are one topic here, if their types are the same.

    Args:
        file: The bag, open for reading.
        path: The bag, for people.
        salvage: Leave damaged parts out, and say so in `warnings`, instead of raising an error.

    Raises:
        BagError: It is no ROS 1 bag of version 2.0, or is encrypted or damaged.
    """

    storage = ROSBAG

    def __init__(self, file: BinaryIO, path: str, *, salvage: bool = False) -> None:
        self.path = path
        self.metadata: Sequence[tuple[str, Mapping[str, str]]] = ()
        self.warnings = WarningList()
        self.is_damaged = False
        self._file = file
        self._source = Source(path, file.seek(0, 2), self._read)
        self._contents = _Contents()
        index = self._read_header()
        self._tolerant = not index
        if not index:
            self.warnings.add(
                f"{path}: without an index, as its recorder did not finish; read from its beginning"
            )
        elif not self._read_index(index, salvage):
            index = 0
        self._tolerant |= salvage
        if not index:
            self._scan()
        self.topics: Mapping[int, Topic] = self._contents.topics
        self.statistics = Statistics(self._contents.counts, *(self._contents.times or (0, 0)))

    def __enter__(self) -> Ros1Reader:
        return self

    def __exit__(self, *exception: object) -> None:
        self._file.close()

    def attachments(self) -> Iterator[Attachment]:
        """Yield nothing: a ROS 1 bag has none."""
        return iter(())

    def chunks(
        self, selection: Selection = EVERYTHING, *, in_time_order: bool = False
    ) -> Iterator[StoredChunk]:
        """Yield the chunks of the bag whose times a selection has; see `StorageReader.chunks`.

        Raises:
            BagError: The bag is damaged; the message says where.
        """
        if in_time_order:
            yield from self._chunks_in_time_order(selection)
            return
        for record in self._records(len(_MAGIC)):
            if record.operation == Operation.CHUNK and self._selected(record.place, selection):
                yield from self._chunk(record)
        if self._contents.loose_start is not None:
            yield from self._loose_chunks(CHUNK_SIZE)

    def _chunks_in_time_order(self, selection: Selection) -> Iterator[StoredChunk]:
        starts = {place: times[0] for place, times in self._contents.chunk_times.items()}
        loose = self._contents.loose_start
        if loose is not None:
            starts[self._source.size] = loose
        for place in sorted(starts, key=starts.__getitem__):
            if place == self._source.size:
                yield from self._loose_chunks(self._source.size)  # as one, since others may lie between
            elif self._selected(place, selection):
                try:
                    chunk = self._source.record(place)
                except BagError as error:
                    self._tolerate(error, "it is left out")
                else:
                    yield from self._chunk(chunk)

    def _chunk(self, chunk: Record) -> Iterator[StoredChunk]:
        messages = _Messages()
        for record in self._inside(chunk):
            self._add(record, messages)
        if messages.data:
            yield messages.chunk(chunk.where, chunk.place)

    def _loose_chunks(self, size: int) -> Iterator[StoredChunk]:
        """Yield the messages of the chunk that the recorder was writing when it was killed: they are in no chunk."""
        messages = _Messages()
        for record in self._records(len(_MAGIC)):
            self._add(record, messages)
            if messages.size >= size:
                yield messages.chunk(record.where, record.place)
                messages = _Messages()
        if messages.data:
            yield messages.chunk(f"{self.path}, the messages at its end", self._source.size)

    def _add(self, record: Record, messages: _Messages) -> None:
        if record.operation == Operation.MESSAGE:
            try:
                messages.add(record, self._contents)
            except BagError as error:
                self._tolerate(error, "it is left out")

    def _selected(self, place: int, selection: Selection) -> bool:
        first, last = self._contents.chunk_times.get(place, (selection.start_time, selection.start_time))
        return last >= selection.start_time and (selection.end_time is None or first < selection.end_time)

    def _records(self, start: int) -> Iterator[Record]:
        """Yield the records of the file from a place on."""
        try:
            yield from self._source.records(start)
        except BagError as error:
            self._tolerate(error, "what follows there is left out")

    def _inside(self, chunk: Record) -> Iterator[Record]:
        """Yield the records in a chunk."""
        try:
            yield from _chunk_records(chunk)
        except BagError as error:
            self._tolerate(error, "what follows there is left out")

    def _tolerate(self, error: BagError, consequence: str) -> None:
        """Say what is damaged, instead of raising an error, if the bag is to be salvaged or not finished anyway."""
        if not self._tolerant:
            raise error
        self.is_damaged = True
        self.warnings.add(f"{error}; {consequence}")

    def _read(self, start: int, size: int) -> memoryview:
        self._file.seek(start)
        data = self._file.read(size)
        if len(data) != size:
            raise BagError(f"{self.path}: became shorter while it was read")
        return memoryview(data)

    def _read_header(self) -> int:
        """Read the header of the bag, and return where its index is; 0 if there is none."""
        magic = bytes(self._read(0, min(len(_MAGIC), self._source.size)))
        if magic != _MAGIC:
            name = magic.split(b"\n")[0].decode("ascii", "replace")
            raise BagError(f"{self.path}: no ROS 1 bag of version 2.0: it begins with {name!r}")
        record = self._source.record(len(_MAGIC))
        if record.operation != Operation.BAG:
            raise BagError(f"{record.where}: damaged: the header of the bag is missing")
        encryptor = record.fields.get(b"encryptor", b"").decode("ascii", "replace")
        if encryptor:
            raise BagError(f"{self.path}: encrypted with {encryptor}; `rosbag decrypt` of ROS 1 decrypts it")
        return record.number(b"index_pos", 8)

    def _read_index(self, start: int, salvage: bool) -> bool:
        """Return whether the index says what is in the bag; to salvage a bag, a damaged one does not."""
        try:
            self._add_index(start)
        except BagError as error:
            if not salvage:
                raise BagError(f"{error}; {SALVAGE} what is whole") from error
            self._contents = _Contents()
            self._tolerant = True
            self._tolerate(error, "read from its beginning, without the index")
        return not self.is_damaged

    def _add_index(self, start: int) -> None:
        if start > self._source.size:
            size = self._source.size
            raise BagError(
                f"{self.path}: cut off: its index should be at byte {start}, but it has {size} bytes"
            )
        infos: list[Record] = []
        for record in self._records(start):
            if record.operation == Operation.CONNECTION:
                self._contents.add_connection(record)
            elif record.operation == Operation.CHUNK_INFO:
                infos.append(record)
        for info in infos:
            self._add_chunk_info(info)

    def _add_chunk_info(self, info: Record) -> None:
        if info.size % 8:
            raise BagError(f"{info.where}: damaged: {info.size} bytes of counts, which have 8 bytes each")
        times = info.time(b"start_time"), info.time(b"end_time")
        self._contents.chunk_times[info.number(b"chunk_pos", 8)] = times
        for number, count in struct.iter_unpack("<II", info.data()):
            self._contents.add_messages(number, count, info.where)
            self._contents.add_times(*times)

    def _scan(self) -> None:
        """Find out what is in a bag without an index."""
        counts: Counter[int] = Counter()
        for record in self._records(len(_MAGIC)):
            in_chunk = record.operation == Operation.CHUNK
            times: tuple[int, ...] = ()
            for inner in self._inside(record) if in_chunk else (record,):
                try:
                    if inner.operation == Operation.CONNECTION:
                        self._contents.add_connection(inner)
                    elif inner.operation == Operation.MESSAGE:
                        number, time = inner.number(b"conn"), inner.time(b"time")
                        counts[number] += 1
                        times = min((time, *times)), max((time, *times))
                except BagError as error:
                    self._tolerate(error, "it is left out")
            if times and in_chunk:
                self._contents.chunk_times[record.place] = times[0], times[1]
            elif times:
                known = self._contents.loose_start
                self._contents.loose_start = times[0] if known is None else min(times[0], known)
            self._contents.add_times(*times)
        for number, count in counts.items():
            if number in self._contents.topic_ids:
                self._contents.add_messages(number, count, self.path)


def _chunk_records(chunk: Record) -> Iterator[Record]:
    """Yield the records in a chunk, decompressed."""
    plain = _decompressed(chunk)
    return Source(
        f"{chunk.where}, in the chunk", len(plain), lambda start, size: plain[start : start + size]
    ).records(0)


def _decompressed(chunk: Record) -> memoryview:
    compression = chunk.fields.get(b"compression", b"").decode("ascii", "replace")
    size = chunk.number(b"size")
    if compression == "bz2":
        try:
            data = bz2.BZ2Decompressor().decompress(chunk.data(), max_length=size + 1)
        except (OSError, EOFError) as error:
            raise BagError(
                f"{chunk.where}: the chunk is damaged: it cannot be decompressed: {error}"
            ) from None
        if len(data) != size:
            raise BagError(f"{chunk.where}: the chunk is damaged: it has {len(data)} bytes and says {size}")
        return memoryview(data)
    if compression not in ("none", "lz4"):
        raise BagError(
            f"{chunk.where}: the compression {compression!r} is unknown; these are known: none, bz2, lz4"
        )
    stored = StoredChunk(chunk.where, chunk.data(), compression.removeprefix("none"), size, 0, 0, 0)
    return memoryview(records_of(stored)).cast("B")


def _topic(connection: Record) -> Topic:
    fields = read_fields(connection.data(), connection.where)
    type_name = _text(connection, fields, b"type")
    metadata = {
        name: _text(connection, fields, name.encode()) for name in _KEPT_FIELDS if name.encode() in fields
    }
    return Topic(
        name=_text(connection, connection.fields, b"topic"),
        type_name="/msg/".join(type_name.split("/", 1)),
        serialization_format=ROS1,
        definition=RecordedDefinition("ros1msg", fields.get(b"message_definition", b"")),
        schema_name=type_name,
        metadata=metadata,
    )


def _text(record: Record, fields: Mapping[bytes, bytes], name: bytes) -> str:
    if name not in fields:
        raise BagError(f"{record.where}: damaged: a connection without {name.decode()}")
    try:
        return fields[name].decode()
    except UnicodeDecodeError as error:
        raise BagError(f"{record.where}: {name.decode()} is not UTF-8 at byte {error.start}") from None
