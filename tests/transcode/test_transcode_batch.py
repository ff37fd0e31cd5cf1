"""Batches: many messages into one buffer, on several threads, with an error for each that fails."""

from __future__ import annotations

import array
import contextlib
import pickle
import random
import struct
import threading
from collections.abc import Callable
from typing import Any

import numpy
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference_cdr import write_cdr
from ros_types import nasty_types, random_value, struct_type, transcoder

from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.transcode import Batch, BufferTooSmallError, TranscodeError, Transcoder
from rosidl_adapter_proto.transcode.codec import NOWHERE

NASTY = nasty_types()
STRING = struct_type("test/msg/String", data="string")
BYTES = struct_type("test/msg/Bytes", data="uint8[]")
GOOD, BAD = b"\0\1\0\0\2\0\0\0a\0", b"\0\1\0\0\2\0\0\0ab"
GOOD_PROTO, BAD_PROTO = b"\x0a\x01a", b"\x0a\x01\xff"


def nasty_messages(count: int) -> list[bytes]:
    rng = random.Random(7)
    return [
        write_cdr(NASTY, "test/msg/Nasty", random_value(NASTY, "test/msg/Nasty", rng)) for _ in range(count)
    ]


def strings() -> Transcoder:
    return transcoder(STRING, "test/msg/String", hashed=False)[0]


def places(messages: list[bytes], gap: int = 0) -> array.array[int]:
    """Return where messages are that lie one after the other, `gap` bytes apart."""
    result, at = array.array("Q"), 0
    for each in messages:
        result.extend((at, at + len(each)))
        at += len(each) + gap
    return result


def outcomes(batch: Batch) -> list[bytes | str]:
    """Return the content of each result, or its error as text."""
    result: list[bytes | str] = []
    for index in range(len(batch)):
        try:
            result.append(bytes(batch[index]))
        except TranscodeError as error:
            assert error is batch.errors[index]
            result.append(str(error))
    return result


@pytest.mark.parametrize("threads", [1, 2, 5, 2**64])
@pytest.mark.parametrize("count", [0, 1, 64, 300])
def test_batch(count: int, threads: int) -> None:
    transcode, _ = transcoder(NASTY, "test/msg/Nasty")
    messages = nasty_messages(count)
    batch = transcode.cdr_to_proto_batch(messages, threads=threads)
    protos = [bytes(each) for each in batch]
    assert protos == [transcode.cdr_to_proto(each) for each in messages]
    assert batch.buffer == b"".join(protos)
    assert batch.ranges.tolist() == places(protos).tolist()
    assert not batch.errors
    assert list(transcode.proto_to_cdr_batch(tuple(protos), threads)) == messages
    assert list(transcode.proto_to_cdr_batch([bytearray(each) for each in protos], threads)) == messages
    assert list(transcode.proto_to_cdr_batch(iter(batch), threads)) == messages
    assert list(transcode.proto_to_cdr_batch(batch.buffer, threads, ranges=batch.ranges)) == messages


@given(st.lists(st.binary(max_size=40)), st.integers(1, 4), st.booleans())
def test_batch_equals_single_messages(messages: list[bytes], threads: int, good: bool) -> None:
    """Of arbitrary bytes, and of strings of any length, in both directions."""
    transcode = strings()
    if good:
        messages = [b"\0\1\0\0" + struct.pack("<I", len(each) + 1) + each + b"\0" for each in messages]
    for single, many in (
        (transcode.cdr_to_proto, transcode.cdr_to_proto_batch),
        (transcode.proto_to_cdr, transcode.proto_to_cdr_batch),
    ):
        expected: list[bytes | str] = []
        for index, each in enumerate(messages):
            try:
                expected.append(single(each))
            except TranscodeError as error:
                error.batch_index = index
                expected.append(str(error))
        assert outcomes(many(messages, threads)) == expected
        assert outcomes(many(b"".join(messages), threads, ranges=places(messages))) == expected


