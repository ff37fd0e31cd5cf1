"""sqlite3 files of bags for tests, in every schema that rosbag2 has had."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from rosidl_adapter_proto.bags.compression import records_of
from rosidl_adapter_proto.bags.model import EVERYTHING, Selection
from rosidl_adapter_proto.bags.storage import StorageReader
from rosidl_adapter_proto.transcode.records import read_records

_OLD_TOPICS = """CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,
serialization_format TEXT NOT NULL"""
_MESSAGES = """CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,
timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);"""
_THREE = """CREATE TABLE schema(schema_version INTEGER PRIMARY KEY,ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY,metadata_version INTEGER NOT NULL,metadata TEXT NOT NULL);"""
_QOS = ",offered_qos_profiles TEXT NOT NULL"
_FOUR = """CREATE TABLE message_definitions(id INTEGER PRIMARY KEY,topic_type TEXT NOT NULL,encoding TEXT NOT NULL,
encoded_message_definition TEXT NOT NULL,type_description_hash TEXT NOT NULL);"""

SCHEMAS = {
    1: f"{_OLD_TOPICS});{_MESSAGES}",
    2: f"{_OLD_TOPICS}{_QOS});{_MESSAGES}",
    3: f"{_THREE}{_OLD_TOPICS}{_QOS});{_MESSAGES}INSERT INTO schema VALUES (3, 'humble');",
    4: f"{_THREE}{_OLD_TOPICS}{_QOS},type_description_hash TEXT NOT NULL);{_FOUR}{_MESSAGES}"
    "INSERT INTO schema VALUES (4, 'jazzy');",
}
QOS = """\
- history: 3
  depth: 0
  reliability: 1
  durability: 2
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false"""
NAMED_QOS = (
    QOS.replace("history: 3", "history: unknown")
    .replace("reliability: 1", "reliability: reliable")
    .replace("durability: 2", "durability: volatile")
    .replace("liveliness: 1", "liveliness: automatic")
)
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


class Row(NamedTuple):
    """A message of the table."""

    topic: str
    time: int
    data: bytes


ROWS = tuple(
    Row(("/a", "/b")[i % 3 == 2], 1000 + i * 10 - i % 4 * 15, bytes([i]) * (10 + i)) for i in range(40)
)
"""Messages of two topics that are not quite in the order of time."""


def database(path: Path, schema: int = 4, rows: Iterable[Row] = ROWS, more: str = "") -> Path:
    """Make a database with the topics `/a` (row 1) and `/b` (row 2) of std_msgs/msg/String.

    Args:
        path: Where.
        schema: The version of the schema.
        rows: The messages.
        more: SQL that is executed at the end.
    """
    with sqlite3.connect(path) as connection:
        connection.executescript(SCHEMAS[schema])
        for number, name in enumerate(("/a", "/b"), start=1):
            values = [number, name, "std_msgs/msg/String", "cdr", QOS, STRING_HASH][
                : 3 + min(schema, 2) + (schema == 4)
            ]
            connection.execute(f"INSERT INTO topics VALUES ({', '.join('?' * len(values))})", values)
        if schema == 4:
            definition = ("std_msgs/msg/String", "ros2msg", "string data\n", STRING_HASH)
            connection.execute("INSERT INTO message_definitions VALUES (1, ?, ?, ?, ?)", definition)
        insertion = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)"
        connection.executemany(
            insertion, ((("/a", "/b").index(row.topic) + 1, row.time, row.data) for row in rows)
        )
        connection.executescript(more)
    connection.close()
    return path


def rows_of(reader: StorageReader, selection: Selection = EVERYTHING, **options: bool) -> list[Row]:
    """Return the messages of a reader."""
    rows: list[Row] = []
    for chunk in reader.chunks(selection, **options):
        records = read_records(
            records_of(chunk), selection.topic_ids, selection.start_time, selection.end_time
        )
        rows += [
            Row(reader.topics[records.topic_ids[index]].name, records.log_times[index], bytes(records[index]))
            for index in range(len(records))
        ]
    return rows
