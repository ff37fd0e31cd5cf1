"""Conversions of other formats: with plugins, and from ROS 1."""

from __future__ import annotations

import threading
from array import array
from pathlib import Path
from typing import Any

import numpy
import pytest
from rosbags.rosbag1 import Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_typestore

from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.bags.conversion import Counts
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.bags.model import Topic
from rosidl_adapter_proto.bags.plugins import PluginConverter
from rosidl_adapter_proto.bags.routes import Fate, TopicRoute
from rosidl_adapter_proto.converters import Converter, ConverterRegistry
from rosidl_adapter_proto.errors import BagError, ConverterError
from rosidl_adapter_proto.transcode.records import pack_records, read_records
from tests.bags.recordings import START, STRING, Recorded, contents, mcap_bytes, strings
from tests.converters.plugins import JsonConverter, JsonSerializer

pytestmark = pytest.mark.usefixtures("folder")


class Careful(JsonConverter):
    """Wants what plugins are promised: no two threads at once."""

    lock = threading.Lock()

    def serialize(self, *arguments: Any) -> None:
        assert self.lock.acquire(blocking=False)
        JsonSerializer().serialize(*arguments)
        self.lock.release()


def registry(plugin: type[JsonConverter] = JsonConverter) -> ConverterRegistry:
    plugins = ConverterRegistry()
    plugins.register("json_converter", plugin)
    return plugins


@pytest.mark.parametrize("threads", [1, 4])
def test_plugins(threads: int) -> None:
    messages = [*strings("/a", 30), Recorded("/n", START, b"\0\1\0\0\7\0\0\0", START)]
    Path("in.mcap").write_bytes(mcap_bytes(messages, {"/n": "std_msgs/msg/Int32"}))
    plugins = registry(Careful)

    result = convert_bag("in.mcap", "there.mcap", target_format="json", registry=plugins, threads=threads)

    assert result.total == Counts(converted=31)
    there = contents(Path("there.mcap"))
    assert there.topics["/a", "json"][:3] == (STRING, "ros2msg", b"string data\n")
    assert [each.data.decode() for each in there.messages if each.topic == "/a"] == [
        f'{{"data": "/a {i}"}}' for i in range(30)
    ]
    convert_bag("there.mcap", "back.mcap", target_format="cdr", registry=plugins, threads=threads)
    assert contents(Path("back.mcap"))._replace(metadata=[]) == contents(Path("in.mcap"))


@pytest.mark.parametrize(
    ("on_error", "counts"),
    [("skip", Counts(converted=3, skipped=1)), ("copy", Counts(converted=3, copied=1))],
)
def test_a_plugin_that_fails(on_error: str, counts: Counts) -> None:
    texts = [f'{{"data": "{i}"}}'.encode() for i in range(4)]
    texts[2] = b"{"
    messages = [Recorded("/a", START + i, text) for i, text in enumerate(texts)]
    Path("in.mcap").write_bytes(mcap_bytes(messages, formats={"/a": "json"}))
    with pytest.raises(BagError) as caught:
        convert_bag("in.mcap", "out.mcap", registry=registry())
    assert str(caught.value).startswith(
        f"in.mcap: message 3 of /a, recorded at {START + 2}: {STRING}: json_converter"
    )

    result = convert_bag("in.mcap", "out.mcap", registry=registry(), on_error=on_error)
    assert result.total == counts and result.failures[0].number == 3
    kept = [each for each in contents(Path("out.mcap")).messages if each.data == b"{"]
    assert len(kept) == counts.copied


def test_a_chunk_of_failures_keeps_few_errors() -> None:
    schema = TypeRegistry()[STRING]
    topic = Topic("/a", STRING, "json")
    route = TopicRoute(topic, Fate.CONVERTED, topic, schema, schema)
    converter = PluginConverter({1: route, 2: route}, {2: 9}, Converter("json", "cdr", registry()))
    numbers = range(3000)
    topic_ids = array("H", (1 + i % 2 for i in numbers))
    chunk = pack_records(
        topic_ids, array("I", numbers), array("Q", numbers), array("Q", numbers), [b"{"] * 3000
    )

    converted = converter.convert(chunk)

    assert converted.failure_counts == {1: 1500, 2: 1500}
    assert [each.index for each in converted.failures] == list(range(10))
    assert (converted.message_count, set(read_records(converted.data).topic_ids)) == (1500, {9})


def test_a_selection_with_plugins() -> None:
    messages = [*strings("/a", 10), *strings("/b", 10)]
    Path("in.mcap").write_bytes(mcap_bytes(messages))
    times: dict[str, Any] = {"start": START + 2 * 10**9, "end": START + 5 * 10**9}
    result = convert_bag(
        "in.mcap", "out.mcap", target_format="json", topics=["/b"], registry=registry(), **times
    )
    assert result.total == Counts(converted=3, not_selected=17)
    assert [each.log_time for each in contents(Path("out.mcap")).messages] == [
        START + i * 10**9 for i in (2, 3, 4)
    ]


