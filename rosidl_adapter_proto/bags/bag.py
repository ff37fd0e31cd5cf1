"""Bags, open for reading: `open_bag` gives their messages as protobuf messages, whatever they were recorded as."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cache, cached_property
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from google.protobuf.message import Message

from rosidl_adapter_proto.bags.compression import records_of
from rosidl_adapter_proto.bags.decoding import Decode, decoder
from rosidl_adapter_proto.bags.model import Selection, Statistics, StoredChunk, Topic
from rosidl_adapter_proto.bags.order import Run, in_time_order
from rosidl_adapter_proto.bags.recording import Recording, find_recording
from rosidl_adapter_proto.bags.storage import StorageReader
from rosidl_adapter_proto.bags.types import BagTypes
from rosidl_adapter_proto.errors import BagError, ConversionError
from rosidl_adapter_proto.schema.registry import Schema
from rosidl_adapter_proto.time import to_nanoseconds
from rosidl_adapter_proto.transcode.error import RecordsError
from rosidl_adapter_proto.transcode.records import Records, read_records

if TYPE_CHECKING:
    from rosidl_adapter_proto.time import Time


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


class BagMessage:
    """A message of a bag. It unpacks as `topic, message, log_time`.

    Attributes:
        topic: The topic that it was sent to.
        log_time: When it was recorded, in nanoseconds since 1970.
        publish_time: When it was sent, in nanoseconds since 1970; where the recorder did not know, `log_time`.
        sequence: Its number among those of its sender; 0 where the recorder did not count.
        data: The message as it was recorded, serialized.
    """

    __slots__ = ("_decode", "_message", "_number", "data", "log_time", "publish_time", "sequence", "topic")

    def __init__(
        self,
        topic: str,
        log_time: int,
        publish_time: int,
        sequence: int,
        data: bytes,
        decode: Callable[[BagMessage], Message],
        number: int,
    ) -> None:
        self.topic = topic
        self.log_time = log_time
        self.publish_time = publish_time
        self.sequence = sequence
        self.data = data
        self._decode = decode
        self._number = number
        self._message: Message | None = None

    @property
    def message(self) -> Any:
        """The protobuf message, which is made when it is first asked for.

        Raises:
            BagError: The bytes are no valid message of the type.
        """
        if self._message is None:
            self._message = self._decode(self)
        return self._message

    def __iter__(self) -> Iterator[Any]:
        return iter((self.topic, self.message, self.log_time))

    def __repr__(self) -> str:
        return f"<BagMessage of {self.topic}, recorded at {self.log_time}, {len(self.data)} bytes>"


@dataclass(frozen=True)
class _Source:
    """Where messages come from: a topic in a file.

    Attributes:
        path: The file, for people.
        topic: The topic.
        decode: Makes messages of bytes.
        numbers: Counts the messages.
    """

    path: str
    topic: Topic
    decode: Callable[[], Decode]
    numbers: Iterator[int] = field(default_factory=lambda: count(1))

    def message(self, recorded: BagMessage) -> Message:
        """Return the protobuf message of a recorded one."""
        decode = self.decode()
        try:
            return decode(recorded.data)
        except ConversionError as error:
            raise BagError(
                f"{self.path}: message {recorded._number} of {recorded.topic}, recorded at {recorded.log_time}: {error}"
            ) from error


class Bag:
    """A bag, open for reading. It may be used in a `with` statement, and need not be: it holds no file open.

    Attributes:
        path: The folder or the file.
        recording: Its files, as they are stored.

    Args:
        recording: Its files, as they are stored.
        include: Folders that have the definitions that the bag does not have.
        distro: The ROS distribution of the embedded store, for definitions that are nowhere else.
    """

    def __init__(self, recording: Recording, include: Iterable[Path] = (), distro: str | None = None) -> None:
        self.path = recording.path
        self.recording = recording
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
        """What is odd about the bag and the types that were asked for so far, for people."""
        return [*self._contents[1], *self.types.warnings]

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
            BagError: There is no such topic, or nothing is known of its type.
        """
        (name,) = self._names(topic)
        return self.types.schema(self.topics[name])

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
            BagError: There is no such topic; or, while messages are read, a file is damaged.
            SchemaError: A topic does not have one of the fields.
            TypeError: A time is none, or `fields` is one text.
        """
        if isinstance(fields, str):
            raise TypeError(f"fields must be a list of names, such as [{fields!r}], not a text")
        names = frozenset(self.topics if topics is None else self._names(topics))
        chosen = None if fields is None else tuple(fields)
        if chosen is not None:
            for name in sorted(names):
                decoder(self.topics[name], self.types, chosen)
        return self._messages(self.runs(names, start=start, end=end), chosen)

    def runs(
        self, topics: Iterable[str], *, start: Time | None = None, end: Time | None = None
    ) -> Iterator[tuple[StorageReader, Run]]:
        """Return an iterator over the same messages as `messages`, many at a time and as they were recorded.

        Args:
            topics: The names of topics.
            start: As for `messages`.
            end: As for `messages`.

        Returns:
            For each run of messages, the open file that it is in and the run.

        Raises:
            BagError: There is no such topic; or, while messages are read, a file is damaged.
            TypeError: A time is none.
        """
        names = frozenset(self._names(topics))
        start_time = 0 if start is None else max(to_nanoseconds(start, "time"), 0)
        end_time = None if end is None else max(to_nanoseconds(end, "time"), 0)
        return self._runs(names, start_time, end_time)

    def _runs(
        self, names: frozenset[str], start_time: int, end_time: int | None
    ) -> Iterator[tuple[StorageReader, Run]]:
        for index, file in enumerate(self.files):
            ids = frozenset(topic_id for topic_id, topic in file.topics.items() if topic.name in names)
            after = file.statistics.end_time < start_time
            before = end_time is not None and file.statistics.start_time >= end_time
            if not ids or after or before:
                continue
            self._check_open()
            with self.recording.open(index) as reader:
                for run in self._file_runs(reader, Selection(ids, start_time, end_time)):
                    yield reader, run

    def _file_runs(self, reader: StorageReader, selection: Selection) -> Iterator[Run]:
        def read(chunk: StoredChunk) -> Records:
            self._check_open()
            try:
                return read_records(
                    records_of(chunk), selection.topic_ids, selection.start_time, selection.end_time
                )
            except RecordsError as error:
                raise BagError(f"{chunk.where}: {error}") from error

        return in_time_order(reader.chunks(selection, in_time_order=True), read)

    def _messages(
        self, runs: Iterator[tuple[StorageReader, Run]], fields: Sequence[str] | None
    ) -> Iterator[BagMessage]:
        sources: dict[tuple[str, int], _Source] = {}
        for reader, run in runs:
            records = run.records
            data, ranges = records.data, records.ranges
            for i in run.indexes:
                key = reader.path, records.topic_ids[i]
                if key not in sources:
                    sources[key] = self._source(reader, key[1], fields)
                source = sources[key]
                yield BagMessage(
                    source.topic.name,
                    records.log_times[i],
                    records.publish_times[i],
                    records.sequences[i],
                    bytes(data[ranges[2 * i] : ranges[2 * i + 1]]),
                    source.message,
                    next(source.numbers),
                )

    def _source(self, reader: StorageReader, topic_id: int, fields: Sequence[str] | None) -> _Source:
        topic = reader.topics[topic_id]
        return _Source(reader.path, topic, cache(lambda: decoder(topic, self.types, fields)))

    @cached_property
    def _contents(self) -> tuple[Sequence[BagFile], Sequence[str]]:
        """The files, and what is odd about them; each is opened for it once."""
        self._check_open()
        files, warnings = [], list(self.recording.warnings)
        for reader in self.recording.readers():
            files.append(BagFile(reader.path, reader.storage, reader.topics, reader.statistics))
            warnings.extend(reader.warnings)
        return tuple(files), tuple(dict.fromkeys(warnings))

    @property
    def _statistics(self) -> list[Statistics]:
        return [file.statistics for file in self.files if file.statistics.message_count]

    def _names(self, topics: str | Iterable[str]) -> list[str]:
        """Return names of topics, all of which there are."""
        names = [topics] if isinstance(topics, str) else list(topics)
        for name in names:
            if name not in self.topics:
                near = get_close_matches(name, self.topics, n=3)
                known = (
                    f"did you mean {' or '.join(near)}?"
                    if near
                    else f"there are {', '.join(self.topics) or 'none'}"
                )
                raise BagError(f"{self.path}: there is no topic {name}; {known}")
        return names

    def _check_open(self) -> None:
        if self._closed:
            raise BagError(f"{self.path}: the bag was closed; read its messages before, or do not close it")


def open_bag(
    path: str | os.PathLike[str],
    *,
    include: Iterable[str | os.PathLike[str]] = (),
    distro: str | None = None,
) -> Bag:
    """Open a bag for reading.

    Args:
        path: A folder of rosbag2, an `.mcap` or `.db3` file, or a ROS 1 `.bag`.
        include: Folders of packages that have the definitions that the bag does not have.
        distro: The ROS distribution of the embedded store, for definitions that are nowhere else; by default
            `$ROS_DISTRO`, else the newest.

    Returns:
        The bag. Its messages are read when somebody goes through them.

    Raises:
        BagError: There is no bag, or it cannot be read.
    """
    bag = Bag(find_recording(os.fspath(path)), [Path(each) for each in include], distro)
    bag.files  # noqa: B018  # what is wrong with a file is said here
    return bag
