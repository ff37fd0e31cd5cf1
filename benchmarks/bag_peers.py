"""What can be done with bags without this project, and the least that any program has to do."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import islice
from pathlib import Path
from typing import IO, Any

from bag_maker import typestore
from isal.isal_zlib import crc32
from messages import assign_to_protobuf, copy_header, copy_imu, copy_vector

from rosidl_adapter_proto.bags.compression import compress, records_of
from rosidl_adapter_proto.bags.model import StoredChunk

MAGIC = b"\x89MCAP0\r\n"
CHUNK = 0x06
RECORD = struct.Struct("<BQ")  # of a record: its opcode and its length (https://mcap.dev/spec#records)
CHUNK_HEAD = struct.Struct("<QQQII")


def copy_chunks(source: Path, destination: Path, compression: str, threads: int) -> None:
    """Copy an MCAP file without looking into its chunks.

    Each is read, decompressed, compared with its checksum, compressed, given its checksum and written, by the code that
    conversions have for that. What else is in the file is copied, so that as much is written as in a real one; its
    index leads nowhere.
    """
    with source.open("rb") as read, destination.open("wb") as write, ThreadPoolExecutor(threads) as pool:
        write.write(read.read(len(MAGIC)))
        under_way: deque[Callable[[], Sequence[Any]]] = deque()
        for opcode, content in records(read):
            if opcode != CHUNK:
                under_way.append(partial(record, opcode, content))
            elif threads == 1:
                under_way.append(partial(chunk_again, content, compression))
            else:
                under_way.append(pool.submit(chunk_again, content, compression).result)
            while len(under_way) > 4 * threads:
                write.writelines(under_way.popleft()())
        for result in under_way:
            write.writelines(result())
        write.write(MAGIC)


def records(file: IO[bytes]) -> Iterator[tuple[int, bytes]]:
    """Yield the opcode and the content of the records of an MCAP file."""
    while len(head := file.read(RECORD.size)) == RECORD.size:
        opcode, length = RECORD.unpack(head)
        yield opcode, file.read(length)


def record(opcode: int, *contents: Any) -> Sequence[Any]:
    """Return the bytes of a record, in pieces."""
    return RECORD.pack(opcode, sum(map(len, contents))), *contents


def chunk_again(content: bytes, compression: str) -> Sequence[Any]:
    """Return the record of a chunk (https://mcap.dev/spec#chunk-op0x06), decompressed and compressed again."""
    start_time, end_time, size, crc, name_size = CHUNK_HEAD.unpack_from(content)
    data = memoryview(content)[CHUNK_HEAD.size + name_size + 8 :]
    plain = records_of(StoredChunk("", data, compression, size, crc, start_time, end_time))
    again = compress(plain, compression)
    head = CHUNK_HEAD.pack(start_time, end_time, size, crc32(plain), name_size)
    return record(CHUNK, head, compression.encode(), len(again).to_bytes(8, "little"), again)


def copy_with_library(source: Path, destination: Path, compression: str) -> None:
    """Copy a file with the mcap library, message by message."""
    from mcap.reader import make_reader
    from mcap.writer import Writer

    with source.open("rb") as read, destination.open("wb") as write:
        writer = Writer(write, compression=mcap_compression(compression))
        writer.start(profile="ros2")
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(read).iter_messages(log_time_order=False):
            if channel.id not in channels:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schema_id, channel.metadata
                )
            writer.add_message(
                channels[channel.id],
                message.log_time,
                message.data,
                message.publish_time,
                message.sequence,
            )
        writer.finish()


def mcap_compression(name: str) -> Any:
    from mcap.writer import CompressionType

    return CompressionType[(name or "none").upper()]


def convert_by_hand(source: Path, destination: Path, classes: dict[str, Any], count: int) -> None:
    """Convert the first messages of a bag as one does today: rosbags, a copy of each attribute, and the mcap writer.

    Args:
        source: An MCAP file.
        destination: The MCAP file to write.
        classes: The protobuf class of each ROS type.
        count: How many messages.
    """
    from mcap.writer import Writer
    from rosbags.highlevel import AnyReader

    with AnyReader([source]) as reader, destination.open("wb") as write:
        writer = Writer(write, compression=mcap_compression(""))
        writer.start(profile="")
        channels: dict[str, int] = {}
        for connection, time, data in islice(reader.messages(), count):
            custom_class = classes[connection.msgtype]
            if connection.topic not in channels:
                descriptor = custom_class.DESCRIPTOR
                schema = writer.register_schema(descriptor.full_name, "protobuf", descriptor_set(descriptor))
                channels[connection.topic] = writer.register_channel(connection.topic, "protobuf", schema)
            message = reader.deserialize(data, connection.msgtype)
            custom = COPIES[connection.msgtype](message, custom_class())
            writer.add_message(channels[connection.topic], time, custom.SerializeToString(), time)
        writer.finish()


def descriptor_set(descriptor: Any) -> bytes:
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

    files: dict[str, Any] = {}

    def add(file: Any) -> None:
        for each in file.dependencies:
            add(each)
        files[file.name] = file

    add(descriptor.file)
    result = FileDescriptorSet()
    for file in files.values():
        file.CopyToProto(result.file.add())
    return result.SerializeToString()


# Adapters as a user would write them: attribute by attribute.


def copy_joint_state(source: Any, target: Any) -> Any:
    copy_header(source, target)
    target.name.extend(source.name)
    for name in ("position", "velocity", "effort"):
        assign_to_protobuf(target, name, getattr(source, name))
    return target


def copy_tf(source: Any, target: Any) -> Any:
    for each in source.transforms:
        copied = target.transforms.add()
        copy_header(each, copied)
        copied.child_frame_id = each.child_frame_id
        copy_vector(each.transform.translation, copied.transform.translation, "xyz")
        copy_vector(each.transform.rotation, copied.transform.rotation, "xyzw")
    return target


COPIES: dict[str, Callable[[Any, Any], Any]] = {
    "sensor_msgs/msg/Imu": lambda source, target: copy_imu(source, target, assign_to_protobuf),
    "sensor_msgs/msg/JointState": copy_joint_state,
    "tf2_msgs/msg/TFMessage": copy_tf,
}


# Reading.


def read_with_rosbags(source: Path, count: int) -> int:
    """Deserialize the first messages of a bag with rosbags, and return how many there were."""
    from rosbags.highlevel import AnyReader

    number = 0
    with AnyReader([source], default_typestore=typestore()) as reader:
        for connection, _, data in islice(reader.messages(), count):
            reader.deserialize(data, connection.msgtype)
            number += 1
    return number


def read_with_mcap_ros2(source: Path, count: int) -> int:
    """Decode the first messages of a bag with mcap-ros2-support, and return how many there were."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with source.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return sum(1 for _ in islice(reader.iter_decoded_messages(), count))


def copy_rows(source: Path, destination: Path) -> None:
    """Copy the messages of a sqlite3 file, as one does who does not look at them."""
    import sqlite3

    with sqlite3.connect(source) as read, sqlite3.connect(destination) as write:
        write.execute(
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
        )
        write.executemany(
            "INSERT INTO messages VALUES (?, ?, ?, ?)",
            read.execute("SELECT id, topic_id, timestamp, data FROM messages ORDER BY timestamp"),
        )
    read.close()
    write.close()
