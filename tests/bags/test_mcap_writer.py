"""MCAP files that we write, as the mcap library reads them."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO

import fsspec
import pytest
from mcap.reader import NonSeekingReader, SeekingReader
from mcap.records import Channel, Schema, SummaryOffset
from mcap.stream_reader import StreamReader

import rosidl_adapter_proto
from rosidl_adapter_proto.bags.compression import COMPRESSIONS
from rosidl_adapter_proto.bags.mcap_reader import McapReader
from rosidl_adapter_proto.bags.mcap_writer import McapWriter
from rosidl_adapter_proto.bags.model import Attachment, RecordedDefinition, Statistics, Topic
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.records import pack_records
from tests.bags.mcap_files import MESSAGES, QOS, RIHS, Recorded, messages_of, messages_of_library, reader_of

ROS = RecordedDefinition("ros2msg", b"string data\n")
CDR = Topic(
    "/a",
    "std_msgs/msg/String",
    "cdr",
    ROS,
    schema_name="std_msgs/msg/String",
    type_hash=RIHS,
    qos_profiles=QOS,
    metadata={"color": "blue"},
)
PROTOBUF = Topic(
    "/b",
    "std_msgs/msg/String",
    "protobuf",
    RecordedDefinition("protobuf", b"\x0a\x00"),
    ROS,
    schema_name="std_msgs.msg.pb.String",
    qos_profiles=QOS,
)
ATTACHMENT = Attachment("map.png", "image/png", 5, 6, b"\x89PNG")


class Sink(BytesIO):
    """A file that can only be written to, whose bytes outlive it."""

    data = b""

    def seekable(self) -> bool:
        return False

    def seek(self, offset: int, whence: int = 0) -> int:
        raise OSError("not seekable")

    def close(self) -> None:
        self.data = self.getvalue()


def records(messages: Sequence[Recorded], topic_ids: dict[str, int]) -> bytearray:
    """Return messages as a chunk."""
    return bytearray(
        pack_records(
            array("H", [topic_ids[message.topic] for message in messages]),
            array("I", [message.sequence for message in messages]),
            array("Q", [message.log_time for message in messages]),
            array("Q", [message.publish_time for message in messages]),
            [message.data for message in messages],
        )
    )


def write(topics: Sequence[Topic], *, profile: str = "ros2", compression: str = "", pieces: int = 4) -> bytes:
    """Return a file with all messages, in several chunks."""
    sink = Sink()
    with McapWriter(sink, "b.mcap", profile=profile, compression=compression) as writer:
        topic_ids = {topic.name: writer.add_topic(topic) for topic in topics}
        messages = [message for message in MESSAGES if message.topic in topic_ids]
        for start in range(0, len(messages), len(messages) // pieces):
            chunk = writer.pack(records(messages[start : start + len(messages) // pieces], topic_ids))
            writer.write(chunk)
        writer.finish()
    return sink.data


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("kind", [SeekingReader, NonSeekingReader])
def test_the_library_reads_every_message(
    kind: type[SeekingReader | NonSeekingReader], compression: str
) -> None:
    data = write([CDR, PROTOBUF], compression=compression)
    assert messages_of_library(data, kind) == sorted(MESSAGES, key=lambda message: message.log_time)
    assert tuple(messages_of(reader_of(data))) == MESSAGES


def test_what_the_library_finds_beside_the_messages() -> None:
    data = write([CDR, PROTOBUF], profile="", compression="zstd")
    reader = SeekingReader(BytesIO(data), validate_crcs=True)
    header, summary = reader.get_header(), reader.get_summary()
    assert (header.profile, header.library) == (
        "",
        f"rosidl_adapter_proto {rosidl_adapter_proto.__version__}",
    )
    assert summary is not None and summary.statistics is not None
    assert summary.schemas == {
        1: Schema(1, b"string data\n", "ros2msg", "std_msgs/msg/String"),
        2: Schema(2, b"\x0a\x00", "protobuf", "std_msgs.msg.pb.String"),
    }
    qos = {"offered_qos_profiles": QOS}
    assert summary.channels == {
        1: Channel(1, "/a", "cdr", {**qos, "topic_type_hash": RIHS, "color": "blue"}, 1),
        2: Channel(2, "/b", "protobuf", {**qos, "ros_type": "std_msgs/msg/String"}, 2),
    }
    assert summary.statistics.channel_message_counts == {1: 27, 2: 13}
    assert (summary.statistics.message_count, summary.statistics.chunk_count) == (40, 4)
    assert summary.statistics.message_start_time == min(message.log_time for message in MESSAGES)
    assert summary.statistics.message_end_time == max(message.log_time for message in MESSAGES)
    assert [(record.name, record.metadata) for record in reader.iter_metadata()] == [
        ("rosidl_adapter_proto.ros_definitions", {"std_msgs/msg/String": "ros2msg\nstring data\n"})
    ]


def test_only_groups_that_have_something_are_in_the_summary() -> None:
    summary = SeekingReader(BytesIO(write([CDR]))).get_summary()
    assert summary is not None and not summary.attachment_indexes and not summary.metadata_indexes

    offsets = [
        record for record in StreamReader(BytesIO(write([CDR]))).records if isinstance(record, SummaryOffset)
    ]
    assert [offset.group_opcode for offset in offsets] == [0x03, 0x04, 0x0B, 0x08]
    assert all(offset.group_length for offset in offsets)


def test_attachments_and_metadata_are_kept() -> None:
    sink = Sink()
    with McapWriter(sink, "b.mcap", profile="ros2") as writer:
        writer.add_attachment(ATTACHMENT)
        writer.add_metadata("rosbag2", {"serialized_metadata": "version: 8"})
        writer.add_topic(CDR, 7)
        writer.finish()
    library = SeekingReader(BytesIO(sink.data), validate_crcs=True)
    (attachment,) = library.iter_attachments()
    assert (attachment.name, attachment.media_type, attachment.data) == ("map.png", "image/png", b"\x89PNG")
    with reader_of(sink.data) as reader:
        assert list(reader.attachments()) == [ATTACHMENT]
        assert reader.metadata == [("rosbag2", {"serialized_metadata": "version: 8"})]
        assert reader.topics == {7: CDR}
        assert reader.statistics == Statistics()


def test_topics_keep_all_that_is_known_of_them() -> None:
    ros1 = Topic(
        "/c",
        "sensor_msgs/msg/Imu",
        "ros1",
        RecordedDefinition("ros1msg", b"x"),
        schema_name="sensor_msgs/Imu",
    )
    undefined = Topic("/d", "a/msg/B", "cdr", schema_name="a/msg/B")
    unknown = Topic("/e", "", "json")
    for topic in (CDR, PROTOBUF, ros1, undefined, unknown):
        assert list(reader_of(write_topics([topic])).topics.values()) == [topic]


def write_topics(topics: Sequence[Topic]) -> bytes:
    """Return a file with topics, and no messages."""
    sink = Sink()
    with McapWriter(sink, "b.mcap", profile="") as writer:
        for topic in topics:
            writer.add_topic(topic)
        writer.finish()
    return sink.data


def test_a_file_that_was_not_finished_has_all_that_its_chunks_need() -> None:
    sink = Sink()
    with McapWriter(sink, "b.mcap", profile="") as writer:
        topic_id = writer.add_topic(PROTOBUF)
        messages = [message for message in MESSAGES if message.topic == "/b"]
        writer.write(writer.pack(records(messages, {"/b": topic_id})))
    reader = reader_of(sink.data)
    assert list(messages_of(reader)) == messages
    assert reader.topics == {1: PROTOBUF}
    assert reader.warnings == [
        "a.mcap: the recording was not finished: it has no end; it was searched, and 13 messages were found"
    ]


def test_one_schema_is_written_for_topics_of_one_type() -> None:
    summary = SeekingReader(BytesIO(write_topics([CDR, replace(CDR, name="/z")]))).get_summary()
    assert summary is not None
    assert list(summary.schemas) == [1]
    assert [channel.schema_id for channel in summary.channels.values()] == [1, 1]


def test_several_definitions_of_one_type_are_kept_for_the_way_back() -> None:
    other = replace(
        PROTOBUF,
        name="/other",
        definition=RecordedDefinition("protobuf", b"\x0a\x02\x0a\x00"),
        ros_definition=RecordedDefinition("ros2msg", b"string data\nint32 more\n"),
    )
    topics = [PROTOBUF, other, replace(other, name="/third"), replace(PROTOBUF, name="/fourth")]
    assert list(reader_of(write_topics(topics)).topics.values()) == topics


def test_a_definition_with_letters_of_old_code_pages_is_kept_as_it_is() -> None:
    topic = replace(PROTOBUF, ros_definition=RecordedDefinition("ros2msg", b"# Gr\xf6\xdfe\nstring data\n"))
    data = write_topics([topic])
    (read,) = reader_of(data).topics.values()
    assert read.ros_definition == topic.ros_definition
    with pytest.raises(BagError) as caught:
        reader_of(data.replace(b" base64\nIyB", b" base64\n?yB"))
    assert str(caught.value).startswith("a.mcap: the ROS definition of std_msgs/msg/String is damaged: ")


def test_empty_chunks_are_not_written() -> None:
    sink = Sink()
    with McapWriter(sink, "b.mcap", profile="ros2") as writer:
        writer.write(writer.pack(b""))
        assert writer.statistics == Statistics()
        writer.finish()
    assert list(reader_of(sink.data).chunks()) == []


def test_what_cannot_be_written_is_refused() -> None:
    with pytest.raises(BagError) as unknown:
        McapWriter(Sink(), "b.mcap", profile="", compression="gzip")
    assert str(unknown.value) == "the compression `gzip` is unknown to MCAP; these are known: zstd, lz4"
    writer = McapWriter(Sink(), "b.mcap", profile="")
    writer.add_topic(CDR, 3)
    with pytest.raises(BagError) as taken:
        writer.add_topic(PROTOBUF, 3)
    assert str(taken.value) == "b.mcap: the topic id 3 of `/b` is taken"
    with pytest.raises(BagError) as large:
        writer.add_topic(PROTOBUF, 65536)
    assert str(large.value) == "b.mcap: `/b` has the topic id 65536, and MCAP has ids up to 65535"
    with pytest.raises(BagError) as missing:
        writer.write(writer.pack(records(MESSAGES[:1], {"/a": 4})))
    assert str(missing.value) == "b.mcap: there are messages of topic id 4, which was not added"


def test_files_that_are_somewhere_else() -> None:
    """Files of fsspec can only be written from the front to the end."""
    memory = fsspec.filesystem("memory")
    with McapWriter(memory.open("/b.mcap", "wb"), "memory://b.mcap", profile="ros2") as writer:
        topic_ids = {topic.name: writer.add_topic(topic) for topic in (CDR, PROTOBUF)}
        writer.write(writer.pack(records(MESSAGES, topic_ids)))
        writer.finish()
    with McapReader(memory.open("/b.mcap", "rb"), "memory://b.mcap") as reader:
        assert tuple(messages_of(reader)) == MESSAGES
