"""The Python side: buffers, batches, threads, memory."""

from __future__ import annotations

import array
import contextlib
import gc
import random
import resource
import threading
from collections.abc import Callable
from typing import Any

import pytest
from reference_cdr import write_cdr
from ros_types import nasty_types, protobuf_message, random_value, same_message, struct_type, transcoder

from rosidl_adapter_proto.transcode import TranscodeError

NASTY = nasty_types()
STRING = struct_type("test/msg/String", data="string")
NESTED = {
    **struct_type("test/msg/Inner", x="double"),
    **struct_type("test/msg/Outer", inner="test/msg/Inner"),
}


def nasty_messages(count: int) -> list[bytes]:
    rng = random.Random(7)
    return [
        write_cdr(NASTY, "test/msg/Nasty", random_value(NASTY, "test/msg/Nasty", rng)) for _ in range(count)
    ]


BUFFERS: dict[str, Callable[[bytes], Any]] = {
    "bytes": bytes,
    "bytearray": bytearray,
    "memoryview": memoryview,
    "array": lambda data: array.array("B", data),
    "slice": lambda data: memoryview(b"x" + data + b"x")[1:-1],
    "odd address": lambda data: memoryview(bytearray(b"x" + data))[1:],
}


@pytest.mark.parametrize("form", BUFFERS)
def test_any_contiguous_buffer(form: str) -> None:
    transcode, _ = transcoder(NASTY, "test/msg/Nasty")
    cdr = nasty_messages(1)[0]
    proto = transcode.cdr_to_proto(cdr)
    assert transcode.cdr_to_proto(BUFFERS[form](cdr)) == proto
    assert transcode.proto_to_cdr(BUFFERS[form](proto)) == cdr


def test_what_is_no_buffer() -> None:
    transcode, _ = transcoder(STRING, "test/msg/String")
    with pytest.raises(TypeError):
        transcode.cdr_to_proto("text")  # type: ignore[arg-type]
    with pytest.raises(BufferError):
        transcode.cdr_to_proto(memoryview(bytes(20))[::2])


def test_large_message() -> None:
    """Past the size from which on other threads may run meanwhile."""
    transcode, message_class = transcoder(STRING, "test/msg/String")
    message = message_class(data="ä" * 1_000_000)
    cdr = transcode.proto_to_cdr(message.SerializeToString())
    assert cdr == write_cdr(STRING, "test/msg/String", {"data": "ä" * 1_000_000})
    assert transcode.cdr_to_proto(cdr) == message.SerializeToString()
    with pytest.raises(TranscodeError, match="bytes are needed"):
        transcode.cdr_to_proto(cdr[:-1])
    with pytest.raises(TranscodeError, match="not valid UTF-8"):
        transcode.proto_to_cdr(message.SerializeToString()[:-2] + b"aa\xff"[1:])


def test_threads_share_a_transcoder() -> None:
    transcode, _ = transcoder(NASTY, "test/msg/Nasty")
    messages = nasty_messages(40)
    expected = [transcode.cdr_to_proto(each) for each in messages]
    wrong: list[int] = []

    def work(seed: int) -> None:
        order = list(range(len(messages))) * 20
        random.Random(seed).shuffle(order)
        for i in order:
            proto = transcode.cdr_to_proto(messages[i])
            if proto != expected[i] or transcode.proto_to_cdr(proto) != messages[i]:
                wrong.append(i)
            with pytest.raises(TranscodeError):
                transcode.cdr_to_proto(messages[i][:50])

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(8)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert wrong == []


def test_data_that_changes_meanwhile() -> None:
    """Another thread writes into the buffer: any result or an error, but no crash."""
    types = struct_type("test/msg/Texts", texts="string[]")
    transcode, _ = transcoder(types, "test/msg/Texts")
    cdr = bytearray(write_cdr(types, "test/msg/Texts", {"texts": ["abcdefg"] * 20_000}))
    stop = threading.Event()

    def disturb() -> None:
        while not stop.is_set():
            for place in range(8, len(cdr), 12 * 97):
                cdr[place] ^= 1

    thread = threading.Thread(target=disturb)
    thread.start()
    outcomes: set[type] = set()
    for _ in range(200):
        try:
            outcomes.add(type(transcode.cdr_to_proto(cdr)))
        except TranscodeError as error:
            outcomes.add(type(error))
    stop.set()
    thread.join()
    assert outcomes <= {bytes, TranscodeError}


