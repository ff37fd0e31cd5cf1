"""Reads MCAP files (https://mcap.dev/spec): whole, without a summary, unfinished or damaged."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import BinaryIO, TypeVar

from mcap import records
from mcap.opcode import Opcode

from rosidl_adapter_proto.bags.mcap_contents import (
    DEFINITIONS,
    Contents,
    add_definition,
    find_end,
    missing_schemas,
    read_footer,
    read_summary,
    scan,
    walk,
)
from rosidl_adapter_proto.bags.mcap_records import KNOWN_OPCODES, MAGIC, ChunkPlace, McapFile, RecordPlace
from rosidl_adapter_proto.bags.mcap_topics import read_topics
from rosidl_adapter_proto.bags.model import EVERYTHING, Attachment, Selection, StoredChunk
from rosidl_adapter_proto.bags.storage import MCAP, SALVAGE
from rosidl_adapter_proto.bags.warning_list import WarningList
from rosidl_adapter_proto.errors import BagError

_Chunk = TypeVar("_Chunk", ChunkPlace, StoredChunk)


class McapReader:
    """One MCAP file, open for reading; see `StorageReader`.

    The summary says which topics there are and how much to expect. The data itself is read from the front, record by
    record, so that the order is that of the file, and nothing is missed that the summary does not know.

    Args:
        file: The file, which must be able to seek. It is closed with the reader.
        path: The file, for people.
        salvage: Read what can be read of a damaged file, and say in `warnings` what cannot.

    Attributes:
        profile: The profile of the file, such as `ros2`.
        warnings: What is odd about the file; reading chunks may add what is damaged there.
        is_damaged: Whether something could not be read.

    Raises:
        BagError: The file is no MCAP file; or it is damaged, and not to be salvaged.
    """

    storage = MCAP

    def __init__(self, file: BinaryIO, path: str, *, salvage: bool = False) -> None:
        self.path = path
        self.is_damaged = False
        self.warnings = WarningList()
        self._unknown: dict[int, int] = {}  # where the first records of unknown kinds are
        self._file = McapFile(file, path)
        self._salvage = salvage
        self.profile = self._read_header().profile
        contents = self._contents = self._read_contents()
        for error in missing_schemas(contents, path):
            self._damaged(error)
        self.topics = read_topics(contents.channels, contents.schemas, contents.metadata, path)
        self.statistics = contents.statistics
        self.metadata = [(record.name, record.metadata) for record in contents.metadata]

    def attachments(self) -> Iterator[Attachment]:
        """Yield the attachments of the file; see `StorageReader.attachments`."""
        for place in self._contents.attachments:
            try:
                attachment = self._file.attachment(place)
            except BagError as error:
                self._damaged(error)
            else:
                yield attachment

    def chunks(
        self, selection: Selection = EVERYTHING, *, in_time_order: bool = False
    ) -> Iterator[StoredChunk]:
        """Yield the chunks that may have messages of a selection; see `StorageReader.chunks`."""
        if in_time_order:
            places = sorted(self._chunks(selection, _without_data), key=lambda place: place.start_time)
            yield from filter(None, map(self._with_data, places))
        else:
            yield from self._chunks(selection, self._with_data)

    def _chunks(
        self, selection: Selection, found_as: Callable[[ChunkPlace | StoredChunk], _Chunk | None]
    ) -> Iterator[_Chunk]:
        """Yield the chunks that may have messages of a selection, in the order of the file."""
        chunk: _Chunk | None = None
        last: ChunkPlace | StoredChunk | None = None
        chunk_count = 0
        message_counts: list[int | None] = []
        for found in walk(self._file, self._damaged):
            if isinstance(found, RecordPlace) and found.opcode == Opcode.MESSAGE_INDEX:
                if isinstance(last, ChunkPlace):
                    message_counts[-1] = (message_counts[-1] or 0) + (found.end - found.content - 6) // 16
                continue
            # The indexes of a chunk are behind it, and nothing is read twice.
            if chunk is not None:
                yield replace(chunk, message_count=message_counts[-1])
                chunk = None
            if isinstance(found, RecordPlace):
                self._check(found)
                continue
            last = found
            chunk_count += isinstance(found, ChunkPlace)
            message_counts.append(found.message_count if isinstance(found, StoredChunk) else None)
            if _in_time(found, selection) and self._has_topics(found, selection):
                chunk = found_as(found)
        if chunk is not None:
            yield replace(chunk, message_count=message_counts[-1])
        self._check_counts(chunk_count, message_counts)

    def __enter__(self) -> McapReader:
        return self

    def __exit__(self, *exception: object) -> None:
        self._file.close()

    def _read_header(self) -> records.Header:
        start = self._file.read(0, min(len(MAGIC), self._file.size))
        if start != MAGIC:
            raise BagError(
                f"{self.path}: this is no MCAP file: it {f'begins with {start!r}' if start else 'is empty'}"
            )
        try:
            place = self._file.place(len(MAGIC), self._file.size)
            return self._file.record(records.Header, place)
        except BagError as error:
            self._damaged(error)
            return records.Header(profile="", library="")

    def _read_contents(self) -> Contents:
        """Return what the summary says, or else what the whole file says."""
        why, wrong = "the recording was not finished: it has no end", None
        footer = read_footer(self._file)
        if footer is not None:
            why = "the summary is missing, or leaves something out"
            try:
                if contents := read_summary(self._file, footer):
                    return contents
            except BagError as error:
                why, wrong = "the summary is not used", error
        end = find_end(self._file)
        if end is not None and end < self._file.size:
            garbage = self._file.size - end
            self._damaged(
                BagError(f"{self._file.where(end)}: the recording ends here, and {garbage} bytes follow")
            )
            self._file.size = end
            return self._read_contents()
        if wrong is not None:
            self._damaged(wrong)
        return self._scan(why)

    def _scan(self, why: str) -> Contents:
        """Return what is in the whole file; all damage is looked for before it is reported."""
        damages: list[BagError] = []
        contents = scan(self._file, damages.append)
        count = contents.statistics.message_count
        if damages and not self._salvage:
            raise BagError(f"{damages[0]}; {count} messages are whole, and {SALVAGE} them") from damages[0]
        self.warnings.add(f"{self.path}: {why}; it was searched, and {count} messages were found")
        for error in damages:
            self._damaged(error)
        return contents

    def _damaged(self, error: BagError) -> None:
        """Raise an error, unless what can be read is to be read."""
        if not self._salvage:
            raise BagError(f"{error}; {SALVAGE} what is whole") from error
        self.is_damaged = True
        self.warnings.add(str(error))

    def _check(self, place: RecordPlace) -> None:
        """Compare a record with what is known of the file."""
        where = self._file.where(place.start)
        if (
            place.opcode not in KNOWN_OPCODES
            and self._unknown.setdefault(place.opcode, place.start) == place.start
        ):
            self.warnings.add(f"{where}: {place.name} is left out, and so are all others of it")
        if place.opcode not in DEFINITIONS:
            return
        channels = self._contents.channels
        try:
            add_definition(self._contents, place.opcode, self._file.read(place.content, place.end), where)
            unknown = channels.keys() - self.topics.keys() if len(channels) > len(self.topics) else ()
            for topic_id in unknown:
                raise BagError(
                    f"{self.path}: channel {topic_id} (`{channels[topic_id].topic}`) is not in the summary"
                )
        except BagError as error:
            self._damaged(error)

    def _check_counts(self, chunk_count: int, message_counts: list[int | None]) -> None:
        """Compare the number of chunks, and of messages as far as their indexes say, with the summary."""
        expected = self._contents.chunk_count
        if expected is None:
            return
        if expected != chunk_count:
            self._damaged(
                BagError(f"{self.path}: the summary counts {expected} chunks, and there are {chunk_count}")
            )
        counts = [count for count in message_counts if count is not None]
        message_count = self.statistics.message_count
        if len(counts) == len(message_counts) and sum(counts) != message_count:
            self._damaged(
                BagError(
                    f"{self.path}: the summary counts {message_count} messages, and there are {sum(counts)}"
                )
            )

    def _with_data(self, found: ChunkPlace | StoredChunk) -> StoredChunk | None:
        """Return a chunk with its data; None if it cannot be read, which is noted."""
        if isinstance(found, StoredChunk):
            return found
        try:
            return self._file.stored_chunk(found)
        except BagError as error:
            self._damaged(error)
            return None

    def _has_topics(self, chunk: ChunkPlace | StoredChunk, selection: Selection) -> bool:
        """Return whether a chunk may have messages of the topics of a selection, as far as the summary says."""
        if selection.topic_ids is None or isinstance(chunk, StoredChunk):
            return True
        topics = self._contents.chunk_topics.get(chunk.start)
        return topics is None or not topics.isdisjoint(selection.topic_ids)


def _in_time(chunk: ChunkPlace | StoredChunk, selection: Selection) -> bool:
    return chunk.end_time >= selection.start_time and (
        selection.end_time is None or chunk.start_time < selection.end_time
    )


def _without_data(chunk: ChunkPlace | StoredChunk) -> ChunkPlace:
    """Return where a chunk is, so that its data can be read later."""
    if isinstance(chunk, ChunkPlace):
        return chunk
    start, size = chunk.position, chunk.size
    return ChunkPlace(
        chunk.where,
        start,
        start,
        size,
        "",
        size,
        chunk.crc,
        chunk.start_time,
        chunk.end_time,
        chunk.message_count,
    )
