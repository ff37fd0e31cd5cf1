"""Converts one file of a recording. It shares nothing with the conversion of other files."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from rosidl_adapter_proto.bags.chunks import ConvertedChunk, chunk_converter, convert_chunk
from rosidl_adapter_proto.bags.compression import ZSTD
from rosidl_adapter_proto.bags.conversion import ConversionResult, OnError, Settings
from rosidl_adapter_proto.bags.description import WrittenFile, describe
from rosidl_adapter_proto.bags.labels import label_warnings
from rosidl_adapter_proto.bags.ledger import Ledger
from rosidl_adapter_proto.bags.mcap_topics import ROS_DEFINITIONS
from rosidl_adapter_proto.bags.mcap_writer import McapWriter
from rosidl_adapter_proto.bags.metadata import ROSBAG2, SERIALIZED_METADATA, write_inner_metadata
from rosidl_adapter_proto.bags.model import CDR, Selection, Statistics, StoredChunk, Topic
from rosidl_adapter_proto.bags.pipeline import map_in_order
from rosidl_adapter_proto.bags.places import Place, written_locally
from rosidl_adapter_proto.bags.recording import Recording
from rosidl_adapter_proto.bags.routes import MIXED_FORMATS, Fate, plan_routes, selected_topics
from rosidl_adapter_proto.bags.sqlite3_writer import SqliteWriter
from rosidl_adapter_proto.bags.storage import SQLITE3, StorageReader, StorageWriter
from rosidl_adapter_proto.bags.types import BagTypes
from rosidl_adapter_proto.converters import Converter
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.interfaces.catalog import Catalog

WINDOW_SIZE = 2**28
"""How many bytes of chunks are under way at once, not compressed, however many threads there are."""


@dataclass(frozen=True)
class FileTask:
    """The conversion of one file: plain data, which can be sent to another process.

    Attributes:
        recording: The recording that the file is part of.
        index: Which of its files it is.
        destination: The file to write.
        source_format: How its messages are serialized.
        target_format: What they are converted to.
        storage: The storage of what is written.
        settings: How else to convert.
        elsewhere: Where definitions are that the file does not have.
    """

    recording: Recording
    index: int
    destination: Place
    source_format: str
    target_format: str
    storage: str
    settings: Settings
    elsewhere: Catalog


@dataclass(frozen=True)
class FileResult:
    """What the conversion of one file has made.

    Attributes:
        result: What was done.
        topics: The topics in the file that was written, and how many messages they have.
        statistics: How much is in that file.
    """

    result: ConversionResult
    topics: Mapping[int, Topic]
    statistics: Statistics


def convert_file(task: FileTask, progress: Callable[[int, int], None]) -> FileResult:
    """Convert one file.

    Args:
        task: What to do.
        progress: Called whenever something was written, with the numbers of bytes of the source and of messages.

    Raises:
        BagError: A message or the file cannot be converted, and it was not asked to go on; the file to write cannot be
            written; or there are other numbers of messages than the file itself says.
    """
    if task.storage == SQLITE3:  # whose library writes nothing but files of this machine
        with written_locally(task.destination) as local:
            return _convert_file(replace(task, destination=local), progress)
    return _convert_file(task, progress)


def _convert_file(task: FileTask, progress: Callable[[int, int], None]) -> FileResult:
    salvage = task.settings.on_error is not OnError.STOP
    with task.recording.open(task.index, salvage) as reader, _open_writer(task, reader) as writer:
        selected = selected_topics(reader.topics, task.settings)
        others = {topic.serialization_format for topic in selected.values()} - {task.source_format}
        if others:
            raise BagError(
                f"{MIXED_FORMATS} ({reader.path} has {', '.join(sorted(others))}, other files {task.source_format})"
            )
        wrong_labels = label_warnings(reader, selected)
        try:
            return _FileConversion(task, reader, writer, selected, wrong_labels).run(progress)
        except BagError as error:
            raise BagError("; ".join([str(error), *wrong_labels])) from error


def _open_writer(task: FileTask, reader: StorageReader) -> StorageWriter:
    path, metadata = str(task.destination), task.recording.metadata
    if task.storage == SQLITE3:
        return SqliteWriter(path, ros_distro=metadata.ros_distro if metadata else "")
    # The profile makes CDR mandatory, and what cannot be converted may be copied.
    profile = "ros2" if task.target_format == CDR and task.settings.on_error is not OnError.COPY else ""
    compression = _compression(task, reader)
    return McapWriter(task.destination.open("wb"), path, profile=profile, compression=compression)


def _compression(task: FileTask, reader: StorageReader) -> str:
    """Return how to compress: as the user says, or as the source is, whatever of it is compressed."""
    asked, metadata = task.settings.compression, task.recording.metadata
    if asked is not None:
        return "" if asked == "none" else asked
    if task.recording.files[task.index].compressed or (metadata and metadata.compression_mode):
        return ZSTD
    try:
        first = next(reader.chunks(), None)
    except BagError:  # those who convert the chunks will say so
        first = None
    return first.compression if first else ""


class _FileConversion:
    """The conversion of one open file."""

    def __init__(
        self,
        task: FileTask,
        reader: StorageReader,
        writer: StorageWriter,
        selected: Mapping[int, Topic],
        warnings: Sequence[str],
    ) -> None:
        settings = task.settings
        self._task = task
        self._reader = reader
        self._writer = writer
        find_types = partial(
            BagTypes, include=settings.include, distro=settings.distro, elsewhere=task.elsewhere
        )
        self._types = find_types(selected.values())
        self._routes = plan_routes(
            reader.topics,
            selected,
            reader.statistics,
            settings.on_error,
            task.target_format,
            self._types,
            find_types(()),
        )
        self._failed_ids = self._reserve_failed_ids()
        self._ledger = Ledger(reader.path, self._routes, reader.statistics.message_counts, settings)
        self._topics: dict[int, Topic] = {}
        self._warnings = list(warnings)
        self._damage: BagError | None = None

    def run(self, progress: Callable[[int, int], None]) -> FileResult:
        """Convert everything."""
        if self._writer.storage == SQLITE3 != self._reader.storage:
            self._warnings.append(
                "sqlite3 has no room for publish times and sequence numbers: they are left out"
            )
        for topic_id, route in self._routes.items():
            if route.reason:
                self._warnings.append(f"{route.reason}; its messages are {route.fate.value}")
            if route.result is not None:
                self._add_topic(route.result, topic_id)
        self._convert_chunks(progress)
        counts = self._ledger.counts(self._writer.statistics.message_counts)
        self._copy_the_rest()
        statistics = self._writer.statistics
        self._writer.finish()
        warnings = [*self._reader.warnings, *self._types.warnings, *self._warnings, *self._ledger.warnings]
        result = ConversionResult(
            counts,
            self._ledger.failures,
            self._ledger.failed_count,
            tuple(dict.fromkeys(warnings)),
            is_damaged=self._reader.is_damaged or self._ledger.is_damaged,
        )
        return FileResult(result, self._topics, statistics)

    def _selected(self) -> dict[int, Topic]:
        return {
            topic_id: route.topic
            for topic_id, route in self._routes.items()
            if route.fate in (Fate.CONVERTED, Fate.COPIED)
        }

    def _reserve_failed_ids(self) -> dict[int, int]:
        """Return the ids in the result of messages that cannot be converted, by those of their topics."""
        if self._task.settings.on_error is not OnError.COPY:
            return {}
        converted = [topic_id for topic_id, route in self._routes.items() if route.fate is Fate.CONVERTED]
        free = [each for each in range(1, 2**16) if each not in self._routes]
        if len(free) < len(converted):
            raise BagError(
                f"{self._reader.path}: {len(self._routes)} topics are too many for `--on-error copy`, which needs as "
                "many again; choose some with `--topic`"
            )
        return dict(zip(converted, free, strict=False))

    def _add_topic(self, topic: Topic, topic_id: int) -> None:
        self._topics[self._writer.add_topic(topic, topic_id)] = topic

    def _convert_chunks(self, progress: Callable[[int, int], None]) -> None:
        """Convert all chunks on threads, and write them in their order."""
        task, settings = self._task, self._task.settings
        convert = partial(
            convert_chunk,
            converter=chunk_converter(
                self._routes,
                self._failed_ids,
                Converter(task.source_format, task.target_format, settings.registry),
            ),
            topic_ids=self._routes,
            writer=self._writer,
            start_time=settings.start_time,
            end_time=settings.end_time,
        )
        for chunk in map_in_order(
            convert,
            self._chunks(),
            settings.threads or os.cpu_count() or 1,
            size=lambda chunk: chunk.size,
            size_limit=WINDOW_SIZE,
        ):
            self._write(chunk)
            progress(memoryview(chunk.source.data).nbytes, chunk.packed.message_count if chunk.packed else 0)
        if self._damage:
            self._ledger.add_damage(self._damage)

    def _chunks(self) -> Iterator[StoredChunk]:
        """Yield the chunks to convert; of a damaged file those before the damage, which are then done first."""
        settings = self._task.settings
        selection = Selection(frozenset(self._selected()), settings.start_time, settings.end_time)
        try:
            yield from self._reader.chunks(selection)
        except BagError as error:
            self._damage = error

    def _write(self, chunk: ConvertedChunk) -> None:
        """Write a chunk, and note what could not be converted."""
        if chunk.damage:
            count = self._writer.statistics.message_count
            self._ledger.add_damage(
                chunk.damage,
                f"; {count} messages before that are whole, and `--on-error skip` converts all that can be read",
            )
        if chunk.failures:
            self._ledger.add_failures(
                chunk.failure_counts, chunk.failures, self._writer.statistics.message_counts
            )
        for topic_id in chunk.failure_counts.keys() & self._failed_ids.keys():
            if self._failed_ids[topic_id] not in self._topics:
                self._add_topic(self._routes[topic_id].topic, self._failed_ids[topic_id])
        if chunk.packed:
            self._writer.write(chunk.packed)

    def _copy_the_rest(self) -> None:
        """Copy what else is in the file, and describe the result as rosbag2 does."""
        for attachment in self._reader.attachments():
            self._copy(partial(self._writer.add_attachment, attachment))
        for name, values in self._reader.metadata:
            if name not in (ROSBAG2, ROS_DEFINITIONS):
                self._copy(partial(self._writer.add_metadata, name, values))
        file = WrittenFile(self._task.destination.name, self._topics, self._writer.statistics)
        metadata = describe(self._task.storage, [file], self._task.recording.metadata)
        self._writer.add_metadata(ROSBAG2, {SERIALIZED_METADATA: write_inner_metadata(metadata)})

    def _copy(self, add: Callable[[], None]) -> None:
        """Add something that the storage may have no room for."""
        try:
            add()
        except BagError as error:
            if self._task.settings.on_error is OnError.STOP:
                raise BagError(f"{error}, or leave it out with `--on-error skip`") from None
            self._ledger.warnings.add(f"{error}; it is left out")
