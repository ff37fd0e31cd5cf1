"""Databases that are written: what rosbag2 would have written, read by sqlite3 and rosbags."""

from __future__ import annotations

import sqlite3
from array import array
from dataclasses import replace
from pathlib import Path

import pytest

from rosidl_adapter_proto.bags.model import PROTOBUF, Attachment, RecordedDefinition, Statistics, Topic
from rosidl_adapter_proto.bags.sqlite3_reader import SqliteReader
from rosidl_adapter_proto.bags.sqlite3_writer import SqliteWriter
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.records import pack_records
from tests.bags.databases import QOS, ROWS, STRING_HASH, Row, database, rows_of

STRING = Topic(
    "/a",
    "std_msgs/msg/String",
    "cdr",
    RecordedDefinition("ros2msg", b"string data\n"),
    schema_name="std_msgs/msg/String",
    type_hash=STRING_HASH,
    qos_profiles=QOS,
)
PROTOBUF_STRING = Topic(
    "/p",
    "std_msgs/msg/String",
    PROTOBUF,
    RecordedDefinition(PROTOBUF, b"\x0a\x00"),
    RecordedDefinition("ros2msg", b"string data\n"),
    schema_name="std_msgs.msg.pb.String",
)


def _records(rows: tuple[Row, ...]) -> bytearray:
    times = array("Q", [row.time for row in rows])
    topic_ids = array("H", [("/a", "/b").index(row.topic) + 1 for row in rows])
    return pack_records(topic_ids, array("I", range(len(rows))), times, times, [row.data for row in rows])


def _write(path: Path, topics: dict[int, Topic], rows: tuple[Row, ...] = ()) -> Statistics:
    with SqliteWriter(str(path), ros_distro="jazzy") as writer:
        for topic_id, topic in topics.items():
            assert writer.add_topic(topic, topic_id) == topic_id
        for part in (rows[:25], rows[25:], ()):
            chunk = writer.pack(_records(part))
            assert chunk.message_count == len(part)
            writer.write(chunk)
        writer.add_metadata("rosbag2", {"serialized_metadata": "version: 8\n"})
        writer.finish()
        return writer.statistics


def _dump(path: Path) -> dict[str, list[tuple[object, ...]]]:
    with sqlite3.connect(path) as connection:
        tables = ["sqlite_master", "schema", "topics", "message_definitions", "messages"]
        columns = {"sqlite_master": "type, name, tbl_name"}
        dump = {
            table: connection.execute(f"SELECT {columns.get(table, '*')} FROM {table}").fetchall()
            for table in tables
        }
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    connection.close()
    dump["sqlite_master"].sort()
    return dump