@pytest.mark.parametrize("threads", [1, 2, 3, 4])
def test_threads_do_not_change_the_result(threads: int) -> None:
    """Where results lie does not depend on the threads either."""
    transcode = strings()
    rng = random.Random(3)
    messages = [transcode.proto_to_cdr(b"\x0a\x64" + b"a" * 100) for _ in range(5000)]
    for index in rng.sample(range(len(messages)), 500):
        messages[index] = rng.choice([b"", BAD, bytes(70_000)])
    one, more = transcode.cdr_to_proto_batch(messages), transcode.cdr_to_proto_batch(messages, threads)
    assert (one.buffer, one.ranges) == (more.buffer, more.ranges)
    assert list(map(str, one.errors.values())) == list(map(str, more.errors.values()))
    assert list(one.errors) == [i for i, each in enumerate(messages) if len(each) != 109]


@pytest.mark.parametrize("threads", [1, 4])
def test_errors_do_not_fail_the_others(threads: int) -> None:
    batch = strings().cdr_to_proto_batch([BAD if i in (0, 123, 299) else GOOD for i in range(300)], threads)
    assert list(batch.errors) == [0, 123, 299]
    assert [batch[i] for i in range(300) if i not in batch.errors] == [GOOD_PROTO] * 297
    assert batch.buffer == GOOD_PROTO * 297
    assert batch.ranges[2 * 123 : 2 * 125].tolist() == [NOWHERE, NOWHERE, 122 * 3, 123 * 3]
    for index in (0, 123, 299, -1):
        with pytest.raises(TranscodeError) as caught:
            batch[index]
        assert caught.value.batch_index == index % 300
    assert str(batch.errors[123]) == (
        "test/msg/String.data at byte 9 of message 123:"
        " the string does not end with NUL; the data is damaged or of another type"
    )
    with pytest.raises(TranscodeError, match="of message 0:"):
        list(batch)
    assert repr(batch) == "<Batch of 300 messages, 3 failed>"


@pytest.mark.parametrize("threads", [1, 4])
def test_errors_found_while_writing(threads: int) -> None:
    """Text in protobuf is checked while it is copied: the place of such a message stays, with zeros."""
    kept = bytearray(b"\xee" * 40)
    batch = strings().proto_to_cdr_batch([GOOD_PROTO, BAD_PROTO, GOOD_PROTO], threads, into=kept)
    assert kept == GOOD + bytes(10) + GOOD + b"\xee" * 10
    assert batch.ranges.tolist() == [0, 10, NOWHERE, NOWHERE, 20, 30]
    assert [str(each) for each in batch.errors.values()] == [
        "test/msg/String.data at byte 2 of message 1: the text is not valid UTF-8;"
        " encode it as UTF-8, or use bytes for what is not text"
    ]
    assert batch[0] == batch[2] == GOOD
    with pytest.raises(TranscodeError, match="of message 1:"):
        batch[1]


@pytest.mark.parametrize("threads", [1, 3])
def test_all_bad(threads: int) -> None:
    batch = strings().cdr_to_proto_batch([BAD] * 1000, threads)
    assert list(batch.errors) == list(range(1000))
    assert len(batch.buffer) == 0
    assert batch.ranges.tolist() == [NOWHERE] * 2000


def test_a_failed_message_is_not_overlooked_by_the_next_batch() -> None:
    batch = strings().cdr_to_proto_batch([GOOD, BAD])
    with pytest.raises(ValueError, match=f"message 1 is from byte {NOWHERE} to {NOWHERE}, which is not in"):
        strings().proto_to_cdr_batch(batch.buffer, ranges=batch.ranges)


def test_an_empty_result_is_not_an_error() -> None:
    batch = strings().cdr_to_proto_batch([b"\0\1\0\0\1\0\0\0\0", GOOD])
    assert [bytes(each) for each in batch] == [b"", GOOD_PROTO]


