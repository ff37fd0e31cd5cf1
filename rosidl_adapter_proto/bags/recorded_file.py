"""The files of a recording: recognized by their first bytes, decompressed and opened, with what metadata.yaml adds.

rosbag2 may have compressed whole files (compression mode `FILE`) or each message (`MESSAGE`), always with zstd.
"""

from __future__ import annotations

import shutil
import tempfile
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import zstandard

from rosidl_adapter_proto.bags.compression import ZSTD, read_chunk
from rosidl_adapter_proto.bags.mcap_reader import McapReader
from rosidl_adapter_proto.bags.mcap_records import MAGIC
from rosidl_adapter_proto.bags.metadata import METADATA_FILE, SERIALIZED_METADATA, BagMetadata, read_metadata
from rosidl_adapter_proto.bags.model import EVERYTHING, Attachment, Selection, Statistics, StoredChunk, Topic
from rosidl_adapter_proto.bags.places import RemotePath, find_place, local_copy
from rosidl_adapter_proto.bags.ros1 import Ros1Reader
from rosidl_adapter_proto.bags.sqlite3_database import JOURNAL_SUFFIXES
from rosidl_adapter_proto.bags.sqlite3_reader import SqliteReader
from rosidl_adapter_proto.bags.storage import (
    CHUNK_SIZE,
    MAXIMUM_CHUNK_SIZE,
    MCAP,
    ROSBAG,
    SALVAGE,
    SQLITE3,
    StorageReader,
)
from rosidl_adapter_proto.bags.warning_list import WarningList
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.records import Records, pack_records

ZSTD_SUFFIX = ".zstd"

_MAGICS = {MAGIC: MCAP, b"SQLite format 3\0": SQLITE3, b"#ROSBAG V": ROSBAG}
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_SPARE_SPACE = 2**26  # bytes that stay free on the disk of temporary files
_SHARED_FIELDS = {
    "type_name": "type",
    "serialization_format": "serialization format",
    "type_hash": "type hash",
    "qos_profiles": "QoS",
}


@dataclass(frozen=True)
class RecordedFile:
    """A file of a recording.

    Attributes:
        path: Where it is.
        storage: The name of its storage in rosbag2: `mcap`, `sqlite3` or `rosbag_v2`.
        compressed: Whether it is compressed as a whole.
    """

    path: str
    storage: str
    compressed: bool

    @property
    def is_copied(self) -> bool:
        """Whether it is copied whole whenever it is opened, and so should not be opened just to look into it."""
        return self.compressed or (self.storage == SQLITE3 and isinstance(find_place(self.path), RemotePath))


def recognize(path: str) -> RecordedFile:
    """Return what a file is, whatever its name.

    Raises:
        BagError: It cannot be read, or is no file of a bag.
    """
    with open_file(path) as file:
        head = file.read(16)
        compressed = head.startswith(_ZSTD_MAGIC)
        if compressed:
            file.seek(0)
            try:
                head = zstandard.ZstdDecompressor().stream_reader(file).read(16)
            except zstandard.ZstdError as error:
                raise BagError(f"{path}: damaged zstd: {error}") from None
    for magic, storage in _MAGICS.items():
        if head.startswith(magic):
            return RecordedFile(path, storage, compressed)
    if not head:
        raise BagError(f"{path}: {'cut off: nothing in it can be decompressed' if compressed else 'empty'}")
    raise BagError(f"{path}: neither MCAP nor sqlite3 nor a ROS 1 bag: it begins with {head.hex(' ')}")


def open_file(path: str) -> BinaryIO:
    """Open a file of a recording.

    Raises:
        BagError: It cannot be opened.
    """
    try:
        return find_place(path).open("rb")
    except OSError as error:
        raise BagError(f"{path}: {error.strerror}") from None


def open_reader(file: RecordedFile, metadata: BagMetadata | None, salvage: bool = False) -> StorageReader:
    """Open a file for reading, from a temporary copy if it is compressed.

    Args:
        file: The file.
        metadata: What metadata.yaml says about the recording.
        salvage: Read what can be read of a damaged file.

    Raises:
        BagError: It cannot be read.
    """
    with ExitStack() as stack:
        damage = None
        try:
            path, damage = _decompressed(file.path, stack) if file.compressed else (file.path, None)
            if damage and not salvage:
                raise damage
            reader = stack.enter_context(_OPENERS[file.storage](path, file.path, salvage, stack))
        except OSError as error:  # also of temporary files, such as that the disk is full
            raise BagError(f"{file.path}: cannot be opened: {error}") from None
        return _OpenedFile(reader, metadata, stack, salvage, damage)