def test_what_is_written_is_what_rosbag2_writes(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    statistics = _write(
        path,
        {1: STRING, 2: Topic("/b", "std_msgs/msg/String", "cdr", type_hash=STRING_HASH, qos_profiles=QOS)},
        ROWS,
    )
    assert _dump(path) == _dump(database(tmp_path / "rosbag2.db3"))
    assert statistics == Statistics(
        {1: 27, 2: 13}, min(row.time for row in ROWS), max(row.time for row in ROWS)
    )
    with SqliteReader(str(path)) as reader:
        assert rows_of(reader) == list(ROWS)
        assert reader.topics[1] == STRING
        assert reader.statistics == statistics
        assert reader.metadata == [("rosbag2", {"serialized_metadata": "version: 8\n"})]


def test_rosbags_reads_what_is_written(tmp_path: Path) -> None:
    from rosbags.rosbag2 import Reader

    from rosidl_adapter_proto.bags.metadata import BagMetadata, TopicInformation, write_metadata

    topics = {1: STRING, 2: replace(STRING, name="/b")}
    _write(tmp_path / "a.db3", topics, ROWS)
    information = tuple(
        TopicInformation(topic, count) for topic, count in zip(topics.values(), (27, 13), strict=True)
    )
    metadata = BagMetadata("sqlite3", ("a.db3",), information, message_count=40)
    (tmp_path / "metadata.yaml").write_text(write_metadata(metadata))
    with Reader(tmp_path) as oracle:
        rows = [Row(connection.topic, time, bytes(data)) for connection, time, data in oracle.messages()]
        assert rows == sorted(ROWS, key=lambda row: row.time)
        assert oracle.connections[0].msgdef.data == "string data\n"
        assert oracle.connections[0].digest == STRING_HASH


def test_protobuf_topics_keep_descriptors_and_definitions(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    other = Topic(
        "/q", "std_msgs/msg/String", PROTOBUF, PROTOBUF_STRING.definition, PROTOBUF_STRING.ros_definition
    )
    _write(path, {7: PROTOBUF_STRING, 9: other})
    with SqliteReader(str(path)) as reader:
        assert reader.topics[7] == PROTOBUF_STRING
        assert reader.topics[9].definition == PROTOBUF_STRING.definition
    with sqlite3.connect(path) as connection:
        assert connection.execute("SELECT * FROM protobuf_descriptors").fetchall() == [
            ("std_msgs/msg/String", "std_msgs.msg.pb.String", b"\x0a\x00")
        ]
        assert connection.execute("SELECT topic_type FROM message_definitions").fetchall() == [
            ("std_msgs/msg/String",)
        ]
    connection.close()


def test_definitions_are_written_by_the_name_of_what_defines_them_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    definition = RecordedDefinition("ros2msg", b"# 20 \xb0C\nbool a\n---\n")
    topics = {
        1: Topic("/s/_service_event", "p/srv/S_Event", "cdr", definition, schema_name="p/srv/S_Event"),
        2: Topic("/t/_service_event", "p/srv/S_Event", "cdr", definition, schema_name="p/srv/S_Event"),
        3: Topic("/u", "p/msg/U", "cdr", schema_name="p/msg/U"),
    }
    _write(path, topics)
    with SqliteReader(str(path)) as reader:
        assert reader.topics == topics
    with sqlite3.connect(path) as connection:
        assert connection.execute("SELECT topic_type FROM message_definitions").fetchall() == [("p/srv/S",)]
    connection.close()


OTHER = {
    "a definition without a hash": (
        replace(STRING, type_hash=""),
        replace(STRING, name="/b", type_hash="", definition=RecordedDefinition("ros2msg", b"int8 data\n")),
    ),
    "a descriptor": (
        PROTOBUF_STRING,
        replace(PROTOBUF_STRING, name="/q", definition=RecordedDefinition(PROTOBUF, b"\x0a\x02\x0a\x00")),
    ),
}


@pytest.mark.parametrize("topics", OTHER.values(), ids=OTHER)
def test_a_second_definition_of_a_type_has_no_room(tmp_path: Path, topics: tuple[Topic, Topic]) -> None:
    path = tmp_path / "a.db3"
    one, other = topics
    with SqliteWriter(str(path)) as writer:
        writer.add_topic(one)
        with pytest.raises(BagError) as caught:
            writer.add_topic(other)
    assert str(caught.value) == (
        f"{path}: {other.name} and {one.name} have other definitions of std_msgs/msg/String, and sqlite3 has room for "
        "one; write MCAP instead"
    )


def test_a_definition_with_other_comments_is_the_same_by_its_hash(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    other = replace(STRING, name="/b", definition=RecordedDefinition("ros2msg", b"# Text\nstring data\n"))
    _write(path, {1: STRING, 2: other})
    with SqliteReader(str(path)) as reader:
        assert reader.topics[2] == replace(STRING, name="/b")


def test_protobuf_topics_without_ros_types_keep_their_descriptors(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    descriptors = {name: RecordedDefinition(PROTOBUF, name.encode()) for name in ("a.B", "a.C")}
    topics = [Topic(f"/{name}", "", PROTOBUF, data, schema_name=name) for name, data in descriptors.items()]
    _write(path, dict(enumerate(topics, 1)))
    with SqliteReader(str(path)) as reader:
        found = [(each.schema_name, each.definition) for each in reader.topics.values()]
    assert found == list(descriptors.items())


def test_names_of_qos_policies_are_written_as_numbers(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    _write(
        path, {1: Topic("/a", "p/msg/U", "cdr", qos_profiles="- history: keep_last\n  reliability: reliable")}
    )
    with sqlite3.connect(path) as connection:
        assert connection.execute("SELECT offered_qos_profiles FROM topics").fetchall() == [
            ("- history: 1\n  reliability: 1",)
        ]
    connection.close()


def test_ids_are_given_one_after_the_other(tmp_path: Path) -> None:
    with SqliteWriter(str(tmp_path / "a.db3")) as writer:
        assert [writer.add_topic(STRING), writer.add_topic(STRING, 5), writer.add_topic(STRING)] == [1, 5, 6]
        with pytest.raises(BagError, match=r"a\.db3: /a: the id 5 is that of /a$"):
            writer.add_topic(STRING, 5)


def test_nothing_that_exists_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    path.write_bytes(b"mine")
    for place, reason in ((path, "exists already"), (path / "b.db3", "Not a directory")):
        with pytest.raises(BagError) as caught:
            SqliteWriter(str(place))
        assert str(caught.value) == f"{place}: {reason}"
    assert path.read_bytes() == b"mine"


@pytest.mark.parametrize(
    ("work", "expected"),
    [
        (
            lambda writer: writer.add_attachment(Attachment("map.png", "image/png", 0, 0, b"")),
            "sqlite3 has no room for the attachment map.png; write MCAP instead",
        ),
        (
            lambda writer: writer.add_metadata("notes", {"a": "b"}),
            "sqlite3 has no room for the metadata notes; write MCAP instead",
        ),
        (
            lambda writer: writer.write(writer.pack(_records((Row("/b", 0, b""),)))),
            "messages of topic 2, which was not added",
        ),
        (
            lambda writer: writer.write(writer.pack(_records((Row("/a", 2**63, b""),)))),
            "sqlite3 has no room for times after 2262, or messages of 2 GB",
        ),
    ],
)
def test_what_has_no_room_is_said(tmp_path: Path, work: object, expected: str) -> None:
    with SqliteWriter(str(tmp_path / "a.db3")) as writer:
        writer.add_topic(STRING)
        with pytest.raises(BagError) as caught:
            work(writer)  # type: ignore[operator]
    assert str(caught.value) == f"{tmp_path / 'a.db3'}: {expected}"


def test_a_full_disk_is_said(tmp_path: Path) -> None:
    with SqliteWriter(str(tmp_path / "a.db3")) as writer:
        writer.add_topic(STRING)
        writer._connection.execute("PRAGMA max_page_count = 20")
        with pytest.raises(BagError) as caught:
            writer.write(writer.pack(_records(tuple(Row("/a", 0, bytes(10_000)) for _ in range(20)))))
    assert str(caught.value) == f"{tmp_path / 'a.db3'}: sqlite3 says: database or disk is full"