def test_batch_is_a_sequence() -> None:
    batch = strings().cdr_to_proto_batch([GOOD] * 3)
    assert len(batch) == 3
    assert batch[-1] == batch[-3] == GOOD_PROTO
    for index in (3, -4):
        with pytest.raises(IndexError):
            batch[index]


@pytest.mark.parametrize("threads", [1, 2])
def test_kept_buffer(threads: int) -> None:
    """One buffer for a stream of batches: what it held before does not matter."""
    transcode = strings()
    kept = bytearray(b"\xee" * 1000)
    for text in (b"a" * 20, b"bc", b"", b"d" * 20):
        cdr = b"\0\1\0\0" + struct.pack("<I", len(text) + 1) + text + b"\0"
        batch = transcode.cdr_to_proto_batch([cdr] * 30, threads, into=kept)
        assert list(batch) == [transcode.cdr_to_proto(cdr)] * 30
        assert batch.buffer.obj is kept
        assert len(batch.buffer) == sum(map(len, batch))
    assert kept[30 * 22 :] == b"\xee" * (1000 - 30 * 22)


INTO: dict[str, Callable[[], Any]] = {
    "bytearray": lambda: bytearray(30),
    "memoryview": lambda: memoryview(bytearray(40))[3:37],
    "array": lambda: array.array("I", [0] * 10),
    "numpy": lambda: numpy.zeros((4, 3), dtype=numpy.float32),
}


@pytest.mark.parametrize("form", INTO)
def test_any_writable_buffer(form: str) -> None:
    into = INTO[form]()
    batch = strings().proto_to_cdr_batch([GOOD_PROTO] * 3, into=into)
    assert list(batch) == [GOOD] * 3
    assert bytes(into)[:30] == GOOD * 3


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("size", [0, 1, 8999])
def test_buffer_too_small(size: int, threads: int) -> None:
    """The error says what is needed, with which it works; nothing is written after the end."""
    transcode = strings()
    memory = bytearray(b"\xee" * 9000)
    with pytest.raises(BufferTooSmallError) as caught:
        transcode.cdr_to_proto_batch([GOOD] * 3000, threads, into=memoryview(memory)[:size])
    assert (caught.value.needed, caught.value.size) == (9000, size)
    assert str(caught.value) == (
        f"the results take 9000 bytes and `into` has {size}; give a buffer of at least 9000 bytes"
    )
    assert isinstance(caught.value, Error)
    assert memory[size:] == b"\xee" * (9000 - size)
    assert list(transcode.cdr_to_proto_batch([GOOD] * 3000, threads, into=memory)) == [GOOD_PROTO] * 3000
    copy = pickle.loads(pickle.dumps(caught.value))
    assert (str(copy), copy.needed) == (str(caught.value), 9000)


def test_buffer_that_cannot_be_written() -> None:
    transcode = strings()
    with pytest.raises(BufferError, match="not writable"):
        transcode.cdr_to_proto_batch([GOOD], into=bytes(100))
    with pytest.raises((BufferError, ValueError), match="contiguous"):
        transcode.cdr_to_proto_batch([GOOD], into=memoryview(bytearray(100))[::2])
    with pytest.raises(TypeError, match="a bytes-like object is required, not 'str'"):
        transcode.cdr_to_proto_batch([GOOD], into="text")  # type: ignore[arg-type]


def test_buffer_of_the_messages() -> None:
    """Results may not be written over what is still to be read."""
    transcode = strings()
    memory = bytearray(GOOD + bytes(50))
    message, rest = memoryview(memory)[:10], memoryview(memory)[10:]
    cases: list[tuple[list[bytes | memoryview], bytearray | memoryview]] = [
        ([message], memory),
        ([GOOD, message], memoryview(memory)[9:]),
    ]
    for messages, into in cases:
        with pytest.raises(ValueError, match="`into` is memory of the messages; give other memory"):
            transcode.cdr_to_proto_batch(messages, into=into)
    with pytest.raises(ValueError, match="`into` is memory of the messages"):
        transcode.cdr_to_proto_batch(memory, ranges=array.array("Q", [0, 10]), into=memory)
    assert list(transcode.cdr_to_proto_batch([message], into=rest)) == [GOOD_PROTO]
    assert memory[:10] == GOOD


