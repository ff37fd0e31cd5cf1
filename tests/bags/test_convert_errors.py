"""Conversions of bags with messages, labels or files that are wrong."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType

from rosidl_adapter_proto.bags.bag import open_bag
from rosidl_adapter_proto.bags.conversion import ConversionResult, Counts
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.converters import ConverterRegistry
from rosidl_adapter_proto.errors import BagError, ConverterError, Error, RequestError
from tests.bags.recordings import START, STRING, Recorded, contents, mcap_bytes, rows, string_cdr, strings
from tests.converters.plugins import JsonConverter

pytestmark = pytest.mark.usefixtures("folder")

INT32 = "std_msgs/msg/Int32"
TYPES = {"/a": STRING, "/n": INT32}
BAD = b"\0\1\0\0\xff\0\0\0xy\0"
WRONG = {
    "/a": [3, 4, 11],
    "/n": [],
}
SKIPS = "; `--on-error skip` leaves such messages out, and `--on-error copy` copies them"
REASON = "std_msgs/msg/String.data at byte 8: "


def names() -> list[str]:
    return sorted(each.name for each in Path().iterdir())


def some_wrong(wrong: Mapping[str, list[int]] = WRONG) -> list[Recorded]:
    """Return messages of two topics, some of which are no valid ones of their type."""
    texts = [
        each._replace(data=BAD) if index in wrong["/a"] else each
        for index, each in enumerate(strings("/a", 14))
    ]
    numbers = [
        Recorded("/n", START + i * 10**9 + 1, b"\0\1\0\0" + i.to_bytes(4, "little"), 0, i) for i in range(9)
    ]
    return sorted([*texts, *numbers], key=lambda each: each.log_time)


def convert(data: bytes, destination: str = "out.mcap", **options: Any) -> ConversionResult:
    Path("in.mcap").write_bytes(data)
    return convert_bag("in.mcap", destination, **options)


def refused(data: bytes, **options: Any) -> str:
    """Return the text of the error with which a conversion ends, of which nothing is left."""
    with pytest.raises(BagError) as caught:
        convert(data, **options)
    assert names() == ["in.mcap"]
    return str(caught.value)


@pytest.mark.parametrize("threads", [1, 3])
def test_the_first_wrong_message_ends_it(threads: int) -> None:
    text = refused(mcap_bytes(some_wrong(), TYPES), threads=threads)
    assert text.startswith(
        f"in.mcap: message 4 of /a, recorded at {START + 3 * 10**9}: std_msgs/msg/String.data at byte "
    )
    assert text.endswith(SKIPS)


@pytest.mark.parametrize("threads", [1, 3])
def test_wrong_messages_are_skipped(threads: int) -> None:
    result = convert(mcap_bytes(some_wrong(), TYPES), on_error="skip", threads=threads)

    assert result.counts == {"/a": Counts(converted=11, skipped=3), "/n": Counts(converted=9)}
    assert not result.is_complete and result.failed_count == 3
    assert [(each.topic, each.number, each.log_time) for each in result.failures] == [
        ("/a", index + 1, START + index * 10**9) for index in WRONG["/a"]
    ]
    convert_bag("out.mcap", "back.mcap")
    assert contents(Path("back.mcap")).messages == [
        each._replace(publish_time=each.publish_time or each.log_time)
        for each in some_wrong()
        if each.data != BAD
    ]


@pytest.mark.parametrize("threads", [1, 3])
def test_wrong_messages_are_copied(threads: int) -> None:
    result = convert(mcap_bytes(some_wrong(), TYPES), on_error="copy", threads=threads)

    assert result.counts == {"/a": Counts(converted=11, copied=3), "/n": Counts(converted=9)}
    assert not result.is_complete
    found = contents(Path("out.mcap"))
    assert found.topics.keys() == {("/a", "protobuf"), ("/n", "protobuf"), ("/a", "cdr")}
    assert found.topics["/a", "cdr"] == contents(Path("in.mcap")).topics["/a", "cdr"]
    assert [each._replace(data=b"") for each in found.messages] == [
        each._replace(data=b"") for each in contents(Path("in.mcap")).messages
    ]
    assert [each for each in found.messages if each.data == BAD] == [
        each for each in some_wrong() if each.data == BAD
    ]


def test_a_topic_of_copied_messages_is_there_only_if_there_are_some() -> None:
    result = convert(mcap_bytes(some_wrong({"/a": []}), TYPES), on_error="copy")
    assert result.is_complete
    assert contents(Path("out.mcap")).topics.keys() == {("/a", "protobuf"), ("/n", "protobuf")}


def test_wrong_messages_in_sqlite3() -> None:
    convert(mcap_bytes(some_wrong(), TYPES), "out.db3", on_error="copy")
    assert [each[2] for each in rows(Path("out.db3")) if each[0] == "/a"] == [
        "cdr" if index in WRONG["/a"] else "protobuf" for index in range(14)
    ]


def test_only_the_first_failures_are_kept() -> None:
    wrong = mcap_bytes(some_wrong({"/a": list(range(14))}), TYPES)
    result = convert(wrong, on_error="skip")
    assert (result.failed_count, len(result.failures)) == (14, 10)
    assert str(result.failures[1]).startswith(
        f"in.mcap: message 2 of /a, recorded at {START + 10**9}: std_msgs"
    )


def test_a_message_is_numbered_among_the_selected() -> None:
    wrong = mcap_bytes(some_wrong(), TYPES)
    result = convert(wrong, on_error="skip", start=START + 2 * 10**9)
    assert [each.number for each in result.failures] == [2, 3, 10]


# Definitions


def test_a_type_that_nobody_knows() -> None:
    messages = [*strings("/a", 2), Recorded("/x", START, b"\0\1\0\0\5")]
    types = {"/x": "other_msgs/msg/X"}
    text = refused(mcap_bytes(messages, types))
    assert text.startswith("topic /x") and "other_msgs" in text

    result = convert(mcap_bytes(messages, types), on_error="skip")
    assert result.counts == {"/a": Counts(converted=2), "/x": Counts(skipped=1)}
    assert not result.is_complete and result.warnings[0].endswith("; its messages are skipped")
    assert contents(Path("out.mcap")).topics.keys() == {("/a", "protobuf")}

    result = convert(mcap_bytes(messages, types), "copy.mcap", on_error="copy")
    assert result.counts == {"/a": Counts(converted=2), "/x": Counts(copied=1)}
    assert not result.is_complete and result.warnings[0].endswith("; its messages are copied")
    assert contents(Path("copy.mcap")).messages[-1].data == b"\0\1\0\0\5"


def test_a_definition_that_is_given() -> None:
    from tests.folders import write_package

    write_package(Path("src/other_msgs"), {"msg/X.msg": "uint8 a"})
    messages = [Recorded("/x", START, b"\0\1\0\0\5", START)]
    data = mcap_bytes(messages, {"/x": "other_msgs/msg/X"})
    assert convert(data, include=["src"]).total == Counts(converted=1)
    convert_bag("out.mcap", "back.mcap")
    assert contents(Path("back.mcap")).messages == messages


# Labels


MIXED_FORMATS = (
    "Topics with different rmw serialization format have been found. "
    "All topics must have the same serialization format. (cdr: /a; protobuf: /b, /c; `--topic` chooses some)"
)


def test_mixed_formats() -> None:
    messages = [*strings("/a", 2), Recorded("/b", START, b"")]
    formats = {"/b": "protobuf", "/c": "protobuf"}
    data = mcap_bytes(messages, {"/c": STRING}, formats=formats)
    assert refused(data) == MIXED_FORMATS
    assert convert(data, topics=["/a"]).counts["/a"] == Counts(converted=2)


def test_files_of_different_formats() -> None:
    Path("in").mkdir()
    Path("in/0.mcap").write_bytes(mcap_bytes(strings("/a", 2)))
    Path("in/1.mcap").write_bytes(mcap_bytes(strings("/a", 2), formats={"/a": "protobuf"}))
    with pytest.raises(
        BagError, match=r"^Topics with different rmw .* \(cdr: /a; protobuf: /a; `--topic` chooses"
    ):
        convert_bag("in", "out")
    assert names() == ["in"]


METADATA = """\
rosbag2_bagfile_information:
  version: 4
  storage_identifier: mcap
  duration: {nanoseconds: 0}
  starting_time: {nanoseconds_since_epoch: 0}
  message_count: 2
  topics_with_message_count:
    - topic_metadata:
        {name: /a, type: std_msgs/msg/String, serialization_format: cdr, offered_qos_profiles: ""}
      message_count: 2
  compression_format: zstd
  compression_mode: FILE
  relative_file_paths: [0.mcap.zstd]
