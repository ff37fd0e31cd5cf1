"""What a bag is, whatever storage it is in: topics, and chunks of messages.

A chunk is a batch: the messages of a piece of a recording, one after the other, in one piece of memory. It has the form
that MCAP gives its chunks (https://mcap.dev/spec#chunk-op0x06), whatever storage it comes from or goes to, and is read
and written by the native module: nothing in Python looks at a message while a bag is converted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing_extensions import Buffer

CDR = "cdr"
PROTOBUF = "protobuf"
ROS1 = "ros1"


@dataclass(frozen=True)
class RecordedDefinition:
    """The definition of a type, as a recording has it.

    Attributes:
        encoding: How it is written: `ros2msg`, `ros2idl`, `ros1msg` or `protobuf`; empty if there is none.
        data: The definition and those of all types that it refers to. For protobuf, a serialized `FileDescriptorSet`.
    """

    encoding: str = ""
    data: bytes = b""


@dataclass(frozen=True)
class Topic:
    """One topic of a recording, and how its messages are written.

    Attributes:
        name: Its name, such as `/imu`.
        type_name: The ROS type of its messages, such as `sensor_msgs/msg/Imu`.
        serialization_format: How its messages are serialized, such as `cdr`, in the words of rosbag2.
        definition: The definition in the recording of what the bytes are: ROS's, or a descriptor for protobuf.
        ros_definition: ROS's definition of the type, where `definition` is another one.
        schema_name: What the recording calls the type: for protobuf, the full name of the protobuf message.
        type_hash: The RIHS01 hash that it was recorded with (REP-2011); empty if unknown.
        qos_profiles: The QoS profiles that it was offered with, as the YAML text of rosbag2; may be empty.
        metadata: Whatever else the recording says of it.
    """

    name: str
    type_name: str
    serialization_format: str
    definition: RecordedDefinition = field(default=RecordedDefinition(), repr=False)
    ros_definition: RecordedDefinition = field(default=RecordedDefinition(), repr=False)
    schema_name: str = ""
    type_hash: str = ""
    qos_profiles: str = field(default="", repr=False)
    metadata: Mapping[str, str] = field(default_factory=dict, repr=False)


def message_place(path: str, number: int, topic: str, log_time: int) -> str:
    """Return where a message is, for people.

    Args:
        path: The file.
        number: Which message of the topic it is; the first one is 1.
        topic: The name of the topic.
        log_time: When it was recorded, in nanoseconds since 1970.
    """
    return f"{path}: message {number} of {topic}, recorded at {log_time}"


@dataclass(frozen=True)
class Attachment:
    """A file inside a recording (https://mcap.dev/spec#attachment-op0x09)."""

    name: str
    media_type: str
    log_time: int
    create_time: int
    data: bytes = field(repr=False)


@dataclass(frozen=True)
class Statistics:
    """How much is in a recording.

    Attributes:
        message_counts: The number of messages of each topic, by the topic's id in the recording.
        start_time: When the first message was recorded, in nanoseconds since 1970; 0 without messages.
        end_time: When the last message was recorded, in nanoseconds since 1970; 0 without messages.
    """

    message_counts: Mapping[int, int] = field(default_factory=dict)
    start_time: int = 0
    end_time: int = 0

    @property
    def message_count(self) -> int:
        """The number of all messages."""
        return sum(self.message_counts.values())


@dataclass(frozen=True)
class Selection:
    """Which messages to read.

    Attributes:
        topic_ids: Those of these topics; None for all.
        start_time: Those recorded at this time or later, in nanoseconds since 1970.
        end_time: Those recorded before this time; None for no end.
    """

    topic_ids: frozenset[int] | None = None
    start_time: int = 0
    end_time: int | None = None


EVERYTHING = Selection()


@dataclass(frozen=True)
class StoredChunk:
    """A chunk as it lies in a file, perhaps compressed.

    Attributes:
        where: Its place, for people, such as `a.mcap at byte 1234`.
        data: What is stored.
        compression: `zstd`, `lz4`, or empty.
        size: Its size in bytes when it is not compressed.
        crc: The CRC-32 of it when it is not compressed; 0 if unknown.
        start_time: When its first message was recorded, in nanoseconds since 1970.
        end_time: When its last message was recorded, in nanoseconds since 1970.
        message_count: How many messages the storage says it has; None if it does not say.
        position: Where it is in its file: a later chunk has a higher one. Only MCAP, whose chunks may overlap in time,
            needs one.
    """

    where: str
    data: Buffer = field(repr=False)
    compression: str
    size: int
    crc: int
    start_time: int
    end_time: int
    message_count: int | None = None
    position: int = 0