def test_buffers_are_let_go() -> None:
    """Afterwards nothing holds the messages, and only the results hold their buffer."""
    transcode = strings()
    memory, kept = bytearray(GOOD), bytearray(100)
    batch = transcode.cdr_to_proto_batch([memory], into=kept)
    memory.clear()  # no longer locked
    with pytest.raises(BufferError):
        kept.clear()  # the results are in it
    del batch
    kept.clear()


def test_memory_is_locked_meanwhile() -> None:
    """Another thread tries to take the memory away while it is read and written."""
    transcode = strings()
    message, kept = bytearray(GOOD), bytearray(30_000)
    stop = threading.Event()

    def disturb() -> None:
        while not stop.is_set():
            for each, size in ((message, 10), (kept, 30_000)):
                with contextlib.suppress(BufferError):
                    each.extend(bytes(100_000))
                    del each[size:]

    thread = threading.Thread(target=disturb)
    thread.start()
    try:
        for _ in range(100):
            batch = transcode.cdr_to_proto_batch([memoryview(GOOD), message] * 5000, 2, into=kept)
            assert batch.buffer[:3] == GOOD_PROTO
            assert set(batch.errors) <= set(range(1, 10_000, 2))  # those that were longer
            del batch
    finally:
        stop.set()
        thread.join()


def test_list_that_changes_meanwhile() -> None:
    """Taking the items of a batch can run any code: here an iterator that changes the list behind it."""
    transcode = strings()
    messages: list[bytes] = [GOOD] * 100

    def items() -> Any:
        for each in messages:
            yield each
            messages.pop()

    assert list(transcode.cdr_to_proto_batch(items())) == [GOOD_PROTO] * 50


RANGES: dict[str, Callable[[list[int]], Any]] = {
    "array": lambda values: array.array("Q", values),
    "signed": lambda values: array.array("q", values),
    "memoryview": lambda values: memoryview(array.array("Q", values)),
    "numpy": lambda values: numpy.array(values, dtype=numpy.uint64),
    "rows": lambda values: numpy.array(values, dtype=numpy.int64).reshape(-1, 2),
}


@pytest.mark.parametrize("form", RANGES)
def test_ranges(form: str) -> None:
    """Messages anywhere in one buffer: in any order, with anything between them, more than once."""
    buffer = b"??" + GOOD + b"?" + BAD
    values = [13, 23, 2, 12, 2, 12, 23, 23]
    batch = strings().cdr_to_proto_batch(buffer, ranges=RANGES[form](values))
    assert list(batch.errors) == [0, 3]
    assert batch[1] == batch[2] == GOOD_PROTO
    assert "of message 3: a CDR message begins with a header of 4 bytes and this one has 0" in str(
        batch.errors[3]
    )


def test_messages_that_begin_at_the_same_place() -> None:
    """What is remembered about the fields of one is not taken for the other."""
    transcode = strings()
    buffer = GOOD_PROTO + b"\x0a\x02bc"
    batch = transcode.proto_to_cdr_batch(buffer, ranges=array.array("Q", [0, 3, 0, 7, 0, 3]))
    assert list(batch) == [GOOD, transcode.proto_to_cdr(buffer), GOOD]
    batch = transcode.proto_to_cdr_batch(buffer, ranges=array.array("Q", [0, 7, 0, 3]))
    assert list(batch) == [transcode.proto_to_cdr(buffer), GOOD]


