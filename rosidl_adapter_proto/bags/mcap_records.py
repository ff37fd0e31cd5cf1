"""The records of an MCAP file (https://mcap.dev/spec): where they are, and what is in them.

What is in a record is read by the `mcap` library, except for chunks and messages, which are handed on in one piece.
Everything that can be wrong with a record ends here as a `BagError` with its place.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, BinaryIO, TypeVar

from isal.isal_zlib import crc32
from mcap import records
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode

from rosidl_adapter_proto.bags.model import Attachment, StoredChunk
from rosidl_adapter_proto.bags.storage import CHUNK_SIZE, MAXIMUM_CHUNK_SIZE
from rosidl_adapter_proto.errors import BagError

if TYPE_CHECKING:
    from typing_extensions import Buffer

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")
CHUNK_HEAD = struct.Struct("<QQQII")
"""Of a chunk: start time, end time, size and CRC-32 when decompressed, length of the name of its compression."""
MESSAGE_HEAD = struct.Struct("<BQHIQQ")
"""Of a message, with the head of its record: opcode, length, channel, sequence, log time, publish time."""
FOOTER_SIZE = RECORD_HEAD.size + 20

# What is read at once has bounds, whatever a file says. Kinds that we do not know are never read.
_LARGEST_RECORDS = {
    **dict.fromkeys(Opcode, 64 * 1024 * 1024),
    Opcode.MESSAGE_INDEX: MAXIMUM_CHUNK_SIZE,
    Opcode.CHUNK: MAXIMUM_CHUNK_SIZE,
    Opcode.MESSAGE: MAXIMUM_CHUNK_SIZE,
    Opcode.ATTACHMENT: MAXIMUM_CHUNK_SIZE,
}
_LONGEST_COMPRESSION = 32
KNOWN_OPCODES = frozenset(Opcode)
PIECE_SIZE = 1024 * 1024
"""How much is read at once where nothing else says."""

_Record = TypeVar("_Record", bound=records.McapRecord)


@dataclass(frozen=True)
class RecordPlace:
    """Where a record is.

    Attributes:
        opcode: What kind of record it is.
        start: Its first byte in the file.
        content: The first byte behind its opcode and length.
        end: The first byte behind it.
    """

    opcode: int
    start: int
    content: int
    end: int

    @property
    def name(self) -> str:
        """What kind of record it is, for people."""
        return opcode_name(self.opcode)


@dataclass(frozen=True)
class ChunkPlace:
    """Where a chunk is, and what it says of itself, without its data."""

    where: str
    start: int
    data_start: int
    data_size: int
    compression: str
    size: int
    crc: int
    start_time: int
    end_time: int
    message_count: int | None = None


class McapFile:
    """The bytes of an MCAP file, by records. No more memory is taken than the file has bytes.

    Attributes:
        path: The file, for people.
        size: The number of its bytes; a reader that finds garbage behind the end of the recording makes it smaller.
    """

    def __init__(self, file: BinaryIO, path: str) -> None:
        self._file = file
        self.path = path
        self.size = file.seek(0, 2)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def where(self, offset: int) -> str:
        """Return a place, for people."""
        return f"{self.path} at byte {offset}"

    def read(self, start: int, end: int) -> bytes:
        """Return the bytes from one place to another, both in the file."""
        try:
            self._file.seek(start)
            data = self._file.read(end - start)
        except OSError as error:
            raise BagError(f"{self.where(start)}: it cannot be read: {error.strerror or error}") from error
        if len(data) != end - start:
            raise BagError(f"{self.where(start)}: the file became shorter while it was read")
        return data

    def crc(self, start: int, end: int) -> int:
        """Return the CRC-32 of the bytes from one place to another, both in the file."""
        crc = 0
        for piece in range(start, end, PIECE_SIZE):
            crc = crc32(self.read(piece, min(piece + PIECE_SIZE, end)), crc)
        return crc

    def place(self, start: int, limit: int) -> RecordPlace:
        """Return where the record is that begins at `start` and ends at `limit` or before.

        Raises:
            BagError: There is none, or not all of it.
        """
        content = start + RECORD_HEAD.size
        if content > limit:
            raise BagError(f"{self.where(start)}: {limit - start} bytes are too few for a record")
        opcode, length = RECORD_HEAD.unpack(self.read(start, content))
        if opcode == 0:
            raise BagError(f"{self.where(start)}: there is no record, its first byte is 0")
        if length > limit - content:
            there = limit - content
            raise BagError(
                f"{self.where(start)}: {opcode_name(opcode)} has {length} bytes, of which only {there} are there"
            )
        largest = _LARGEST_RECORDS.get(opcode, length)
        if length > largest:
            raise BagError(
                f"{self.where(start)}: {opcode_name(opcode)} has {length} bytes; up to {largest} are read"
            )
        return RecordPlace(opcode, start, content, content + length)

    def places(self, start: int, end: int) -> Iterator[RecordPlace]:
        """Yield where the records between two places are."""
        while start < end:
            place = self.place(start, end)
            yield place
            start = place.end

    def record(self, kind: type[_Record], place: RecordPlace) -> _Record:
        """Return what is in a record of a kind that `mcap.records` knows.

        Raises:
            BagError: Its content is damaged.
        """
        return parse(kind, self.read(place.content, place.end), f"{self.where(place.start)}: {place.name}")

    def attachment(self, place: RecordPlace) -> Attachment:
        """Return an attachment, compared with its checksum.

        Raises:
            BagError: It is damaged.
        """
        attachment = self.record(records.Attachment, place)
        stated = int.from_bytes(self.read(place.end - 4, place.end), "little")
        crc = self.crc(place.content, place.end - 4)
        if stated not in (0, crc):
            raise self.damaged(place, f"its checksum is {crc:#010x} and should be {stated:#010x}")
        return Attachment(
            attachment.name,
            attachment.media_type,
            attachment.log_time,
            attachment.create_time,
            attachment.data,
        )

    def damaged(self, place: RecordPlace, reason: str) -> BagError:
        """Return the error for a record whose content is wrong."""
        return BagError(f"{self.where(place.start)}: {place.name} is damaged: {reason}")

    def chunk(self, place: RecordPlace) -> ChunkPlace:
        """Return what a Chunk record says of itself.

        Raises:
            BagError: It is damaged.
        """
        head = self.read(
            place.content, min(place.end, place.content + CHUNK_HEAD.size + _LONGEST_COMPRESSION + 8)
        )
        if len(head) < CHUNK_HEAD.size + 8:
            raise self.damaged(place, "a length in it points behind its end")
        start_time, end_time, size, crc, name_length = CHUNK_HEAD.unpack_from(head)
        name_end = CHUNK_HEAD.size + name_length
        if name_end + 8 > len(head):
            raise self.damaged(place, "a length in it points behind its end")
        try:
            compression = head[CHUNK_HEAD.size : name_end].decode()
        except UnicodeDecodeError as error:
            raise self.damaged(place, "a text in it is not UTF-8") from error
        data_size = int.from_bytes(head[name_end : name_end + 8], "little")
        data_start = place.content + name_end + 8
        if data_start + data_size != place.end:
            raise self.damaged(place, f"it has {place.end - data_start} bytes of data and says {data_size}")
        where = self.where(place.start)
        return ChunkPlace(
            where, place.start, data_start, data_size, compression, size, crc, start_time, end_time
        )

    def stored_chunk(self, chunk: ChunkPlace) -> StoredChunk:
        """Return a chunk with its data."""
        data = self.read(chunk.data_start, chunk.data_start + chunk.data_size)
        return StoredChunk(
            chunk.where,
            data,
            chunk.compression,
            chunk.size,
            chunk.crc,
            chunk.start_time,
            chunk.end_time,
            chunk.message_count,
            chunk.start,
        )

    def loose_messages(self, first: RecordPlace) -> tuple[StoredChunk, int]:
        """Return Message records that are in no chunk, as if they were one, and the place behind them.

        They are about 1 MB, but always at least the one message.

        Args:
            first: The first of them.
        """
        piece = self.read(first.start, max(first.end, min(first.start + CHUNK_SIZE, self.size)))
        position, count, start_time, end_time = 0, 0, 2**64 - 1, 0
        while position + MESSAGE_HEAD.size <= len(piece):
            opcode, length, _, _, log_time, _ = MESSAGE_HEAD.unpack_from(piece, position)
            following = position + RECORD_HEAD.size + length
            if opcode != Opcode.MESSAGE or following > len(piece) or following < position + MESSAGE_HEAD.size:
                break
            position = following
            count += 1
            start_time, end_time = min(start_time, log_time), max(end_time, log_time)
        if not count:
            raise self.damaged(first, "it is too short for a message")
        data = memoryview(piece)[:position]
        where = self.where(first.start)
        chunk = StoredChunk(where, data, "", position, 0, start_time, end_time, count, first.start)
        return chunk, first.start + position


def opcode_name(opcode: int) -> str:
    """Return what kind of record it is, for people: `a Chunk record`."""
    for kind in Opcode:
        if kind == opcode:
            name = kind.name.title().replace("_", "")
            return f"{'an' if name[0] in 'AEIOU' else 'a'} {name} record"
    return f"a record of the unknown kind {opcode:#04x}"


def parse(kind: type[_Record], content: Buffer, what: str) -> _Record:
    """Return what is in a record of a kind that `mcap.records` knows.

    Args:
        kind: The kind.
        content: The record, without its opcode and length.
        what: The record and its place, for people.

    Raises:
        BagError: Its content is damaged.
    """
    try:
        record: _Record = kind.read(_ExactStream(BytesIO(content)))  # type: ignore[attr-defined]
    except (EndOfFile, OverflowError) as error:
        raise BagError(f"{what} is damaged: a length in it points behind its end") from error
    except UnicodeDecodeError as error:
        raise BagError(f"{what} is damaged: a text in it is not UTF-8") from error
    except (McapError, struct.error) as error:
        raise BagError(f"{what} is damaged: {error}") from error
    return record


def write(record: records.McapRecord) -> bytes:
    """Return a record as the bytes of a file."""
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


class _ExactStream(ReadDataStream):
    """A stream whose end is noticed: the library's own returns what there is."""

    def read(self, length: int) -> bytes:
        data = super().read(length)
        if len(data) != length:
            raise EndOfFile
        return data
