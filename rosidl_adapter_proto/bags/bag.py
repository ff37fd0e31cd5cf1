"""Bags, open for reading: `open_bag` gives their messages as protobuf messages, whatever they were recorded as."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from rosidl_adapter_proto.bags.compression import read_chunk
from rosidl_adapter_proto.bags.decoding import decoder
from rosidl_adapter_proto.bags.message import BagMessage, MessageSource
from rosidl_adapter_proto.bags.model import Selection, Statistics, StoredChunk, Topic
from rosidl_adapter_proto.bags.order import Run, in_time_order
from rosidl_adapter_proto.bags.pipeline import map_in_order
from rosidl_adapter_proto.bags.recording import Recording, find_recording
from rosidl_adapter_proto.bags.storage import SALVAGE, StorageReader
from rosidl_adapter_proto.bags.topic_names import no_such_topic
from rosidl_adapter_proto.bags.types import BagTypes
from rosidl_adapter_proto.bags.warning_list import WarningList
from rosidl_adapter_proto.errors import BagError, RequestError
from rosidl_adapter_proto.schema.registry import Schema
from rosidl_adapter_proto.time import to_nanoseconds
from rosidl_adapter_proto.transcode.plan import chosen_names
from rosidl_adapter_proto.transcode.records import Records, read_records

if TYPE_CHECKING:
    from rosidl_adapter_proto.time import Time


_READ_AHEAD = 64 * 2**20
"""So many bytes of chunks are read before somebody needs them, unless one is larger."""


@dataclass(frozen=True)
class BagTopic(Topic):
    """A topic of a bag, and how many messages it has in all files.

    Attributes:
        message_count: The number of its messages.
    """

    message_count: int = 0


@dataclass(frozen=True)
class BagFile:
    """A file of a bag.

    Attributes:
        path: Where it is.
        storage: The name of its storage in rosbag2, such as `mcap`.
        topics: Its topics by their ids in it.
        statistics: How many messages they have, and of which time.
    """

    path: str
    storage: str
    topics: Mapping[int, Topic] = field(repr=False)
    statistics: Statistics = field(repr=False)


class Bag:
    """A bag, open for reading. It may be used in a `with` statement, and need not be: it holds no file open.

    Attributes:
        path: The folder or the file.
        recording: Its files, as they are stored.
        salvage: Whether what can be read of a damaged file is read.

    Args:
        recording: Its files, as they are stored.
        include: Folders that have the definitions that the bag does not have.
        distro: The ROS distribution of the embedded store, for definitions that are nowhere else.
        salvage: Read what can be read of a damaged file.
    """

    def __init__(
        self,
        recording: Recording,
        include: Iterable[Path] = (),
        distro: str | None = None,
        *,
        salvage: bool = False,
    ) -> None:
        self.path = recording.path
        self.recording = recording
        self.salvage = salvage
        self._warnings = WarningList()
        self._is_damaged = False
        self._include = tuple(include)
        self._distro = distro
        self._closed = False

    def __enter__(self) -> Bag:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Bag {self.path}>"

    def close(self) -> None:
        """Read no more: what still goes through its messages ends with an error."""
        self._closed = True

    @property
    def files(self) -> Sequence[BagFile]:
        """The files, in the order in which they were recorded."""
        return self._contents[0]

    @cached_property
    def topics(self) -> Mapping[str, BagTopic]:
        """The topics by their names. Of one that has several types, this is the first."""
        topics: dict[str, Topic] = {}
        counts: Counter[str] = Counter()
        for file in self.files:
            for topic_id, topic in file.topics.items():
                topics.setdefault(topic.name, topic)
                counts[topic.name] += file.statistics.message_counts.get(topic_id, 0)
        return {
            name: BagTopic(**vars(topic), message_count=counts[name])
            for name, topic in sorted(topics.items())
        }

    @property
    def message_count(self) -> int:
        """The number of all messages."""
        return sum(file.statistics.message_count for file in self.files)

    @property
    def start_time(self) -> int:
        """When the first message was recorded, in nanoseconds since 1970; 0 without messages."""
        return min((each.start_time for each in self._statistics), default=0)

    @property
    def end_time(self) -> int:
        """When the last message was recorded, in nanoseconds since 1970; 0 without messages."""
        return max((each.end_time for each in self._statistics), default=0)

    @property
    def duration(self) -> int:
        """How long it takes from the first message to the last, in nanoseconds."""
        return self.end_time - self.start_time

    @property
    def warnings(self) -> Sequence[str]:
        """What is odd about the bag, and about the messages and types that were asked for so far, for people."""
        return list(dict.fromkeys([*self._contents[1], *self._warnings, *self.types.warnings]))

    @property
    def is_damaged(self) -> bool:
        """Whether something could not be read so far, as `warnings` say."""
        self._contents  # noqa: B018
        return self._is_damaged

    @cached_property
    def types(self) -> BagTypes:
        """The types of all topics."""
        topics = (topic for file in self.files for topic in file.topics.values())
        return BagTypes(topics, self._include, self._distro)

    def schema(self, topic: str) -> Schema:
        """Return the type of a topic, as `TypeRegistry` has it.

        Args:
            topic: The name of the topic.

        Raises:
            BagError: Nothing is known of its type.
            RequestError: There is no such topic.
        """
        (name,) = self._names(topic)
        return self.types.schema(self.topics[name])

    @contextmanager
    def open_file(self, index: int) -> Iterator[StorageReader]:
        """Open a file; what is odd about what is read of it is among `warnings` afterwards.

        Args:
            index: Which of `files`.

        Raises:
            BagError: It cannot be read.
        """
        with self.recording.open(index, self.salvage) as reader:
            try:
                yield reader
            finally:
                self._note(reader)

    def messages(
        self,
        topics: str | Iterable[str] | None = None,
        *,
        start: Time | None = None,
        end: Time | None = None,
        fields: Iterable[str] | None = None,
    ) -> Iterator[BagMessage]:
        """Return an iterator over messages, in the order in which they were recorded.

        Files come one after the other. What is in memory is the chunks of a file that overlap in time.

        Args:
            topics: The name of a topic, or several; None for all.
            start: Messages that were recorded at this time or later: nanoseconds since 1970, a `datetime` with a time
                zone, or anything else that `rosidl_adapter_proto.time` takes.
            end: Messages that were recorded before this time.
            fields: Read only these fields, such as `["header.stamp", "width"]`, of all these topics; the others are
                empty in the messages.

        Raises:
            BagError: While messages are read: a file is damaged.
            RequestError: There is no such topic.
            SchemaError: A topic does not have one of the fields.
            TypeError: A time is none, or `fields` is one text.
        """
        chosen = chosen_names(fields)
        names = frozenset(self.topics if topics is None else self._names(topics))
        if chosen is not None:
            for topic in self.topics.values():
                if topic.name in names and topic.message_count:
                    decoder(topic, self.types, chosen)
        return self._messages(self.runs(names, start=start, end=end), chosen)

    def runs(
        self,
        topics: Iterable[str],
        *,
        start: Time | None = None,
        end: Time | None = None,
        threads: int = 1,
    ) -> Iterator[tuple[StorageReader, Run]]:
        """Return an iterator over the same messages as `messages`, many at a time and as they were recorded.

        Args:
            topics: The names of topics.
            start: As for `messages`.
            end: As for `messages`.
            threads: On how many threads chunks are decompressed, ahead of who takes the messages; with one, when they
                are needed.

        Returns:
            For each run of messages, the open file that it is in and the run.

        Raises:
            BagError: While messages are read: a file is damaged.
            RequestError: There is no such topic.
            TypeError: A time is none.
        """
        names = frozenset(self._names(topics))
        start_time = 0 if start is None else max(to_nanoseconds(start, "time"), 0)
        end_time = None if end is None else max(to_nanoseconds(end, "time"), 0)
        return self._runs(names, start_time, end_time, threads)

    def _runs(
        self, names: frozenset[str], start_time: int, end_time: int | None, threads: int
    ) -> Iterator[tuple[StorageReader, Run]]:
        for index, file in enumerate(self.files):
            ids = frozenset(topic_id for topic_id, topic in file.topics.items() if topic.name in names)
            after = file.statistics.end_time < start_time
            before = end_time is not None and file.statistics.start_time >= end_time
            if not ids or after or before:
                continue
            self._check_open()
            with self.open_file(index) as reader:
                found = 0
                for run in self._file_runs(reader, Selection(ids, start_time, end_time), threads):
                    found += len(run.indexes)
                    yield reader, run
            said = sum(file.statistics.message_counts.get(each, 0) for each in ids)
            if found != said and not start_time and end_time is None:
                self._damaged(
                    f"{file.path}: it says that there are {said} messages of these topics, but {found} were found",
                    f"{SALVAGE} those",
                )

    def _file_runs(self, reader: StorageReader, selection: Selection, threads: int) -> Iterator[Run]:
        def read(chunk: StoredChunk) -> Records:
            self._check_open()
            self._note(reader)
            try:
                return read_chunk(chunk, selection)
            except BagError as error:
                self._damaged(str(error), f"{SALVAGE} what is whole")
                return read_records(b"")

        chunks = reader.chunks(selection, in_time_order=True)
        if threads == 1:
            return in_time_order(chunks, read)
        ready: dict[int, Records] = {}

        def read_ahead() -> Iterator[StoredChunk]:
            def pair(chunk: StoredChunk) -> tuple[StoredChunk, Records]:
                return chunk, read(chunk)

            for chunk, records in map_in_order(
                pair, chunks, threads, size=lambda chunk: chunk.size, size_limit=_READ_AHEAD
            ):
                ready[id(chunk)] = records
                yield chunk

        return in_time_order(read_ahead(), lambda chunk: ready.pop(id(chunk)))

    def _messages(
        self, runs: Iterator[tuple[StorageReader, Run]], fields: Sequence[str] | None
    ) -> Iterator[BagMessage]:
        sources: dict[str, dict[int, MessageSource]] = {}
        for reader, run in runs:
            if reader.path not in sources:
                sources[reader.path] = {
                    topic_id: self._source(reader.path, topic, fields)
                    for topic_id, topic in reader.topics.items()
                }
            by_topic, records = sources[reader.path], run.records
            data, ranges = records.data, records.ranges
            for i in run.indexes:
                source = by_topic[records.topic_ids[i]]
                yield BagMessage(
                    source.topic.name,
                    records.log_times[i],
                    records.publish_times[i],
                    records.sequences[i],
                    bytes(data[ranges[2 * i] : ranges[2 * i + 1]]),
                    source,
                    next(source.numbers),
                )

    def _source(self, path: str, topic: Topic, fields: Sequence[str] | None) -> MessageSource:
        return MessageSource(path, topic, lambda: self.types, fields)

    @cached_property
    def _contents(self) -> tuple[Sequence[BagFile], Sequence[str]]:
        """The files, and what is odd about them; each is opened for it once."""
        self._check_open()
        files, warnings = [], list(self.recording.warnings)
        for reader in self.recording.readers(self.salvage):
            files.append(BagFile(reader.path, reader.storage, reader.topics, reader.statistics))
            warnings.extend(reader.warnings)
            self._is_damaged |= reader.is_damaged
        warnings += self.recording.count_warnings(sum(file.statistics.message_count for file in files))
        types: dict[str, set[str]] = {}
        for topic in (topic for file in files for topic in file.topics.values()):
            types.setdefault(topic.name, set()).add(topic.type_name)
        for name, several in types.items():
            if len(several) > 1:
                warnings.append(f"{self.path}: topic {name} has several types: {', '.join(sorted(several))}")
        return tuple(files), tuple(dict.fromkeys(warnings))

    def _note(self, reader: StorageReader) -> None:
        """Note what a reader has found to be odd."""
        self._is_damaged |= reader.is_damaged
        for each in reader.warnings:
            self._warnings.add(each)

    def _damaged(self, reason: str, advice: str) -> None:
        """Raise an error, unless what can be read is to be read."""
        if not self.salvage:
            raise BagError(f"{reason}; {advice}")
        self._is_damaged = True
        self._warnings.add(reason)

    @property
    def _statistics(self) -> list[Statistics]:
        return [file.statistics for file in self.files if file.statistics.message_count]

    def _names(self, topics: str | Iterable[str]) -> list[str]:
        """Return names of topics, all of which there are."""
        names = [topics] if isinstance(topics, str) else list(topics)
        for name in names:
            if name not in self.topics:
                raise RequestError(f"{self.path}: {no_such_topic(name, self.topics)}")
        return names

    def _check_open(self) -> None:
        if self._closed:
            raise BagError(f"{self.path}: the bag was closed; read its messages before, or do not close it")


def open_bag(
    path: str | os.PathLike[str],
    *,
    include: Iterable[str | os.PathLike[str]] = (),
    distro: str | None = None,
    salvage: bool = False,
) -> Bag:
    """Open a bag for reading.

    Args:
        path: A folder of rosbag2, an `.mcap` or `.db3` file, or a ROS 1 `.bag`: a path, or a URL that fsspec knows.
        include: Folders of packages that have the definitions that the bag does not have.
        distro: The ROS distribution of the embedded store, for definitions that are nowhere else; by default
            `$ROS_DISTRO`, else the newest.
        salvage: Of a file that was cut off or is damaged, read what is whole, and say in `Bag.warnings` what is not:
            the same as `bag convert --on-error skip` does. By default, damage is an error.

    Returns:
        The bag. Its messages are read when somebody goes through them.

    Raises:
        BagError: There is no bag, or it cannot be read.
        PlaceError: The place that a URL names cannot be reached.
        RequestError: There is nothing installed that knows the URL.
    """
    bag = Bag(find_recording(os.fspath(path)), [Path(each) for each in include], distro, salvage=salvage)
    bag.files  # noqa: B018  # what is wrong with a file is said here
    return bag
