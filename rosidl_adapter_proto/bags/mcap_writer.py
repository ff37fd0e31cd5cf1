"""Writes MCAP files (https://mcap.dev/spec) from the front to the end, without seeking, so that any file will do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, BinaryIO

from isal.isal_zlib import crc32
from mcap import records
from mcap.opcode import Opcode

import rosidl_adapter_proto
from rosidl_adapter_proto.bags.compression import COMPRESSIONS, compress
from rosidl_adapter_proto.bags.mcap_records import CHUNK_HEAD, MAGIC, RECORD_HEAD, write
from rosidl_adapter_proto.bags.mcap_topics import (
    ROS_DEFINITIONS,
    other_definition_name,
    write_channel,
    write_ros_definition,
    write_schema,
)
from rosidl_adapter_proto.bags.model import Attachment, RecordedDefinition, Statistics, Topic
from rosidl_adapter_proto.bags.storage import MCAP
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.records import RecordIndex, index_records

if TYPE_CHECKING:
    from typing_extensions import Buffer

    from rosidl_adapter_proto.bags.storage import PackedChunk

_MAXIMUM_ID = 2**16 - 1

# The groups of the summary, in the order of the official writers.
_GROUPS = (
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.STATISTICS,
    Opcode.CHUNK_INDEX,
    Opcode.ATTACHMENT_INDEX,
    Opcode.METADATA_INDEX,
)


@dataclass(frozen=True)
class PackedMcapChunk:
    """A chunk ready to be written."""

    data: Buffer = field(repr=False)
    size: int
    crc: int
    index: RecordIndex

    @property
    def message_count(self) -> int:
        """How many messages it has."""
        return sum(self.index.message_counts.values())


class McapWriter:
    """One MCAP file, open for writing; see `StorageWriter`.

    A file that is not finished can be read up to its last whole chunk: what is needed for a chunk is in front of it.

    Args:
        file: The file, which is written from the front to the end. It is closed with the writer.
        path: The file, for people.
        profile: `ros2` for CDR alone, else empty: the profile makes CDR mandatory (https://mcap.dev/spec/registry#ros2).
        compression: `zstd`, `lz4` or empty.

    Raises:
        BagError: There is no such compression.
    """

    storage = MCAP

    def __init__(self, file: BinaryIO, path: str, *, profile: str, compression: str = "") -> None:
        if compression not in COMPRESSIONS:
            raise BagError(f"the compression `{compression}` is unknown to MCAP; these are known: zstd, lz4")
        self.path = path
        self.compression = compression
        self._file = file
        self._size = 0
        self._topics: dict[int, Topic] = {}
        self._new_topics: dict[int, Topic] = {}
        self._schema_ids: dict[tuple[str, str, bytes], int] = {}
        self._definitions: dict[str, RecordedDefinition] = {}  # by their names in ROS_DEFINITIONS
        self._summary: dict[Opcode, bytearray] = {group: bytearray() for group in _GROUPS}
        self._statistics = records.Statistics(0, 0, {}, 0, 0, 0, 0, 0, 0)
        self._write(MAGIC)
        library = f"rosidl_adapter_proto {rosidl_adapter_proto.__version__}"
        self._write(write(records.Header(profile=profile, library=library)))

    @property
    def statistics(self) -> Statistics:
        """What was written so far."""
        counted = self._statistics
        return Statistics(
            dict(counted.channel_message_counts), counted.message_start_time, counted.message_end_time
        )

    def add_topic(self, topic: Topic, topic_id: int | None = None) -> int:
        """Add a topic; see `StorageWriter.add_topic`. It is written in front of the next chunk.

        Raises:
            BagError: The id is taken, or there are more topics than MCAP has ids.
        """
        if topic_id is None:
            topic_id = max(self._topics, default=0) + 1
        if topic_id in self._topics:
            raise BagError(f"{self.path}: the topic id {topic_id} of `{topic.name}` is taken")
        if not 0 <= topic_id <= _MAXIMUM_ID:
            raise BagError(
                f"{self.path}: `{topic.name}` has the topic id {topic_id}, and MCAP has ids up to {_MAXIMUM_ID}"
            )
        self._topics[topic_id] = self._new_topics[topic_id] = topic
        return topic_id

    def pack(self, records: Buffer) -> PackedMcapChunk:
        """Return a chunk ready to be written; see `StorageWriter.pack`."""
        return PackedMcapChunk(
            compress(records, self.compression),
            memoryview(records).nbytes,
            crc32(records),
            index_records(records),
        )

    def write(self, chunk: PackedChunk) -> None:
        """Write a chunk, unless it is empty.

        Raises:
            BagError: It has messages of a topic that was not added.
        """
        assert isinstance(chunk, PackedMcapChunk)
        if not chunk.message_count:
            return
        unknown = chunk.index.message_counts.keys() - self._topics.keys()
        if unknown:
            raise BagError(f"{self.path}: there are messages of topic id {min(unknown)}, which was not added")
        self._write_topics()
        index, compression = chunk.index, self.compression.encode()
        start, data_size = self._size, memoryview(chunk.data).nbytes
        head = CHUNK_HEAD.pack(index.start_time, index.end_time, chunk.size, chunk.crc, len(compression))
        head += compression + data_size.to_bytes(8, "little")
        self._write(RECORD_HEAD.pack(Opcode.CHUNK, len(head) + data_size) + head)
        self._write(chunk.data)
        index_start = self._size
        self._write(index.data)
        self._summary[Opcode.CHUNK_INDEX] += write(
            records.ChunkIndex(
                chunk_length=index_start - start,
                chunk_start_offset=start,
                compression=self.compression,
                compressed_size=data_size,
                message_end_time=index.end_time,
                message_index_length=self._size - index_start,
                message_index_offsets={
                    topic_id: index_start + place for topic_id, place in index.places.items()
                },
                message_start_time=index.start_time,
                uncompressed_size=chunk.size,
            )
        )
        self._count(index)

    def add_attachment(self, attachment: Attachment) -> None:
        """Write an attachment."""
        start = self._size
        self._write(
            write(
                records.Attachment(
                    create_time=attachment.create_time,
                    log_time=attachment.log_time,
                    name=attachment.name,
                    media_type=attachment.media_type,
                    data=attachment.data,
                )
            )
        )
        self._summary[Opcode.ATTACHMENT_INDEX] += write(
            records.AttachmentIndex(
                offset=start,
                length=self._size - start,
                log_time=attachment.log_time,
                create_time=attachment.create_time,
                data_size=len(attachment.data),
                name=attachment.name,
                media_type=attachment.media_type,
            )
        )
        self._statistics.attachment_count += 1

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        start = self._size
        self._write(write(records.Metadata(name=name, metadata=dict(values))))
        index = records.MetadataIndex(offset=start, length=self._size - start, name=name)
        self._summary[Opcode.METADATA_INDEX] += write(index)
        self._statistics.metadata_count += 1

    def finish(self) -> None:
        """Write the summary, and close the file."""
        self._write_topics()
        self._write(write(records.DataEnd(data_section_crc=0)))
        self._summary[Opcode.STATISTICS] += write(self._statistics)
        summary_start = self._size
        summary, offsets = bytearray(), bytearray()
        for opcode, group in self._summary.items():
            # No offset for what is not there: rosbag2 takes an empty group for damage.
            if group:
                start = summary_start + len(summary)
                offsets += write(
                    records.SummaryOffset(group_opcode=opcode, group_start=start, group_length=len(group))
                )
                summary += group
        offset_start = summary_start + len(summary)
        footer = write(records.Footer(summary_start, offset_start, 0))[:-4]
        summary += offsets + footer
        self._write(summary)
        self._write(crc32(summary).to_bytes(4, "little"))
        self._write(MAGIC)
        self._file.close()

    def __enter__(self) -> McapWriter:
        return self

    def __exit__(self, *exception: object) -> None:
        self._file.close()

    def _write(self, data: Buffer) -> None:
        self._file.write(data)
        self._size += memoryview(data).nbytes

    def _write_topics(self) -> None:
        """Write the topics that were added since the last chunk, and ROS's definitions of their types."""
        definitions = {}
        for topic_id, topic in self._new_topics.items():
            schema_id = self._write_schema(topic)
            channel = write(write_channel(topic, topic_id, schema_id))
            self._write(channel)
            self._summary[Opcode.CHANNEL] += channel
            self._statistics.channel_count += 1
            name, definition = topic.type_name, topic.ros_definition
            if self._definitions.get(name, definition) != definition:
                name = other_definition_name(name, schema_id)
            if definition.encoding and name not in self._definitions:
                self._definitions[name] = definition
                definitions[name] = write_ros_definition(definition)
        if definitions:
            self.add_metadata(ROS_DEFINITIONS, definitions)
        self._new_topics = {}

    def _write_schema(self, topic: Topic) -> int:
        """Return the id of the schema of a topic, which is written unless it was; 0 if there is none."""
        schema = write_schema(topic)
        key = (schema.name, schema.encoding, schema.data)
        if not any(key):
            return 0
        if key not in self._schema_ids:
            schema.id = self._schema_ids[key] = len(self._schema_ids) + 1
            self._write(write(schema))
            self._summary[Opcode.SCHEMA] += write(schema)
            self._statistics.schema_count += 1
        return self._schema_ids[key]

    def _count(self, index: RecordIndex) -> None:
        """Count the messages of a chunk."""
        counted = self._statistics
        first = not counted.message_count
        counted.chunk_count += 1
        for topic_id, count in index.message_counts.items():
            counted.message_count += count
            counted.channel_message_counts[topic_id] = counted.channel_message_counts.get(topic_id, 0) + count
        counted.message_start_time = (
            index.start_time if first else min(counted.message_start_time, index.start_time)
        )
        counted.message_end_time = max(counted.message_end_time, index.end_time)
