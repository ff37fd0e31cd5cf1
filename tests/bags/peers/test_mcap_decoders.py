"""Messages in MCAP files that we write, decoded by the decoders of the mcap project."""

from __future__ import annotations

from array import array
from io import BytesIO

import mcap_protobuf.decoder
import mcap_ros2.decoder
from google.protobuf import descriptor_pb2, wrappers_pb2
from mcap.reader import make_reader

from rosidl_adapter_proto.bags.mcap_writer import McapWriter
from rosidl_adapter_proto.bags.model import RecordedDefinition, Topic
from rosidl_adapter_proto.transcode.records import pack_records

STRING = Topic("/chatter", "std_msgs/msg/String", "cdr", RecordedDefinition("ros2msg", b"string data\n"))
FILES = descriptor_pb2.FileDescriptorSet()
wrappers_pb2.DESCRIPTOR.CopyToProto(FILES.file.add())
VALUE = Topic(
    "/chatter",
    "std_msgs/msg/String",
    "protobuf",
    RecordedDefinition("protobuf", FILES.SerializeToString()),
    schema_name="google.protobuf.StringValue",
)


def write(topic: Topic, message: bytes) -> BytesIO:
    """Return a file with one message."""
    file = BytesIO()
    writer = McapWriter(file, "a.mcap", profile="ros2" if topic is STRING else "", compression="zstd")
    topic_id = writer.add_topic(topic)
    writer.write(
        writer.pack(
            pack_records(array("H", [topic_id]), array("I", [1]), array("Q", [2]), array("Q", [3]), [message])
        )
    )
    file.close = lambda: None  # type: ignore[method-assign]
    writer.finish()
    return BytesIO(file.getvalue())


def test_ros_2() -> None:
    file = write(STRING, b"\x00\x01\x00\x00\x06\x00\x00\x00hello\x00")
    reader = make_reader(file, decoder_factories=[mcap_ros2.decoder.DecoderFactory()])
    assert [decoded.decoded_message.data for decoded in reader.iter_decoded_messages()] == ["hello"]


def test_protobuf() -> None:
    file = write(VALUE, wrappers_pb2.StringValue(value="hello").SerializeToString())
    reader = make_reader(file, decoder_factories=[mcap_protobuf.decoder.DecoderFactory()])
    assert [decoded.decoded_message.value for decoded in reader.iter_decoded_messages()] == ["hello"]
