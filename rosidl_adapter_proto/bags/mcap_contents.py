"""What is in an MCAP file besides its messages: from its summary, or where that is missing, from the whole file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING

from mcap import records
from mcap.opcode import Opcode

from rosidl_adapter_proto.bags.compression import COMPRESSIONS, read_chunk
from rosidl_adapter_proto.bags.mcap_records import (
    FOOTER_SIZE,
    KNOWN_OPCODES,
    MAGIC,
    PIECE_SIZE,
    RECORD_HEAD,
    ChunkPlace,
    McapFile,
    RecordPlace,
    opcode_name,
    parse,
)
from rosidl_adapter_proto.bags.model import Statistics, StoredChunk
from rosidl_adapter_proto.errors import BagError

if TYPE_CHECKING:
    from typing_extensions import Buffer

Damaged = Callable[[BagError], None]
"""What is called with each damage that is found: it raises it, or notes it, and then what can be read is read."""

DEFINITIONS = (Opcode.SCHEMA, Opcode.CHANNEL)

# Where a schema, channel, message or chunk may begin, with a length below 2^48: how reading goes on behind what is no
# record. The first three are also what an uncompressed chunk that was cut off has inside.
_CANDIDATE = re.compile(rb"[\x03-\x06].{6}\x00\x00", re.DOTALL)
_BELIEVABLE_RECORDS = 3
# What ends the data: a damaged opcode must not end it sooner.
_END_SIZES: dict[int, int] = {Opcode.DATA_END: 4, Opcode.FOOTER: 20}


@dataclass
class Contents:
    """What is in a file besides its messages.

    Attributes:
        schemas: The schemas, by id.
        channels: The channels, by id.
        metadata: The metadata records, in the order of the file.
        attachments: Where the attachments are.
        statistics: How many messages there are.
        chunk_count: How many chunks the summary says there are; None without a summary.
        chunk_topics: The channels that have messages in a chunk, by the chunk's place, as far as the summary says.
    """

    schemas: dict[int, records.Schema] = field(default_factory=dict)
    channels: dict[int, records.Channel] = field(default_factory=dict)
    metadata: list[records.Metadata] = field(default_factory=list)
    attachments: list[RecordPlace] = field(default_factory=list)
    statistics: Statistics = field(default_factory=Statistics)
    chunk_count: int | None = None
    chunk_topics: dict[int, frozenset[int]] = field(default_factory=dict)


def find_end(file: McapFile) -> int | None:
    """Return the place behind the recording, looked for from the front: garbage may follow.

    Returns:
        None if the recording was not finished, or something is wrong on the way.
    """

    def stop(error: BagError) -> None:
        raise error

    try:
        for found in walk(file, stop):
            if isinstance(found, RecordPlace) and found.opcode == Opcode.FOOTER:
                end = found.end + len(MAGIC)
                return end if end <= file.size and file.read(found.end, end) == MAGIC else None
    except BagError:
        return None
    return None


def read_footer(file: McapFile) -> records.Footer | None:
    """Return the footer, which is at the end of a file that was finished; None where the end is missing."""
    start = file.size - FOOTER_SIZE - len(MAGIC)
    if start < len(MAGIC) or file.read(file.size - len(MAGIC), file.size) != MAGIC:
        return None
    if RECORD_HEAD.unpack(file.read(start, start + RECORD_HEAD.size)) != (Opcode.FOOTER, 20):
        return None
    return file.record(records.Footer, file.place(start, file.size))


def read_summary(file: McapFile, footer: records.Footer) -> Contents | None:
    """Return what the summary says; None if it leaves out some of it, as it may.

    Raises:
        BagError: The summary is damaged, or points to what is not there.
    """
    if not footer.summary_start:
        return None
    end = file.size - FOOTER_SIZE - len(MAGIC)
    if not len(MAGIC) <= footer.summary_start <= end:
        raise BagError(
            f"{file.where(end)}: the summary should begin at byte {footer.summary_start}, where it cannot"
        )
    if footer.summary_crc:
        crc = file.crc(footer.summary_start, file.size - len(MAGIC) - 4)
        if crc != footer.summary_crc:
            raise BagError(
                f"{file.where(footer.summary_start)}: the summary is damaged: its checksum is {crc:#010x} and should be"
                f" {footer.summary_crc:#010x}"
            )
    contents = Contents()
    statistics = None
    # By place: what two indexes point to is there once.
    metadata: dict[int, RecordPlace] = {}
    attachments: dict[int, RecordPlace] = {}
    known_topics: dict[frozenset[int], frozenset[int]] = {}
    for place in file.places(footer.summary_start, end):
        if place.opcode in DEFINITIONS:
            add_definition(
                contents, place.opcode, file.read(place.content, place.end), file.where(place.start)
            )
        elif place.opcode == Opcode.STATISTICS:
            statistics = file.record(records.Statistics, place)
        elif place.opcode == Opcode.METADATA_INDEX:
            offset = file.record(records.MetadataIndex, place).offset
            metadata[offset] = _indexed(file, offset, Opcode.METADATA, place)
        elif place.opcode == Opcode.ATTACHMENT_INDEX:
            offset = file.record(records.AttachmentIndex, place).offset
            attachments[offset] = _indexed(file, offset, Opcode.ATTACHMENT, place)
        elif place.opcode == Opcode.CHUNK_INDEX:
            index = file.record(records.ChunkIndex, place)
            topics = frozenset(index.message_index_offsets)
            if topics:
                contents.chunk_topics[index.chunk_start_offset] = known_topics.setdefault(topics, topics)
    contents.metadata = [file.record(records.Metadata, place) for place in metadata.values()]
    contents.attachments = list(attachments.values())
    if statistics is None or not _complete(contents, statistics):
        return None
    contents.statistics = Statistics(
        statistics.channel_message_counts, statistics.message_start_time, statistics.message_end_time
    )
    if contents.statistics.message_count != statistics.message_count:
        raise BagError(
            f"{file.where(footer.summary_start)}: the summary counts {statistics.message_count} messages, and"
            f" {contents.statistics.message_count} in the sum of its topics"
        )
    contents.chunk_count = statistics.chunk_count
    return contents


def scan(file: McapFile, damaged: Damaged) -> Contents:
    """Return what is in the whole file, which is read once for it."""
    contents = Contents()
    counts: Counter[int] = Counter()
    times: list[int] = []
    for found in walk(file, damaged):
        try:
            if isinstance(found, RecordPlace):
                _add(contents, file, found)
                continue
            chunk = file.stored_chunk(found) if isinstance(found, ChunkPlace) else found
            messages = read_chunk(chunk)
            for opcode, content in messages.others:
                add_definition(contents, opcode, content, chunk.where)
        except BagError as error:
            damaged(error)
            continue
        counts.update(messages.topic_ids)
        if len(messages.log_times):
            times += min(messages.log_times), max(messages.log_times)
    for topic_id in counts.keys() - contents.channels.keys():
        damaged(
            BagError(
                f"{file.path}: {counts[topic_id]} messages are of channel {topic_id}, which is not there"
            )
        )
    contents.statistics = Statistics(dict(counts), min(times, default=0), max(times, default=0))
    return contents


def walk(file: McapFile, damaged: Damaged) -> Iterator[RecordPlace | ChunkPlace | StoredChunk]:
    """Yield what is in a file, in its order: chunks, messages without one, and places of other records.

    Args:
        file: The file.
        damaged: What to do where there is no record; if it returns, the next record is looked for. Behind the
            data, where no messages are lost, it is not called.
    """
    start, in_data = len(MAGIC), True
    while start < file.size:
        try:
            place = file.place(start, file.size)
            found: RecordPlace | ChunkPlace | StoredChunk = place
            following = place.end
            if place.opcode == Opcode.MESSAGE:
                found, following = file.loose_messages(place)
            elif place.opcode == Opcode.CHUNK:
                found = file.chunk(place)
            elif place.opcode in _END_SIZES and place.end - place.content != _END_SIZES[place.opcode]:
                raise file.damaged(place, f"it should have {_END_SIZES[place.opcode]} bytes")
            elif place.opcode == Opcode.MESSAGE_INDEX and (place.end - place.content - 6) % 16:
                raise file.damaged(place, "its last entry is not whole")
            elif place.opcode == Opcode.DATA_END:
                in_data = False
        except BagError as error:
            if not in_data:
                return
            damaged(error)
            start = _find_record(file, start + 1)
            continue
        yield found
        if place.opcode == Opcode.FOOTER:
            return
        start = following


def add_definition(contents: Contents, opcode: int, content: Buffer, where: str) -> None:
    """Add a schema or a channel, which may be there several times; other kinds of records are left out.

    Raises:
        BagError: It is damaged, or there is another one with its id.
    """
    what = f"{where}: {opcode_name(opcode)}"
    if opcode == Opcode.SCHEMA:
        schema = parse(records.Schema, content, what)
        other = contents.schemas.setdefault(schema.id, schema)
        if schema != other:
            raise BagError(
                f"{where}: schema {schema.id} is `{schema.name}` here, and another `{other.name}` elsewhere"
            )
    elif opcode == Opcode.CHANNEL:
        channel = parse(records.Channel, content, what)
        known = contents.channels.setdefault(channel.id, channel)
        if channel != known:
            raise BagError(
                f"{where}: channel {channel.id} is `{channel.topic}` here, and another `{known.topic}` elsewhere"
            )


def missing_schemas(contents: Contents, path: str) -> list[BagError]:
    """Return an error for each channel whose schema is not in the file."""
    return [
        BagError(
            f"{path}: channel {channel.id} (`{channel.topic}`) has schema {channel.schema_id}, which is not there"
        )
        for channel in contents.channels.values()
        if channel.schema_id and channel.schema_id not in contents.schemas
    ]


def _add(contents: Contents, file: McapFile, place: RecordPlace) -> None:
    """Add a record of the data section."""
    if place.opcode in DEFINITIONS:
        add_definition(contents, place.opcode, file.read(place.content, place.end), file.where(place.start))
    elif place.opcode == Opcode.METADATA:
        contents.metadata.append(file.record(records.Metadata, place))
    elif place.opcode == Opcode.ATTACHMENT:
        contents.attachments.append(place)


def _indexed(file: McapFile, offset: int, opcode: Opcode, index: RecordPlace) -> RecordPlace:
    """Return the record that an index in the summary points to."""
    if offset < index.start:
        place = file.place(offset, index.start)
        if place.opcode == opcode:
            return place
    raise file.damaged(index, f"{opcode_name(opcode)} should be at byte {offset} and is not")


def _complete(contents: Contents, statistics: records.Statistics) -> bool:
    """Return whether a summary leaves nothing out.

    rosbag2 counts only the channels that have messages, but repeats all of them.
    """
    return (
        len(contents.schemas) >= statistics.schema_count
        and len(contents.channels) >= statistics.channel_count
        and len(contents.metadata) >= statistics.metadata_count
        and len(contents.attachments) >= statistics.attachment_count
        and (bool(statistics.channel_message_counts) or not statistics.message_count)
        and contents.channels.keys() >= statistics.channel_message_counts.keys()
    )


def _find_record(file: McapFile, start: int) -> int:
    """Return where the next record is, somewhere behind damage; the end of the file if there is none."""
    while start < file.size:
        end = min(start + PIECE_SIZE, file.size)
        try:
            piece = file.read(start, end)
        except BagError:
            piece = b""  # a part of the disk that cannot be read, which was said at the first record in it
        for match in _CANDIDATE.finditer(piece):
            if _is_believable(file, start + match.start()):
                return start + match.start()
        start = end if end == file.size else end - RECORD_HEAD.size
    return file.size


def _is_believable(file: McapFile, start: int) -> bool:
    """Return whether a chunk begins at a place, or a record that others follow."""
    try:
        for place in islice(file.places(start, file.size), _BELIEVABLE_RECORDS):
            if place.opcode == Opcode.CHUNK:
                return file.chunk(place).compression in COMPRESSIONS
            if place.opcode not in KNOWN_OPCODES:
                return False
    except BagError:
        return False
    return True