BAD_RANGES: dict[str, tuple[Any, type[Exception], str]] = {
    "behind the end": (
        array.array("Q", [0, 10, 1, 11]),
        ValueError,
        "message 1 is from byte 1 to 11, which is not in a buffer of 10 bytes",
    ),
    "backwards": (
        array.array("Q", [5, 4]),
        ValueError,
        "message 0 is from byte 5 to 4, which is not in a buffer of 10 bytes",
    ),
    "negative": (
        array.array("q", [-1, 4]),
        ValueError,
        f"message 0 is from byte {NOWHERE} to 4, which is not in a buffer of 10 bytes",
    ),
    "odd": (
        array.array("Q", [0, 10, 0]),
        ValueError,
        "`ranges` has an odd number of places; give each message its first byte and the one after its last",
    ),
    "narrow": (
        array.array("I", [0, 10]),
        TypeError,
        "`ranges` must be a contiguous buffer of 64-bit numbers, such as array('Q')",
    ),
    "floats": (
        array.array("d", [0, 10]),
        TypeError,
        "`ranges` must be a contiguous buffer of 64-bit numbers, such as array('Q')",
    ),
    "bytes": (
        bytes(16),
        TypeError,
        "`ranges` must be a contiguous buffer of 64-bit numbers, such as array('Q')",
    ),
    "other byte order": (
        numpy.array([0, 10], dtype=">u8"),
        TypeError,
        "`ranges` must be a contiguous buffer of 64-bit numbers, such as array('Q')",
    ),
    "a list": ([0, 10], TypeError, "a bytes-like object is required, not 'list'"),
}


@pytest.mark.parametrize("case", BAD_RANGES)
def test_bad_ranges(case: str) -> None:
    ranges, kind, text = BAD_RANGES[case]
    with pytest.raises(kind) as caught:
        strings().cdr_to_proto_batch(GOOD, ranges=ranges)
    assert str(caught.value) == text


def test_batch_arguments() -> None:
    transcode = strings()
    with pytest.raises(ValueError, match="threads must be 1 or more"):
        transcode.cdr_to_proto_batch([], threads=0)
    with pytest.raises(TypeError, match="'str' object cannot be interpreted as an integer"):
        transcode.cdr_to_proto_batch([], threads="2")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="a batch must be a sequence of messages"):
        transcode.cdr_to_proto_batch(5)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="a bytes-like object is required, not 'NoneType'"):
        transcode.cdr_to_proto_batch([GOOD, None])  # type: ignore[list-item]
    with pytest.raises(TypeError, match="a bytes-like object is required, not 'int'"):
        transcode.cdr_to_proto_batch(GOOD)  # one message is no batch
    with pytest.raises(TypeError, match="a bytes-like object is required, not 'list'"):
        transcode.cdr_to_proto_batch([GOOD], ranges=array.array("Q", [0, 10]))


def test_large_messages() -> None:
    """Each is a block of its own, between small ones."""
    transcode, _ = transcoder(BYTES, "test/msg/Bytes", hashed=False)
    messages = [
        b"\0\1\0\0" + struct.pack("<I", size) + random.Random(size).randbytes(size)
        for size in (5, 3_000_000, 0, 100_000, 40_000, 7)
    ]
    batch = transcode.cdr_to_proto_batch(messages, 3)
    assert list(batch) == [transcode.cdr_to_proto(each) for each in messages]
    assert list(transcode.proto_to_cdr_batch(batch, 3)) == messages


def test_size_limit_is_of_one_message() -> None:
    transcode, _ = transcoder(STRING, "test/msg/String", hashed=False, size_limit=3)
    batch = transcode.cdr_to_proto_batch([GOOD, b"\0\1\0\0\3\0\0\0ab\0", GOOD])
    assert batch[0] == batch[2] == GOOD_PROTO
    assert str(batch.errors[1]) == (
        "test/msg/String at byte 11 of message 1: the result would have more than 3 bytes;"
        " split the message or raise the size limit"
    )