def _decompressed(path: str, stack: ExitStack) -> tuple[str, BagError | None]:
    """Return a temporary file with what another has compressed, and why that is not all of it."""
    folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="rosidl-proto-"))
    target = Path(folder, find_place(path).name.removesuffix(ZSTD_SUFFIX))
    room = shutil.disk_usage(folder).free - _SPARE_SPACE
    with open_file(path) as source, target.open("wb") as file:
        try:
            for piece in _decompressed_pieces(source, path):
                room -= len(piece)
                if room < 0:
                    reason = f"too large to be decompressed in {folder}; set TMPDIR to a larger disk"
                    raise BagError(f"{path}: {reason}")
                file.write(piece)
        except _DamagedFile as error:
            return str(target), error
    return str(target), None


class _DamagedFile(BagError):
    """A compressed file is damaged; what is before that is whole."""


def _decompressed_pieces(source: BinaryIO, path: str) -> Iterator[bytes]:
    """Yield what the zstd frames of a file have, in pieces of at most 128 MiB: 2^15 times what is read for each."""
    frame = zstandard.ZstdDecompressor().decompressobj()
    while data := source.read(4096):
        while data:
            if frame.eof:
                frame = zstandard.ZstdDecompressor().decompressobj()
            try:
                yield frame.decompress(data)
            except zstandard.ZstdError as error:
                raise _DamagedFile(f"{path}: damaged zstd before byte {source.tell()}: {error}") from None
            data = frame.unused_data if frame.eof else b""
    if not frame.eof:
        raise _DamagedFile(
            f"{path}: cut off: its compressed data does not end at its last byte, {source.tell()}"
        )


def _open_mcap(path: str, name: str, salvage: bool, stack: ExitStack) -> StorageReader:
    return McapReader(stack.enter_context(open_file(path)), name, salvage=salvage)


def _open_ros1(path: str, name: str, salvage: bool, stack: ExitStack) -> StorageReader:
    return Ros1Reader(stack.enter_context(open_file(path)), name, salvage=salvage)


def _open_sqlite3(path: str, name: str, salvage: bool, stack: ExitStack) -> StorageReader:
    # Its library reads nothing but files of this machine.
    copy = stack.enter_context(local_copy(find_place(path), JOURNAL_SUFFIXES))
    return SqliteReader(str(copy), name, salvage=salvage)


_OPENERS: Mapping[str, Callable[[str, str, bool, ExitStack], StorageReader]] = {
    MCAP: _open_mcap,
    SQLITE3: _open_sqlite3,
    ROSBAG: _open_ros1,
}
"""Open a file, which the stack closes, also if it turns out that it cannot be read."""


