"""ROS 1 bags, written by rosbags or byte for byte, whole and damaged."""

from __future__ import annotations

import bz2
import re
import struct
from io import BytesIO
from pathlib import Path

import lz4.frame
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rosidl_adapter_proto.bags.model import Selection, Statistics
from rosidl_adapter_proto.bags.ros1 import Ros1Reader
from rosidl_adapter_proto.errors import BagError
from tests.bags.databases import Row, rows_of

ROWS = tuple(Row(("/a", "/b")[i % 3 == 2], 10**9 * (i // 4) + i, f"message {i}".encode()) for i in range(12))
MD5 = b"992ce8a1687cec8c8bd883ec73ca41d1"


def _header(fields: dict[str, bytes]) -> bytes:
    parts = [name.encode() + b"=" + value for name, value in fields.items()]
    return b"".join(struct.pack("<I", len(part)) + part for part in parts)


def _record(operation: int, data: bytes = b"", **fields: bytes) -> bytes:
    header = _header({"op": bytes([operation]), **fields})
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def _u32(value: int) -> bytes:
    return struct.pack("<I", value)


def _time(time: int) -> bytes:
    return struct.pack("<II", *divmod(time, 10**9))


def _connection(number: int, topic: str, **more: bytes) -> bytes:
    data = {
        "topic": topic.encode(),
        "type": b"std_msgs/String",
        "md5sum": MD5,
        "message_definition": b"string data\n",
    }
    return _record(7, _header({**data, **more}), conn=_u32(number), topic=topic.encode())


def _message(number: int, row: Row) -> bytes:
    return _record(2, row.data, conn=_u32(number), time=_time(row.time))


def _chunk(data: bytes, compression: str = "none", size: int | None = None) -> bytes:
    stored = {"bz2": bz2.compress, "lz4": lz4.frame.compress}.get(compression, bytes)(data)
    return _record(
        5, stored, compression=compression.encode(), size=_u32(len(data) if size is None else size)
    )


CONNECTIONS = [_connection(0, "/a"), _connection(1, "/b"), _connection(2, "/a", callerid=b"/node")]


def bag(
    compression: str = "none", *, index: bool = True, head: bytes = b"", rows: tuple[Row, ...] = ROWS
) -> bytes:
    """Return a bag with rows in chunks of four, whose topic `/a` has the connections 0 and 2.

    Args:
        compression: That of its chunks.
        index: Whether it has one.
        head: More fields of its header.
        rows: The messages; the times of four rise.
    """
    numbers = [1 if row.topic == "/b" else i % 2 * 2 for i, row in enumerate(rows)]
    content = b""
    infos = b""
    begin = len(b"#ROSBAG V2.0\n") + 4096
    for first in range(0, len(rows), 4):
        part = list(zip(numbers, rows, strict=True))[first : first + 4]
        data = b"".join(CONNECTIONS) + b"".join(_message(number, row) for number, row in part)
        counts = b"".join(_u32(n) + _u32([m for m, _ in part].count(n)) for n in sorted({m for m, _ in part}))
        times = {"start_time": _time(part[0][1].time), "end_time": _time(part[-1][1].time)}
        place = struct.pack("<Q", begin + len(content))
        infos += _record(6, counts, ver=_u32(1), chunk_pos=place, count=_u32(len(counts) // 8), **times)
        content += _chunk(data, compression) + _record(4, bytes(12), ver=_u32(1), conn=_u32(0), count=_u32(1))
    position = struct.pack("<Q", begin + len(content) if index else 0)
    header = (
        _header({"op": b"\3", "index_pos": position, "conn_count": _u32(3), "chunk_count": _u32(3)}) + head
    )
    header = struct.pack("<I", len(header)) + header
    header += _u32(4092 - len(header)) + b" " * (4092 - len(header))
    return b"#ROSBAG V2.0\n" + header + content + (b"".join(CONNECTIONS) + infos if index else b"")


def _read(content: bytes, salvage: bool = False) -> tuple[list[Row], Statistics, list[str]]:
    with Ros1Reader(BytesIO(content), "a.bag", salvage=salvage) as reader:
        return rows_of(reader), reader.statistics, reader.warnings


STATISTICS = Statistics({1: 8, 2: 4}, 0, 2 * 10**9 + 11)


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_a_bag_is_read(compression: str) -> None:
    assert _read(bag(compression)) == (list(ROWS), STATISTICS, [])


def test_topics_have_names_of_ros_2_and_definitions_of_ros_1() -> None:
    with Ros1Reader(BytesIO(bag()), "a.bag") as reader:
        topic = reader.topics[1]
        assert (topic.name, topic.type_name, topic.schema_name) == (
            "/a",
            "std_msgs/msg/String",
            "std_msgs/String",
        )
        assert (topic.serialization_format, topic.definition.encoding) == ("ros1", "ros1msg")
        assert topic.definition.data == b"string data\n"
        assert topic.metadata == {"md5sum": MD5.decode()}
        assert list(reader.attachments()) == []


@pytest.mark.parametrize("compression", [None, "BZ2", "LZ4"])
def test_bags_of_rosbags_are_read_as_rosbags_reads_them(tmp_path: Path, compression: str | None) -> None:
    from rosbags.rosbag1 import Reader, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Writer(tmp_path / "a.bag")
    writer.chunk_threshold = 1000
    if compression:
        writer.set_compression(Writer.CompressionFormat[compression])
    with writer:
        connections = [
            writer.add_connection(name, "std_msgs/msg/String", typestore=store) for name in ("/a", "/b")
        ]
        for i in range(300):
            writer.write(connections[i % 3 == 2], 10**9 + i, b"\4\0\0\0text" * (i % 7))
    with Reader(tmp_path / "a.bag") as oracle, Ros1Reader((tmp_path / "a.bag").open("rb"), "a.bag") as reader:
        assert rows_of(reader) == [
            Row(found.topic, time, bytes(data)) for found, time, data in oracle.messages()
        ]
        assert reader.statistics.message_count == oracle.message_count
        assert reader.statistics.start_time == oracle.start_time
        assert reader.statistics.end_time == oracle.end_time - 1
        assert len(list(reader.chunks())) > 5
        first, *_ = reader.topics.values()
        assert first.type_name == oracle.connections[0].msgtype
        assert first.definition.data.decode() == oracle.connections[0].msgdef.data


def test_chunks_of_other_times_are_not_read() -> None:
    with Ros1Reader(BytesIO(bag()), "a.bag") as reader:
        assert len(list(reader.chunks())) == 3
        for selection, first in ((Selection(start_time=2 * 10**9), 8), (Selection(end_time=10**9), 0)):
            assert rows_of(reader, selection) == list(ROWS[first : first + 4])
            assert [chunk.message_count for chunk in reader.chunks(selection)] == [4]


@pytest.mark.parametrize("index", [True, False])
def test_chunks_come_in_the_order_of_time(index: bool) -> None:
    loose = () if index else (Row("/a", 10**9 + 7, b"loose"), Row("/b", 7 * 10**9, b"late"))
    content = bag(index=index, rows=ROWS[8:] + ROWS[:8]) + b"".join(
        _message("ab".index(row.topic[1]), row) for row in loose
    )
    with Ros1Reader(BytesIO(content), "a.bag") as reader:
        assert rows_of(reader) == [*ROWS[8:], *ROWS[:8], *loose]
        assert rows_of(reader, in_time_order=True) == [*ROWS[:8], *loose, *ROWS[8:]]
        assert rows_of(reader, Selection(end_time=10**9), in_time_order=True) == list(ROWS[:4])
        positions = [chunk.position for chunk in reader.chunks()]
        assert positions == sorted(positions)


UNFINISHED = "a.bag: without an index, as its recorder did not finish; read from its beginning"


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_a_bag_without_an_index_is_read(compression: str) -> None:
    assert _read(bag(compression, index=False)) == (list(ROWS), STATISTICS, [UNFINISHED])


def test_what_a_killed_recorder_was_writing_is_read() -> None:
    """A chunk that is not finished says that it has no bytes; its records stand behind it."""
    open_chunk = _record(5, compression=b"none", size=_u32(0))
    content = bag(index=False) + open_chunk + _connection(7, "/c")
    content += _message(7, Row("/c", 5, b"half"))
    rows, statistics, warnings = _read(content + _message(7, Row("/c", 6, b"cut off"))[:-3])
    assert rows == [*ROWS, Row("/c", 5, b"half")]
    assert statistics.message_counts == {1: 8, 2: 4, 3: 1}
    cut = f"a.bag at byte {len(content)}: cut off: at least 3 bytes of a record are missing"
    assert warnings == [UNFINISHED, f"{cut}; what follows there is left out"]


def test_many_messages_outside_of_chunks_become_bounded_chunks() -> None:
    messages = b"".join(_message(0, Row("/a", i, bytes(2**18))) for i in range(10))
    with Ros1Reader(BytesIO(bag(index=False) + messages), "a.bag") as reader:
        assert [chunk.message_count for chunk in reader.chunks()] == [4, 4, 4, 4, 4, 2]


BAG = bag()
FIRST_CHUNK = 13 + 4096
INDEX = BAG.rindex(_connection(0, "/a"))
_INFO = {
    "ver": _u32(1),
    "chunk_pos": bytes(8),
    "start_time": bytes(8),
    "end_time": bytes(8),
    "count": _u32(1),
}


def _with_chunk(chunk: bytes) -> bytes:
    """Return a bag whose only chunk this is."""
    header = BAG[:FIRST_CHUNK].replace(struct.pack("<Q", INDEX), struct.pack("<Q", FIRST_CHUNK + len(chunk)))
    return header + chunk + b"".join(CONNECTIONS)


SALVAGE = "; `bag convert --on-error skip`, elsewhere `--salvage`, reads what is whole"
WRONG = {
    "another version": (
        b"#ROSBAG V1.2\n" + BAG[13:],
        "no ROS 1 bag of version 2.0: it begins with '#ROSBAG V1.2'",
    ),
    "empty": (b"", "no ROS 1 bag of version 2.0: it begins with ''"),
    "encrypted": (
        bag(head=_header({"encryptor": b"rosbag/AesCbcEncryptor"})),
        "encrypted with rosbag/AesCbcEncryptor; `rosbag decrypt` of ROS 1 decrypts it",
    ),
    "cut off": (
        BAG[:5000],
        "cut off: its index should be at byte %d, but it has 5000 bytes" + SALVAGE,
    ),
    "a record without a kind": (
        BAG[:13] + _u32(0) + _u32(0),
        "at byte 13: damaged: a record that does not say what it is",
    ),
    "no header": (BAG[:13] + _record(4), "at byte 13: damaged: the header of the bag is missing"),
    "cut off in the header": (BAG[:20], "at byte 13: cut off: at least 70 bytes of a record are missing"),
    "an enormous header": (
        BAG[:13] + b"\xff" * 20,
        "at byte 13: damaged: the header of a record has 4294967295 bytes",
    ),
    "a header without names": (
        BAG[:13] + _u32(8) + _u32(4) + b"abcd" + _u32(0),
        "at byte 13: damaged: byte 0 of a header is no field",
    ),
    "a field that is longer than the header": (
        BAG[:13] + _u32(8) + _u32(9) + b"ab=d" + _u32(0),
        "at byte 13: damaged: byte 0 of a header is no field",
    ),
    "no index position": (
        BAG[:13] + _record(3),
        "at byte 13: damaged: index_pos has 0 bytes instead of 8",
    ),
    "unknown compression": (
        BAG.replace(b"compression=none", b"compression=lzma"),
        f"at byte {FIRST_CHUNK}: the compression 'lzma' is unknown; these are known: none, bz2, lz4",
    ),
    "a chunk that lies about its size": (
        _with_chunk(_chunk(b"12345", size=6)),
        f"at byte {FIRST_CHUNK}: the chunk is damaged: it says that its 5 bytes become 6, which is impossible",
    ),
    "bz2 that is none": (
        _with_chunk(_chunk(b"12345").replace(b"\x10\0\0\0compression=none", b"\x10\0\0\0compression=bz2 ")),
        f"at byte {FIRST_CHUNK}: the compression 'bz2 ' is unknown; these are known: none, bz2, lz4",
    ),
    "bz2 that is longer": (
        _with_chunk(_chunk(b"12345", "bz2", 4)),
        f"at byte {FIRST_CHUNK}: the chunk is damaged: it has 5 bytes and says 4",
    ),
    "bz2 that is shorter": (
        _with_chunk(_chunk(b"12345", "bz2", 2**32 - 1)),
        f"at byte {FIRST_CHUNK}: the chunk is damaged: it has 5 bytes and says 4294967295",
    ),
    "damaged bz2": (
        _with_chunk(_chunk(b"12345", "bz2").replace(b"BZh9", b"BZh!")),
        f"at byte {FIRST_CHUNK}: the chunk is damaged: it cannot be decompressed: Invalid data stream",
    ),
    "a cut off record in a chunk": (
        _with_chunk(_chunk(_message(0, ROWS[0])[:-1])),
        f"at byte {FIRST_CHUNK}, in the chunk at byte 0: cut off: at least 1 bytes of a record are missing",
    ),
    "counts of nobody": (
        BAG[: BAG.rindex(_connection(0, "/a"))] + _record(6, _u32(9) + _u32(1), **_INFO),
        "at byte %d: damaged: messages of connection 9, which is not in the bag" + SALVAGE,
    ),
    "counts that are no counts": (
        BAG[: BAG.rindex(_connection(0, "/a"))] + _record(6, bytes(7), **_INFO),
        "at byte %d: damaged: 7 bytes of counts, which have 8 bytes each" + SALVAGE,
    ),
    "a connection without a type": (
        BAG[: BAG.rindex(_connection(0, "/a"))] + _record(7, conn=_u32(0), topic=b"/a"),
        "at byte %d: damaged: a connection without type" + SALVAGE,
    ),
    "a message of nobody": (
        BAG.replace(_message(0, ROWS[0]), _message(9, ROWS[0])),
        f"at byte {FIRST_CHUNK}, in the chunk at byte {sum(map(len, CONNECTIONS))}: "
        "damaged: messages of connection 9, which is not in the bag",
    ),
    "a topic that is no text": (
        BAG.replace(b"topic=/a", b"topic=/\xff"),
        "at byte %d: topic is not UTF-8 at byte 1" + SALVAGE,
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_with_its_place(name: str) -> None:
    content, expected = WRONG[name]
    with pytest.raises(BagError) as caught:
        _read(content)
    assert str(caught.value).removeprefix("a.bag").lstrip(": ") == expected.replace("%d", str(INDEX))


def test_damaged_chunks_are_left_out_of_what_is_salvaged() -> None:
    second = BAG.index(_message(0, ROWS[4]))
    content = BAG[: second + 4] + b"\xff" + BAG[second + 5 :]
    chunk = BAG.index(_chunk(b"")[:20], FIRST_CHUNK + 100)
    where = f"a.bag at byte {chunk}, in the chunk at byte {sum(map(len, CONNECTIONS))}"
    with pytest.raises(BagError) as caught:
        _read(content)
    assert str(caught.value) == f"{where}: damaged: byte 0 of a header is no field"
    rows, statistics, warnings = _read(content, salvage=True)
    assert rows == [*ROWS[:4], *ROWS[8:]]
    assert statistics == STATISTICS
    assert warnings == [f"{where}: damaged: byte 0 of a header is no field; what follows there is left out"]


def test_a_bag_that_lost_its_end_is_salvaged_from_its_beginning() -> None:
    content = BAG[: BAG.rindex(b"compression=none") + 50]
    with Ros1Reader(BytesIO(content), "a.bag", salvage=True) as reader:
        assert rows_of(reader) == list(ROWS[:8])
        assert reader.statistics.message_count == 8 and reader.is_damaged
        index, missing = reader.warnings
    assert index == (
        f"a.bag: cut off: its index should be at byte {INDEX}, but it has {len(content)} bytes; "
        "read from its beginning, without the index"
    )
    assert re.fullmatch(
        r"a\.bag at byte \d+: cut off: at least \d+ bytes of a record are missing; what follows .*", missing
    )


@given(
    changes=st.lists(st.tuples(st.integers(0, len(BAG)), st.integers(0, 255)), max_size=10),
    cut=st.integers(0, len(BAG)) | st.none(),
    compression=st.sampled_from(["none", "bz2", "lz4"]),
    index=st.booleans(),
    salvage=st.booleans(),
)
@settings(max_examples=300, deadline=None)
def test_damaged_bags_raise_nothing_else(
    changes: list[tuple[int, int]], cut: int | None, compression: str, index: bool, salvage: bool
) -> None:
    content = bytearray(bag(compression, index=index))
    for place, value in changes:
        content[place % len(content)] = value
    try:
        rows, statistics, warnings = _read(bytes(content[:cut]), salvage)
    except BagError as error:
        assert str(error).startswith("a.bag")
    else:
        assert len(rows) == statistics.message_count or UNFINISHED not in warnings