def test_no_leak() -> None:
    transcode, _ = transcoder(NASTY, "test/msg/Leaf")
    cdr = write_cdr(NASTY, "test/msg/Leaf", {"text": "abc", "empties": [], "wide": "x"})
    proto = transcode.cdr_to_proto(cdr)

    def work(rounds: int) -> None:
        for i in range(rounds):
            transcode.cdr_to_proto(cdr)
            transcode.proto_to_cdr(proto)
            if i % 50 == 0:
                transcode.cdr_to_proto_batch([cdr, bytearray(cdr)])
                with contextlib.suppress(TranscodeError):
                    transcode.proto_to_cdr(b"\xff")

    work(20_000)
    gc.collect()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    work(500_000)
    gc.collect()
    # A leak of 8 bytes for each of the million messages would be twice this.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 4096


def test_empty_messages() -> None:
    cdr = b"\0\1\0\0" + bytes(8)
    present, message_class = transcoder(NESTED, "test/msg/Outer", hashed=False)
    assert present.cdr_to_proto(cdr) == b"\x0a\x00"
    assert message_class.FromString(present.cdr_to_proto(cdr)).HasField("inner")
    absent, _ = transcoder(NESTED, "test/msg/Outer", hashed=False, omit_empty_messages=True)
    assert absent.cdr_to_proto(cdr) == b""
    assert present.proto_to_cdr(b"") == present.proto_to_cdr(b"\x0a\x00") == cdr


def test_placeholder() -> None:
    """The member of an empty struct means nothing: its byte, which C++ leaves as it was, is not passed on."""
    transcode, _ = transcoder(NASTY, "test/msg/Empty", hashed=False)
    assert transcode.cdr_to_proto(b"\0\1\0\0\x56") == b""
    assert transcode.proto_to_cdr(b"\x08\x07") == b"\0\1\0\0\0"


def test_string_without_terminator_length() -> None:
    """Length 0 stands for the empty string, as Fast CDR reads it."""
    transcode, _ = transcoder(STRING, "test/msg/String")
    assert transcode.cdr_to_proto(b"\0\1\0\0\0\0\0\0") == b""


PADDING = {
    "alignment": (struct_type("test/msg/P", x="uint8"), b"\7", 3),
    "string": (struct_type("test/msg/P", x="string"), b"\1\0\0\0\0", 3),
    "bounded": (struct_type("test/msg/P", x="uint8[<=10]"), b"\0\0\0\0", 13),
    "empty sequence of doubles": (
        struct_type("test/msg/P", s="string", x="double[]"),
        b"\1\0\0\0" + bytes(8),
        11,
    ),
    "wide string": (struct_type("test/msg/P", x="wstring"), bytes(4), 11),
}


@pytest.mark.parametrize("case", PADDING)
def test_trailing_padding(case: str) -> None:
    types, body, most = PADDING[case]
    transcode, _ = transcoder(types, "test/msg/P")
    message = b"\0\1\0\0" + body
    for size in range(most + 1):
        assert transcode.cdr_to_proto(message + b"\xee" * size) == transcode.cdr_to_proto(message)
    with pytest.raises(TranscodeError, match=f"{most + 1} bytes follow the last field"):
        transcode.cdr_to_proto(message + b"\xee" * (most + 1))


@pytest.mark.parametrize("hashed", [True, False])
@pytest.mark.parametrize("big_endian", [True, False])
def test_every_kind_of_field(hashed: bool, big_endian: bool) -> None:
    transcode, message_class = transcoder(NASTY, "test/msg/Nasty", hashed=hashed)
    rng = random.Random(5)
    for _ in range(50):
        value = random_value(NASTY, "test/msg/Nasty", rng)
        expected = protobuf_message(NASTY, "test/msg/Nasty", value, message_class())
        cdr = write_cdr(NASTY, "test/msg/Nasty", value, big_endian=big_endian, padding_byte=0xCC)
        assert same_message(message_class.FromString(transcode.cdr_to_proto(cdr)), expected)
        assert transcode.proto_to_cdr(expected.SerializeToString()) == write_cdr(
            NASTY, "test/msg/Nasty", value
        )