"""


def test_a_compressed_file_of_another_format() -> None:
    """It is not opened before its turn: what metadata.yaml says is believed until then."""
    Path("in").mkdir()
    Path("in/metadata.yaml").write_text(METADATA)
    data = mcap_bytes(strings("/a", 2), formats={"/a": "protobuf"})
    Path("in/0.mcap.zstd").write_bytes(zstandard.compress(data))
    with pytest.raises(BagError) as caught:
        convert_bag("in", "out")
    assert str(caught.value) == (
        "Topics with different rmw serialization format have been found. All topics must have the same "
        "serialization format. (in/0.mcap.zstd has protobuf, other files cdr)"
    )
    assert names() == ["in"]


def test_fewer_messages_than_metadata_says() -> None:
    Path("in").mkdir()
    Path("in/metadata.yaml").write_text(METADATA.replace("message_count: 2", "message_count: 3"))
    Path("in/0.mcap").write_bytes(mcap_bytes(strings("/a", 2)))
    warning = "in: metadata.yaml says 3 messages, but its files have 2"
    assert warning in convert_bag("in", "out").warnings
    assert warning in open_bag("in").warnings


@pytest.mark.parametrize("label", ["cdr", "protobuf", "my_format"])
def test_from_says_what_the_messages_are(label: str) -> None:
    data = mcap_bytes(strings("/a", 2), {"/b": STRING}, formats={"/a": label})
    result = convert(data, source_format="cdr")
    assert result.counts["/a"] == Counts(converted=2) and not result.warnings
    convert_bag("out.mcap", "back.mcap")
    assert contents(Path("back.mcap")).messages == strings("/a", 2)


@pytest.mark.parametrize(
    ("label", "data", "other"),
    [
        ("cdr", b"\x8a\x69\x6f\x5c\x01a", "protobuf"),
        ("cdr", b"", "protobuf"),
        ("cdr", b"\0\x7f\0\0", "protobuf"),
        ("protobuf", string_cdr("x"), "cdr"),
    ],
)
def test_a_label_that_the_bytes_contradict(label: str, data: bytes, other: str) -> None:
    messages = [each._replace(data=data) for each in strings("/a", 3)]
    wrong = mcap_bytes([*messages, *strings("/b", 2)], formats={"/a": label, "/b": "cdr"})
    warning = (
        f"topic /a says {label}, but its messages do not look like it; "
        f"if they are {other}, `--from {other}` says so"
    )
    assert refused(wrong, topics=["/a"]).endswith(f"; {warning}")
    result = convert(wrong, topics=["/a"], on_error="skip")
    assert warning in result.warnings
    assert result.counts["/a"].skipped == 3


@pytest.mark.parametrize("header", [b"\0\0", b"\0\1", b"\0\7", b"\0\x0b"])
def test_labels_that_fit(header: bytes) -> None:
    wrong = mcap_bytes([each._replace(data=header + b"\0\0zz") for each in strings("/a", 3)])
    assert not convert(wrong, target_format="cdr").warnings
    empty = mcap_bytes([Recorded("/a", START, b"")], formats={"/a": "protobuf"})
    assert not convert(empty, "empty.mcap", target_format="protobuf").warnings


# Damage


def with_damage(where: int = 7) -> bytes:
    """Return a file one of whose chunks does not have the checksum that it should have."""
    data = bytearray(mcap_bytes(some_wrong({"/a": []}), TYPES, compression=CompressionType.NONE))
    place = data.index(f"/a {where}".encode())
    data[place : place + 2] = b"??"
    return bytes(data)


def test_a_damaged_chunk() -> None:
    text = refused(with_damage())
    assert re.fullmatch(
        r"in\.mcap at byte \d+: the chunk is damaged: its checksum is 0x\w{8} and should be 0x\w{8}; \d+ messages "
        r"before that are whole, and `--on-error skip` converts all that can be read",
        text,
    ), text


@pytest.mark.parametrize("where", [0, 7])
@pytest.mark.parametrize("on_error", ["skip", "copy"])
def test_what_is_not_damaged_is_converted(on_error: str, where: int) -> None:
    result = convert(with_damage(where), on_error=on_error)
    lost = result.total.lost
    assert 0 < lost < 10
    assert result.total == Counts(converted=23 - lost, lost=lost) and not result.is_complete
    assert "of the 14 messages of /a are lost" in " ".join(result.warnings)
    assert len(contents(Path("out.mcap")).messages) == 23 - lost


def with_an_unknown_topic() -> bytes:
    """Return a file with a message of a channel that is not there."""
    data = bytearray(
        mcap_bytes(strings("/a", 9), compression=CompressionType.NONE, chunk_size=150, enable_crcs=False)
    )
    data[data.index(b"/a 5") - 30] = 77  # the channel stands in front of sequence number, times and CDR
    return bytes(data)


@pytest.mark.parametrize("target_format", ["protobuf", "json"])
def test_a_message_of_a_topic_that_is_not_there(target_format: str) -> None:
    registry = ConverterRegistry()
    registry.register("json_converter", JsonConverter)
    options: dict[str, Any] = {"target_format": target_format, "registry": registry}
    reason = (
        r"in\.mcap at byte \d+: 1 messages are of topics that are not in the file, such as one with the id 77"
    )
    assert re.match(
        rf"{reason}; \d messages before that are whole", refused(with_an_unknown_topic(), **options)
    )

    result = convert(with_an_unknown_topic(), on_error="skip", **options)
    assert result.total == Counts(converted=8, lost=1) and not result.is_complete
    assert re.fullmatch(reason, result.warnings[0])
    kept = [each.sequence for each in strings("/a", 9)]
    del kept[5]
    assert [each.sequence for each in contents(Path("out.mcap")).messages] == kept


def test_reading_finds_another_number_of_messages() -> None:
    Path("in.mcap").write_bytes(with_an_unknown_topic())
    with pytest.raises(BagError) as caught:
        list(open_bag("in.mcap").messages("/a"))
    assert str(caught.value) == (
        "in.mcap: it says that there are 9 messages of these topics, but 8 were found; "
        "`bag convert --on-error skip`, elsewhere `--salvage`, reads those"
    )
    assert len(list(open_bag("in.mcap").messages("/a", start=1))) == 8


def test_a_truncated_file() -> None:
    whole = mcap_bytes(strings("/a", 40), compression=CompressionType.NONE)
    cut = whole[: len(whole) // 2]
    assert "`bag convert --on-error skip`, elsewhere `--salvage`, reads" in refused(cut)

    result = convert(cut, on_error="skip")
    found = contents(Path("out.mcap")).messages
    assert 10 < result.total.converted == len(found) < 30
    assert [each.log_time for each in found] == [each.log_time for each in strings("/a", 40)[: len(found)]]
    assert result.is_damaged and not result.is_complete  # how much is lost nobody knows


def test_damage_among_chosen_times() -> None:
    """Whether the lost messages were of these times nobody knows."""
    result = convert(with_damage(), on_error="skip", end=START + 100 * 10**9)
    assert result.total.lost == 0 and result.is_damaged and not result.is_complete


def test_what_sqlite3_has_no_room_for() -> None:
    data = mcap_bytes(strings("/a", 2), attachments=[("map", b"x")], metadata=[("recorder", {"a": "b"})])
    with pytest.raises(BagError) as caught:
        convert(data, "out.db3")
    assert str(caught.value).endswith(
        "sqlite3 has no room for the attachment map; write MCAP instead, or leave it out with `--on-error skip`"
    )
    assert names() == ["in.mcap"]
    result = convert(data, "out.db3", on_error="skip")
    assert [each.partition("sqlite3 has")[2] for each in result.warnings[1:]] == [
        " no room for the attachment map; write MCAP instead; it is left out",
        " no room for the metadata recorder; write MCAP instead; it is left out",
    ]


# What cannot be asked for


def test_no_converter() -> None:
    data = mcap_bytes(strings("/a", 2))
    with pytest.raises(ConverterError, match=r"^Could not find converter for format ros1"):
        convert(data, target_format="ros1")
    with pytest.raises(ConverterError, match=r"^Could not find converter for format my_format"):
        convert(data, source_format="my_format")
    with pytest.raises(ConverterError, match=r"^Could not find converter for format json"):
        convert(mcap_bytes(strings("/a", 2), {"/a": "no ROS type"}, formats={"/a": "json"}))
    assert names() == ["in.mcap"]


@pytest.mark.parametrize(
    ("destination", "options", "text"),
    [
        (
            "in/out",
            {},
            "in/out is inside of in, which is not changed; choose another place",
        ),
        (
            "out.mcap",
            {},
            "in has 2 files, each of which becomes one: name a folder instead of out.mcap",
        ),
        (
            "out.db3",
            {"storage": "mcap"},
            "out.db3 ends as a file of sqlite3, and the storage is to be mcap",
        ),
        (
            "out",
            {"storage": "sqlite3", "compression": "lz4"},
            "files of sqlite3 are not compressed; leave --compression out, or write mcap",
        ),
        ("out.bag", {}, "storage 'rosbag_v2' cannot be written; mcap and sqlite3 can"),
        ("out", {"topics": ["/a", "a"]}, "there is no topic a; did you mean /a?"),
    ],
)
def test_what_does_not_fit(destination: str, options: dict[str, Any], text: str) -> None:
    Path("in").mkdir()
    for name in ("0.mcap", "1.mcap"):
        Path("in", name).write_bytes(mcap_bytes(strings("/a", 2)))
    with pytest.raises(RequestError) as caught:
        convert_bag("in", destination, **options)
    assert str(caught.value) == text
    assert names() == ["in"]


def test_there_is_nothing() -> None:
    with pytest.raises(BagError, match=r"^in: no such file or folder$"):
        convert_bag("in", "out")
    convert(mcap_bytes([]))
    assert contents(Path("out.mcap")).messages == []
    with pytest.raises(BagError, match=r"^out\.mcap exists, and nothing is overwritten"):
        convert_bag("in.mcap", "out.mcap")


# Garbage


SOUND = mcap_bytes(
    [*strings("/a", 30), *strings("/b", 5)],
    compression=CompressionType.LZ4,
    attachments=[("map", b"x" * 50)],
    metadata=[("recorder", {"a": "b"})],
)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    place=st.integers(0, len(SOUND) - 1),
    change=st.binary(min_size=1, max_size=9),
    cut=st.booleans(),
    on_error=st.sampled_from(["stop", "skip", "copy"]),
)
def test_garbage_is_an_error_or_accounted_for(place: int, change: bytes, cut: bool, on_error: str) -> None:
    rest = b"" if cut else SOUND[place + len(change) :]
    Path("garbage.mcap").write_bytes(SOUND[:place] + change + rest)
    Path("garbage_out.mcap").unlink(missing_ok=True)
    try:
        result = convert_bag("garbage.mcap", "garbage_out.mcap", on_error=on_error, threads=1)
    except Error:
        assert not Path("garbage_out.mcap").exists()
    else:
        kept = len(contents(Path("garbage_out.mcap")).messages)
        assert result.total.converted + result.total.copied == kept
    assert not list(Path().glob(".*"))
