"""Chunks of recordings: read, made, indexed and converted, against the mcap library and single messages."""

from __future__ import annotations

import array
import functools
import io
import mmap
import pickle
import random
import struct
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ros_types import struct_type, transcoder

from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.transcode import RecordsError, TranscodeError, Transcoder, _core
from rosidl_adapter_proto.transcode.records import (
    KEPT_FAILURES,
    Converted,
    Direction,
    Failure,
    RecordConverter,
    Records,
    Route,
    index_records,
    pack_records,
    read_records,
)
from tests.transcode.test_transcode_damage import mutate

Message = tuple[int, int, int, int, bytes]
"""Topic id, sequence number, log time, publish time and data."""

NUMBERS_OF_64_BITS = st.integers(0, 2**64 - 1)
MESSAGES = st.lists(
    st.tuples(
        st.integers(0, 4) | st.integers(0, 65535),
        st.integers(0, 2**32 - 1),
        st.integers(0, 9) | NUMBERS_OF_64_BITS,
        NUMBERS_OF_64_BITS,
        st.binary(max_size=40),
    ),
    max_size=30,
)
LARGEST = 2**32 - 1
GOOD, BAD = b"\0\1\0\0\2\0\0\0a\0", b"\0\1\0\0\2\0\0\0ab"
GOOD_PROTO, BAD_PROTO = b"\x0a\x01a", b"\x0a\x01\xff"
OF_ROS1 = b"\1\0\0\0a"
CUT = "are left; the chunk is cut off or damaged"


@functools.cache
def strings(**options: Any) -> Transcoder:
    return transcoder(
        struct_type("test/msg/String", data="string"), "test/msg/String", hashed=False, **options
    )[0]


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def message_record(topic_id: int, sequence: int, log_time: int, publish_time: int, data: bytes) -> bytes:
    return record(5, struct.pack("<HIQQ", topic_id, sequence, log_time, publish_time) + data)


def chunk_of(messages: Sequence[Message]) -> bytes:
    return b"".join(message_record(*each) for each in messages)


def simple_chunk(*messages: tuple[int, bytes]) -> bytes:
    """Return messages whose sequence numbers and times are 0, 1, 2..."""
    return chunk_of([(topic_id, i, i, i, data) for i, (topic_id, data) in enumerate(messages)])


def messages_of(records: Records) -> list[Message]:
    return [
        (*numbers, bytes(records[index]))
        for index, numbers in enumerate(
            zip(records.topic_ids, records.sequences, records.log_times, records.publish_times, strict=True)
        )
    ]


def pack(messages: Sequence[Message]) -> bytearray:
    ids, sequences, log_times, publish_times, data = zip(*messages, strict=True) if messages else ((),) * 5
    return pack_records(
        array.array("H", ids),
        array.array("I", sequences),
        array.array("Q", log_times),
        array.array("Q", publish_times),
        data,
    )


# Reading, making, indexing -------------------------------------------------------------------------------------------


@given(MESSAGES)
def test_what_is_packed_is_read(messages: list[Message]) -> None:
    chunk = pack(messages)
    assert chunk == chunk_of(messages)
    records = read_records(chunk)
    assert messages_of(records) == messages
    assert len(records) == len(messages)
    assert bytes(records.data) == chunk
    assert not records.others
    assert [each.format for each in (records.topic_ids, records.sequences, records.ranges)] == ["H", "I", "Q"]


@given(MESSAGES, st.sets(st.integers(0, 4)) | st.none(), NUMBERS_OF_64_BITS | st.integers(-5, 9), st.data())
def test_selection(
    messages: list[Message], topic_ids: set[int] | None, start: int, data: st.DataObject
) -> None:
    end = data.draw(st.none() | st.integers(start - 3, start + 3) | st.integers(2**64 - 1, 2**65))
    wanted = [
        each
        for each in messages
        if (topic_ids is None or each[0] in topic_ids) and start <= each[2] and (end is None or each[2] < end)
    ]
    chunk = chunk_of(messages)
    assert messages_of(read_records(chunk, topic_ids, start, end)) == wanted
    ids = {each[0] for each in messages}
    routes = {each: Route(each) if topic_ids is None or each in topic_ids else None for each in ids}
    converted = RecordConverter(routes).convert(chunk, start_time=start, end_time=end)
    assert converted == Converted(memoryview(chunk_of(wanted)), len(wanted), {}, ())


