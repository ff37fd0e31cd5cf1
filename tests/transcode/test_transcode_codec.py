"""Codecs: protobuf messages to CDR and back."""

from __future__ import annotations

import contextlib
import gc
import inspect
import itertools
import pickle
import sys
import threading
import warnings
import weakref
from typing import Any

import pytest
from google.protobuf.message import EncodeError
from google.protobuf.timestamp_pb2 import Timestamp
from google.protobuf.wrappers_pb2 import StringValue
from ros_types import describe, protobuf_class, struct_type

from rosidl_adapter_proto.errors import ConversionError, Error, SchemaError
from rosidl_adapter_proto.transcode import Codec, TranscodeError, Transcoder, _core

TIME = struct_type("test/msg/Time", seconds="int64", nanos="int16")
DESCRIPTION = describe(TIME, "test/msg/Time")
Time: Any = protobuf_class(TIME, "test/msg/Time")
CDR = b"\0\1\0\0\1\0\0\0\0\0\0\0\2\0"


def test_both_ways() -> None:
    codec = Codec(DESCRIPTION, Time)
    assert codec.to_cdr(Time(seconds=1, nanos=2)) == CDR
    assert codec.from_cdr(CDR) == Time(seconds=1, nanos=2)
    assert codec.from_cdr(memoryview(bytearray(CDR))) == Time(seconds=1, nanos=2)
    assert Time.FromString(codec.transcoder.cdr_to_proto(CDR)) == Time(seconds=1, nanos=2)
    assert codec.message_class is Time


def test_errors() -> None:
    codec = Codec(DESCRIPTION, Time)
    with pytest.raises(
        TranscodeError, match=r"^test/msg/Time\.nanos at byte 12: 2 bytes are needed and 0 are left"
    ):
        codec.from_cdr(CDR[:12])
    with pytest.raises(TranscodeError, match=r"^test/msg/Time\.nanos at byte .*: 40000 does not fit int16"):
        codec.to_cdr(Time(nanos=40000))
    with pytest.raises(SchemaError):
        Codec(DESCRIPTION, Timestamp)


@pytest.mark.parametrize("message", [Timestamp(), Time, None, b""])
def test_message_of_another_class(message: Any) -> None:
    found = type(message)
    with pytest.raises(ConversionError) as caught:
        Codec(DESCRIPTION, Time).to_cdr(message)
    assert str(caught.value) == (
        "test/msg/Time: expected a protobuf message test.msg.pb.Time, "
        f"not {found.__module__}.{found.__qualname__}"
    )


class Huge:
    """Like a protobuf message that protobuf does not serialize."""

    DESCRIPTOR = Time.DESCRIPTOR
    FromString = Time.FromString
    error: Exception = EncodeError("Failed to serialize proto")

    def SerializeToString(self) -> bytes:
        raise self.error


def test_message_that_protobuf_does_not_serialize() -> None:
    codec: Codec[Any] = Codec(DESCRIPTION, Huge)
    with pytest.raises(ConversionError) as caught:
        codec.to_cdr(Huge())
    assert str(caught.value) == (
        "test/msg/Time: protobuf does not serialize it (Failed to serialize proto);"
        " a message has 2147483647 bytes at most, split it"
    )
    assert isinstance(caught.value.__cause__, EncodeError)