class _OpenedFile:
    """A file of a recording, with what only metadata.yaml says of its topics; see `StorageReader`."""

    def __init__(
        self,
        reader: StorageReader,
        metadata: BagMetadata | None,
        stack: ExitStack,
        salvage: bool,
        damage: BagError | None,
    ) -> None:
        self.path = reader.path
        self.storage = reader.storage
        self.metadata: Sequence[tuple[str, Mapping[str, str]]] = reader.metadata
        self.topics, self._contradictions = _with_metadata(reader, metadata)
        self._salvage = salvage
        self._damages = WarningList()
        if damage is not None:
            self._damages.add(str(damage))
        metadata = metadata or self._inner_metadata(reader)
        self._messages_compressed = metadata is not None and metadata.compresses_messages
        if metadata is not None and self._messages_compressed and metadata.compression_format != ZSTD:
            known = f"compressed with {metadata.compression_format!r}; only zstd is known"
            raise BagError(f"{self.path}: its messages are {known}")
        self._reader = reader
        self._stack = stack.pop_all()

    @property
    def statistics(self) -> Statistics:
        return self._reader.statistics

    @property
    def warnings(self) -> Sequence[str]:
        return [*self._damages, *self._reader.warnings, *self._contradictions]

    @property
    def is_damaged(self) -> bool:
        return bool(self._damages) or self._reader.is_damaged

    def attachments(self) -> Iterator[Attachment]:
        return self._reader.attachments()

    def chunks(
        self, selection: Selection = EVERYTHING, *, in_time_order: bool = False
    ) -> Iterator[StoredChunk]:
        for chunk in self._reader.chunks(selection, in_time_order=in_time_order):
            if self._messages_compressed:
                # In the order of time, pieces of a chunk would have to stand between those of others.
                yield from self._with_plain_messages(
                    chunk, selection, MAXIMUM_CHUNK_SIZE if in_time_order else CHUNK_SIZE
                )
            else:
                yield chunk

    def _with_plain_messages(
        self, chunk: StoredChunk, selection: Selection, piece_size: int
    ) -> Iterator[StoredChunk]:
        """Yield the messages of a chunk, each of which is compressed, in chunks of a bounded size."""
        try:
            records = read_chunk(chunk, selection)
        except BagError:
            yield chunk  # it is damaged, which those who look into it will find as well
            return
        size = 0
        messages: dict[int, bytes] = {}
        for index in range(len(records)):
            try:
                messages[index] = _decompressed_message(records[index])
            except zstandard.ZstdError as error:
                topic = self.topics[records.topic_ids[index]].name
                self._damaged(
                    f"{chunk.where}: a message of {topic}, recorded at {records.log_times[index]}, cannot be "
                    f"decompressed: {error}"
                )
                continue
            size += len(messages[index])
            if size >= piece_size:
                yield _plain_chunk(chunk, records, messages)
                size, messages = 0, {}
        if messages:
            yield _plain_chunk(chunk, records, messages)

    def _damaged(self, reason: str) -> None:
        """Raise an error, unless what can be read is to be read."""
        if not self._salvage:
            raise BagError(f"{reason}; {SALVAGE} the others")
        self._damages.add(reason)

    def _inner_metadata(self, reader: StorageReader) -> BagMetadata | None:
        """Return what rosbag2 wrote into a file about its bag; the last one counts."""
        texts = [
            values[SERIALIZED_METADATA] for _, values in reader.metadata if SERIALIZED_METADATA in values
        ]
        if not texts:
            return None
        try:
            return read_metadata(texts[-1].encode(), f"{reader.path}, the metadata in it")
        except BagError as error:
            self._contradictions.append(f"{error} (read without it)")
            return None

    def __enter__(self) -> _OpenedFile:
        return self

    def __exit__(self, *exception: object) -> None:
        self._stack.close()


def _with_metadata(
    reader: StorageReader, metadata: BagMetadata | None
) -> tuple[Mapping[int, Topic], list[str]]:
    """Return the topics of a file with what only metadata.yaml says of them, and what the two say differently."""
    listed = (
        {information.topic.name: information.topic for information in metadata.topics} if metadata else {}
    )
    topics: dict[int, Topic] = {}
    contradictions: list[str] = []
    for topic_id, topic in reader.topics.items():
        values = {
            name: (getattr(topic, name), getattr(listed.get(topic.name, topic), name))
            for name in _SHARED_FIELDS
        }
        topics[topic_id] = replace(topic, **{name: own or other for name, (own, other) in values.items()})
        differing = [
            _SHARED_FIELDS[name] for name, (own, other) in values.items() if own and other and own != other
        ]
        if differing:
            names = " and ".join(differing)
            contradictions.append(
                f"{reader.path}: {topic.name}: {METADATA_FILE} says another {names} than the file, which is believed"
            )
    return topics, contradictions


def _decompressed_message(data: memoryview) -> bytes:
    """Return a message decompressed, or raise a ZstdError."""
    size = zstandard.frame_content_size(data)
    if size < 0:
        raise zstandard.ZstdError("it does not say how large it is")
    if size > MAXIMUM_CHUNK_SIZE:
        raise zstandard.ZstdError(f"its size would be {size} bytes")
    plain: bytes = zstandard.ZstdDecompressor().decompress(data, allow_extra_data=False)
    return plain


def _plain_chunk(chunk: StoredChunk, records: Records, messages: Mapping[int, bytes]) -> StoredChunk:
    """Return a chunk with messages, by their places in its records."""
    times = array("Q", (records.log_times[index] for index in messages))
    data = pack_records(
        array("H", (records.topic_ids[index] for index in messages)),
        array("I", (records.sequences[index] for index in messages)),
        times,
        array("Q", (records.publish_times[index] for index in messages)),
        list(messages.values()),
    )
    return StoredChunk(
        chunk.where, data, "", len(data), 0, min(times), max(times), len(messages), chunk.position
    )