def test_other_records_are_told() -> None:
    chunk = record(3, b"schema") + simple_chunk((7, b"one")) + record(0x80, b"") + simple_chunk((8, b"two"))
    records = read_records(memoryview(chunk))
    assert [(opcode, bytes(content)) for opcode, content in records.others] == [(3, b"schema"), (0x80, b"")]
    assert [each[4] for each in messages_of(records)] == [b"one", b"two"]
    assert bytes(records[-1]) == b"two"
    with pytest.raises(IndexError):
        records[2]
    assert RecordConverter({7: Route(7), 8: Route(8)}).convert(chunk).data == simple_chunk((7, b"one")) + (
        simple_chunk((8, b"two"))
    )


def test_records_that_are_no_messages_are_few() -> None:
    empty = record(0x80, b"")
    assert len(read_records(empty * 2**18).others) == 2**18
    with pytest.raises(RecordsError) as caught:
        read_records(empty * (2**18 + 1))
    assert str(caught.value) == (
        "byte 2359296 of the chunk: the chunk has more than 262144 records that are no messages; it is damaged"
    )


@pytest.mark.parametrize("kind", [_core.Memory, _core.PooledMemory])
def test_memory_is_made_by_the_native_module(kind: type[_core.Memory]) -> None:
    with pytest.raises(TypeError, match="no constructor defined"):
        kind()
    with pytest.raises(BufferError, match=r"^only the native module makes memory$"):
        memoryview(kind.__new__(kind))


def mcap_file(messages: Sequence[Message]) -> bytes:
    """Return a file of one chunk that the mcap library writes; topic ids count from 1 there."""
    from mcap.writer import CompressionType, IndexType, Writer

    file = io.BytesIO()
    writer: Any = Writer(file, 2**32, CompressionType.NONE, index_types=IndexType.ALL)
    writer.start()
    for topic_id in range(1, max((each[0] for each in messages), default=0) + 1):
        writer.register_channel(f"/{topic_id}", "cdr", 0)
    for topic_id, sequence, log_time, publish_time, data in messages:
        writer.add_message(topic_id, log_time, data, publish_time, sequence)
    writer.finish()
    return file.getvalue()


@given(MESSAGES.map(lambda messages: [(1 + each[0] % 5, *each[1:]) for each in messages]))
def test_mcap_agrees(messages: list[Message]) -> None:
    from mcap.records import Chunk, MessageIndex
    from mcap.stream_reader import StreamReader

    records = list(StreamReader(io.BytesIO(mcap_file(messages)), emit_chunks=True).records)
    chunks = [each for each in records if isinstance(each, Chunk)]
    assert len(chunks) == 1 or not messages
    for chunk in chunks:
        assert messages_of(read_records(chunk.data)) == messages
        # The library writes the entries in the order of the chunk; the specification wants them sorted.
        expected = {
            each.channel_id: sorted(each.records, key=lambda entry: entry[0])
            for each in records
            if isinstance(each, MessageIndex)
        }
        index = index_records(chunk.data)
        found = {}
        for topic_id, place in index.places.items():
            reader = StreamReader(io.BytesIO(index.data[place:]), skip_magic=True, record_size_limit=None)
            one: Any = next(iter(reader.records))
            assert one.channel_id == topic_id
            found[topic_id] = one.records
        assert found == expected
        assert index.message_counts == {topic_id: len(each) for topic_id, each in expected.items()}
        if messages:
            assert (index.start_time, index.end_time) == (chunk.message_start_time, chunk.message_end_time)


def test_an_index_is_in_the_order_of_topics_and_times() -> None:
    chunk = chunk_of([(9, 0, 5, 0, b"a"), (300, 1, 7, 0, b""), (9, 2, 3, 0, b""), (9, 3, 5, 0, b"b")])
    index = index_records(chunk)
    entries = struct.pack("<HI6Q", 9, 48, 3, 63, 5, 0, 5, 94)
    assert index.data == record(7, entries) + record(7, struct.pack("<HI2Q", 300, 16, 7, 32))
    assert (index.places, index.message_counts) == ({9: 0, 300: 63}, {9: 3, 300: 1})
    assert list(index.places) == [9, 300]
    assert (index.start_time, index.end_time) == (3, 7)


def test_every_topic_id() -> None:
    rng = random.Random(1)
    ids = rng.sample(range(65536), 65536)
    chunk = pack([(each, 0, each, 0, b"") for each in ids])
    index = index_records(chunk)
    assert list(index.places) == list(range(65536))
    assert index.data[index.places[40000] :][:31] == record(
        7, struct.pack("<HIQQ", 40000, 16, 40000, 31 * ids.index(40000))
    )
    converted = RecordConverter({each: Route(65535 - each) for each in range(65536)}).convert(chunk)
    assert read_records(converted.data).topic_ids.tolist() == [65535 - each for each in ids]


