"""MCAP files that others wrote: with and without all that is optional."""

from __future__ import annotations

from collections import Counter
from io import BytesIO
from typing import Any

import pytest
from mcap.writer import CompressionType, IndexType, Writer

from rosidl_adapter_proto.bags.mcap_reader import McapReader
from rosidl_adapter_proto.bags.model import Attachment, RecordedDefinition, Selection, Statistics, Topic
from rosidl_adapter_proto.errors import BagError
from tests.bags.mcap_files import (
    MESSAGES,
    NO_SUMMARY,
    QOS,
    RIHS,
    STRING,
    Recorded,
    mcap_file,
    messages_of,
    reader_of,
)

STATISTICS = Statistics(
    dict(Counter(1 if message.topic == "/a" else 2 for message in MESSAGES)),
    min(message.log_time for message in MESSAGES),
    max(message.log_time for message in MESSAGES),
)
SEARCHED = (
    "a.mcap: the summary is missing, or leaves something out; it was searched, and 40 messages were found"
)


def topic(name: str) -> Topic:
    """Return a topic of the files of these tests."""
    return Topic(
        name,
        "std_msgs/msg/String",
        "cdr",
        RecordedDefinition("ros2msg", STRING),
        schema_name="std_msgs/msg/String",
        type_hash=RIHS,
        qos_profiles=QOS,
        metadata={"color": "blue"},
    )


@pytest.mark.parametrize(
    ("options", "warnings"),
    [
        ({}, []),
        ({"compression": CompressionType.ZSTD}, []),
        ({"compression": CompressionType.LZ4}, []),
        ({"enable_crcs": False}, []),
        ({"enable_data_crcs": True}, []),
        ({"use_summary_offsets": False}, []),
        ({"index_types": IndexType.NONE}, []),
        ({"use_chunking": False}, []),
        ({"repeat_channels": False}, [SEARCHED]),
        ({"repeat_schemas": False}, [SEARCHED]),
        ({"use_statistics": False}, [SEARCHED]),
        (NO_SUMMARY, [SEARCHED]),
        ({**NO_SUMMARY, "use_chunking": False}, [SEARCHED]),
        ({**NO_SUMMARY, "compression": CompressionType.ZSTD}, [SEARCHED]),
    ],
)
def test_whatever_is_optional(options: dict[str, Any], warnings: list[str]) -> None:
    with reader_of(mcap_file(**options)) as reader:
        assert reader.topics == {1: topic("/a"), 2: topic("/b")}
        assert reader.statistics == STATISTICS
        assert tuple(messages_of(reader)) == MESSAGES
        assert reader.warnings == warnings
        assert (reader.profile, reader.path, reader.storage) == ("ros2", "a.mcap", "mcap")


def test_a_recording_may_be_empty() -> None:
    reader = reader_of(mcap_file([]))
    assert (reader.topics, reader.statistics, list(reader.chunks())) == ({}, Statistics(), [])


def test_chunks_say_how_many_messages_they_have() -> None:
    chunks = list(reader_of(mcap_file()).chunks())
    assert sum(chunk.message_count or 0 for chunk in chunks) == 40
    assert len(chunks) > 3
    assert chunks[0].where == "a.mcap at byte 33"
    unknown = reader_of(mcap_file(index_types=IndexType.CHUNK)).chunks()
    assert {chunk.message_count for chunk in unknown} == {None}


def test_messages_without_chunks_are_read_in_pieces() -> None:
    messages = [Recorded("/a", i, i, i, bytes(300_000 if i % 5 else 3_000_000)) for i in range(10)]
    chunks = list(reader_of(mcap_file(messages, use_chunking=False)).chunks())
    assert [chunk.message_count for chunk in chunks] == [1, 3, 1, 1, 3, 1]
    assert [(chunk.start_time, chunk.end_time) for chunk in chunks] == [
        (0, 0),
        (1, 3),
        (4, 4),
        (5, 5),
        (6, 8),
        (9, 9),
    ]
    assert list(messages_of(reader_of(mcap_file(messages, use_chunking=False)))) == messages


@pytest.mark.parametrize(
    "options", [{}, {"use_chunking": False}, NO_SUMMARY, {"index_types": IndexType.NONE}]
)
@pytest.mark.parametrize(
    "selection",
    [
        Selection(frozenset({2})),
        Selection(frozenset({1}), 1100, 1200),
        Selection(start_time=1200),
        Selection(end_time=1200),
        Selection(frozenset()),
        Selection(frozenset({9})),
    ],
)
def test_a_selection(selection: Selection, options: dict[str, Any]) -> None:
    expected = [
        message
        for message in MESSAGES
        if (selection.topic_ids is None or {"/a": 1, "/b": 2}[message.topic] in selection.topic_ids)
        and message.log_time >= selection.start_time
        and (selection.end_time is None or message.log_time < selection.end_time)
    ]
    assert list(messages_of(reader_of(mcap_file(**options)), selection)) == expected


def test_chunks_without_anything_selected_are_left_out() -> None:
    messages = [Recorded("/a" if i < 20 else "/b", i, i, i, bytes(30)) for i in range(40)]
    reader = reader_of(mcap_file(messages))
    everything = len(list(reader.chunks()))
    assert 0 < len(list(reader.chunks(Selection(frozenset({1}))))) < everything
    assert 0 < len(list(reader.chunks(Selection(start_time=30)))) < everything


def more(writer: Writer) -> None:
    writer.add_attachment(6, 5, "map.png", "image/png", b"\x89PNG")
    writer.add_metadata("notes", {"driver": "me"})
    writer.add_metadata("notes", {"driver": "you"})