@pytest.mark.parametrize("error", [MemoryError(), KeyboardInterrupt(), ValueError("other")])
def test_other_errors_stay_what_they_are(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    monkeypatch.setattr(Huge, "error", error)
    codec: Codec[Any] = Codec(DESCRIPTION, Huge)
    with pytest.raises(type(error)) as caught:
        codec.to_cdr(Huge())
    assert caught.value is error


def test_chosen_fields() -> None:
    codec = Codec(DESCRIPTION, Time)
    for fields in (["nanos"], ("nanos",), iter(["nanos"]), {"nanos": 1}):
        assert codec.from_cdr(CDR, fields=fields) == Time(nanos=2)
    assert codec.from_cdr(CDR, ["seconds", "nanos"]) == Time(seconds=1, nanos=2)
    assert codec.from_cdr(CDR, fields=None) == codec.from_cdr(CDR, None) == Time(seconds=1, nanos=2)


@pytest.mark.parametrize("rest", [b"", b"\xff" * 50])
def test_the_rest_is_not_read(rest: bytes) -> None:
    codec = Codec(DESCRIPTION, Time)
    assert codec.from_cdr(CDR[:12] + rest, fields=["seconds"]) == Time(seconds=1)
    with pytest.raises(
        TranscodeError, match=r"^test/msg/Time\.seconds at byte 4: 8 bytes are needed and 7 are left"
    ):
        codec.from_cdr(CDR[:11], fields=["seconds"])


WRONG_FIELDS: dict[str, tuple[Any, type[Exception], str]] = {
    "unknown": (["second"], SchemaError, "test/msg/Time has no field 'second'; did you mean 'seconds'?"),
    "none": (
        [],
        SchemaError,
        "test/msg/Time: no field is chosen; name one, or give no fields for all of them",
    ),
    "one text": ("nanos", TypeError, "fields must be a list of names, such as ['nanos'], not a text"),
    "a number": (5, TypeError, "from_cdr() takes fields as a list of names, not int"),
    "numbers": ([5], TypeError, "from_cdr() takes fields as a list of names, and one of these is int"),
    "lists": ([["nanos"]], TypeError, "from_cdr() takes fields as a list of names, and one of these is list"),
}


@pytest.mark.parametrize("case", WRONG_FIELDS)
def test_wrong_fields(case: str) -> None:
    fields, kind, text = WRONG_FIELDS[case]
    with pytest.raises(kind) as caught:
        Codec(DESCRIPTION, Time).from_cdr(CDR, fields=fields)
    assert str(caught.value) == text


WRONG_ARGUMENTS: dict[str, tuple[tuple[Any, ...], dict[str, Any], str]] = {
    "none": ((), {}, "from_cdr() takes the data and perhaps fields, but 0 arguments were given"),
    "only fields": (
        (),
        {"fields": ["nanos"]},
        "from_cdr() takes the data and perhaps fields, but only fields were given",
    ),
    "three": (
        (CDR, ["nanos"], 1),
        {},
        "from_cdr() takes the data and perhaps fields, but 3 arguments were given",
    ),
    "fields twice": (
        (CDR, ["nanos"]),
        {"fields": ["nanos"]},
        "from_cdr() takes the data and perhaps fields, but 3 arguments were given",
    ),
    "another name": (
        (CDR,),
        {"field": ["nanos"]},
        "from_cdr() has no argument 'field'; give fields=[...] to choose some",
    ),
    "data by name": ((), {"data": CDR}, "from_cdr() takes the data by position, as from_cdr(data)"),
}


@pytest.mark.parametrize("case", WRONG_ARGUMENTS)
def test_wrong_arguments(case: str) -> None:
    arguments, named, text = WRONG_ARGUMENTS[case]
    with pytest.raises(TypeError) as caught:
        Codec(DESCRIPTION, Time).from_cdr(*arguments, **named)
    assert str(caught.value) == text


def test_choices_are_remembered_and_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is prepared once; many different ones do not take more and more memory."""
    made: weakref.WeakSet[Transcoder] = weakref.WeakSet()

    class Made(Transcoder):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            made.add(self)

    codec = Codec(DESCRIPTION, Time)
    monkeypatch.setattr("rosidl_adapter_proto.transcode.codec.Transcoder", Made)
    for fields in (["nanos"], ("nanos",), iter(["nanos"])):
        codec.from_cdr(CDR, fields=fields)
    assert len(made) == 1
    for count in range(1, 200):
        codec.from_cdr(CDR, fields=["nanos"] * count)
    assert 0 < len(made) <= 64


def test_one_field_of_a_large_message_keeps_the_interpreter_lock() -> None:
    """It takes less time than to give the lock away, and somebody else may keep it for long."""
    types = struct_type("test/msg/Large", first="int32", data="uint8[]", last="int32")
    large: Any = protobuf_class(types, "test/msg/Large")
    codec = Codec(describe(types, "test/msg/Large"), large)
    cdr = codec.to_cdr(large(first=1, data=bytes(1 << 20), last=2))
    assert codec.from_cdr(cdr, ["first"]).first == 1
    done: list[Any] = []
    seen: list[int] = []

    def other() -> None:
        while not done:
            pass
        seen.append(len(done))

    thread = threading.Thread(target=other)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    gc.disable()  # what others want to know of it would be Python code
    try:
        thread.start()
        # No Python code runs in here, at which the other thread could get its turn.
        done.extend(map(codec.from_cdr, itertools.repeat(cdr, 10_000), itertools.repeat(["first"])))
        thread.join()
    finally:
        gc.enable()
        sys.setswitchinterval(interval)
    assert seen == [10_000]
    assert codec.from_cdr(cdr, fields=["last"]) == large(last=2)
    assert codec.from_cdr(cdr, fields=["data"]) == large(data=bytes(1 << 20))
    with pytest.raises(TranscodeError, match=r"^test/msg/Large\.last at byte 1048588: 4 bytes are needed"):
        codec.from_cdr(cdr[:-1], fields=["last"])


def test_signatures_and_documentation() -> None:
    codec = Codec(DESCRIPTION, Time)
    for method, signature in (
        (codec.to_cdr, "(message, /)"),
        (codec.from_cdr, "(data, /, fields=None)"),
        (codec.transcoder.cdr_to_proto, "(data, /)"),
        (codec.transcoder.proto_to_cdr, "(data, /)"),
        (Codec.to_cdr, "(self, message, /)"),
    ):
        assert str(inspect.signature(method)) == signature
        assert method.__doc__ is not None and method.__doc__.startswith("Turn a ")


def test_codec_of_a_type() -> None:
    """`Codec[Time]` is for annotations, as with other generic classes."""
    assert Codec[Time](DESCRIPTION, Time).to_cdr(Time(seconds=1, nanos=2)) == CDR


def test_pickle() -> None:
    """A method can be handed to another process."""
    description = describe(struct_type("test/msg/Text", value="string"), "test/msg/Text")
    to_cdr = pickle.loads(pickle.dumps(Codec(description, StringValue).to_cdr))
    assert to_cdr(StringValue(value="a")) == b"\0\1\0\0\2\0\0\0a\0"


ODD: tuple[Any, ...] = (
    *(
        None,
        True,
        1,
        -1,
        2**64,
        2**70,
        1.5,
        "text",
        "\ud800",
        b"x",
        bytearray(b"x"),
        memoryview(b"abcd")[::2],
    ),
    *([], [1], [None], (b"",), {}, object(), int, len, Time, Time()),
)


def test_any_arguments_at_all() -> None:
    """Whatever the native module is given, it takes or refuses it in the terms of Python."""
    transcoder = Transcoder(DESCRIPTION, Time.DESCRIPTOR)
    codec: Any = Codec(DESCRIPTION, Time)
    calls: dict[Any, int] = {
        _core.Transcoder: 3,
        _core.Codec: 2,
        _core.packed_fields: 3,
        transcoder.cdr_to_proto: 1,
        transcoder.proto_to_cdr: 1,
        codec.to_cdr: 1,
        codec.from_cdr: 2,
    }
    taken = 0
    for call, count in calls.items():
        for arguments in itertools.product((*ODD, transcoder), repeat=count):
            with contextlib.suppress(
                TypeError, ValueError, OverflowError, BufferError, AttributeError, Error
            ):
                call(*arguments)
                taken += 1
    for batch in (transcoder._cdr_to_proto_batch, transcoder._proto_to_cdr_batch):
        for first, second in itertools.product(ODD, repeat=2):
            for arguments in ((first, second, 1, None), ([], None, second, first), ([CDR], first, 1, second)):
                with contextlib.suppress(TypeError, ValueError, OverflowError, BufferError, Error):
                    batch(*arguments)
                    taken += 1
    assert taken > 0


class Unfinished(Transcoder):
    """Does not call `__init__` of its base."""

    def __init__(self) -> None:
        pass


def test_odd_arguments() -> None:
    with pytest.raises(TypeError, match=r"^__init__ of the base class has not been called$"):
        Unfinished().cdr_to_proto(CDR)
    with pytest.raises(TypeError, match=r"^__init__ of the base class has not been called$"):
        _core.Codec(Unfinished(), Time)
    with warnings.catch_warnings(), pytest.raises(TypeError):
        warnings.simplefilter("ignore")  # nanobind warns as well
        Unfinished().cdr_to_proto_batch([])
    with pytest.raises(TypeError, match="doesn't apply to a 'int' object"):
        Transcoder.cdr_to_proto(5, CDR)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^serialize must return bytes$"):
        _core.packed_fields(lambda message: "text", Time(), 1)  # type: ignore[arg-type,return-value]
    with pytest.raises(TypeError):
        _core.packed_fields(Time.SerializeToString, Time(), "1")  # type: ignore[arg-type]
    with pytest.raises(OverflowError):
        _core.packed_fields(Time.SerializeToString, Time(), -1)
    with pytest.raises(ValueError, match="plan"):
        _core.Transcoder(b"no plan", "test/msg/Time", 100)
    for arguments in ((5, "x", 100), (b"", 5, 100), (b"", "x", "100"), (b"", "x", -1)):
        with pytest.raises(TypeError):
            _core.Transcoder(*arguments)
    with pytest.raises(TypeError):
        _core.Codec(5, Time)  # type: ignore[arg-type]
    with pytest.raises(AttributeError):
        Codec(DESCRIPTION, object)  # type: ignore[type-var]