def test_a_chunk_that_is_too_large() -> None:
    # Of this memory nothing is touched.
    with mmap.mmap(-1, 2**32) as zeros, pytest.raises(RecordsError) as caught:
        index_records(zeros)
    assert str(caught.value) == (
        f"byte 0 of the chunk: the chunk has {2**32} bytes and may have {LARGEST}; make smaller chunks"
    )


def test_an_empty_chunk() -> None:
    assert messages_of(read_records(b"")) == []
    index = index_records(b"")
    assert (index.data, index.places, index.start_time, index.end_time) == (b"", {}, 0, 0)
    assert RecordConverter({}).convert(b"") == Converted(memoryview(b""), 0, {}, ())
    assert pack([]) == b""


def test_what_cannot_be_packed() -> None:
    ids, sequences, times = array.array("H", [1]), array.array("I", [1]), array.array("Q", [1])
    with pytest.raises(
        ValueError, match="there are 2 messages and 1 numbers in `topic_ids`; give one for each"
    ):
        pack_records(ids, sequences, times, times, [b"", b""])
    with pytest.raises(ValueError, match="there are 1 messages and 0 numbers in `publish_times`"):
        pack_records(ids, sequences, times, times[:0], [b""])
    with pytest.raises(
        TypeError, match="`topic_ids` must be a contiguous buffer of 16-bit numbers, such as array\\('H'\\)"
    ):
        pack_records(b"12", sequences, times, times, [b""])
    with pytest.raises(TypeError, match="`log_times` must be a contiguous buffer of 64-bit numbers"):
        pack_records(ids, sequences, array.array("d", [1]), times, [b""])
    with pytest.raises(TypeError, match="messages must be a sequence of buffers"):
        pack_records(ids, sequences, times, times, 5)  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        pack_records(ids, sequences, times, times, ["text"])  # type: ignore[list-item]
    # Of numpy as well; and nothing larger than a chunk may be, before memory is taken.
    columns: list[Any] = [numpy.zeros(4096, f"uint{bits}") for bits in (16, 32, 64, 64)]
    with pytest.raises(RecordsError) as caught:
        pack_records(columns[0], columns[1], columns[2], columns[3], [bytes(2**20)] * 4096)
    assert str(caught.value) == (
        f"byte {4095 * (2**20 + 31)} of the chunk: with this message the result would have more than {LARGEST} bytes;"
        " make smaller chunks"
    )


# Converting ----------------------------------------------------------------------------------------------------------


def test_routes() -> None:
    chunk = simple_chunk(
        (1, GOOD),
        (2, GOOD_PROTO),
        (3, OF_ROS1),
        (4, b"as it is"),
        (5, b"not wanted"),
        (1, GOOD),
        (65535, GOOD),
    )
    converter = RecordConverter(
        {
            1: Route(11, strings()),
            2: Route(12, strings(), Direction.PROTO_TO_CDR),
            3: Route(11, strings(), Direction.ROS1_TO_PROTO),
            4: Route(0),
            5: None,
            65535: Route(65535, strings(size_limit=2), failed_topic_id=9),
        }
    )
    converted = converter.convert(chunk)
    assert messages_of(read_records(converted.data)) == [
        (11, 0, 0, 0, GOOD_PROTO),
        (12, 1, 1, 1, GOOD),
        (11, 2, 2, 2, GOOD_PROTO),
        (0, 3, 3, 3, b"as it is"),
        (11, 5, 5, 5, GOOD_PROTO),
        (9, 6, 6, 6, GOOD),
    ]
    assert converted.message_count == 6
    assert converted.failure_counts == {65535: 1}
    (failure,) = converted.failures
    assert (failure.topic_id, failure.log_time, failure.sequence, failure.index) == (65535, 6, 6, 6)
    assert str(failure.error) == (
        "test/msg/String at byte 10: the result would have more than 2 bytes;"
        " split the message or raise the size limit"
    )
    assert converted.data.readonly
    assert messages_of(read_records(converter.convert(chunk, start_time=2, end_time=4).data)) == [
        (11, 2, 2, 2, GOOD_PROTO),
        (0, 3, 3, 3, b"as it is"),
    ]