@pytest.mark.parametrize(
    "options", [{}, NO_SUMMARY, {"index_types": IndexType.CHUNK}, {"index_types": IndexType.METADATA}]
)
def test_attachments_and_metadata(options: dict[str, Any]) -> None:
    reader = reader_of(mcap_file(more=more, **options))
    assert list(reader.attachments()) == [Attachment("map.png", "image/png", 5, 6, b"\x89PNG")]
    assert reader.metadata == [("notes", {"driver": "me"}), ("notes", {"driver": "you"})]
    assert tuple(messages_of(reader)) == MESSAGES


def test_channels_that_rosbag2_does_not_count() -> None:
    """It repeats the channels without messages in the summary, where alone they are, and counts only the others."""
    data = mcap_file(more=lambda writer: writer.register_channel("/unused", "cdr", 1))
    reader = reader_of(data)
    assert [topic.name for topic in reader.topics.values()] == ["/a", "/b", "/unused"]
    assert reader.statistics == STATISTICS and not reader.warnings


def test_qos_with_names_is_read_as_that_with_numbers() -> None:
    """rosbag2 writes names since version 9 of the metadata."""

    def named(writer: Writer) -> None:
        qos = "- history: keep_last\n  depth: 5\n  reliability: best_effort\n"
        writer.register_channel("/c", "cdr", 1, {"offered_qos_profiles": qos})

    topics = reader_of(mcap_file(more=named)).topics
    assert topics[3].qos_profiles == "- history: 1\n  depth: 5\n  reliability: 2"


def test_several_channels_of_one_topic_are_topics_of_their_own() -> None:
    def again(writer: Writer) -> None:
        channel = writer.register_channel("/a", "cdr", 1, {"offered_qos_profiles": "- depth: 5\n"})
        writer.add_message(channel, 5000, b"again", 5000)

    reader = reader_of(mcap_file(more=again))
    assert [topic.name for topic in reader.topics.values()] == ["/a", "/b", "/a"]
    assert [message.data for message in messages_of(reader)][-1] == b"again"


ROSBAG2 = """\
version: 8
storage_identifier: mcap
relative_file_paths: []
topics_with_message_count:
  - topic_metadata:
      name: /t
      type: std_msgs/msg/Header
      serialization_format: protobuf
"""


@pytest.mark.parametrize(
    ("encoding", "schema", "metadata", "type_name"),
    [
        ("cdr", ("std_msgs/msg/String", "ros2msg"), {}, "std_msgs/msg/String"),
        ("cdr", ("std_msgs/srv/Trigger_Event", "ros2idl"), {}, "std_msgs/srv/Trigger_Event"),
        ("cdr", None, {}, "std_msgs/msg/Header"),
        ("ros1", ("sensor_msgs/Imu", "ros1msg"), {}, "sensor_msgs/msg/Imu"),
        ("ros1", ("Odd", "ros1msg"), {}, "Odd"),
        ("protobuf", ("sensor_msgs.msg.pb.Imu", "protobuf"), {}, "sensor_msgs/msg/Imu"),
        ("protobuf", ("std_srvs.srv.pb.Trigger_Event", "protobuf"), {}, "std_srvs/srv/Trigger_Event"),
        (
            "protobuf",
            ("foxglove.Imu", "protobuf"),
            {"ros_type": "sensor_msgs/msg/Imu"},
            "sensor_msgs/msg/Imu",
        ),
        ("protobuf", ("foxglove.SceneUpdate", "protobuf"), {}, "std_msgs/msg/Header"),
        ("json", ("Scene", "jsonschema"), {}, "std_msgs/msg/Header"),
        ("json", ("std_msgs/msg/String", "jsonschema"), {}, "std_msgs/msg/String"),
    ],
)
@pytest.mark.parametrize("rosbag2", [ROSBAG2, None])
def test_the_type_of_a_topic(
    encoding: str,
    schema: tuple[str, str] | None,
    metadata: dict[str, str],
    type_name: str,
    rosbag2: str | None,
) -> None:
    def add(writer: Writer) -> None:
        schema_id = writer.register_schema(*schema, b"definition") if schema else 0
        writer.register_channel("/t", encoding, schema_id, metadata)
        if rosbag2 is not None:
            writer.add_metadata("rosbag2", {"serialized_metadata": "version: 99"})
            writer.add_metadata("rosbag2", {"serialized_metadata": rosbag2})

    (read,) = reader_of(mcap_file([], more=add)).topics.values()
    expected = "" if type_name == "std_msgs/msg/Header" and rosbag2 != ROSBAG2 else type_name
    assert (read.name, read.type_name, read.serialization_format) == ("/t", expected, encoding)
    assert read.schema_name == (schema[0] if schema else "")
    assert read.definition == (
        RecordedDefinition(schema[1], b"definition") if schema else RecordedDefinition()
    )
    assert not read.metadata


def test_the_file_is_closed_with_its_reader() -> None:
    file = BytesIO(mcap_file())
    with McapReader(file, "a.mcap"):
        pass
    assert file.closed


@pytest.mark.parametrize("schema", ["std_msgs/msg/String", ""])
def test_a_description_of_rosbag2_is_needed_only_where_a_type_is_not_known(schema: str) -> None:
    def add(writer: Writer) -> None:
        writer.register_channel("/t", "cdr", writer.register_schema(schema, "", b""))
        writer.add_metadata("rosbag2", {"serialized_metadata": "version: 99"})

    data = mcap_file([], more=add)
    if schema:
        assert [topic.type_name for topic in reader_of(data).topics.values()] == [schema]
        return
    with pytest.raises(BagError) as caught:
        reader_of(data)
    assert str(caught.value) == (
        "a.mcap, the metadata in it: version: 99 is not known (1 to 9); name a file of the bag instead of its folder"
    )