# ROS 1


def ros1_bag(path: Path) -> list[Any]:
    """Write a bag of ROS 1 with rosbags, and return its messages."""
    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    names = ("sensor_msgs/msg/Temperature", "std_msgs/msg/String")
    messages: list[Any] = []
    with Writer(path) as writer:
        connections = [writer.add_connection(f"/{i}", name, typestore=store) for i, name in enumerate(names)]
        for i in range(20):
            stamp = types["builtin_interfaces/msg/Time"](sec=i, nanosec=i + 1)
            header = types["std_msgs/msg/Header"](seq=i + 100, stamp=stamp, frame_id=f"frame {i}")
            made = (
                types[names[0]](header=header, temperature=i / 2, variance=-1.0),
                types[names[1]](data=f"text {i}"),
            )
            for connection, message in zip(connections, made, strict=True):
                writer.write(connection, START + i, store.serialize_ros1(message, connection.msgtype))
                messages.append(message)
    return messages


def test_ros1_to_protobuf() -> None:
    messages = ros1_bag(Path("in.bag"))
    result = convert_bag("in.bag", "out")

    assert result.total == Counts(converted=40)
    found = contents(Path("out/in.mcap"))
    assert {each[1] for each in found.topics} == {"protobuf"}
    registry = TypeRegistry.from_texts(
        {"std_msgs/msg/Header": "uint32 seq\nbuiltin_interfaces/Time stamp\nstring frame_id"}
    )
    temperature = registry["sensor_msgs/msg/Temperature"].message_class
    texts = registry[STRING].message_class
    for before, after in zip(messages, found.messages, strict=True):
        if after.topic == "/0":
            message: Any = temperature.FromString(after.data)
            assert (message.header.seq, message.header.stamp.sec) == (
                before.header.seq,
                before.header.stamp.sec,
            )
            assert (message.header.frame_id, message.temperature) == (
                before.header.frame_id,
                before.temperature,
            )
        else:
            text: Any = texts.FromString(after.data)
            assert text.data == before.data


@pytest.mark.parametrize("first_to_protobuf", [False, True])
def test_ros1_to_cdr(first_to_protobuf: bool) -> None:
    """However it comes there: a header of ROS 2 has no `seq`."""
    messages = ros1_bag(Path("in.bag"))
    if first_to_protobuf:
        convert_bag("in.bag", "there.mcap")
    source = "there.mcap" if first_to_protobuf else "in.bag"
    result = convert_bag(source, "out.mcap", target_format="cdr")

    assert result.total == Counts(converted=40)
    found = contents(Path("out.mcap"))
    assert found.profile == "ros2"
    store = get_typestore(Stores.ROS2_KILTED)
    for before, after in zip(messages, found.messages, strict=True):
        after_ros: Any = store.deserialize_cdr(after.data, found.topics[after.topic, "cdr"][0])
        if after.topic == "/0":
            assert after_ros.header.frame_id == before.header.frame_id
            assert numpy.float64(after_ros.temperature) == before.temperature
        else:
            assert after_ros.data == before.data


def test_ros1_is_not_written() -> None:
    ros1_bag(Path("in.bag"))
    convert_bag("in.bag", "there.mcap")
    with pytest.raises(ConverterError, match=r"^Could not find converter for format ros1"):
        convert_bag("there.mcap", "back.mcap", target_format="ros1")
    with pytest.raises(ConverterError, match=r"^Could not find converter for format rosbag_v2"):
        convert_bag("there.mcap", "back.mcap", target_format="rosbag_v2")


# What rosbag2 has compressed


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE"])
@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
def test_compressed_by_rosbag2(mode: str, storage: str) -> None:
    """Of what is compressed there, chunks are compressed."""
    store = get_typestore(Stores.ROS2_KILTED)
    messages = strings("/a", 30)
    writer = Rosbag2Writer(Path("in"), version=8, storage_plugin=StoragePlugin[storage])
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/a", STRING, typestore=store)
        for each in messages:
            writer.write(connection, each.log_time, each.data)

    result = convert_bag("in", "there", storage="mcap")
    assert result.total == Counts(converted=30) and not result.warnings
    assert contents(Path("there/in.mcap")).compressions == {"zstd"}
    convert_bag("there", "back.mcap")
    assert [(each.log_time, each.data) for each in contents(Path("back.mcap")).messages] == [
        (each.log_time, each.data) for each in messages
    ]