@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.sampled_from([GOOD, BAD, GOOD_PROTO, BAD_PROTO, b""]) | st.binary())
    ),
    st.none() | st.just(100),
)
def test_messages_are_what_single_calls_make_of_them(
    messages: list[tuple[int, bytes]], failed_topic_id: int | None
) -> None:
    transcode = strings()
    calls = {
        Direction.CDR_TO_PROTO: transcode.cdr_to_proto,
        Direction.PROTO_TO_CDR: transcode.proto_to_cdr,
        Direction.ROS1_TO_PROTO: transcode.ros1_to_proto,
    }
    routes: dict[int, Route | None] = {
        topic_id: Route(topic_id + 10, transcode, direction, failed_topic_id)
        for topic_id, direction in enumerate(Direction)
    }
    converted = RecordConverter({**routes, 3: Route(13)}).convert(simple_chunk(*messages))
    expected, failures = [], []
    for index, (topic_id, data) in enumerate(messages):
        numbers = (index, index, index)
        route = routes.get(topic_id)
        try:
            content = calls[route.direction](data) if route is not None else data
        except TranscodeError as error:
            failures.append((topic_id, index, index, index, str(error), error.args))
            if failed_topic_id is not None:
                expected.append((failed_topic_id, *numbers, data))
        else:
            expected.append((topic_id + 10, *numbers, content))
    assert messages_of(read_records(converted.data)) == expected
    assert converted.message_count == len(expected)
    assert converted.failure_counts == Counter(each[0] for each in failures)
    assert [failure_row(each) for each in converted.failures] == failures[:KEPT_FAILURES]


def failure_row(failure: Failure) -> tuple[int, int, int, int, str, tuple[Any, ...]]:
    numbers = (failure.topic_id, failure.log_time, failure.sequence, failure.index)
    return (*numbers, str(failure.error), failure.error.args)


@pytest.mark.parametrize("failed_topic_id", [None, 9])
def test_a_chunk_of_failures_makes_few_errors(failed_topic_id: int | None) -> None:
    converter = RecordConverter(
        {topic_id: Route(topic_id, strings(), failed_topic_id=failed_topic_id) for topic_id in (1, 300)}
    )
    chunk = simple_chunk(*[(1, GOOD), (1, b""), (300, b"")] * 5000)
    converted = converter.convert(chunk)
    assert converted.failure_counts == {1: 5000, 300: 5000}
    assert converted.message_count == (15_000 if failed_topic_id else 5000)
    assert [each.index for each in converted.failures] == [1, 2, 4, 5, 7, 8, 10, 11, 13, 14]


def test_large_messages() -> None:
    types = struct_type("test/msg/Bytes", data="uint8[]")
    transcode, message_class = transcoder(types, "test/msg/Bytes")
    images = [bytes([i]) * (1 << 20) for i in range(5)]
    protos = [message_class(data=each).SerializeToString() for each in images]
    chunk = simple_chunk(*((1, each) for each in protos))
    to_cdr = RecordConverter({1: Route(1, transcode, Direction.PROTO_TO_CDR)}).convert(chunk)
    back = RecordConverter({1: Route(1, transcode)}).convert(to_cdr.data)
    assert back.data == chunk
    # A result that is many times as large as the chunk.
    doubles, _ = transcoder(struct_type("test/msg/Doubles", x="double[10000]"), "test/msg/Doubles")
    zeros = RecordConverter({1: Route(1, doubles, Direction.PROTO_TO_CDR)}).convert(
        simple_chunk(*[(1, b"")] * 100)
    )
    assert zeros.data == simple_chunk(*[(1, b"\0\1\0\0" + bytes(80_000))] * 100)


def test_threads() -> None:
    """One converter for all of them."""
    rng = random.Random(5)
    transcode = strings()
    converter = RecordConverter({1: Route(1, transcode), 2: Route(2, transcode, Direction.PROTO_TO_CDR)})
    chunks = []
    for _ in range(40):
        lines = [b"x" * rng.randrange(200) for _ in range(300)]
        protos = [
            b"" if not each else transcode.ros1_to_proto(struct.pack("<I", len(each)) + each)
            for each in lines
        ]
        chunks.append(
            simple_chunk(
                *((1, transcode.proto_to_cdr(each)) if i % 2 else (2, each) for i, each in enumerate(protos))
            )
        )
    expected = [bytes(converter.convert(each).data) for each in chunks]
    with ThreadPoolExecutor(8) as pool:
        assert [bytes(each.data) for each in pool.map(converter.convert, chunks)] == expected


