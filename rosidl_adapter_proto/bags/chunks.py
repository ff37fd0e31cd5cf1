"""Converts chunks: what the threads do while a bag is converted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from rosidl_adapter_proto.bags.compression import records_of
from rosidl_adapter_proto.bags.model import StoredChunk
from rosidl_adapter_proto.bags.plugins import PluginConverter
from rosidl_adapter_proto.bags.routes import TopicRoute
from rosidl_adapter_proto.bags.storage import PackedChunk, StorageWriter
from rosidl_adapter_proto.converters import Converter
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.schema.registry import Schema
from rosidl_adapter_proto.transcode import Transcoder
from rosidl_adapter_proto.transcode.error import RecordsError
from rosidl_adapter_proto.transcode.records import (
    Converted,
    Failure,
    RecordConverter,
    Route,
    pack_records,
    read_records,
)

if TYPE_CHECKING:
    from typing_extensions import Buffer


class ChunkConverter(Protocol):
    """Converts records: `RecordConverter`, or `PluginConverter` for formats that the native module does not know."""

    def convert(self, data: Buffer, *, start_time: int = 0, end_time: int | None = None) -> Converted: ...


def chunk_converter(
    routes: Mapping[int, TopicRoute],
    failed_ids: Mapping[int, int],
    converter: Converter,
) -> ChunkConverter:
    """Return what converts the chunks of a file.

    Args:
        routes: What becomes of each topic, by its id.
        failed_ids: The ids in the result of messages that cannot be converted; without one they are left out.
        converter: What converts messages from their serialization format to the other.
    """
    directions = converter.native_directions
    if directions is None or len(directions) > 1:
        return PluginConverter(routes, failed_ids, converter)
    transcoders: dict[Schema, Transcoder] = {}
    native: dict[int, Route | None] = {}
    for topic_id, route in routes.items():
        if route.result is None:
            native[topic_id] = None
        elif route.result_schema is None:
            native[topic_id] = Route(topic_id)
        else:
            schema = route.result_schema
            if schema not in transcoders:
                transcoders[schema] = Transcoder(schema.type_description, schema.descriptor)
            native[topic_id] = Route(topic_id, transcoders[schema], directions[0], failed_ids.get(topic_id))
    return RecordConverter(native)


@dataclass(frozen=True)
class FailureInChunk:
    """A message that could not be converted.

    Attributes:
        failure: What is wrong with it.
        number: Which message of its topic in the chunk it is, counted from 0.
    """

    failure: Failure
    number: int


@dataclass(frozen=True)
class ConvertedChunk:
    """A chunk that was converted, ready to be written.

    Attributes:
        source: The chunk that it was.
        packed: What is to be written; None if no message is left.
        failure_counts: How many messages of each topic could not be converted, by its id.
        failures: The first of them.
        damage: Why the chunk, or some of its messages, could not be read.
    """

    source: StoredChunk
    packed: PackedChunk | None = None
    failure_counts: Mapping[int, int] = field(default_factory=dict)
    failures: Sequence[FailureInChunk] = ()
    damage: BagError | None = None


def convert_chunk(
    chunk: StoredChunk,
    converter: ChunkConverter,
    topic_ids: Collection[int],
    writer: StorageWriter,
    start_time: int,
    end_time: int | None,
) -> ConvertedChunk:
    """Convert a chunk, on any thread.

    Args:
        chunk: The chunk.
        converter: What converts its records.
        topic_ids: The ids of the topics in the file: only of those there should be messages.
        writer: What it will be written with.
        start_time: The first time of recording to convert.
        end_time: The first time not to convert any more; None for no end.
    """
    damage = None
    try:
        records = records_of(chunk)
        try:
            converted = converter.convert(records, start_time=start_time, end_time=end_time)
        except RecordsError:
            records, damage = _of_known_topics(records, topic_ids, chunk.where)
            converted = converter.convert(records, start_time=start_time, end_time=end_time)
    except BagError as error:
        return ConvertedChunk(chunk, damage=error)
    except RecordsError as error:
        return ConvertedChunk(chunk, damage=BagError(f"{chunk.where}: {error}"))
    packed = writer.pack(converted.data) if converted.message_count else None
    failures = _in_topics(records, converted.failures, start_time, end_time) if converted.failures else ()
    return ConvertedChunk(chunk, packed, converted.failure_counts, failures, damage)


def _of_known_topics(data: Buffer, topic_ids: Collection[int], where: str) -> tuple[Buffer, BagError | None]:
    """Return the messages of a chunk whose topics there are, and what is wrong with the others, if there are any.

    Raises:
        RecordsError: The chunk is damaged.
    """
    unknown = Counter(read_records(data).topic_ids)
    for topic_id in topic_ids:
        del unknown[topic_id]
    if not unknown:
        return data, None
    known = read_records(data, topic_ids)
    messages = [known[index] for index in range(len(known))]
    packed = pack_records(known.topic_ids, known.sequences, known.log_times, known.publish_times, messages)
    return packed, BagError(
        f"{where}: {unknown.total()} messages are of topics that are not in the file, such as one with the id "
        f"{min(unknown)}"
    )


def _in_topics(
    data: Buffer, failures: Sequence[Failure], start_time: int, end_time: int | None
) -> list[FailureInChunk]:
    """Return which messages of their topics those are that failed."""
    records = read_records(data)
    by_index = {each.index: each for each in failures}
    counts: dict[int, int] = {}
    found = []
    for index, (topic_id, log_time) in enumerate(zip(records.topic_ids, records.log_times, strict=True)):
        if log_time < start_time or (end_time is not None and log_time >= end_time):
            continue
        number = counts.get(topic_id, 0)
        counts[topic_id] = number + 1
        if index in by_index:
            found.append(FailureInChunk(by_index[index], number))
            if len(found) == len(failures):
                break
    return found
