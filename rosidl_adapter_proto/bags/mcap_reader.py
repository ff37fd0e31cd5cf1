"""Reads MCAP files (https://mcap.dev/spec): whole, without a summary, unfinished or damaged."""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

from mcap import records
from mcap.opcode import Opcode

from rosidl_adapter_proto.bags.mcap_contents import (
    Contents,
    add_channel,
    read_footer,
    read_summary,
    scan,
    walk,
)
from rosidl_adapter_proto.bags.mcap_records import MAGIC, ChunkPlace, McapFile, Place
from rosidl_adapter_proto.bags.mcap_topics import read_topics
from rosidl_adapter_proto.bags.model import EVERYTHING, Attachment, Selection, StoredChunk
from rosidl_adapter_proto.errors import BagError


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

    Raises:
        BagError: The file is no MCAP file; or it is damaged, and not to be salvaged.
    """

    storage = "mcap"

    def __init__(self, file: BinaryIO, path: str, *, salvage: bool = False) -> None:
        self.path = path
        self.warnings: list[str] = []
        self._file = McapFile(file, path)
        self._salvage = salvage
        self.profile = self._read_header().profile
        contents = self._read_contents()
        self._contents = contents
        self.topics = read_topics(contents.channels, contents.schemas, contents.metadata)
        self.statistics = contents.statistics
        self.metadata = [(record.name, record.metadata) for record in contents.metadata]

    def attachments(self) -> Iterator[Attachment]:
        """Yield the attachments of the file."""
        for place in self._contents.attachments:
            attachment = self._file.record(records.Attachment, place)
            yield Attachment(
                attachment.name,
                attachment.media_type,
                attachment.log_time,
                attachment.create_time,
                attachment.data,
            )

    def chunks(self, selection: Selection = EVERYTHING) -> Iterator[StoredChunk]:
        """Yield the chunks that may have messages of a selection; see `StorageReader.chunks`."""
        for found in walk(self._file, self._file.size, self._damaged):
            if isinstance(found, Place) and found.opcode == Opcode.MESSAGE_INDEX:
                continue
            if isinstance(found, Place):
                self._check(found)
            elif isinstance(found, StoredChunk):
                if _in_time(found, selection):
                    yield found
            elif _in_time(found, selection) and self._has_topics(found, selection):
                yield self._file.stored_chunk(found)

    def __enter__(self) -> McapReader:
        return self

    def __exit__(self, *exception: object) -> None:
        self._file.close()

    def _read_header(self) -> records.Header:
        if self._file.size < len(MAGIC) or self._file.read(0, len(MAGIC)) != MAGIC:
            raise BagError(f"{self.path}: this is no MCAP file")
        place = self._file.place(len(MAGIC), self._file.size)
        return self._file.record(records.Header, place)

    def _read_contents(self) -> Contents:
        footer = read_footer(self._file)
        if footer is not None:
            contents = read_summary(self._file, footer)
            if contents is not None:
                return contents
            self.warnings.append(
                f"{self.path}: the summary is missing or not complete: the file is read twice"
            )
        else:
            self.warnings.append(f"{self.path}: the recording was not finished: the file is read twice")
        return scan(self._file, self._damaged)

    def _damaged(self, error: BagError) -> None:
        if not self._salvage:
            raise error
        if str(error) not in self.warnings:
            self.warnings.append(str(error))

    def _check(self, place: Place) -> None:
        if place.opcode == Opcode.CHANNEL:
            add_channel(
                self._contents, self._file.record(records.Channel, place), self._file.where(place.start)
            )

    def _has_topics(self, chunk: ChunkPlace, selection: Selection) -> bool:
        """Return whether a chunk may have messages of the topics of a selection."""
        topics = self._contents.chunk_topics.get(chunk.start)
        return topics is None or selection.topic_ids is None or not topics.isdisjoint(selection.topic_ids)


def _in_time(chunk: ChunkPlace | StoredChunk, selection: Selection) -> bool:
    return chunk.end_time >= selection.start_time and (
        selection.end_time is None or chunk.start_time < selection.end_time
    )
