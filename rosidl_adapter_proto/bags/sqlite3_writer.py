"""The sqlite3 storage of rosbag2, writing: `.db3` files of schema 4, as rosbag2 itself writes them."""

from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rosidl_adapter_proto.bags.metadata import ROSBAG2, SERIALIZED_METADATA, WRITTEN_VERSION
from rosidl_adapter_proto.bags.model import PROTOBUF, Attachment, RecordedDefinition, Statistics, Topic
from rosidl_adapter_proto.bags.qos import numbered_qos
from rosidl_adapter_proto.bags.sqlite3_reader import definition_names
from rosidl_adapter_proto.bags.storage import SQLITE3, PackedChunk
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.records import Records, read_records

if TYPE_CHECKING:
    from typing_extensions import Buffer

# A file that is not finished is thrown away: so nothing is done for a process or machine that dies before.
_PRAGMAS = "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA locking_mode = EXCLUSIVE;"

# The texts are those of rosbag2_storage_sqlite3/sqlite_storage.cpp.
_SCHEMA = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY,ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY,metadata_version INTEGER NOT NULL,metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,
    offered_qos_profiles TEXT NOT NULL,type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(id INTEGER PRIMARY KEY,topic_type TEXT NOT NULL,encoding TEXT NOT NULL,
    encoded_message_definition TEXT NOT NULL,type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL);
