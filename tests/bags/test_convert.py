"""Bags from CDR to protobuf and back: everything is as it was."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest
import yaml
from google.protobuf.descriptor_pool import DescriptorPool
from mcap.writer import CompressionType
from ros_types import protobuf_message, random_value, same_message

from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.bags.conversion import Counts, Progress
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.bags.recording import find_recording
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import installed_sources
from rosidl_adapter_proto.schema import pools
from tests.bags.recordings import (
    START,
    STRING,
    Recorded,
    cdr,
    contents,
    definition_text,
    mcap_bytes,
    rows,
    string_cdr,
    strings,
    types_of,
)


@pytest.fixture(autouse=True)
def in_folder(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test has an empty folder, away from any ROS installation unless it asks for one."""
    if "ros_prefix" in request.fixturenames:
        monkeypatch.chdir(tmp_path)
    else:
        request.getfixturevalue("folder")


A = strings("/a", 12)
B = strings("/b", 9)
MIXED = sorted([*A, *B], key=lambda each: each.log_time)
ROSBAG2 = "rosbag2"
ROS_DEFINITIONS = "rosidl_adapter_proto.ros_definitions"


def bag(data: bytes, name: str = "in.mcap") -> Path:
    Path(name).write_bytes(data)
    return Path(name)


def protobuf_string(text: str) -> bytes:
    """Return a `std_msgs.msg.pb.String`, written by hand: the field number of `data` is 0x0B9D2D71 >> 3."""
    message = TypeRegistry()[STRING].message_class(data=text)
    return bytes(message.SerializeToString())


def check_every_type(threads: int) -> None:
    """Convert a bag with messages of all types that are found, and back."""
    catalog = Catalog(tuple(installed_sources()))
    registry = TypeRegistry(catalog)
    names = [
        str(name)
        for package in catalog.packages.values()
        for name, definition in package.items()
        if name.namespace == "msg" and not definition.file.endswith(".idl")
    ]
    messages: list[Recorded] = []
    values: list[dict[str, Any]] = []
    for name in names:
        schema, rng = registry[name], random.Random(name)
        for _ in range(2):
            values.append(random_value(types_of(schema), name, rng))
            time = START + len(messages)
            messages.append(Recorded(f"/{name}", time, cdr(schema, values[-1]), time - 9, len(messages)))
    types = {f"/{name}": name for name in names}
    texts = {name: definition_text(catalog, name) for name in names}
    hashes = {name: registry[name].type_hash for name in names}
    source = bag(mcap_bytes(messages, types, texts, hashes=hashes, chunk_size=4000))
    everything = Counts(converted=2 * len(names))

    result = convert_bag(source, "there.mcap", threads=threads)

    assert len(names) > 150 and result.total == everything and not result.warnings
    for before, after, value in zip(messages, contents(Path("there.mcap")).messages, values, strict=True):
        assert before._replace(data=b"") == after._replace(data=b"")
        schema = registry[before.topic[1:]]
        expected = protobuf_message(types_of(schema), schema.type_name, value, schema.message_class())
        assert same_message(schema.message_class.FromString(after.data), expected), schema.type_name

    result = convert_bag("there.mcap", "back.mcap", threads=threads)

    assert result.total == everything and not result.warnings
    assert contents(Path("back.mcap"))._replace(metadata=[]) == contents(source)


def test_every_type_of_the_store(monkeypatch: pytest.MonkeyPatch) -> None:
    # Other tests have types of what is installed, which may be other versions, in the pool of generated code.
    pool = DescriptorPool()
    monkeypatch.setattr(pools, "default_pool", lambda: pool)
    monkeypatch.setattr(pools, "_promised", {})
    check_every_type(threads=1)


def test_every_type_of_ros(ros_prefix: Path) -> None:
    check_every_type(threads=3)


OLD = "{version: 8, storage_identifier: mcap, relative_file_paths: [x.mcap], topics_with_message_count: []}"


def test_all_that_is_in_a_file_is_kept() -> None:
    more: dict[str, Any] = {
        "attachments": [("map", b"\0\1"), ("log", b"")],
        "metadata": [("recorder", {"name": "x", "ä": ""}), (ROSBAG2, {"serialized_metadata": OLD})],
    }
    source = bag(mcap_bytes(MIXED, {"/a": STRING, "/b": STRING, "/none": "std_msgs/msg/Int32"}, **more))
    convert_bag(source, "there.mcap")
    convert_bag("there.mcap", "back.mcap")

    before, there, back = contents(source), contents(Path("there.mcap")), contents(Path("back.mcap"))
    assert back._replace(metadata=[]) == before._replace(metadata=[])
    assert there.profile == "" and there.attachments == before.attachments
    assert [name for name, _ in back.metadata] == ["recorder", ROSBAG2]
    assert [name for name, _ in there.metadata] == [ROS_DEFINITIONS, "recorder", ROSBAG2]
    assert there.metadata[1] == back.metadata[0] == before.metadata[0]