def test_memory_is_used_again_when_nobody_looks_at_it() -> None:
    converter = RecordConverter({1: Route(1)})
    chunks = [simple_chunk((1, bytes([i]) * (100_000 >> i % 5))) for i in range(40)]
    for _ in range(2):
        results = [converter.convert(each).data for each in chunks]
        assert results == chunks
        kept = results[7][-9:]
        del results
        assert converter.convert(chunks[1]).data == chunks[1]
        with pytest.raises(RecordsError):
            converter.convert(chunks[2] + b"\5")
        assert bytes(kept) == bytes([7]) * 9


def test_results_outlive_their_converter() -> None:
    converted = RecordConverter({1: Route(1)}).convert(simple_chunk((1, b"abc")))
    part = converted.data[-3:]
    del converted
    assert bytes(part) == b"abc"


def test_the_topic_of_what_fails_is_a_number_of_16_bits() -> None:
    with pytest.raises(ValueError, match="65536 is no topic id; give a number from 0 to 65535"):
        RecordConverter({1: Route(1, strings(), failed_topic_id=65536)})


@pytest.mark.parametrize("topic_id", [-1, 65536, 1.5, "1", None])
def test_topic_ids_are_numbers_of_16_bits(topic_id: Any) -> None:
    text = f"{topic_id!r} is no topic id; give a number from 0 to 65535"
    for routes in ({topic_id: Route(1)}, {1: Route(topic_id)}):
        with pytest.raises(ValueError) as caught:
            RecordConverter(routes)
        assert str(caught.value) == text
    with pytest.raises(ValueError, match="is no topic id"):
        read_records(b"", [topic_id])


# Damage --------------------------------------------------------------------------------------------------------------

FIRST = simple_chunk((1, b"good"))
DAMAGED = {
    "cut header": (b"\5" + bytes(7), f"a record begins with 9 bytes and 8 {CUT}"),
    "cut content": (struct.pack("<BQ", 5, 22) + bytes(21), f"a record of 22 bytes is announced and 21 {CUT}"),
    "overflow": (struct.pack("<BQ", 5, 2**64 - 1), f"a record of {2**64 - 1} bytes is announced and 0 {CUT}"),
    "overflow with header": (
        struct.pack("<BQ", 9, 2**64 - 9),
        f"a record of {2**64 - 9} bytes is announced and 0 {CUT}",
    ),
    "no opcode": (record(0, b"x" * 30), "0 is no opcode of a record; the chunk is damaged"),
    "short message": (
        record(5, bytes(21)),
        "a message record has at least 22 bytes and this one has 21; the chunk is damaged",
    ),
    "no route": (
        message_record(513, 0, 0, 0, b""),
        "there is no route for topic id 513; give one, or None to leave the messages of this topic out",
    ),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_errors(name: str) -> None:
    data, reason = DAMAGED[name]
    calls: list[Callable[[bytes], object]] = [RecordConverter({1: Route(1, failed_topic_id=3)}).convert]
    if name != "no route":
        calls += [read_records, index_records]
    for call in calls:
        with pytest.raises(RecordsError) as caught:
            call(FIRST + data)
        assert str(caught.value) == f"byte {len(FIRST)} of the chunk: {reason}"
        assert (caught.value.byte_offset, caught.value.reason) == (len(FIRST), reason)
        assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
        assert isinstance(caught.value, Error)


def test_a_route_counts_outside_of_the_times_as_well() -> None:
    with pytest.raises(RecordsError, match="no route for topic id 2"):
        RecordConverter({1: None}).convert(simple_chunk((1, b""), (2, b"")), start_time=10)


def test_damage() -> None:
    """Whatever stands in a chunk: an error of ours, or results that agree with each other."""
    rng = random.Random(11)
    transcode = strings()
    routes = {
        each: Route(each, transcode, (*Direction,)[each % 3], 500) if each % 4 else Route(each)
        for each in range(8)
    }
    converter = RecordConverter(routes)
    chunk = simple_chunk(*((i % 8, rng.choice([GOOD, GOOD_PROTO, OF_ROS1, BAD])) for i in range(20)))
    chunk += record(4, b"channel") + chunk
    good = 0
    for _ in range(5000):
        data = mutate(chunk, rng)
        try:
            records = read_records(data)
        except RecordsError as error:
            assert error.byte_offset <= len(data)
            with pytest.raises(RecordsError, match=str(error)):
                index_records(data)
            continue
        assert sum(index_records(data).message_counts.values()) == len(records)
        try:
            converted = converter.convert(data)
        except RecordsError as error:
            assert "no route" in str(error)
            continue
        good += 1
        assert converted.message_count == len(records)
        assert len(read_records(converted.data)) == len(records)
    assert good > 100