"""
# Ours: the descriptors of protobuf topics, with those that they import (`FileDescriptorSet`).
_DESCRIPTORS = """CREATE TABLE IF NOT EXISTS
    protobuf_descriptors(topic_type TEXT PRIMARY KEY,full_name TEXT NOT NULL,descriptor_set BLOB NOT NULL)"""
_ADD_DEFINITION = """INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition,
    type_description_hash) VALUES (?, ?, CAST(? AS TEXT), ?)"""  # the text as it is, UTF-8 or not
_INDEX = "CREATE INDEX timestamp_idx ON messages (timestamp ASC)"


@dataclass(frozen=True)
class _PackedRows:
    """The messages of a chunk, and how many there are of each topic."""

    records: Records = field(repr=False)
    message_counts: Mapping[int, int]

    @property
    def message_count(self) -> int:
        return len(self.records)


class SqliteWriter:
    """A `.db3` file, open for writing; see `StorageWriter`.

    A database keeps the time when a message was recorded, not when it was published, and no sequence numbers.

    Args:
        path: The file, which must not exist.
        ros_distro: The ROS distribution that recorded the messages, if known.

    Raises:
        BagError: The file exists, or cannot be created.
    """

    storage = SQLITE3

    def __init__(self, path: str, *, ros_distro: str = "") -> None:
        self.path = path
        self._topics: dict[int, Topic] = {}
        self._described: dict[str, Topic] = {}  # the topics of which descriptors were written, by their types
        self._defined: dict[str, tuple[Topic, RecordedDefinition]] = (
            {}
        )  # and of which definitions were written
        self._counts: Counter[int] = Counter()
        self._times: tuple[int, int] | None = None
        try:
            Path(path).touch(exist_ok=False)
        except FileExistsError:
            raise BagError(f"{path}: exists already") from None
        except OSError as error:
            raise BagError(f"{path}: {error.strerror}") from None
        self._connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
        with self._errors():
            self._connection.executescript(_PRAGMAS + _SCHEMA)
        self._execute("INSERT INTO schema(schema_version, ros_distro) VALUES (4, ?)", ros_distro)

    def __enter__(self) -> SqliteWriter:
        return self

    def __exit__(self, *exception: object) -> None:
        self._connection.close()

    @property
    def statistics(self) -> Statistics:
        """What was written so far."""
        return Statistics(
            {topic_id: self._counts[topic_id] for topic_id in self._topics}, *(self._times or (0, 0))
        )

    def add_topic(self, topic: Topic, topic_id: int | None = None) -> int:
        """Add a topic, and return its id: by default the next one."""
        if topic_id is None:
            topic_id = max(self._topics, default=0) + 1
        if topic_id in self._topics:
            raise BagError(
                f"{self.path}: {topic.name}: the id {topic_id} is that of {self._topics[topic_id].name}"
            )
        self._execute(
            "INSERT INTO topics VALUES (?, ?, ?, ?, ?, ?)",
            topic_id,
            topic.name,
            _type_name(topic),
            topic.serialization_format,
            numbered_qos(topic.qos_profiles),
            topic.type_hash,
        )
        self._topics[topic_id] = topic
        self._add_definitions(topic)
        return topic_id

    def pack(self, records: Buffer) -> _PackedRows:
        """Return a chunk ready to be written. It may be called on any thread."""
        messages = read_records(records)
        return _PackedRows(messages, Counter(messages.topic_ids))

    def write(self, chunk: PackedChunk) -> None:
        """Write a chunk that `pack` returned."""
        assert isinstance(chunk, _PackedRows)
        unknown = sorted(chunk.message_counts.keys() - self._topics.keys())
        if unknown:
            raise BagError(f"{self.path}: messages of topic {unknown[0]}, which was not added")
        if not chunk.message_count:
            return
        records = chunk.records
        rows = zip(
            records.log_times, records.topic_ids, map(records.__getitem__, range(len(records))), strict=True
        )
        with self._errors():
            self._connection.execute("BEGIN")
            self._connection.executemany(
                "INSERT INTO messages (timestamp, topic_id, data) VALUES (?, ?, ?)", rows
            )
            self._connection.execute("COMMIT")
        self._counts.update(chunk.message_counts)
        times = [*(self._times or ()), min(records.log_times), max(records.log_times)]
        self._times = min(times), max(times)

    def add_attachment(self, attachment: Attachment) -> None:
        """Raise a BagError: a database has no room for attachments."""
        raise BagError(
            f"{self.path}: sqlite3 has no room for the attachment {attachment.name}; write MCAP instead"
        )

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write what rosbag2 says of the bag; for anything else there is no room, which is a BagError."""
        if name != ROSBAG2 or values.keys() != {SERIALIZED_METADATA}:
            raise BagError(f"{self.path}: sqlite3 has no room for the metadata {name}; write MCAP instead")
        insertion = "INSERT INTO metadata (metadata_version, metadata) VALUES (?, ?)"
        self._execute(insertion, WRITTEN_VERSION, values[SERIALIZED_METADATA])

    def finish(self) -> None:
        """Index the messages by time, and close the file."""
        self._execute(_INDEX)
        self._connection.close()

    def _add_definitions(self, topic: Topic) -> None:
        is_protobuf = topic.serialization_format == PROTOBUF
        definition = topic.ros_definition if is_protobuf else topic.definition
        if is_protobuf:
            self._add_descriptor(topic)
        name = definition_names(topic.type_name)[-1]
        if definition.encoding and name not in self._defined:
            self._defined[name] = topic, definition
            self._execute(_ADD_DEFINITION, name, definition.encoding, definition.data, topic.type_hash)
        elif definition.encoding and not is_protobuf:  # of which the descriptors say more
            other, defined = self._defined[name]
            # Not so for the event of a service, and its request; and a hash says all of the type, but no comments.
            same_type = topic.type_name == other.type_name
            if same_type and definition != defined and not topic.type_hash == other.type_hash != "":
                raise self._no_room(topic, other)

    def _add_descriptor(self, topic: Topic) -> None:
        name = _type_name(topic)
        if name not in self._described:
            self._described[name] = topic
            self._execute(_DESCRIPTORS)
            row = name, topic.schema_name, topic.definition.data
            self._execute("INSERT INTO protobuf_descriptors VALUES (?, ?, ?)", *row)
        elif topic.definition != self._described[name].definition:
            raise self._no_room(topic, self._described[name])

    def _no_room(self, topic: Topic, other: Topic) -> BagError:
        return BagError(
            f"{self.path}: {topic.name} and {other.name} have other definitions of {_type_name(topic)}, and sqlite3 "
            "has room for one; write MCAP instead"
        )

    def _execute(self, statement: str, *values: object) -> None:
        with self._errors():
            self._connection.execute(statement, values)

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except OverflowError:
            raise BagError(
                f"{self.path}: sqlite3 has no room for times after 2262, or messages of 2 GB"
            ) from None
        except sqlite3.Error as error:
            raise BagError(f"{self.path}: sqlite3 says: {error}") from None


def _type_name(topic: Topic) -> str:
    """Return the ROS type of a topic; that of protobuf, if it has no other."""
    return topic.type_name or topic.schema_name