def test_the_layout_of_a_protobuf_bag() -> None:
    convert_bag(bag(mcap_bytes(MIXED)), "there.mcap")

    there = contents(Path("there.mcap"))
    name, encoding, descriptors, metadata = there.topics["/a", "protobuf"]
    assert (name, encoding) == ("std_msgs.msg.pb.String", "protobuf")
    assert b"std_msgs/msg/String.proto" in descriptors
    keys = dict(contents(Path("in.mcap")).topics["/a", "cdr"][3])
    assert metadata == {**keys, "ros_type": STRING}
    assert [each.data for each in there.messages] == [
        protobuf_string(each.data[8:-1].decode()) for each in MIXED
    ]
    definitions, description = there.metadata
    assert definitions == (ROS_DEFINITIONS, {STRING: "ros2msg\nstring data\n"})
    topics = yaml.safe_load(description[1]["serialized_metadata"])["topics_with_message_count"]
    assert [
        (
            each["topic_metadata"]["name"],
            each["topic_metadata"]["type"],
            each["topic_metadata"]["serialization_format"],
            each["message_count"],
        )
        for each in topics
    ] == [("/a", STRING, "protobuf", 12), ("/b", STRING, "protobuf", 9)]


@pytest.mark.parametrize(
    ("given", "asked", "found"),
    [
        (CompressionType.ZSTD, None, {"zstd"}),
        (CompressionType.LZ4, None, {"lz4"}),
        (CompressionType.NONE, None, {""}),
        (CompressionType.ZSTD, "lz4", {"lz4"}),
        (CompressionType.LZ4, "none", {""}),
        (CompressionType.NONE, "zstd", {"zstd"}),
    ],
)
def test_compression(given: CompressionType, asked: str | None, found: set[str]) -> None:
    convert_bag(bag(mcap_bytes(A, compression=given)), "out.mcap", compression=asked)
    assert contents(Path("out.mcap")).compressions == found


def test_a_split_bag() -> None:
    folder = Path("in")
    folder.mkdir()
    files = {
        "b_3.mcap": strings("/a", 4),
        "a_4.mcap": [*strings("/a", 2, 4), *strings("/b", 3)],
        "c.mcap": [],
    }
    for name, messages in files.items():
        (folder / name).write_bytes(mcap_bytes(messages, {"/a": STRING}))
    (folder / "metadata.yaml").write_text(METADATA)

    result = convert_bag(folder, "out")

    assert {name: each.converted for name, each in result.counts.items()} == {"/a": 6, "/b": 3}
    out = Path("out")
    assert sorted(each.name for each in out.iterdir()) == ["a_4.mcap", "b_3.mcap", "c.mcap", "metadata.yaml"]
    for name, messages in files.items():
        assert [each.log_time for each in contents(out / name).messages] == [
            each.log_time for each in messages
        ]
    said = yaml.safe_load((out / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert said["relative_file_paths"] == ["b_3.mcap", "a_4.mcap", "c.mcap"]
    assert [each["message_count"] for each in said["files"]] == [4, 5, 0]
    assert (said["message_count"], said["starting_time"]["nanoseconds_since_epoch"]) == (9, START)
    assert (said["duration"]["nanoseconds"], said["ros_distro"]) == (5 * 10**9, "jazzy")
    assert said["custom_data"] == {"robot": "r2"}
    again = find_recording("out")
    assert not again.warnings and [each.path for each in again.files] == [
        "out/b_3.mcap",
        "out/a_4.mcap",
        "out/c.mcap",
    ]
    convert_bag("out", "back")
    for name in files:
        assert contents(Path("back", name)).messages == contents(folder / name).messages


METADATA = """\
rosbag2_bagfile_information:
  version: 8
  storage_identifier: mcap
  duration: {nanoseconds: 1}
  starting_time: {nanoseconds_since_epoch: 1}
  message_count: 9
  topics_with_message_count: []
  compression_format: ""
  compression_mode: ""
  relative_file_paths: [b_3.mcap, a_4.mcap, c.mcap]
  files: []
  custom_data: {robot: r2}
  ros_distro: jazzy
"""


def test_the_file_of_a_folder_may_become_one_file() -> None:
    convert_bag(bag(mcap_bytes(A)), "folder")
    convert_bag("folder", "back.mcap")
    assert contents(Path("back.mcap")).messages == A


@pytest.mark.parametrize("threads", [1, 2])
def test_sqlite3_and_back(threads: int) -> None:
    source = bag(mcap_bytes(MIXED))
    result = convert_bag(source, "there.db3", threads=threads)

    assert result.warnings == (
        "sqlite3 has no room for publish times and sequence numbers: they are left out",
    )
    assert rows(Path("there.db3")) == [
        (each.topic, STRING, "protobuf", each.log_time, protobuf_string(each.data[8:-1].decode()))
        for each in MIXED
    ]
    assert not convert_bag("there.db3", "cdr.db3").warnings
    assert rows(Path("cdr.db3")) == [(each.topic, STRING, "cdr", each.log_time, each.data) for each in MIXED]

    convert_bag("there.db3", "back.mcap")
    before, after = contents(source), contents(Path("back.mcap"))
    assert after.messages == [each._replace(publish_time=each.log_time, sequence=0) for each in MIXED]
    assert {key: topic[:3] for key, topic in after.topics.items()} == {
        key: topic[:3] for key, topic in before.topics.items()
    }


@pytest.mark.parametrize(
    ("options", "chosen"),
    [
        ({"topics": ["/b"]}, B),
        ({"topics": "/b"}, B),
        ({"topics": ["/[ac]", "/nothing*", "/b"], "excluded_topics": ["/b"]}, None),
        ({"topics": ["/[ac]"]}, A),
        ({"excluded_topics": "*b"}, A),
        ({"start": START + 3 * 10**9}, [each for each in MIXED if each.log_time >= START + 3 * 10**9]),
        ({"end": START + 3 * 10**9}, [each for each in MIXED if each.log_time < START + 3 * 10**9]),
        ({"start": START + 1, "end": START + 2, "topics": ["/a"]}, []),
    ],
)
def test_selection(options: dict[str, Any], chosen: list[Recorded] | None) -> None:
    source = bag(mcap_bytes(MIXED))
    if chosen is None:
        from rosidl_adapter_proto.errors import RequestError

        with pytest.raises(RequestError, match=r"^there is no topic /nothing\*; there are /a, /b$"):
            convert_bag(source, "out.mcap", **options)
        return
    result = convert_bag(source, "out.mcap", **options)

    assert result.total == Counts(converted=len(chosen), not_selected=len(MIXED) - len(chosen))
    assert result.is_complete
    convert_bag("out.mcap", "back.mcap")
    assert contents(Path("back.mcap")).messages == chosen


def test_equal_formats_are_copied() -> None:
    source = bag(mcap_bytes(MIXED, definitions={}))
    result = convert_bag(source, "out.mcap", target_format="cdr", compression="lz4", topics=["/a"])

    assert result.total == Counts(copied=len(A), not_selected=len(B))
    assert contents(Path("out.mcap")).messages == A


def test_progress() -> None:
    told: list[Progress] = []
    source = bag(mcap_bytes(MIXED))
    convert_bag(source, "out.mcap", progress=told.append, threads=2)

    assert len(told) > 3
    assert [each.message_count for each in told] == sorted(each.message_count for each in told)
    assert told[-1].message_count == len(MIXED)
    assert all(0 < each.done <= each.total == source.stat().st_size for each in told)


def test_a_file_without_chunks_and_one_without_a_summary() -> None:
    source = bag(mcap_bytes(MIXED, use_chunking=False))
    assert convert_bag(source, "out.mcap").total == Counts(converted=len(MIXED))

    whole = mcap_bytes(MIXED)
    source = bag(
        whole[: whole.rindex(b"\x0f\x04\0\0\0\0\0\0\0")], "unfinished.mcap"
    )  # before the record DataEnd
    result = convert_bag(source, "unfinished_out.mcap")
    assert result.total == Counts(converted=len(MIXED))
    assert any("not finished" in each for each in result.warnings), result.warnings


def test_topics_without_messages_need_no_definition() -> None:
    source = bag(mcap_bytes(A, {"/none": "nowhere_msgs/msg/Nothing"}))
    assert convert_bag(source, "there.mcap").is_complete
    assert ("/none", "protobuf") in contents(Path("there.mcap")).topics

    assert convert_bag("there.mcap", "back.mcap").is_complete
    assert contents(Path("back.mcap")).topics["/none", "cdr"][0] == "nowhere_msgs/msg/Nothing"


def test_definitions_from_elsewhere_are_kept() -> None:
    """What the bag did not have, the protobuf bag has: the way back needs nothing that is installed."""
    source = bag(mcap_bytes(A, definitions={}))
    assert convert_bag(source, "there.mcap").is_complete
    definitions = dict(contents(Path("there.mcap")).metadata)[ROS_DEFINITIONS]
    assert definitions[STRING].startswith("ros2msg\n") and "string data" in definitions[STRING]


def test_a_channel_for_each_publisher() -> None:
    """Two channels of one topic stay two, and are counted as one."""
    data = mcap_bytes([Recorded("/a", START, string_cdr("x"))], {"/b": STRING}, enable_crcs=False)
    source = bag(data.replace(b"/b", b"/a"))
    result = convert_bag(source, "out.mcap")
    assert result.counts == {"/a": Counts(converted=1)}
    # Each is in the data and in the summary.
    assert Path("out.mcap").read_bytes().count(b"note\5\0\0\0of /") == 4
